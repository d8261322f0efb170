"""Run the stress pictures: `python -m tests.stress [--views N] [--first VIEW] [--only KIND ...]`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tests.stress.answers import DETECTORS
from tests.stress.kinds import KINDS
from tests.stress.page import EVIDENCE, write_page
from tests.stress.results import ROOT, Results
from tests.stress.running import children, run_kind, views_of
from tests.stress.sheet import write_sheet
from tests.stress.summary import faults, figures


def main():
    """0 if every kind holds what is asked, else 1."""
    given = _arguments()
    kinds = [KINDS[name] for name in given.only or KINDS]
    results = Results(given.out)
    asked, found = children(given.detectors), {}
    try:
        for kind in kinds:
            wanted = {detector: views_of(kind, detector, given.first, given.views) for detector in asked}
            found[kind.name] = run_kind(kind, wanted, asked, results)
            _tell(kind, found[kind.name])
    finally:
        for child in asked.values():
            child.close()
    write_sheet(kinds, results.folder / "tiles", results.folder / "sheet.png")
    page = given.page or (EVIDENCE if not given.only and given.first == 0 else None)
    if page:
        write_page(found, Path(page))
    return int(any(faults(rows) for rows in found.values()))


def _arguments():
    parser = argparse.ArgumentParser(prog="python -m tests.stress", description=__doc__)
    parser.add_argument(
        "--views", type=int, default=20, help="pictures of each kind, at most 20; ours sees twice as many"
    )
    parser.add_argument("--first", type=int, default=0, help="first view; those of the page begin at 0")
    parser.add_argument("--only", nargs="+", choices=KINDS, metavar="KIND", help="kinds; all of them without it")
    parser.add_argument("--detectors", nargs="+", choices=DETECTORS, default=DETECTORS, help="ours is always needed")
    parser.add_argument("--out", default=ROOT / "out" / "stress", help="folder of what was found")
    parser.add_argument("--page", help="the table, in Markdown; of all kinds from view 0 it is docs/evidence/stress.md")
    return parser.parse_args()


def _tell(kind, rows):
    for detector, own in rows.items():
        f = figures(own)
        print(
            f"{kind.name:24} {detector:8} found {f.found:6.3f} wrong {f.wrong:4} rms {f.rms_px:8.4f} "
            f"bias {f.bias_px:8.4f} norm {f.normalised:6.2f} s {f.mean_s:6.2f} {f.slowest_s:6.2f} {f.status}",
            flush=True,
        )
    for sentence in faults(rows):
        print(f"    {sentence}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
