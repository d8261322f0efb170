"""Figures as SVG texts, all in one style. Salt and dates are fixed, so that equal data give equal text."""

from __future__ import annotations

import hashlib
import io
import re
from typing import Any

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
from matplotlib.figure import Figure

STYLE: Any = {
    "svg.hashsalt": "eposit",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "svg.fonttype": "none",
}
FONT = re.compile(r"font: (?:(?P<weight>bold|\d+) )?(?P<size>[\d.]+)px [^;]*")

POINTS_PER_INCH = 72  # with which SVG is drawn, so that texts are measured as they will be

COLOURS = {"#000000": "currentColor"}  # of the page's text, in either theme


def svg(figure: Figure) -> str:
    """The figure, which is closed, as one `<svg>` element that a page's style can recolour for its dark theme.

    A page allows no style but its own sheet, so styles become attributes; names get a prefix, since names of two
    figures on one page may not be equal.
    """
    buffer = io.StringIO()
    _lay_out(figure)
    figure.savefig(buffer, format="svg", metadata={"Date": None}, transparent=True)
    plt.close(figure)
    text = re.sub(r"^.*?(?=<svg)", "", buffer.getvalue(), flags=re.S)
    text = re.sub(r"<metadata>.*?</metadata>|<style.*?</style>|<!--.*?-->|\n\s*(?=<)", "", text, flags=re.S)
    text = re.sub(r' style="([^"]*)"', lambda found: _attributes(found[1]), text)
    text = re.sub(r'^<svg [^>]*?(viewBox="[^"]*")[^>]*>', r'<svg class="drawing" aria-hidden="true" \1>', text)
    text = text.replace("xlink:href", "href").replace("<defs></defs>", "").replace("<defs/>", "")
    return _named_apart(text)


def _lay_out(figure: Figure) -> None:
    """Place the axes, once and for all: with a layout left to do, `savefig` draws all twice."""
    engine = figure.get_layout_engine()
    if engine is not None:
        figure.set_dpi(POINTS_PER_INCH)
        engine.execute(figure)
        figure.set_layout_engine(None)


def _attributes(style: str) -> str:
    """Declarations of a style as attributes of the same meaning; of a font the size and weight only."""
    found: list[str] = []
    for part in style.split(";"):
        name, _, value = part.strip().partition(": ")
        font = FONT.fullmatch(part.strip())
        if font:
            found.append(f' font-size="{font["size"]}"')
            found += [f' font-weight="{font["weight"]}"'] if font["weight"] else []
        elif name == "opacity" and value == "0":
            found.append(' visibility="hidden"')
        elif name:
            found.append(f' {name}="{COLOURS.get(value, value)}"')
    return "".join(found)


def _named_apart(text: str) -> str:
    """Only names that are used stay, each with a prefix made from the figure's own text."""
    used = set(re.findall(r'(?:url\(#|href="#)([^")]+)', text))
    text = re.sub(r' id="([^"]*)"', lambda found: found[0] if found[1] in used else "", text)
    prefix = f"f{hashlib.sha256(text.encode()).hexdigest()[:8]}-"
    return re.sub(r'( id="|url\(#|href="#)', rf"\1{prefix}", text)
