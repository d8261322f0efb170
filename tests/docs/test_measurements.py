"""The measured figures: every row has commands that exist, README tells the same figures, and the tool works."""

import json
import re
from dataclasses import asdict

import pytest

from pipelines.pages.sections import Table
from pipelines.pages.template import rendered
from tests.docs.documents import ROOT, RUN, wrong_options
from tools import measurement_figures as figures
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


@pytest.mark.full
def test_a_figure_is_measured_beside_one_by_hand(place):
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


def test_a_command_that_has_run_is_not_run_again(place, capfd, monkeypatch):
    quick = Measurement("other", "the first word", (f"{RUN}recipes",), lambda results: results.outputs[0].split()[0])
    monkeypatch.setattr(measurements, "MEASUREMENTS", (quick,))
    printed = []
    for _ in range(2):
        assert measurements.main(["--only", "other"]) == 0
        printed.append(capfd.readouterr().out)
        assert measurements.read(measurements.FIGURES)["other"].figure == "name"
    assert quick.commands[0] in printed[0]
    assert quick.commands[0] not in printed[1]


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


def test_a_table_of_the_papers_page_is_read_by_its_title(tmp_path):
    tables = [
        Table("First", ("n",), (("1",),)),
        Table("Share & more", ("camera", "a", "b"), (("pinhole", "95 [94, 96] %", ""),)),
    ]
    template = tmp_path / "tables.html"
    template.write_text(
        '{% import "pieces.html" as pieces %}{% for item in tables %}{{ pieces.table(item) }}{% endfor %}'
    )
    (tmp_path / "paper").mkdir()
    (tmp_path / "paper" / "paper.html").write_text(rendered(template, tables=tables))
    assert Results(tmp_path, ()).paper_rows("paper", "Share & more") == [["pinhole", "95 [94, 96] %", ""]]


def test_a_span_is_one_number_where_its_ends_read_alike():
    assert span([0.0041, 0.0179], ".3f") == "0.004 to 0.018"
    assert span([0.0041, 0.0044], ".3f") == "0.004"


def benchmark(times=(), figures=()):
    """A benchmark's JSON. times: ours, ours in ms, compared with, ratio. figures: ours, figure, value."""
    rows = [dict(zip(("ours", "ours_ms", "other", "ratio"), row, strict=True), cpu_ratio=row[3]) for row in times]
    told = [dict(zip(("ours", "figure", "value"), row, strict=True)) for row in figures]
    return Results(ROOT, (json.dumps({"times": rows, "figures": told}),) * 2)


def test_a_benchmarks_ratios_are_told():
    rays = "64 primary rays"
    lenses = {"perspective": 73.0, "stereographic": 26.2, "equidistance": 30.0, "equisolid": 31.0, "orthogonal": 36.8}
    times = [(f"{lens}: render, 4 samples", 7.0, rays, ratio) for lens, ratio in lenses.items()]
    together = ("one render of each camera", 7.0, rays, 40.0)
    assert (
        figures.rendering(benchmark([*times, together])) == "26 to 37 times faster (fish-eyes), 73 times (perspective)"
    )
    all_stages, one = ("all stages, a frame", 100.0, rays, 4.0), ("of which detect", 10.0, rays, 40.0)
    assert figures.stages(benchmark([all_stages, one])) == "0.25 of their time in `clean`, 0.25 in `typical`"


def test_solvers_are_told_by_their_batches():
    loops = ("PoseLib p3p on given rays, in a loop", "PoseLib p3p and its rays, in a loop")
    batches = {"solve best": 1e-3, "solve eposit": 5e-4, "gpnpf": 0.15, "pnpfr": 0.2, "opnp": 1.6}
    times = [
        (f"{name}, {way}", factor * ms, loop, ratio)
        for name, ms in batches.items()
        for way, factor in (("single call", 10.0), ("batch of 100", 1.0))
        for loop, ratio in zip(loops, (1e-3 / ms / factor, 15e-3 / ms / factor), strict=True)
    ]
    told = "1.0 times (`best`), 2.0 times (`eposit`) on given rays; 15 and 30 times where the loop makes its rays"
    assert figures.solver(benchmark(times)) == told
    assert figures.compared_solvers(benchmark(times)) == ("OPnP 3200, GPnPf 300, PnPfr 400 times as long as EPOSIT")


def test_single_poses_are_told_by_kind_of_call():
    polish, sqpnp = "PoseLib p3p and polish, single call", "OpenCV SQPNP, single call"
    times = [
        ("best, four points, single call", 0.03, sqpnp, 1.9),
        ("best, a board, single call", 0.04, sqpnp, 1.0),
        ("best, four points, batch of 10000", 0.004, polish, 5.0),
        ("best, four points, batch of 10000", 0.004, sqpnp, 20.0),
        ("eposit, four points, single call", 0.02, sqpnp, 2.3),
        ("eposit, four points, batch of 10000", 0.001, polish, 40.0),
        ("robust, a board, single call", 2.0, "OpenCV solvePnPRansac, single call", 6.4),
    ]
    once = [
        ("import eposit after numpy, processor time", "0.1 s", "0.08 s"),
        ("first call of best, processor time", "1.7 s", "0.1 s"),
    ]
    assert figures.single_poses(benchmark(times, once)) == (
        "single calls 1.0 to 1.9 times (`best`), 2.3 times (`eposit`) as many as SQPNP; batches 5.0 and 40.0 times as "
        "many as p3p and polish; `robust`, half of 54 points wrong, 6 times as many as solvePnPRansac; import 0.1 s "
        "beyond NumPy, first call 1.7 s, later 0.1 s"
    )


@pytest.mark.parametrize(("last", "told"), [("0.0054", "above 3900 times"), ("0.0033", "3900 times")])
def test_a_ratio_is_a_lower_bound_where_all_samples_did_not_suffice(last, told):
    errors = [
        ("orthogonal: corners, ours", "0.0034 px RMS", ""),
        ("corners, plain script, 64 samples", "0.0090 px RMS", ""),
        ("corners, plain script, 2048 samples", f"{last} px RMS", ""),
    ]
    times = [("frame and detection", 30.0, "full picture, Mitsuba direct, 2048 rays", 3900.4)]
    whole = f"{told}: ours 0.0034 px RMS, plain pictures {last} px RMS with 2048 samples"
    assert figures.equal_error(benchmark(times, errors)) == whole


def test_memory_is_told_by_its_growth():
    rows = [("resident after 200 frames", "500 MB", ""), ("resident after 2000 frames", "505 MB", "+4.8 MB")]
    assert figures.memory(benchmark(figures=rows)) == "5 MB more"
