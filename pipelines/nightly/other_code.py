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
from pipelines.nightly import child

PACKAGES = ("eposit", "render", "datasets", "pipelines")
KEPT = (".py", ".toml", ".html", ".json", ".typed")
ROOT = Path(__file__).resolve().parents[2]
LIMIT_S = 3600.0  # a suite takes minutes; code that hangs must not keep a night from its end
LAST_LINES = 3  # of what a failed process said

# argv: the folder of the code, the packages that it must hold, the folder of a user's frozen code and the module that
# must be in it, or twice nothing; then what the program wants. The current folder, where a user's code of today lies,
# is then left out.
CHOOSE_CODE = """
import importlib, importlib.util, os, sys
from pathlib import Path
folder, packages, frozen, module = Path(sys.argv[1]).resolve(), sys.argv[2].split(","), sys.argv[3], sys.argv[4]
if frozen:
    left_out = ("", os.getcwd()) if "pipelines" in packages else ("",)  # else the current folder may be its checkout
    sys.path[:] = [frozen, *(path for path in sys.path if path not in left_out)]
sys.path.insert(0, str(folder))
def check(name, found, folder):
    if found is None or not Path(found).resolve().is_relative_to(folder):
        sys.exit(f"{name} is {found}, not in {folder}")
for name in packages:
    check(name, importlib.import_module(name).__file__, folder)
if frozen:
    spec = importlib.util.find_spec(module)
    check(module, spec and spec.origin, Path(frozen).resolve())
"""
DONE = "every command has ended"  # said last: a function may end its process with exit code 0
RUN_COMMANDS = (
    CHOOSE_CODE
    + """
import json
from pipelines.__main__ import main
for words in json.loads(sys.argv[5]):
    sys.argv = ["pipelines", *words]
    if code := main():
        sys.exit(code)
"""
    + f"""
print()
print({DONE!r})
"""
)


class OtherCodeError(Exception):
    """The baseline's code did not do what it was asked; the text says what it said."""


@dataclass(frozen=True, slots=True)
class Code:
    """Code to run: a folder that holds all four packages, or an installed version of `eposit` alone."""

    folder: Path
    packages: tuple[str, ...] = PACKAGES
    user: tuple[str, Path] | None = None  # a user's module, and the folder of the frozen copy that must answer
    limit_s: float = LIMIT_S

    def command(self, program: str, *words: str | Path) -> list[str]:
        """The command line of a program that begins with `CHOOSE_CODE`; its own words are from argv[5]."""
        module, frozen = self.user or ("", "")
        chosen = (self.folder, ",".join(self.packages), frozen, module)
        return [sys.executable, "-c", program, *map(str, (*chosen, *words))]

    def run(self, *words: str | Path) -> str:
        """Run `python -m pipelines WORDS` with this code; what it said on stderr.

        Raises:
            OtherCodeError: it failed, or another `eposit` answered.
        """
        return self.run_all([words])

    def run_all(self, commands: Sequence[Sequence[str | Path]]) -> str:
        """Run several commands one after the other in one process, since starting one takes a second; its stderr.

        Raises:
            OtherCodeError: one failed, or another `eposit` answered.
        """
        words = json.dumps([[str(word) for word in command] for command in commands])
        done = self.run_program(RUN_COMMANDS, words, what=", ".join(dict.fromkeys(str(item[0]) for item in commands)))
        if not done.stdout.rstrip().endswith(DONE):
            raise OtherCodeError(f"{self._named}: the process ended before its work was done, as by os._exit")
        return done.stderr

    def run_program(self, program: str, *words: str, what: str) -> subprocess.CompletedProcess[str]:
        """Run a program that begins with `CHOOSE_CODE`. what: names it where it fails.

        Raises:
            OtherCodeError: it failed, or took too long.
        """
        try:
            done = child.run(self.command(program, *words), self.limit_s)
        except subprocess.TimeoutExpired:
            raise OtherCodeError(f"{self._named}, {what}: did not end within {self.limit_s:g} s") from None
        if done.returncode:
            said = " ".join(_without_ignored((done.stderr or done.stdout).strip().splitlines())[-LAST_LINES:])
            raise OtherCodeError(f"{self._named}, {what}: {said or f'exit {done.returncode}'}")
        return done

    @property
    def _named(self) -> str:
        return f"code in {self.folder}" if self.user is None else f"{self.user[0]} in {self.user[1]}"


def _without_ignored(lines: list[str]) -> list[str]:
    """Without what Python tells of exceptions that it ignores, as while objects go at a process's end."""
    kept: list[str] = []
    is_ignored = False
    for line in lines:
        if line.startswith("Exception ignored"):
            is_ignored = True
        elif not is_ignored:
            kept.append(line)
        elif not line.startswith(("Traceback", " ")):
            is_ignored = False  # the exception's own line ends it
    return kept


def digest_of(folder: Path = ROOT, files: Sequence[Path] | None = None) -> str:
    """SHA-256 over the names and contents of files in a folder, by default the source files of a checkout."""
    total = hashlib.sha256()
    for path in _files(folder) if files is None else files:
        content = path.read_bytes()
        total.update(f"{path.relative_to(folder).as_posix()}:{len(content)};".encode() + content)
    return total.hexdigest()


def freeze(store: Path, folder: Path = ROOT, files: Sequence[Path] | None = None) -> Path:
    """Copy files of a folder, by default a checkout's source files, to `store`, under their digest.

    A copy that is there already stays. A checkout's gets the machine code that is known of its sources.

    Raises:
        UserError: the disk or its permissions refuse.
    """
    chosen = list(_files(folder) if files is None else files)
    place = store / digest_of(folder, chosen)[:16]
    if not place.is_dir():
        _copy(folder, chosen, place)
    if files is None:
        from pipelines.nightly.carried_kernels import carry_kernels  # loads the compiler

        carry_kernels(place)
    return place


def _copy(folder: Path, files: Sequence[Path], place: Path) -> None:
    """Copy files of a folder to a new place, all or none.

    Raises:
        UserError: the disk or its permissions refuse.
    """
    temporary = place.with_name(own_name(".tmp-"))
    try:
        for path in files:
            target = temporary / path.relative_to(folder)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, target)
        temporary.rename(place)
    except OSError as error:
        shutil.rmtree(temporary, ignore_errors=True)
        if not place.is_dir():  # another process was faster
            raise UserError(f"cannot freeze the code in {place}: {error.strerror}; choose another --history") from error


def _files(folder: Path) -> Iterator[Path]:
    for package in PACKAGES:
        yield from sorted(path for path in (folder / package).rglob("*") if path.suffix in KEPT and path.is_file())
