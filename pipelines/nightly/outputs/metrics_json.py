"""metrics.json: the whole night as one object, whose form `metrics.schema.json` beside this file states."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pipelines.nightly.history import finding_rows
from pipelines.nightly.outputs.results import Results
from pipelines.nightly.record import Outcome

SCHEMA_VERSION = "1"
SCHEMA_PATH = Path(__file__).with_name("metrics.schema.json")


def text(results: Results) -> str:
    """The object as JSON; numbers that are not finite are null."""
    night = results.night
    rows = finding_rows(night.run_id, results.findings, results.alpha).drop_columns(["run_id"]).to_pylist()
    held = {
        "schema_version": SCHEMA_VERSION,
        "run_id": night.run_id,
        "started": night.started.isoformat(),
        "recipe": night.recipe,
        "baseline": night.baseline,
        "exit": int(night.exit),
        "sentence": night.sentence,
        "alpha": results.alpha,
        "facts": dict(night.facts),
        "data": dict(night.data),
        "gates": [_gate(outcome) for outcome in night.outcomes],
        "speed": [asdict(item) for item in night.timings],
        "findings": [{name: _finite(value) for name, value in row.items()} for row in rows],
        "slices": [asdict(count) for count in results.counts()],
    }
    return json.dumps(held, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _gate(outcome: Outcome) -> dict[str, Any]:
    return {
        "gate": outcome.gate,
        "state": outcome.state,
        "sentence": outcome.sentence,
        "findings": [{"slice": item.slice, "metric": item.change.metric.name} for item in outcome.findings],
        "frames": [{"suite": suite, "frame_id": frame} for suite, frame in outcome.frames],
    }


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
