"""metrics.prom: the night as OpenMetrics text, one gauge for each number of each slice.

Only gauges are used, since Prometheus's older text format, which node_exporter's textfile collector reads, knows them
as well. There are no times of samples in it: the collector's own time is taken, and `started` tells the night's.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from pipelines.nightly.history import finding_rows
from pipelines.nightly.outputs.results import Results
from pipelines.nightly.record import State

PREFIX = "eposit_nightly_"
NUMBERS = {
    "effect": "change from the baseline to the candidate, in the metric's unit",
    "low": "lower end of the change's 95 % interval",
    "high": "upper end of the change's 95 % interval",
    "margin": "a smaller change does not matter",
    "smallest_visible": "change that 95 of 100 such nights would have seen",
    "old": "the baseline's mean",
    "new": "the candidate's mean",
}

Labels = Mapping[str, str]


def text(results: Results) -> str:
    """All gauges, ended by `# EOF`."""
    return (
        "\n".join(
            [*_night(results), *_gates(results), *_speed(results), *_findings(results), *_counts(results), "# EOF"]
        )
        + "\n"
    )


def _night(results: Results) -> Iterator[str]:
    night = results.night
    labels = {"run_id": night.run_id, "recipe": night.recipe, "baseline": night.baseline, **_named(night.facts)}
    yield from _gauge("run", "which run it was; always 1", [(labels, 1)])
    yield from _gauge("started_seconds", "when it began, seconds since 1970", [({}, night.started.timestamp())])
    yield from _gauge("exit", "0 fine, 1 worse, 3 no verdict, 4 could not run", [({}, int(night.exit))])


def _gates(results: Results) -> Iterator[str]:
    held = [
        ({"gate": own.gate, "state": state}, own.state is state) for own in results.night.outcomes for state in State
    ]
    yield from _gauge("gate", "1 for the state in which a gate ended", held)


def _speed(results: Results) -> Iterator[str]:
    timings = results.night.timings
    ratios = [({"stage": item.stage}, item.ratio) for item in timings]
    yield from _gauge("stage_ratio", "processor time of a stage, candidate over baseline", ratios)
    per_frame = [
        ({"stage": item.stage, "side": side}, value / 1000.0)
        for item in timings
        for side, value in (("old", item.old_ms), ("new", item.new_ms))
    ]
    yield from _gauge("stage_seconds", "processor time of a stage, a frame", per_frame)


def _findings(results: Results) -> Iterator[str]:
    rows = finding_rows(results.night.run_id, results.findings, results.alpha).to_pylist()
    labelled = [
        ({"suite": row["suite"], **_slice(row["slice"]), "metric": row["metric"], "unit": row["unit"]}, row)
        for row in rows
    ]
    for name, meaning in NUMBERS.items():
        yield from _gauge(name, meaning, [(labels, row[name]) for labels, row in labelled])


def _counts(results: Results) -> Iterator[str]:
    counts = results.counts()
    labels = [{"suite": item.suite, "side": item.side, **_slice(item.slice)} for item in counts]
    yield from _gauge("frames", "frames of a slice", zip(labels, (item.frames for item in counts), strict=True))
    yield from _gauge("failed_frames", "those that failed", zip(labels, (item.failed for item in counts), strict=True))


def _gauge(name: str, meaning: str, samples: Iterable[tuple[Labels, float]]) -> list[str]:
    lines = [f"{PREFIX}{name}{_labels(labels)} {_number(value)}" for labels, value in samples]
    return [f"# TYPE {PREFIX}{name} gauge", f"# HELP {PREFIX}{name} {meaning}", *lines] if lines else []


def _labels(labels: Labels) -> str:
    inner = ",".join(f'{name}="{_escaped(value)}"' for name, value in labels.items())
    return f"{{{inner}}}" if inner else ""


def _escaped(value: str) -> str:
    return value.replace("\\", "\\\\").replace("\n", "\\n").replace('"', '\\"')


def _number(value: float) -> str:
    return repr(float(value)).replace("inf", "Inf").replace("nan", "NaN")


def _slice(name: str) -> dict[str, str]:
    return dict(zip(("regime", "camera", "system"), name.split("/", 2), strict=False))


def _named(facts: tuple[tuple[str, str], ...]) -> dict[str, str]:
    """Facts as labels, whose names have letters, digits and underscores only."""
    return {"fact_" + re.sub(r"[^A-Za-z0-9_]", "_", name): value for name, value in facts}
