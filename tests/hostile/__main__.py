"""Hostile cases of each kind, one after the other: `python -m tests.hostile --cases 150 --only tables`."""

from __future__ import annotations

import argparse
import importlib
import math
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import cv2
import pyarrow as pa

from datasets.store.dataset import open_dataset
from tests.conftest import TINY, command
from tests.hostile.running import Outcome, adopt_orphans, run_case
from tests.signals import noted_signals

KINDS = ("recipes", "tables", "pictures", "linear_images", "archives", "poses", "options", "functions", "arrays")


def main() -> int:
    """Run the cases; the exit code is 1 if any has a fault."""
    parser = argparse.ArgumentParser(prog="python -m tests.hostile", description=__doc__)
    parser.add_argument("--cases", type=int, default=150, help="of each kind")
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=math.inf, help="all in all; no case begins later")
    parser.add_argument("--only", choices=KINDS, action="append", help="a kind; may be given again")
    parser.add_argument("--source", type=Path, help="finished dataset of the tests' tiny recipe; made if left out")
    parser.add_argument("--verbose", action="store_true", help="a line for each case")
    begin, asked = time.monotonic(), parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="hostile-") as folder:
        source = warmed(Path(folder), asked.source)
        outcomes = _all(asked, source, Path(folder) / "case", begin + asked.seconds)
        return 1 if _told(outcomes, asked.verbose) else 0


def warmed(folder: Path, source: Path | None = None) -> Path:
    """A finished dataset of the tests' tiny recipe, made in a folder if there is none, and all that it takes loaded."""
    found = source or _made(folder)
    _warm(found, folder / "warm")
    return found


def _made(folder: Path) -> Path:
    recipe = folder / "tiny.toml"
    recipe.write_text(TINY)
    if command("run", recipe, "--out", folder / "tiny", "--quiet"):
        raise SystemExit("the dataset that the cases change could not be made")
    for table in ("estimates", "scores"):
        for path in (folder / "tiny" / table).iterdir():
            if not path.name.startswith("best-detected-exact-all"):
                path.unlink()
    open_dataset(folder / "tiny").write_manifest()
    return folder / "tiny"


def _warm(source: Path, copy: Path) -> None:
    """Import and load once what every case needs; Mitsuba alone is left out, as its threads do not outlive a fork."""
    cv2.setNumThreads(1)
    pa.set_cpu_count(1)
    shutil.copytree(source, copy)
    shutil.rmtree(copy / "detections")
    for words in (("detect", copy, "-q"), ("report", copy)):
        if command(*words):
            raise SystemExit(f"`{words[0]}` does not work, so that the cases would tell nothing")


def _all(asked: argparse.Namespace, source: Path, folder: Path, end: float) -> Iterator[tuple[str, Outcome]]:
    adopt_orphans()
    stopped = noted_signals()
    modules = {name: importlib.import_module(f"tests.hostile.kinds.{name}") for name in asked.only or KINDS}
    for number in range(asked.first, asked.first + asked.cases):
        for name, module in modules.items():
            if stopped or time.monotonic() > end:
                return
            seed = f"{asked.seed} {name} {number}"
            yield f"{name} {number}", run_case(module, seed, source.resolve(), TINY, folder)


def _told(outcomes: Iterator[tuple[str, Outcome]], verbose: bool) -> int:
    codes: Counter[tuple[str, str]] = Counter()
    faulty, count, rss, slowest = 0, 0, 0, 0.0
    for name, outcome in outcomes:
        count += 1
        rss, slowest = max(rss, outcome.rss), max(slowest, outcome.seconds)
        codes[name.split()[0], "/".join(map(str, sorted(set(outcome.codes))))] += 1
        if verbose or outcome.faults:
            print(f"{name}: {outcome.what}: {outcome.codes} {outcome.seconds:.1f} s {outcome.rss >> 20} MB", flush=True)
        for fault in outcome.faults:
            print(f"    FAULT {fault}")
        if outcome.faults or verbose:
            for error in outcome.errors:
                print("".join(f"    | {line[:300]}\n" for line in error.strip().splitlines()[-12:]), end="", flush=True)
        faulty += bool(outcome.faults)
    for (kind, found), number in sorted(codes.items()):
        print(f"{kind}: {number} cases ended with {found or 'no code'}")
    print(f"{count} cases, {faulty} with a fault; at most {rss >> 20} MB and {slowest:.1f} s", flush=True)
    return faulty


if __name__ == "__main__":
    sys.exit(main())
