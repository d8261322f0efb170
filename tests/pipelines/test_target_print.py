"""Targets for the printer: sizes read back from the files, and the drawing against the pattern itself."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from pipelines.target_print import POINTS_PER_MM, drawing, pdf, svg, written
from render.targets.aprilgrid import AprilGrid
from render.targets.charuco import Charuco
from render.targets.chessboard import Chessboard
from render.targets.circle_grid import CircleGrid
from tests.render.targets.drawn import drawn
from tests.wrong_input import assert_one_sentence

# Drawn flat and as large as it should be; modules of whole millimetres.
BENT = Charuco(columns=5, rows=4, marker_mm=72.0, bend_sag_mm=9.0, print_scale=(1.1, 1.0))
TARGETS = [Chessboard(), BENT, AprilGrid(columns=2, rows=3)]
SPACE = "{http://www.w3.org/2000/svg}"


def filled(height, width, boxes, discs):
    """(height, width) 0 or 255 at one pixel for a millimetre."""
    y, x = np.mgrid[0:height, 0:width] + 0.5
    black = np.zeros((height, width), bool)
    for left, top, across, down in boxes:
        black |= (x > left) & (x < left + across) & (y > top) & (y < top + down)
    for cx, cy, radius in discs:
        black |= np.hypot(x - cx, y - cy) < radius
    return np.where(black, 0, 255).astype(np.uint8)


def numbers_of(root, kind, *names):
    """(n, k) attributes of all elements of a kind, but for those with shares of the page."""
    found = [[item.get(name, "%") for name in names] for item in root.findall(SPACE + kind)]
    return [[float(value) for value in values] for values in found if "%" not in "".join(values)]


@pytest.mark.parametrize("target", [*TARGETS, CircleGrid(columns=3, rows=5)])
def test_svg_has_the_true_size_and_the_pattern(target):
    root = ET.fromstring(svg(drawing(target)))
    flat = drawn(target)
    x0, x1, y0, y1 = target.sheet.extent_mm
    assert root.get("width").endswith("mm")
    size = [float(root.get(name).removesuffix("mm")) for name in ("width", "height")]
    np.testing.assert_allclose(size, [x1 - x0, y1 - y0], atol=1e-4)
    boxes = numbers_of(root, "rect", "x", "y", "width", "height")
    discs = numbers_of(root, "circle", "cx", "cy", "r")
    np.testing.assert_array_equal(filled(*flat.shape, boxes, discs), flat)


@pytest.mark.parametrize("target", [*TARGETS, CircleGrid(columns=3, rows=5)])
def test_pdf_has_the_true_size_and_the_same_areas(target):
    page = drawing(target)
    text = pdf(page)
    box = [float(value) for value in re.search(r"/MediaBox \[(.*?)\]", text)[1].split()]
    assert box[:2] == [0.0, 0.0]
    np.testing.assert_allclose(np.array(box[2:]) / POINTS_PER_MM, [page.width, page.height], atol=1e-4)
    matrix = [float(value) for value in re.search(r"stream\n(.*) cm", text)[1].split()]
    np.testing.assert_allclose(matrix, [POINTS_PER_MM, 0, 0, -POINTS_PER_MM, 0, box[3]], atol=1e-3)
    areas = [[float(value) for value in line.split()] for line in re.findall(r"^(.*) re$", text, re.MULTILINE)]
    np.testing.assert_allclose(areas, [list(item) for item in page.boxes] or np.empty(0), atol=1e-4)
    assert len(re.findall(r" c$", text, re.MULTILINE)) == 4 * len(page.discs)
    # Readers find the objects by their places in the file.
    start = int(re.search(r"startxref\n(\d+)", text)[1])
    places = [int(line.split()[0]) for line in text[start:].splitlines()[3:7]]
    assert text[start:].startswith("xref\n0 5\n")
    assert [text[place : place + 8] for place in places] == [f"{number} 0 obj\n" for number in range(1, 5)]
    length = int(re.search(r"/Length (\d+)", text)[1])
    assert text[text.index("stream\n") + 7 :][length:].startswith("endstream")


def test_a_drawing_has_few_rectangles():
    """Black cells side by side are one area: a seam between them might show in print."""
    target = AprilGrid(columns=1, rows=1)
    assert len(drawing(target).boxes) < 0.5 * np.count_nonzero(target.lattice().black)


def test_the_command_writes_what_a_recipe_or_a_pattern_says(tmp_path, cli):
    outcome = cli("target", "--pattern", "charuco", "--set", "columns=5", "--out", str(tmp_path / "a.pdf"))
    assert (outcome.code, outcome.err) == (0, "")
    assert "600 x 800 mm: print it at 100 %" in outcome.out
    assert (tmp_path / "a.pdf").read_text() == written(Charuco(columns=5), ".pdf")
    outcome = cli("target", "smoke", "--out", str(tmp_path / "b.svg"))
    assert outcome.code == 0
    assert "the circle is a disc of its own, 60 mm across, 10 mm above the middle of column 1, row 2" in outcome.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["charuco", "--out", "a.png"], "'.png'; name a file that ends in .pdf or .svg"),
        (["--out", "a.pdf"], "either a recipe or --pattern"),
        (["charuco", "--pattern", "charuco", "--out", "a.pdf"], "either a recipe or --pattern"),
        (["charuco", "--set", "columns=5", "--out", "a.pdf"], "--set goes with --pattern"),
        (["--pattern", "dots", "--out", "a.pdf"], "target pattern is 'dots'; choose one of chessboard"),
        (["--pattern", "circles", "--set", "spacing=3", "--out", "a.pdf"], "did you mean 'spacing_mm'?"),
        (["--pattern", "plain_chessboard", "--set", "square_mm=900.0", "--out", "a.pdf"], "larger than PDF takes"),
    ],
)
def test_wrong_wishes_give_one_sentence(arguments, words, tmp_path, monkeypatch, cli):
    monkeypatch.chdir(tmp_path)
    outcome = cli("target", *arguments)
    assert_one_sentence(outcome.code, outcome.err, words)
    assert list(tmp_path.iterdir()) == []
