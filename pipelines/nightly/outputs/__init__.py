"""What a night leaves for other programs: JSON, JUnit, a summary in Markdown, OpenMetrics. The page is elsewhere.

All four are written from the same `Results`, each by its own file's `text`, and a number has the same name in all.
"""

from __future__ import annotations

from pathlib import Path

from datasets.store.atomic import write_text
from pipelines.nightly.outputs import junit, metrics_json, openmetrics, summary
from pipelines.nightly.outputs.results import Results

REPORT = "report.html"


def write_all(results: Results, out: Path, report: str = REPORT) -> list[Path]:
    """Write metrics.json, junit.xml, summary.md and metrics.prom into a folder; their paths.

    report: where the summary's link to the page leads; beside the summary unless given.

    Raises:
        UserError: the disk refuses.
    """
    texts = {
        "metrics.json": metrics_json.text(results),
        "junit.xml": junit.text(results),
        "summary.md": summary.text(results, report),
        "metrics.prom": openmetrics.text(results),
    }
    for name, text in texts.items():
        write_text(out / name, text)
    return [out / name for name in texts]
