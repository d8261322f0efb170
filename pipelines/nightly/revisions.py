"""Two states of this project's code on the same pictures: commits of this checkout, or folders of others."""

from __future__ import annotations

import io
import subprocess
import tarfile
import tempfile
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
from rich.console import Console

from datasets.errors import UserError
from datasets.store.dataset import Dataset
from pipelines.engines.local import LocalEngine
from pipelines.nightly import suites
from pipelines.nightly.judgement import Judgement, judge
from pipelines.nightly.other_code import LIMIT_S, PACKAGES, ROOT, Code, OtherCodeError, freeze
from pipelines.nightly.reading import Frozen
from pipelines.nightly.work_folder import work_folder

GIT_S = 60.0  # what git may take to pack a commit's files


@dataclass(frozen=True, slots=True)
class Pictures:
    """What both states of the code read."""

    recipe: str
    regimes: tuple[str, ...]
    root: Path  # pictures are kept here as a night's history keeps them, and copies of the code


def is_checkout(folder: Path) -> bool:
    """Whether a folder holds all packages of this project."""
    return all((folder / name / "__init__.py").is_file() for name in PACKAGES)


def compare_code(old: str, new: str, pictures: Pictures, alpha: float, workers: int, console: Console) -> Judgement:
    """Judge `new` against `old` frame by frame; each runs in a process of its own, which asserts whose code it is.

    old, new: a revision that git knows, or the folder of a checkout.

    Raises:
        UserError: no such revision, git is missing, or a code that cannot read the pictures.
    """
    wanted = suites.suites(suites.PINNED, pictures.recipe, pictures.regimes)
    codes = [(name, Code(_folder(name, pictures.root / "code"))) for name in (old, new)]
    engine = LocalEngine(workers)
    made = {suite.name: suite.make(pictures.root / "pictures" / suite.name, engine, console) for suite in wanted}
    with work_folder(pictures.root) as work:
        before, after = (
            _measures(name, code, made, work / side, workers)
            for (name, code), side in zip(codes, ("old", "new"), strict=True)
        )
    return judge(before, after, alpha, paired=True)


def _measures(name: str, code: Code, made: dict[str, Dataset], folder: Path, workers: int) -> pa.Table:
    frozen = Frozen(code, {}, workers)
    try:
        readings = [frozen.read(item, folder / suite, suites.READ, LIMIT_S) for suite, item in made.items()]
    except OtherCodeError as error:
        raise UserError(f"the code of {name} cannot read these pictures: {error}; choose a later state") from None
    return pa.concat_tables([item.measures for item in readings])


def _folder(name: str, store: Path) -> Path:
    """A copy of the source files of a revision or of a checkout, so that nobody changes them meanwhile."""
    if is_checkout(Path(name)):
        return freeze(store, Path(name).resolve())
    found = _git("rev-parse", "--verify", "--quiet", "--end-of-options", f"{name}^{{commit}}")
    if found.returncode:
        told = f"{name!r} is no dataset, no checkout of this project, and no revision that git knows in {ROOT}"
        raise UserError(f"{told}; give two datasets, or two revisions or checkouts")
    archive = _git("archive", "--format=tar", found.stdout.decode().strip())
    if archive.returncode:
        said = archive.stderr.decode(errors="replace").strip()
        raise UserError(f"git cannot give the files of {name}: {said}; give a checkout's folder instead")
    with tempfile.TemporaryDirectory() as temporary:
        _unpack(archive.stdout, Path(temporary))
        if not is_checkout(Path(temporary)):
            told = f"{name} is from before this project had the packages {', '.join(PACKAGES)}"
            raise UserError(f"{told}; choose a later commit")
        return freeze(store, Path(temporary))


def _unpack(archive: bytes, folder: Path) -> None:
    """The files of the packages in a tar archive."""
    with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
        for member in tar:
            content, parts = tar.extractfile(member) if member.isfile() else None, Path(member.name).parts
            if content is not None and parts[0] in PACKAGES and ".." not in parts:
                path = folder / member.name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content.read())


def _git(*words: str) -> subprocess.CompletedProcess[bytes]:
    try:
        return subprocess.run(
            ["git", "-C", str(ROOT), *words], stdin=subprocess.DEVNULL, capture_output=True, check=False, timeout=GIT_S
        )
    except FileNotFoundError:
        raise UserError("git is not installed here; give the folders of two checkouts instead of commits") from None
    except subprocess.TimeoutExpired:
        raise UserError(f"git did not answer within {GIT_S:g} s; give the folders of two checkouts") from None
