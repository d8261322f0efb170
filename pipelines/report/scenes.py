"""Other datasets inside a dataset's folder, as its report shows them: the demo's board in a room."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from datasets.rows import decode_image
from datasets.store.dataset import RECIPE_FILE, Dataset, open_dataset
from pipelines.pages.pictures import jpeg_address
from pipelines.report.data import series
from pipelines.report.points import point_errors
from pipelines.report.run import Run
from pipelines.report.summary import summarised

PICTURE_PX = 480  # the longest side as shown


@dataclass(frozen=True, slots=True)
class ShownPicture:
    """A whole picture, small."""

    name: str
    told: str
    address: str  # of the image's data


@dataclass(frozen=True, slots=True)
class Scene:
    """A dataset in the folder of another."""

    folder: str
    description: str
    sentences: tuple[str, ...]  # of its own report
    pictures: tuple[ShownPicture, ...]  # the first of each camera

    def link(self, report: str) -> str:
        """Address of its own report, from the folder of the other."""
        return f"{self.folder}/{report}"


def scenes(dataset: Dataset, report: str) -> list[Scene]:
    """The datasets in a dataset's folder that have a report.

    Raises:
        UserError: a shard of theirs is damaged.
    """
    folders = sorted(path for path in dataset.root.iterdir() if (path / RECIPE_FILE).is_file())
    return [_scene(open_dataset(path)) for path in folders if (path / report).is_file()]


def _scene(dataset: Dataset) -> Scene:
    frames = dataset.read("frames").to_pylist()
    points = point_errors(dataset, frames) if dataset.shards("detections") else []
    summary = summarised(Run(dataset.recipe, frames, points, series(dataset.read("scores"))))
    first = {frame["camera_name"]: frame for frame in reversed(frames)}
    shown = [_shown(dataset, frame) for frame in sorted(first.values(), key=lambda frame: frame["frame_id"])]
    return Scene(dataset.root.name, dataset.recipe.description, (summary.sentence, *summary.facts), tuple(shown))


def _shown(dataset: Dataset, frame: dict[str, Any]) -> ShownPicture:
    image = decode_image(frame["image"], dataset.root, frame["frame_id"], in_colour=True)
    told = f"frame {frame['frame_id']}, tilt {frame['tilt_deg']:.0f}°"
    return ShownPicture(frame["camera_name"], told, jpeg_address(image, PICTURE_PX))
