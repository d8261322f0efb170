"""A target's print as a drawing at true size, for a printer or a plotter: PDF or SVG, areas without lines.

The drawing has nominal lengths, flat, white margin and all: scale and bend of a recipe are what printer and mounting
make of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from datasets.errors import UserError
from render.targets.chessboard import Chessboard
from render.targets.kinds import AnyTarget
from render.targets.lattice import Cells, Lattice

POINTS_PER_MM = 72.0 / 25.4  # PDF's unit
MOST_PDF_MM = 14400.0 / POINTS_PER_MM  # the largest page that readers take
ROUND = 0.5522847498  # of a radius: how far a Bezier curve's inner points stand from the ends of a quarter circle


class _Box(NamedTuple):
    """A black rectangle, mm, from the drawing's upper left corner."""

    x: float
    y: float
    width: float
    height: float


class _Disc(NamedTuple):
    x: float
    y: float
    radius: float


class Drawing(NamedTuple):
    """Black areas on a white page, mm, y down."""

    width: float
    height: float
    boxes: list[_Box]
    discs: list[_Disc]


def drawing(target: AnyTarget) -> Drawing:
    """The printed board of a target, margin and all, as it is to be printed. A raised circle is a piece of its own."""
    lattice, (x0, x1, y0, y1) = target.lattice(), target.sheet.extent_mm
    boxes = [_Box(x - x0, y - y0, width, height) for x, y, width, height in _merged(lattice)]
    discs = [_Disc(x - x0, y - y0, lattice.disc_radius_mm) for x, y in lattice.disc_centres.tolist()]
    return Drawing(x1 - x0, y1 - y0, boxes, discs)


def written(target: AnyTarget, suffix: str) -> str:
    """The text of the file with that suffix, .pdf or .svg.

    Raises:
        UserError: another suffix, or a page that is too large for PDF.
    """
    if suffix not in (".pdf", ".svg"):
        raise UserError(f"a target cannot be written as {suffix!r}; name a file that ends in .pdf or .svg")
    page = drawing(target)
    if suffix == ".svg":
        return svg(page)
    if max(page.width, page.height) > MOST_PDF_MM:
        raise UserError(
            f"a page of {page.width:g} x {page.height:g} mm is larger than PDF takes, {MOST_PDF_MM:g} mm; write .svg"
        )
    return pdf(page)


def advice(target: AnyTarget) -> str:
    """What to know before printing, one line."""
    page = drawing(target)
    text = f"{page.width:g} x {page.height:g} mm: print it at 100 %, and measure it afterwards"
    if isinstance(target, Chessboard):
        column, row = target.circle_square
        text += (
            f"; the circle is a disc of its own, {2.0 * target.circle_radius_mm:g} mm across, "
            f"{target.circle_height_mm:g} mm above the middle of column {column}, row {row}"
        )
    return text


def svg(page: Drawing) -> str:
    """Scalable Vector Graphics whose unit is the millimetre."""
    size = f'width="{_number(page.width)}mm" height="{_number(page.height)}mm"'
    view = f'viewBox="0 0 {_number(page.width)} {_number(page.height)}"'
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} {view}>',
        '<rect width="100%" height="100%" fill="white"/>',
    ]
    for box in page.boxes:
        x, y, width, height = map(_number, box)
        lines.append(f'<rect x="{x}" y="{y}" width="{width}" height="{height}"/>')
    for disc in page.discs:
        x, y, radius = map(_number, disc)
        lines.append(f'<circle cx="{x}" cy="{y}" r="{radius}"/>')
    return "\n".join([*lines, "</svg>", ""])


def pdf(page: Drawing) -> str:
    """One page of Portable Document Format, as ASCII text."""
    scale, height = POINTS_PER_MM, page.height
    paths = [f"{_number(scale)} 0 0 {_number(-scale)} 0 {_number(scale * height)} cm 0 g"]  # mm, y down
    paths += [" ".join(map(_number, box)) + " re" for box in page.boxes]
    paths += [line for disc in page.discs for line in _circle(disc)]
    content = "\n".join([*paths, "f", ""])
    box = f"[0 0 {_number(scale * page.width)} {_number(scale * height)}]"
    objects = [
        "<< /Type /Catalog /Pages 2 0 R >>",
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox {box} /Contents 4 0 R /Resources << >> >>",
        f"<< /Length {len(content)} >>\nstream\n{content}endstream",
    ]
    text, places = "%PDF-1.4\n", []
    for number, body in enumerate(objects, 1):
        places.append(len(text))
        text += f"{number} 0 obj\n{body}\nendobj\n"
    table = "".join(f"{place:010d} 00000 n \n" for place in places)
    count = len(objects) + 1
    return (
        f"{text}xref\n0 {count}\n0000000000 65535 f \n{table}trailer\n<< /Size {count} /Root 1 0 R >>\n"
        f"startxref\n{len(text)}\n%%EOF\n"
    )


def _circle(disc: _Disc) -> Iterator[str]:
    """Four Bezier curves; they leave the circle by 0.03 % of its radius at most."""
    x, y, r = disc
    yield f"{_number(x + r)} {_number(y)} m"
    for ax, ay, bx, by in ((1, 0, 0, 1), (0, 1, -1, 0), (-1, 0, 0, -1), (0, -1, 1, 0)):
        points = (ax + ROUND * bx, ay + ROUND * by, bx + ROUND * ax, by + ROUND * ay, bx, by)
        yield " ".join(_number((x, y)[i % 2] + r * value) for i, value in enumerate(points)) + " c"


def _merged(lattice: Lattice) -> Iterator[tuple[float, float, float, float]]:
    """x, y, width and height of rectangles that cover the black cells: seams between cells might show in print."""
    left: Cells = lattice.black.copy()
    for row, column in np.argwhere(lattice.black):
        if not left[row, column]:
            continue
        end = column
        while end < left.shape[1] and left[row, end]:
            end += 1
        bottom = row
        while bottom < left.shape[0] and np.all(left[bottom, column:end]):
            bottom += 1
        left[row:bottom, column:end] = False
        x, y = lattice.x_lines[column], lattice.y_lines[row]
        yield float(x), float(y), float(lattice.x_lines[end] - x), float(lattice.y_lines[bottom] - y)


def _number(value: float) -> str:
    """To a ten-thousandth, without trailing zeros."""
    return f"{value:.4f}".rstrip("0").rstrip(".") or "0"
