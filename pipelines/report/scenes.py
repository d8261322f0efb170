"""Other datasets inside a dataset's folder, as its report shows them: the demo's board in a room."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from datasets.rows import decode_image
from datasets.store.dataset import RECIPE_FILE, Dataset, open_dataset
from pipelines.pages.frames import rows_of
from pipelines.pages.pictures import jpeg_address
from pipelines.report.gather import gathered
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
    run, _ = gathered(dataset)
    summary = summarised(run)
    first = {frame["camera_name"]: frame for frame in reversed(run.frames)}
    shown = list(_shown(dataset, {frame["frame_id"]: frame for frame in first.values()}))
    return Scene(dataset.root.name, dataset.recipe.description, (summary.sentence, *summary.facts), tuple(shown))


def _shown(dataset: Dataset, frames: dict[int, dict[str, Any]]) -> Iterator[ShownPicture]:
    """The whole pictures of some frames, by number, in their order."""
    for row, path in rows_of(dataset, "frames", ["image"], frames):
        frame = frames[row["frame_id"]]
        image = decode_image(row["image"], path, row["frame_id"], in_colour=True)
        told = f"frame {row['frame_id']}, tilt {frame['tilt_deg']:.0f}°"
        yield ShownPicture(frame["camera_name"], told, jpeg_address(image, PICTURE_PX))
