"""Nights, and first runs with empty caches of compiled code, that are killed and go on.

`python -m tests.hostile.killed_processes --nights 20 --first-runs 10`. Each is a process of its own, which is killed at
a random moment with all that it has started; then the same command is given again.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from datasets.errors import UserError
from pipelines.nightly.acceptance import accept_baseline
from pipelines.nightly.history import History
from tests.conftest import TINY
from tests.hostile.interruptions import content
from tests.hostile.running import adopt_orphans, orphans
from tests.signals import heed_signals
from tests.wrong_input import files, left_behind

ROOT = Path(__file__).parents[2]
LIMIT_S = 600.0
NO_BASELINE, FINE = 3, 0  # exit codes of a night
KEPT = ("runs", "findings", "measures")  # folders of a history whose files never change
NIGHT = (
    "nightly", "run", "nightly-smoke", "--regime", "typical", "--seed", "7", "--quiet", "--without", "fresh",
    "--without", "speed",
)  # fmt: skip


def main() -> int:
    """Run the cases; the exit code is 1 if any has a fault."""
    parser = argparse.ArgumentParser(prog="python -m tests.hostile.killed_processes", description=__doc__)
    for name in ("nights", "first-runs"):
        parser.add_argument(f"--{name}", type=int, default=0, help="so many are killed")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    adopt_orphans()
    draw = random.Random(asked.seed)
    faults = []
    with tempfile.TemporaryDirectory(prefix="killed-") as folder:
        for kind, count in ((_nights, asked.nights), (_first_runs, asked.first_runs)):
            place = Path(folder) / kind.__name__
            place.mkdir()
            for fault in kind(place, count, draw) if count else ():
                print(f"FAULT {fault}", flush=True)
                faults.append(fault)
    print(f"{asked.nights} nights and {asked.first_runs} first runs killed, {len(faults)} faults")
    return 1 if faults else 0


@dataclass(frozen=True)
class _Ended:
    """How a process ended, and after how long (s)."""

    code: int
    error: str
    seconds: float


def _process(folder: Path, words: tuple[str, ...], places: Mapping[str, str], moment: float | None = None) -> _Ended:
    """A command in a session of its own, which is killed at a moment (s) if one is given."""
    begin = time.monotonic()
    with open(folder / "stderr", "w+", encoding="utf-8", errors="replace") as told:
        process = subprocess.Popen(
            [sys.executable, "-m", "pipelines", *words],
            cwd=ROOT, env={**os.environ, **places}, stdout=subprocess.DEVNULL, stderr=told, start_new_session=True,
            preexec_fn=heed_signals,
        )  # fmt: skip
        try:
            process.wait(LIMIT_S if moment is None else moment)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        seconds = time.monotonic() - begin
        told.seek(0)
        return _Ended(process.returncode, told.read(), seconds)


def _nights(folder: Path, count: int, draw: random.Random) -> Iterator[str]:
    base = folder / "nights"
    first = _night(folder, base)
    if first.code != NO_BASELINE:
        raise SystemExit(f"the first night ended with {first.code}: {first.error}")
    accept_baseline(base, "latest", "the first", "somebody")
    undisturbed = folder / "undisturbed"
    shutil.copytree(base, undisturbed)
    whole = _night(folder, undisturbed)
    if whole.code != FINE:
        raise SystemExit(f"an undisturbed night ended with {whole.code}: {whole.error}")
    print(f"an undisturbed night takes {whole.seconds:.1f} s", flush=True)
    for number in range(count):
        # Every second one near the end, where the history is written.
        moment = draw.uniform(whole.seconds * (0.7 if number % 2 else 0.0), whole.seconds)
        yield from _killed_night(folder, base, _last(undisturbed), moment)


def _night(folder: Path, history: Path, moment: float | None = None) -> _Ended:
    return _process(folder, (*NIGHT, "--history", str(history)), {}, moment)


def _killed_night(folder: Path, base: Path, wanted: dict[str, str], moment: float) -> Iterator[str]:
    """What was in the history stays and can be read, and the next night finds what the undisturbed one did."""
    what, history = f"a night killed after {moment:.2f} s", folder / "history"
    shutil.rmtree(history, ignore_errors=True)
    shutil.copytree(base, history)
    before = _kept(history)
    _night(folder, history, moment)
    if left := orphans():
        yield f"{what}: {left} processes were left behind"
    try:
        History(history).check()
        History(history).runs()
    except UserError as error:
        yield f"{what}: {error}"
    again = _night(folder, history)
    if again.code != FINE:
        yield f"{what}: the next ended with {again.code}: {again.error[-300:]}"
    elif _last(history) != wanted:
        yield f"{what}: the next found other numbers"
    if not before.items() <= _kept(history).items():
        yield f"{what}: a file of the history was lost or changed"
    if hidden := [path.name for pattern in (".tmp-*", ".work-*") for path in history.rglob(pattern)]:
        yield f"{what}: {', '.join(hidden)} was left"


def _kept(history: Path) -> dict[Path, bytes]:
    return {path: found for path, found in files(history).items() if path.parent.name in KEPT and path.suffix}


def _last(history: Path) -> dict[str, str]:
    """Data and measures of the last night, by name with their digests."""
    row = History(history).run("latest")
    return {item["name"]: item["value"] for part in ("data", "measures") for item in row[part]}


def _first_runs(folder: Path, count: int, draw: random.Random) -> Iterator[str]:
    recipe = folder / "recipe.toml"
    recipe.write_text(TINY)
    whole = _first_run(folder, recipe, "undisturbed")
    if whole.code:
        raise SystemExit(f"an undisturbed first run ended with {whole.code}: {whole.error}")
    wanted = content(folder / "undisturbed")
    print(f"an undisturbed first run takes {whole.seconds:.1f} s", flush=True)
    for number in range(count):
        name, moment = f"first{number}", draw.uniform(0.0, whole.seconds)
        what = f"a first run killed after {moment:.2f} s"
        _first_run(folder, recipe, name, moment)
        if left := orphans():
            yield f"{what}: {left} processes were left behind"
        again = _first_run(folder, recipe, name)
        if again.code:
            yield f"{what}, resumed: exit code {again.code}: {again.error[-300:]}"
        elif content(folder / name) != wanted:
            yield f"{what}, resumed: the content is another one"
        elif left_behind(folder / name):
            yield f"{what}, resumed: hidden files are left"


def _first_run(folder: Path, recipe: Path, name: str, moment: float | None = None) -> _Ended:
    """A run whose caches and home are a folder of its own, at first empty, which the second of that name finds."""
    caches = folder / f"{name}-caches"
    caches.mkdir(exist_ok=True)
    places = dict.fromkeys(("XDG_CACHE_HOME", "NUMBA_CACHE_DIR", "HOME", "TMPDIR"), str(caches))
    return _process(folder, ("run", str(recipe), "--out", str(folder / name), "--quiet"), places, moment)


if __name__ == "__main__":
    sys.exit(main())
