"""Sphinx settings.

Reference pages, the table of measurements and the picture of the layers are written when the pages are built.
"""

from __future__ import annotations

import sys
from pathlib import Path

from sphinx.application import Sphinx

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent))

from tools import layers, measurements, reference  # noqa: E402

project = "EPOSIT"
author = "The EPOSIT pipeline's maintainers"
extensions = ["myst_parser"]
exclude_patterns = ["_generated"]
myst_heading_anchors = 3
myst_enable_extensions = ["colon_fence"]
nitpicky = True
html_theme = "furo"
html_title = "EPOSIT"
html_static_path = ["_static"]
html_css_files = ["tables.css"]
html_show_sourcelink = False
html_show_copyright = False
highlight_language = "none"
html_copy_source = False

# A line `<!-- made: commands -->` of a page is replaced by what the function of that name writes.
MADE = {
    "commands": reference.commands,
    "recipes": reference.recipes,
    "recipe keys": reference.recipe_keys,
    "sensor regimes": reference.sensor_regimes,
    "tables": reference.tables,
    "library": reference.library,
    "history": reference.history,
    "baselines": reference.baselines,
    "measurements": measurements.page,
}


def fill(_: Sphinx, docname: str, source: list[str]) -> None:
    """Put what the code says into a page."""
    for name, write in MADE.items():
        mark = f"<!-- made: {name} -->"
        if mark in source[0]:
            source[0] = source[0].replace(mark, write())


def draw_layers(_: Sphinx) -> None:
    """Draw the picture of the layers; an import that points up stops the build."""
    if layers.main(DOCS / "_generated" / "layers.svg"):
        raise SystemExit(1)


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    app.connect("builder-inited", draw_layers)
    app.connect("source-read", fill)
