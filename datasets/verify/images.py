"""Linear images, truth of pixels and baked light of a dataset: there, of their frame, and as they were written."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from datasets.plan import frame_count, plan
from datasets.store.baked_light import FILE, FOLDER, light_key
from datasets.store.dataset import Dataset
from datasets.store.exr_file import DamagedExrError, Header, read_exr
from datasets.store.kept_masters import Kept, kept_of
from datasets.store.linear_images import MASTERS, linear_path
from datasets.store.masters import masters
from datasets.store.pixel_truth import TRUTH, truth_path
from datasets.verify.archives import archive_problems, single_file_problem, unplanned_archives
from datasets.verify.problems import Kind, Problem, damaged_file, missing_file, unplanned_file


def image_problems(dataset: Dataset) -> Iterator[Problem]:
    """What is wrong with the OpenEXR files of a dataset."""
    kept = kept_of(dataset.root)
    if kept is Kept.FILES:
        yield from _masters(dataset)
    if kept is Kept.ARCHIVES:
        yield from archive_problems(dataset)
    if dataset.recipe.outputs.aovs:
        yield from _truth(dataset)
    yield from _light(dataset)
    yield from _unplanned(dataset)
    yield from unplanned_archives(dataset, kept)


def _masters(dataset: Dataset) -> Iterator[Problem]:
    for master in masters(dataset.root, dataset.recipe):
        problem = single_file_problem(master) if master.file.is_file() else missing_file(master.file)
        if problem is not None:
            yield problem


def _truth(dataset: Dataset) -> Iterator[Problem]:
    for frame in plan(dataset.recipe):
        path = dataset.root / truth_path(frame.frame_id)
        if not path.is_file():
            yield missing_file(path)
            continue
        fault = _fault(path)
        size = frame.camera.width, frame.camera.height
        if isinstance(fault, str):
            yield damaged_file(path, dataset.root, fault)
        elif _size(fault) != size:
            yield damaged_file(path, dataset.root, f"it is not of {size[0]} x {size[1]} pixels")


def _light(dataset: Dataset) -> Iterator[Problem]:
    path = dataset.root / FOLDER / FILE
    if path.is_file():
        fault = _fault(path)
        if isinstance(fault, str):
            yield damaged_file(path, dataset.root, fault)
        elif fault.get("key") != light_key(dataset.recipe, plan(dataset.recipe)[0].world):
            text = f"{path} belongs to another recipe; `repair {dataset.root}` puts it aside"
            yield Problem(path, Kind.FOREIGN, text)


def _unplanned(dataset: Dataset) -> Iterator[Problem]:
    frames = frame_count(dataset.recipe)
    for folder, place in ((MASTERS, linear_path), (TRUTH, truth_path)):
        for path in sorted((dataset.root / folder).glob("[!.]*.exr")):
            number = int(path.stem) if re.fullmatch("[0-9]{6,12}", path.stem) else frames
            if number >= frames or path != dataset.root / place(number):
                yield unplanned_file(path, dataset.root)


def _fault(path: Path) -> Header | str:
    """The header of a sound file, else what is wrong with it."""
    try:
        return read_exr(path)[0]
    except DamagedExrError as error:
        return str(error)
    except OSError:
        return "it cannot be read"


def _size(header: Header) -> tuple[int, int]:
    low, high = header["dataWindow"]
    return int(high[0] - low[0]) + 1, int(high[1] - low[1]) + 1
