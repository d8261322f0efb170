"""The measured figures: every row has commands that exist, README tells the same figures, and the tool works."""

import json
import re
from dataclasses import asdict

import pytest

from tests.docs.documents import ROOT, RUN, wrong_options
from tools import measurements
from tools.measurement_list import MEASUREMENTS, OUT, Measurement
from tools.measurement_results import Results, pooled, rms, span

NAMES = [measurement.name for measurement in MEASUREMENTS]
TARGETS = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.M)


@pytest.mark.parametrize("measurement", MEASUREMENTS, ids=NAMES)
def test_commands_exist(measurement):
    assert measurement.commands
    for command in measurement.commands:
        if command.startswith(RUN):
            assert wrong_options(command.removeprefix(RUN)) == set()
        else:
            assert measurement.figure is None  # the tool runs commands of `pipelines` only
            first, *words = command.split()
            last = words[-1]
            assert (first == "make" and last in TARGETS) or (words[:2] == ["-m", "pytest"] and (ROOT / last).exists())


def test_every_row_has_an_entry_and_stands_on_the_page():
    entries = measurements.read(measurements.FIGURES)
    assert list(entries) == NAMES
    lines = measurements.page().splitlines()
    for measurement in MEASUREMENTS:
        entry = entries[measurement.name]
        assert entry.by_hand or measurement.figure
        (line,) = (line for line in lines if line.startswith(f"| {measurement.what} |"))
        assert entry.figure in line
        assert all(f"`{command}`" in line for command in measurement.commands)


def test_readme_tells_the_measured_figures():
    entries = measurements.read(measurements.FIGURES).values()
    part = (ROOT / "README.md").read_text().partition("## How accurate")[2].partition("\n## ")[0]
    told = re.findall(r"^\| .* \| (.*) \|$", part, flags=re.M)[1:]
    assert len(told) == 5
    assert told == [entry.readme for entry in entries if entry.readme]


def corners(results):
    return f"{rms(pooled(results.points('smoke')[0])):.4f} px, {results.outputs[1].split()[0]}"


BY_HAND = measurements.Entry("7", "2026-01-31", "by heart", True)
SMOKE = Measurement("smoke", "corners", (f"{RUN}run smoke --out {OUT}/smoke --quiet", f"{RUN}recipes"), corners)


@pytest.fixture
def place(tmp_path, monkeypatch):
    """An empty folder to measure in; its measurements.json has the figure of another measurement, entered by hand."""
    by_hand = Measurement("other", "entered by hand", ("make bench-blender",))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(measurements, "MEASUREMENTS", (SMOKE, by_hand))
    monkeypatch.setattr(measurements, "FIGURES", tmp_path / "measurements.json")
    (tmp_path / "measurements.json").write_text(json.dumps({"other": asdict(BY_HAND)}))
    return tmp_path


def test_a_figure_is_measured_and_what_is_there_is_kept(place, capfd):
    assert measurements.main([]) == 0
    entries = json.loads((place / "measurements.json").read_text())
    assert list(entries) == ["smoke", "other"]
    assert entries["other"] == asdict(BY_HAND)
    found = re.fullmatch(r"(\d\.\d{4}) px, name", entries["smoke"]["figure"])
    # Six small frames: 0.003 to 0.006 px through each lens.
    assert found
    assert 0.002 < float(found[1]) < 0.01
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", entries["smoke"]["date"])
    assert "mitsuba 3.9" in entries["smoke"]["made_with"]
    assert not entries["smoke"]["by_hand"]

    first = capfd.readouterr().out
    assert measurements.main(["--only", "smoke"]) == 0
    again = capfd.readouterr().out
    assert SMOKE.commands[0] in first
    assert SMOKE.commands[0] not in again
    assert json.loads((place / "measurements.json").read_text()) == entries


def test_a_command_that_fails_keeps_the_figure_that_was_there(place, capfd, monkeypatch):
    fails = Measurement("other", "a wrong recipe", (f"{RUN}run nonsense --out {OUT}/nonsense",), corners)
    monkeypatch.setattr(measurements, "MEASUREMENTS", (fails,))
    before = (place / "measurements.json").read_text()
    assert measurements.main([]) == 1
    assert "error: other: `python -m pipelines run nonsense" in capfd.readouterr().err
    assert (place / "measurements.json").read_text() == before
    assert not list(place.glob("build/measurements/commands/*"))


@pytest.mark.parametrize(
    ("name", "told"), [("nonsense", "unknown measurement 'nonsense'"), ("other", "other is entered by hand")]
)
def test_a_name_that_cannot_be_measured_is_a_sentence(place, capfd, name, told):
    assert measurements.main(["--only", name]) == 2
    assert told in capfd.readouterr().err


def test_costly_ones_are_left_out_unless_asked_for(monkeypatch):
    def names(*arguments):
        return [measurement.name for measurement in measurements.chosen(*arguments)]

    assert "memory" not in names([], False)
    assert "memory" in names([], True)
    assert names(["memory"], False) == ["memory"]


def test_a_table_of_the_papers_page_is_read_by_its_heading(tmp_path):
    (tmp_path / "paper").mkdir()
    (tmp_path / "paper" / "paper.html").write_text(
        "<h3>First</h3><table><tr><th>n</th></tr><tr><td>1</td></tr></table>"
        "<h3>Share &amp; more</h3>\n<table>\n<tr><th>a</th><th>b</th></tr>\n"
        "<tr><td>95 [94, 96] %</td><td></td></tr>\n</table>"
    )
    assert Results(tmp_path, ()).paper_rows("paper", "Share & more") == [["95 [94, 96] %", ""]]


def test_a_span_is_one_number_where_its_ends_read_alike():
    assert span([0.0041, 0.0179], ".3f") == "0.004 to 0.018"
    assert span([0.0041, 0.0044], ".3f") == "0.004"
