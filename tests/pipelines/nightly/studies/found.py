"""What the studies found, kept in `out/studies` until the pages are written: they take long, and may run one by one."""

from __future__ import annotations

import datetime
import json

from datasets.store.atomic import write_text
from pipelines.machine import commit, facts
from pipelines.nightly.other_code import ROOT

FOLDER = ROOT / "out" / "studies"


def keep(name, values):
    """Keep one study's findings with the date, the commit and the machine."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    made = {"date": datetime.date.today().isoformat(), "commit": commit(), "machine": dict(facts())}
    write_text(FOLDER / f"{name}.json", json.dumps(values | made, indent=1))


def parts(begin):
    """Every study's findings whose name begins so, in the order of the names, with their `name`."""
    return [
        json.loads(path.read_text(encoding="utf-8")) | {"name": path.stem}
        for path in sorted(FOLDER.glob(f"{begin}*.json"))
    ]
