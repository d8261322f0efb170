"""Gate `speed`: processor time of each stage, the baseline's code and this one in turns.

Wall time of a shared machine scatters by 9 % from night to night, whatever it is divided by. Processor time of two
processes that work alternately on the same frames scatters by 1 % on an idle machine, and by 6 % where many processes
share a core. So turns go on until their ratio is known well enough to judge by. Each process warms up first, so that
neither compiling nor loading counts. A user's function is called again within a turn until that takes long enough to be
timed.
"""

from __future__ import annotations

import json
import subprocess
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np

from pipelines.nightly import child
from pipelines.nightly.other_code import CHOOSE_CODE, ROOT, Code, OtherCodeError
from pipelines.nightly.reading import Frozen, with_function
from pipelines.nightly.record import Exit, Outcome, State, Timing

GATE = "speed"
LARGEST_RATIO = 1.10
TURNS = 4  # pairs of turns, in the order ABBA, before their scatter is looked at
MOST_TURNS = 32
KNOWN = 0.015  # standard error of a ratio: 1.15 is then told from 1.10, and 1.00 never taken for it
LEAST_S = 0.2  # of processor time in a turn; a turn of a few milliseconds scatters by a tenth

# argv from 5: the dataset, and the option and the name of a user's function or twice nothing. Each line on stdin asks
# for a turn over the first shard; the answer is the processor seconds of each stage.
PROGRAM = (
    CHOOSE_CODE
    + f"""
import contextlib, json, time
from datasets.store.dataset import open_dataset
from pipelines.stages import detect, estimate
from pipelines.stages.settings import Setting
dataset, option, name = open_dataset(Path(sys.argv[5])), *sys.argv[6:8]
def estimator():
    from pipelines.stages import estimate_images
    from pipelines.stages.settings import System
    return lambda: estimate_images.run_shard(dataset, 0, system=System(name))
work = {{
    "": lambda: {{
        "detect": lambda: detect.run_shard(dataset, 0, detector="edge-fit"),
        "estimate": lambda: estimate.run_shard(dataset, 0, Setting()),
    }},
    "--solver": lambda: {{name: lambda: estimate.run_shard(dataset, 0, Setting(name))}},
    "--estimator": lambda: {{name: estimator()}},
}}[option]()
least, times = {LEAST_S!r} if option else 0.0, dict.fromkeys(work, 1)
for line in sys.stdin:
    spent = {{}}
    for stage, run in work.items():
        start = time.process_time()
        with contextlib.redirect_stdout(sys.stderr):  # the answers are there alone
            for _ in range(times[stage]):
                run()
        spent[stage] = (time.process_time() - start) / times[stage]
        times[stage] = max(1, min(1000, round(least / max(spent[stage], 1e-6))))
    print(json.dumps(spent), flush=True)
"""
)


def time_all(frozen: Frozen, new: Code, folders: tuple[Path, Path], frames: int) -> list[Timing]:
    """Time our stages, then each of a user's functions that the baseline has a copy of; as `time_both`.

    new: a copy of this code, which calls the functions; the checkout itself has compiled what our stages need.
    """
    timings = time_both(frozen.code, Code(ROOT), folders, frames)
    for function, copy in frozen.functions.items():
        old, words = with_function(frozen.code, function, copy, new.limit_s), (function.option, function.name)
        timings += time_both(old, new, folders, frames, function=words)
    return timings


def time_both(
    old: Code,
    new: Code,
    folders: tuple[Path, Path],
    frames: int,
    turns: int = TURNS,
    function: tuple[str, str] = ("", ""),
) -> list[Timing]:
    """Time two codes in turns.

    folders: a dataset with pictures for each, whose first shard has so many frames and is read again at every turn.
    function: the option and the name of a user's function, which is timed instead of our stages; a solver needs points.

    Raises:
        OtherCodeError: a code failed.
    """
    with _running(old, folders[0], function) as before, _running(new, folders[1], function) as after:
        for process in (before, after):
            _turn(process)  # loads, and compiles where that has not been done
            stages = list(_turn(process))  # tells how often a short stage is to be repeated
        found: list[dict[str, float]] = []
        while len(found) < 4 * MOST_TURNS:
            found += [_turn(process) for _ in range(turns) for process in (before, after, after, before)]
            old_s, new_s = _sides(found, stages)
            if np.all(np.std(new_s / old_s, axis=0, ddof=1) <= KNOWN * np.sqrt(len(old_s))):
                break
    old_s, new_s = _sides(found, stages)
    return [_timing(stage, old_s[:, i], new_s[:, i], frames) for i, stage in enumerate(stages)]


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


def _sides(found: Sequence[dict[str, float]], stages: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """(turns, stages) seconds of the baseline's and of the candidate's code, from turns in the order ABBA."""
    return _seconds(found[0::4], found[3::4], stages), _seconds(found[1::4], found[2::4], stages)


def _seconds(
    first: Sequence[dict[str, float]], second: Sequence[dict[str, float]], stages: Sequence[str]
) -> np.ndarray:
    """(turns, stages) mean of both turns of each pair."""
    return np.array([[(a[s] + b[s]) / 2.0 for s in stages] for a, b in zip(first, second, strict=True)])


@contextmanager
def _running(code: Code, folder: Path, function: tuple[str, str]) -> Iterator[subprocess.Popen[str]]:
    command = code.command(PROGRAM, folder, *function)
    with child.started(command, stdin=subprocess.PIPE) as process:
        # Whoever waits for an answer then gets the end of the file.
        limit = threading.Timer(code.limit_s, child.kill, [process])
        limit.start()
        try:
            yield process
        finally:
            limit.cancel()


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
