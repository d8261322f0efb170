"""The baseline's code, frozen as a copy of its files, run in a process of its own.

`PYTHONPATH` is not enough to choose code: a checkout's link in the environment puts itself first. So the process puts
the wanted folder first itself, and refuses to go on if another `eposit` answers.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from datasets.errors import UserError
from datasets.store.atomic import own_name

PACKAGES = ("eposit", "render", "datasets", "pipelines")
KEPT = (".py", ".toml", ".html", ".json", ".typed")
ROOT = Path(__file__).resolve().parents[2]
LIMIT_S = 3600.0  # a suite takes minutes; code that hangs must not keep a night from its end
LAST_LINES = 3  # of what a failed process said

# argv: the folder of the code, the packages that it must hold, then what the program wants.
CHOOSE_CODE = """
import importlib, sys
from pathlib import Path
folder, packages = Path(sys.argv[1]).resolve(), sys.argv[2].split(",")
sys.path.insert(0, str(folder))
for name in packages:
    found = Path(importlib.import_module(name).__file__).resolve()
    if not found.is_relative_to(folder):
        sys.exit(f"{name} is {found}, not in {folder}")
"""
RUN_COMMANDS = (
    CHOOSE_CODE
    + """
import json
from pipelines.__main__ import main
for words in json.loads(sys.argv[3]):
    sys.argv = ["pipelines", *words]
    if code := main():
        sys.exit(code)
"""
)


class OtherCodeError(Exception):
    """The baseline's code did not do what it was asked; the text says what it said."""


@dataclass(frozen=True, slots=True)
class Code:
    """Code to run: a folder that holds all four packages, or an installed version of `eposit` alone."""

    folder: Path
    packages: tuple[str, ...] = PACKAGES

    def run(self, *words: str | Path) -> None:
        """Run `python -m pipelines WORDS` with this code.

        Raises:
            OtherCodeError: it failed, or another `eposit` answered.
        """
        self.run_all([words])

    def run_all(self, commands: Sequence[Sequence[str | Path]]) -> None:
        """Run several commands one after the other in one process, since starting one takes a second.

        Raises:
            OtherCodeError: one failed, or another `eposit` answered.
        """
        words = json.dumps([[str(word) for word in command] for command in commands])
        command = [sys.executable, "-c", RUN_COMMANDS, str(self.folder), ",".join(self.packages), words]
        try:
            done = subprocess.run(
                command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False, timeout=LIMIT_S
            )
        except subprocess.TimeoutExpired:
            raise OtherCodeError(f"code in {self.folder} did not end within {LIMIT_S:g} s") from None
        if done.returncode:
            said = " ".join((done.stderr or done.stdout).strip().splitlines()[-LAST_LINES:])
            names = ", ".join(dict.fromkeys(str(command[0]) for command in commands))
            raise OtherCodeError(f"code in {self.folder}, {names}: {said or f'exit {done.returncode}'}")


def digest_of(folder: Path = ROOT) -> str:
    """SHA-256 over the names and contents of a checkout's source files."""
    total = hashlib.sha256()
    for path in _files(folder):
        content = path.read_bytes()
        total.update(f"{path.relative_to(folder).as_posix()}:{len(content)};".encode() + content)
    return total.hexdigest()


def freeze(store: Path, folder: Path = ROOT) -> Path:
    """Copy a checkout's source files to `store`, under their digest; a copy that is there already stays.

    Raises:
        UserError: the disk or its permissions refuse.
    """
    place = store / digest_of(folder)[:16]
    if place.is_dir():
        return place
    temporary = store / own_name(".tmp-")
    try:
        for path in _files(folder):
            target = temporary / path.relative_to(folder)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, target)
        temporary.rename(place)
    except OSError as error:
        shutil.rmtree(temporary, ignore_errors=True)
        if not place.is_dir():  # another process was faster
            raise UserError(f"cannot freeze the code in {place}: {error.strerror}; choose another --history") from error
    return place


def _files(folder: Path) -> Iterator[Path]:
    for package in PACKAGES:
        yield from sorted(path for path in (folder / package).rglob("*") if path.suffix in KEPT and path.is_file())
