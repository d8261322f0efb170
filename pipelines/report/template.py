"""Pages from templates: the one Jinja environment, with how numbers are shown."""

from __future__ import annotations

from pathlib import Path

import jinja2
import numpy as np

from pipelines.report.sections import Drawing
from pipelines.statistics import Interval


def rendered(template: Path, **values: object) -> str:
    """The page of a template; what it is given is escaped but for what it marks as safe."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(template.parent), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"number": number, "share": share}
    environment.tests["drawing"] = lambda item: isinstance(item, Drawing)
    return environment.get_template(template.name).render(**values)


def number(value: float | None, digits: int = 3) -> str:
    """To significant digits; a dash for none."""
    if value is None or not np.isfinite(value):
        return "\N{EN DASH}"
    return f"{value:.{digits}g}" if abs(value) >= 1e-4 or value == 0.0 else f"{value:.1e}"


def share(found: Interval) -> str:
    """The interval of a share in percent."""
    return f"[{100.0 * found.low:.1f}, {100.0 * found.high:.1f}] %"
