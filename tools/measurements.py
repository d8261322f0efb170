"""Measure the figures that the documents tell, and write them to docs/measurements.json.

Usage: python -m tools.measurements [--only NAME] [--all]. The commands run in the current folder and leave what they
make below build/measurements; one that has run there is not run again, so that a stopped run goes on. Remove the folder
to measure everything anew.
"""

from __future__ import annotations

import argparse
import json
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from datasets.errors import UserError
from datasets.store.atomic import write_text
from pipelines.machine import facts
from tools.measurement_list import MEASUREMENTS, OUT, Measurement
from tools.measurement_results import Results
from tools.reference import table

FIGURES = Path(__file__).resolve().parents[1] / "docs" / "measurements.json"


@dataclass(frozen=True, slots=True)
class Ran:
    """A command that has run."""

    command: str
    output: str  # its stdout
    date: str  # as 2026-01-31
    made_with: str  # versions of the libraries, and the machine


@dataclass(frozen=True, slots=True)
class Entry:
    """A figure of measurements.json."""

    figure: str  # Markdown
    date: str  # when its first command ran
    made_with: str  # versions of the libraries, and the machine
    by_hand: bool  # whether it was entered by hand
    readme: str = ""  # README's shorter figure, if it has one


def ran(command: str) -> Ran:
    """Run a command, or take what it left before.

    Raises:
        UserError: it ended with an error.
    """
    record = Path(OUT) / "commands" / f"{re.sub(r'[^a-z0-9]+', '-', command)}.json"
    if record.exists():
        return Ran(**json.loads(record.read_text(encoding="utf-8")))
    print(command, flush=True)
    start = time.monotonic()
    words = [sys.executable, *shlex.split(command)[1:]]
    done = subprocess.run(words, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        raise UserError(f"`{command}` ended with code {done.returncode}; run it by itself to see why")
    print(f"  {time.monotonic() - start:.0f} s", flush=True)
    told = dict(facts())
    date = told.pop("date")
    found = Ran(command, done.stdout, date, ", ".join(f"{name} {value}" for name, value in told.items()))
    record.parent.mkdir(parents=True, exist_ok=True)
    write_text(record, json.dumps(asdict(found), indent=1))
    return found


def measured(measurement: Measurement) -> Entry:
    """The figure of a measurement: its commands run, what they left read.

    Raises:
        UserError: a command ended with an error, or what it left is not complete.
        ValueError: a figure that is entered by hand.
    """
    if measurement.figure is None:
        raise ValueError(f"{measurement.name} is entered by hand")
    commands = [ran(command) for command in measurement.commands]
    results, oldest = Results(Path(OUT), tuple(done.output for done in commands)), min(commands, key=lambda r: r.date)
    readme = measurement.readme(results) if measurement.readme else ""
    return Entry(measurement.figure(results), oldest.date, oldest.made_with, False, readme)


def read(path: Path) -> dict[str, Entry]:
    """The entries of all measurements by name; none where there is no file yet."""
    entries = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    return {name: Entry(**entry) for name, entry in entries.items()}


def write(path: Path, entries: dict[str, Entry]) -> None:
    """Write the entries in the order of the list."""
    order = [measurement.name for measurement in MEASUREMENTS if measurement.name in entries]
    write_text(path, json.dumps({name: asdict(entries[name]) for name in order}, indent=2, ensure_ascii=False) + "\n")


def page() -> str:
    """The table of all figures, and what they were made with, as Markdown."""
    entries, titles = read(FIGURES), ("what", "figure", "measured", "command")
    made_with = list(dict.fromkeys(entry.made_with for entry in entries.values()))
    rows = []
    for measurement in MEASUREMENTS:
        entry = entries[measurement.name]
        when = f"{entry.date}{', by hand' if entry.by_hand else ''} ({made_with.index(entry.made_with) + 1})"
        commands = "<br>".join(f"`{command}`" for command in measurement.commands)
        rows.append((measurement.what, entry.figure, when, commands))
    machines = "".join(f"{number}. {text}\n" for number, text in enumerate(made_with, start=1))
    return f"{table(titles, rows)}\nThe number behind a date tells what it was made with:\n\n{machines}"


def chosen(names: Sequence[str], everything: bool) -> list[Measurement]:
    """The measurements to make: those named, else all that need no hand, the costly ones only with `everything`.

    Raises:
        UserError: an unknown name, or a figure that is entered by hand.
    """
    known = {measurement.name: measurement for measurement in MEASUREMENTS}
    for name in names:
        if name not in known:
            raise UserError(f"unknown measurement {name!r}; choose one of {', '.join(known)}")
        if known[name].figure is None:
            commands = " and ".join(known[name].commands)
            raise UserError(f"{name} is entered by hand: run {commands}, then edit docs/measurements.json")
    if names:
        return [known[name] for name in names]
    return [item for item in MEASUREMENTS if item.figure is not None and (everything or not item.costly)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, writing each figure when it is there; the exit code: 1 if one failed, 2 for a wrong argument."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", action="append", default=[], metavar="NAME", help="one figure; may be given again")
    parser.add_argument("--all", action="store_true", help="those too that take more than some minutes each")
    given, code = parser.parse_args(arguments), 0
    try:
        measurements = chosen(given.only, given.all)
    except UserError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    for measurement in measurements:
        try:
            entry = measured(measurement)
        except UserError as error:
            print(f"error: {measurement.name}: {error}", file=sys.stderr)
            code = 1
            continue
        print(f"{measurement.name}: {entry.figure}", flush=True)
        write(FIGURES, {**read(FIGURES), measurement.name: entry})
    return code


if __name__ == "__main__":
    raise SystemExit(main())
