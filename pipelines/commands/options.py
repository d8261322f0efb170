"""Options and arguments of the commands, each named once.

Showing help loads nothing heavy, so words and defaults that the stages know stand here, and in the commands, a second
time; a test compares them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from datasets.errors import UserError
from datasets.url_path import dataset_folder


def _folder(text: str) -> Path:
    """A folder or a URL as `dataset_folder` reads it, whose refusal the option's own message holds."""
    try:
        return dataset_folder(text)
    except UserError as error:
        raise typer.BadParameter(str(error)) from None


Out = Annotated[
    Path,
    typer.Option(
        "--out",
        metavar="DIR",
        parser=_folder,
        help="Folder of the dataset, or a URL as s3://bucket/demo; a run that stopped is resumed there.",
    ),
]
Folder = Annotated[
    Path,
    typer.Argument(metavar="DIR", parser=_folder, help="Folder of a dataset, or its URL as s3://bucket/demo."),
]
RecipeName = Annotated[str, typer.Argument(metavar="RECIPE", help="A .toml file, or a name from `recipes`.")]
ShownRecipe = Annotated[str | None, typer.Argument(metavar="[RECIPE]", help="Show its values beside the keys.")]
FrameNumber = Annotated[int, typer.Argument(metavar="FRAME", help="Its frame_id.")]
Png = Annotated[Path, typer.Option("--out", help="File of the picture.")]
Workers = Annotated[int, typer.Option(help="Processes; the result is the same for any number.")]
EngineName = Annotated[
    str, typer.Option("--engine", help="Where shards are worked on: local, or ray (to be installed).")
]
RayAddress = Annotated[
    str | None,
    typer.Option(metavar="HOST:PORT", help="Ray cluster that runs already, instead of a Ray of --workers processes."),
]
Shard = Annotated[
    str | None,
    typer.Option(metavar="I/N", help="Only part I of N, I from 1 to N, of the shards; all parts may run at once."),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress bars.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for machines, instead of text.")]
Rerender = Annotated[
    int, typer.Option(min=0, metavar="N", help="Render N frames, spread over the dataset, anew and compare them, too.")
]
Regime = Annotated[
    str | None, typer.Option(help="Sensor regime, as if the recipe said so: clean, typical, paper or harsh.")
]
Reuse = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        parser=_folder,
        help="Dataset whose linear light is taken where it shows the same views.",
    ),
]

NoMasters = Annotated[
    bool,
    typer.Option("--no-masters", help="Do not keep linear light, nine tenths of the bytes: nothing to reuse."),
]
PackMasters = Annotated[
    bool,
    typer.Option("--pack-masters", help="Keep linear light in one ZIP archive for each shard, not in a file a frame."),
]

Url = Annotated[
    str, typer.Argument(metavar="URL", help="s3://bucket/folder, gs://bucket/folder or file:///folder, with options.")
]
Frames = Annotated[
    str | None, typer.Option("--frames", metavar="N", help="As if the recipe had N frames, as 1e9. [default: its own]")
]
Measure = Annotated[
    bool,
    typer.Option("--measure", help="Make sixteen frames first, in a temporary folder, and keep what they took."),
]
IgnoreDisk = Annotated[
    bool, typer.Option("--ignore-disk", help="Begin even where the disk looks too small for what is still to be made.")
]

DetectorName = Annotated[
    str,
    typer.Option(
        "--detector", help="edge-fit (ours), board-fit (a smooth map through its corners), opencv-subpix or opencv-sb."
    ),
]
DetectSeconds = Annotated[
    float,
    typer.Option(
        metavar="SECONDS",
        help="Processor time that the detection of one picture may take; bounds on its work end it long before.",
    ),
]
OWN = "or your own as package.module:function."
SOLVERS_HELP = (
    "best, centred, eposit, posit, opnp, gpnpf, pnpfr, released, opencv-sqpnp, opencv-epnp, opencv-iterative, "
    f"opencv-p3p, opencv-fisheye, poselib-p3p, poselib-p4pf, {OWN}"
)
SolverName = Annotated[str | None, typer.Option("--solver", help=f"{SOLVERS_HELP}  [default: best]")]
MoreSolvers = Annotated[
    list[str] | None,
    typer.Option("--solver", help=f"One more solver, by name {OWN[:-1]}; may be given again."),
]
Estimator = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="Instead of a solver, a whole system: photometric (ours), or your own as package.module:function, a "
        "function of image, camera and target.",
    ),
]
MoreEstimators = Annotated[
    list[str] | None,
    typer.Option("--estimator", metavar="NAME", help="A whole system as well, as for `estimate`; may be given again."),
]
PoseFile = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Poses of another system, .csv or .parquet, to be scored beside the others."),
]
PoseFormat = Annotated[
    str,
    typer.Option(
        "--pose-format",
        help="Form of the file of --poses: table (.csv or .parquet with named columns, mm), kitti, tum, colmap, bop or "
        "euroc, each with the unit and direction of its definition.",
    ),
]
PosesName = Annotated[str | None, typer.Option("--name", help="Name of the poses of --poses in tables and report.")]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Estimate anew what is there, as your function has changed.")
]
Timeout = Annotated[
    float, typer.Option(metavar="SECONDS", help="Time that a function of yours may take for one image.")
]
MemoryMb = Annotated[
    int,
    typer.Option(
        metavar="MB",
        envvar="EPOSIT_MEMORY_MB",
        help="Memory that the process of a function of yours may take; on Linux.",
    ),
]
PointsName = Annotated[str, typer.Option("--points", help="detected, truth or truth+noise.")]
CameraName = Annotated[str, typer.Option("--camera", help="Camera that is assumed: exact, nominal or paper.")]
Use = Annotated[str, typer.Option("--use", help="Object points: four or all.")]
NoisePx = Annotated[float, typer.Option("--noise-px", help="Standard deviation of truth+noise, px per axis.")]
Draws = Annotated[int, typer.Option("--draws", help="Draws of truth+noise.")]

TargetRecipe = Annotated[
    str | None, typer.Argument(metavar="[RECIPE]", help="Whose target: a .toml file, or a name from `recipes`.")
]
Pattern = Annotated[
    str | None,
    typer.Option(help="Instead of a recipe: chessboard, plain_chessboard, charuco, aprilgrid or circles."),
]
TargetValues = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="A key of [target] as in a recipe; may be given again."),
]
Printed = Annotated[Path, typer.Option("--out", metavar="FILE", help="File to write, .pdf or .svg.")]

Poses = Annotated[int, typer.Option(min=1, help="Poses measured with each camera.")]
Only = Annotated[
    list[str] | None,
    typer.Option(
        help="A part: render, stages, profile, frame, equal, detection, solver, growth, or blender, which `make "
        "bench-blender` sets up; may be given again."
    ),
]
Memory = Annotated[
    int | None, typer.Option(min=1, help="Instead, generate and detect so many frames and tell the memory.")
]
Markdown = Annotated[Path | None, typer.Option("--out", help="Write the table as Markdown, too.")]

PaperOut = Annotated[Path, typer.Option("--out", help="Folder of paper.html, claims.md and the pictures.")]
PaperParts = Annotated[
    list[str] | None,
    typer.Option(
        "--only",
        help="A part: precision, principal-point, pinhole, fisheye, sensitivity, beyond, images, wide or experiment; "
        "may be given again.",
    ),
]
Seeds = Annotated[int, typer.Option(help="Draws of noise on every pose of the helix.")]
PointsOnly = Annotated[bool, typer.Option("--points-only", help="Leave out what renders: images, wide, experiment.")]
