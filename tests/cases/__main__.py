"""Try every case again: `python -m tests.cases FOLDER [PAGE]` prints a table, or writes a page."""

from __future__ import annotations

import sys
from pathlib import Path

from pipelines.machine import facts
from tests.cases import commands, pictures, solvers

HEAD = """\
# Inputs that once failed

Small inputs on which an earlier version gave no answer, a wrong one, or one after a minute; each stands for a kind of
fault. They are not in this repository, some being crops of public photographs; tests draw others of the same kinds.
`python -m tests.cases FOLDER docs/evidence/cases.md` writes this page. Seconds are processor time of one picture.

The second ideal picture's grey values hold one edge along each axis at 599.9, 0.1 px from where it was meant: all
other corners are within 0.004 px. Files of poses are scored against a dataset of six frames that is not theirs."""


def main(arguments):
    """0, or 2 without a folder."""
    if not arguments or not Path(arguments[0]).is_dir():
        print("give the folder of the cases, and a file for the page or nothing", file=sys.stderr)
        return 2
    folder = Path(arguments[0])
    rows = [*pictures.cases(folder), *solvers.cases(folder), *commands.cases(folder)]
    lines = ["| case | what it is | before | now | right |", "|---|---|---|---|---|"]
    lines += [f"| {row.name} | {row.what} | {row.before} | {row.now.replace('|', '/')} | {row.right} |" for row in rows]
    table = "\n".join(lines)
    if len(arguments) < 2:
        print(table)
    else:
        Path(arguments[1]).write_text("\n\n".join([HEAD, _made(), table]) + "\n")
    return 0


def _made():
    known = dict(facts())
    versions = ", ".join(f"{name} {known[name]}" for name in ("python", "numpy", "opencv-python-headless", "numba"))
    return f"Made on {known['date']}: {known['processor']}; {versions}."


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
