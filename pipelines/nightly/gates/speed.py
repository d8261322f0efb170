"""Gate `speed`: processor time of each stage, the baseline's code and this one in turns.

Wall time of a shared machine scatters by 9 % from night to night, whatever it is divided by. Processor time of two
processes that work alternately on the same frames scatters by 1 % on an idle machine, and by 6 % where many processes
share a core. So turns go on until their ratio is known well enough to judge by. Each process warms up first, so that
neither compiling nor loading counts.
"""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np

from pipelines.nightly.other_code import CHOOSE_CODE, LIMIT_S, Code, OtherCodeError
from pipelines.nightly.record import Exit, Outcome, State, Timing

GATE = "speed"
LARGEST_RATIO = 1.10
TURNS = 4  # pairs of turns, in the order ABBA, before their scatter is looked at
MOST_TURNS = 32
KNOWN = 0.015  # standard error of a ratio: 1.15 is then told from 1.10, and 1.00 never taken for it
STAGES = ("detect", "estimate")

# argv behind the choice of the code: the dataset. Each line on stdin asks for a turn over the first shard; the answer
# is the processor seconds of each stage.
PROGRAM = (
    CHOOSE_CODE
    + """
import json, time
from datasets.store.dataset import open_dataset
from pipelines.stages import detect, estimate
from pipelines.stages.settings import Setting
dataset = open_dataset(Path(sys.argv[3]))
work = {
    "detect": lambda: detect.run_shard(dataset, 0, detector="edge-fit"),
    "estimate": lambda: estimate.run_shard(dataset, 0, Setting()),
}
for line in sys.stdin:
    spent = {}
    for name, stage in work.items():
        start = time.process_time()
        stage()
        spent[name] = time.process_time() - start
    print(json.dumps(spent), flush=True)
"""
)


def time_both(old: Code, new: Code, folders: tuple[Path, Path], frames: int, turns: int = TURNS) -> list[Timing]:
    """Time two codes in turns.

    folders: a dataset with pictures for each, whose first shard has so many frames and is read again at every turn.

    Raises:
        OtherCodeError: a code failed.
    """
    with _running(old, folders[0]) as before, _running(new, folders[1]) as after:
        for process in (before, after):
            _turn(process)  # loads, and compiles where that has not been done
        found: list[dict[str, float]] = []
        while len(found) < 4 * MOST_TURNS:
            found += [_turn(process) for _ in range(turns) for process in (before, after, after, before)]
            old_s, new_s = _sides(found)
            if np.all(np.std(new_s / old_s, axis=0, ddof=1) <= KNOWN * np.sqrt(len(old_s))):
                break
    old_s, new_s = _sides(found)
    return [_timing(stage, old_s[:, i], new_s[:, i], frames) for i, stage in enumerate(STAGES)]


def judge(timings: Sequence[Timing], waived: Callable[[str], bool]) -> Outcome:
    """A stage that takes a tenth more processor time fails, unless all such stages are waived."""
    slow = sorted((item for item in timings if item.ratio > LARGEST_RATIO), key=lambda item: -item.ratio)
    if slow:
        worst = slow[0]
        told = (
            f"{worst.stage} takes {worst.ratio:.2f} times the processor time of the baseline, {worst.new_ms:.3g} ms a "
            f"frame instead of {worst.old_ms:.3g}"
        )
        if all(waived(item.stage) for item in slow):
            return Outcome(GATE, State.WAIVED, f"accepted: {told}")
        return Outcome(GATE, State.FAILED, told, Exit.WORSE)
    told = ", ".join(f"{item.stage} {item.ratio:.2f}" for item in timings)
    return Outcome(GATE, State.PASSED, f"processor time over the baseline's: {told}")


def _timing(stage: str, old_s: np.ndarray, new_s: np.ndarray, frames: int) -> Timing:
    ratios = new_s / old_s
    per_frame = 1000.0 / frames
    ratio, low, high = float(np.median(ratios)), float(ratios.min()), float(ratios.max())
    return Timing(stage, ratio, low, high, float(np.median(old_s)) * per_frame, float(np.median(new_s)) * per_frame)


def _sides(found: Sequence[dict[str, float]]) -> tuple[np.ndarray, np.ndarray]:
    """(turns, stages) seconds of the baseline's and of the candidate's code, from turns in the order ABBA."""
    return _seconds(found[0::4], found[3::4]), _seconds(found[1::4], found[2::4])


def _seconds(first: Sequence[dict[str, float]], second: Sequence[dict[str, float]]) -> np.ndarray:
    """(turns, stages) mean of both turns of each pair."""
    return np.array([[(a[s] + b[s]) / 2.0 for s in STAGES] for a, b in zip(first, second, strict=True)])


@contextmanager
def _running(code: Code, folder: Path) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-c", PROGRAM, str(code.folder), ",".join(code.packages), str(folder)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        limit = threading.Timer(LIMIT_S, process.kill)  # whoever waits for an answer then gets the end of the file
        limit.start()
        try:
            yield process
        finally:
            limit.cancel()
            process.kill()


def _turn(process: subprocess.Popen[str]) -> dict[str, float]:
    try:
        _pipe(process.stdin).write("\n")
        _pipe(process.stdin).flush()
        return json.loads(_pipe(process.stdout).readline())
    except (OSError, json.JSONDecodeError):
        said = _pipe(process.stderr).read().strip().splitlines()
        raise OtherCodeError(f"timing failed: {said[-1] if said else 'the process ended'}") from None


def _pipe(stream: IO[str] | None) -> IO[str]:
    assert stream is not None  # all three are pipes
    return stream
