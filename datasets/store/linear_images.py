"""Linear images on disk as OpenEXR: which frames have one, what decides it, reading and writing."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.errors import UserError
from datasets.plan import Frame, plan
from datasets.recipe.model import Recipe
from datasets.recipe.targets import target_values
from datasets.store.atomic import local_copy, write_text
from datasets.store.exr_file import DamagedExrError, read_exr, read_header, write_exr
from eposit import Camera
from render.frame import LinearImage
from render.motion import RollingPose
from render.optics import Optics
from render.targets.image_region import Region

MASTERS = "masters"  # their folder
MOST_RADIANCE = 1e12  # of the light that a white board sends back in full: the sun's disc has some 1e5
NOT_KEPT = "masters-not-kept.txt"  # lies in the folder of a dataset that does not keep them
NOT_KEPT_TEXT = """\
This dataset was made with --no-masters: its linear images are rendered, developed and not kept.
Another regime needs them, and so does `--reuse`: make the dataset in another folder without --no-masters.
"""


class LinearImageError(ValueError):
    """A linear image that cannot be read; the message names the file and the remedy."""


class ForeignImageError(LinearImageError):
    """A linear image of another frame or recipe."""


def write_linear(linear: LinearImage, camera: Camera, path: Path, key: str = "") -> None:
    """EXR with the region as data window inside the picture as display window; atomic, lossless.

    Where the rest is a picture the whole is the data window, and a `region` stands in the header. The channels are Y,
    or R, G and B.

    key: what the image was made from, for `read_linear` to compare.

    ZIP, of what every reader of EXR knows: 55 % of the size at 5 ms of a fish-eye region of 359 x 333 px; none 1.7 ms;
    ZIPS 63 % at 9 ms; PIZ 59 % at 14 ms. HTJ2K has 33 % at 3 ms, but only OpenEXR 3.4 and later read it.
    """
    rest = linear.background
    if isinstance(rest, np.ndarray):
        stored, window, kept = rest, _whole(camera), {"region": _corners(linear.region)}
    else:
        stored, window, kept = linear.radiance, linear.region, {"background": float(rest)}
    header = {"dataWindow": _corners(window), "displayWindow": _corners(_whole(camera)), "key": key, **kept}
    write_exr(path, header, {"RGB": stored} if linear.in_colour else {"Y": stored})


def read_linear(path: Path, key: str = "", *, check: bool = True) -> LinearImage:
    """The linear image in an EXR file. check: whether its values are compared with its digest, if it has one.

    Raises:
        LinearImageError: the file is missing, damaged, not one of ours, or made from something else than `key`.
    """
    if not path.is_file():
        raise LinearImageError(f"{path} is missing; run the generate stage again to render it")
    try:
        with local_copy(path) as here:
            if read_header(here).get("key") != key:
                raise ForeignImageError(
                    f"{path} belongs to another frame or recipe; `repair {path.parent.parent}` puts it aside and "
                    "renders the right one"
                )
            header, channels = read_exr(here, check=check)
        stored = np.asarray(channels["Y" if "Y" in channels else "RGB"], np.float32)
        region = _region(header["dataWindow" if "background" in header else "region"])
        whole, background = _region(header["displayWindow"]), float(header.get("background", 0.0))
        fault = _fault(stored, region, whole, background)
        if fault:
            raise DamagedExrError(fault)
        if "background" in header:
            return LinearImage(stored, region, background)
        return LinearImage(stored[region.pixels], region, stored)
    except LinearImageError:
        raise
    except (ValueError, LookupError, TypeError, OSError) as error:
        what = str(error) if isinstance(error, DamagedExrError) else "it cannot be read"
        raise LinearImageError(f"{path} is damaged: {what}; `repair {path.parent.parent}` renders it again") from error


def _fault(stored: NDArray[np.float32], region: Region, whole: Region, background: float) -> str | None:
    """What in a linear image cannot be, whoever wrote it; None if nothing."""
    inside = region.x >= 0 and region.y >= 0 and region.width > 0 and region.height > 0
    inside = inside and region.x + region.width <= whole.width and region.y + region.height <= whole.height
    if whole[:2] != (0, 0) or not inside:
        return "its region lies outside the picture"
    if not (np.all(np.abs(stored) < MOST_RADIANCE) and abs(background) < MOST_RADIANCE):
        return "it has values that no light has"
    return None


def _whole(camera: Camera) -> Region:
    return Region.whole(camera.width, camera.height)


def _corners(region: Region) -> tuple[np.ndarray, np.ndarray]:
    """The first and the last pixel of a region, as EXR's windows are."""
    x, y, width, height = region
    return np.array([x, y], np.int32), np.array([x + width - 1, y + height - 1], np.int32)


def _region(window: tuple[np.ndarray, np.ndarray]) -> Region:
    low, high = window
    return Region.between((int(low[0]), int(low[1])), (int(high[0]) + 1, int(high[1]) + 1))


def are_kept(root: Path) -> bool:
    """Whether a dataset keeps its linear images."""
    return not (root / NOT_KEPT).exists()


def require_kept(root: Path, what: str) -> None:
    """Refuse a dataset that does not keep its linear images. what: the option or command that needs them.

    Raises:
        UserError: it was made with --no-masters.
    """
    if not are_kept(root):
        raise UserError(
            f"{what}: {root} was made with --no-masters and has no linear images; give a dataset that keeps them"
        )


def settle_kept(root: Path, *, keep: bool) -> None:
    """Note in a dataset's folder that linear images are not kept, unless `keep`; who resumes need not say it again.

    Raises:
        UserError: the dataset has begun with linear images, or the folder cannot be written.
    """
    if keep or not are_kept(root):
        return
    if any((root / MASTERS).glob("*.exr")) or any((root / "frames").glob("[!.]*.parquet")):
        raise UserError(f"{root} keeps its linear images; leave out --no-masters, or choose another --out")
    write_text(root / NOT_KEPT, NOT_KEPT_TEXT)


def masters(root: Path, recipe: Recipe) -> Iterator[tuple[Path, str]]:
    """Path and key of every frame's linear image."""
    for frame in plan(recipe):
        yield root / linear_path(frame.frame_id), linear_key(recipe, frame)


def linear_path(frame_id: int) -> str:
    """Path of a frame's linear image in its dataset's folder."""
    return f"{MASTERS}/{frame_id:06d}.exr"


def linear_key(recipe: Recipe, frame: Frame) -> str:
    """Hash of all that decides a linear image; the sensor model is not among it, nor is a metered exposure.

    By the closed form nothing of Mitsuba's decides anything, and nothing is random.
    """
    parts: dict[str, object] = {
        "target": target_values(recipe.target),
        "light": asdict(recipe.light),
        "camera": asdict(frame.camera.true_camera()),
        "R": frame.cam_from_obj.R.tolist(),
        "t": frame.cam_from_obj.t.tolist(),
        "samples": recipe.sample_count(),
    }
    if recipe.outputs.colour:
        parts["colour"] = True
    if recipe.optics != Optics():
        parts["optics"] = asdict(recipe.optics)
    if isinstance(frame.cam_from_obj, RollingPose):
        rate = frame.cam_from_obj.rate
        parts["rate"] = [*rate.velocity_mm_per_s.tolist(), *rate.turn_rad_per_s.tolist()]
    if recipe.world.method != "closed":
        world, draw = asdict(recipe.world), asdict(frame.world)
        for left_out in ("exposure_range", "file"):
            del world[left_out]
        del draw["exposure"]
        parts |= {"world": world, "draw": draw, "seed": frame.render_seed, "mitsuba": version("mitsuba")}
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
