"""The reproduction of the paper: its parts, its files, and wrong options."""

import re

import numpy as np
import pytest

from pipelines.cli import app, guarded
from pipelines.pages.sections import Table
from pipelines.paper import simulation
from pipelines.paper.claims import Claim, Verdict, judged
from pipelines.paper.command import markdown, reproduce
from pipelines.paper.derivation import advantages, choice, ratios
from pipelines.paper.problems import OBJECT, bounds, information
from pipelines.paper.simulation import principal_point as centres
from pipelines.paper.simulation.comparison import Alike, judged_alike, median_of, told_alike
from pipelines.paper.simulation.fisheye import fisheye
from pipelines.paper.simulation.precision import METHODS, precision
from pipelines.paper.simulation.principal_point import STATEMENTS, Differences, principal_point
from pipelines.paper.simulation.sensitivity import sensitivity
from tests.pipelines.pages.parsed import Page


def test_noise_is_shared_by_the_lenses_and_differs_between_draws():
    first, second = (simulation.draws(lens, 2) for lens in ("perspective", "orthogonal"))
    noise = [part.pixels - part.camera.project(part.pose.apply(OBJECT)) for part in (first, second)]
    np.testing.assert_allclose(noise[0], noise[1], atol=1e-9)  # rounding of pixels of a thousand
    half = len(noise[0]) // 2
    assert np.abs(noise[0][:half] - noise[0][half:]).max() > 0.4
    own = simulation.draws("orthogonal", 2, shared=False)
    assert np.abs(own.pixels - second.pixels).max() > 0.4


def test_the_mean_depth_errors_are_those_known_of_both_behaviours():
    # Known from runs of the released code, -49.6, and of the equations, -42.5 mm. The mean of one draw scatters by
    # 1.2 mm and the lenses share it: four standard errors of five draws are 2.2 mm.
    for method, known in (("released", -49.6), ("equations", -42.5)):
        call = METHODS[method]
        errors = [simulation.outcome(simulation.draws(lens, 5), call).error for lens in simulation.FISHEYES]
        assert np.mean([np.nanmean(error[..., 5]) for error in errors]) == pytest.approx(known, abs=2.2)


@pytest.mark.full
def test_the_default_solver_and_opnp_reach_the_bound_on_single_frames():
    for call, seeds in ((simulation.best, 20), (simulation.with_opnp, 4)):
        problem = simulation.draws("perspective", seeds)
        ratio = np.abs(simulation.outcome(problem, call).vector) / bounds(
            information(problem.camera, OBJECT, problem.pose)
        )
        # A median of 361 x 20 values is good to 1.3 %; of 361 x 4 to 3 %. Three of those, but 4 % for the many.
        limit = 0.04 if seeds == 20 else 0.09
        assert np.abs(np.median(ratio, axis=0) / 0.6745 - 1.0).max() < limit


def test_a_gross_failure_is_a_missing_pose_or_one_twice_as_far():
    problem = simulation.draws("perspective", 1)
    truth = problem.pose

    def estimate(_):
        solution = simulation.best(problem)
        t, status = truth.t.copy(), np.array(solution.status, dtype="<U13")
        t[0], status[1] = 2.1 * t[0], "no_solution"
        return type(solution)(status, type(truth)(truth.R, t), solution.iterations, t[:, 0], solution.covariance)

    found = simulation.outcome(problem, estimate)
    assert found.gross_failure[0, :3].tolist() == [True, True, False]
    assert found.failed[0, :3].tolist() == [False, True, False]
    assert np.isnan(found.error[0, 1]).all()


def test_the_largest_difference_is_that_of_a_frame_and_not_a_mean():
    values = np.zeros((2, 3, 6))
    values[1, 2, 3], values[0, 1, 5] = -1.5, 4.0
    lenses = {(method, lens): values for method in METHODS for lens in simulation.LENSES}
    found = Differences(lenses)
    assert found.farthest("released", simulation.PLACE) == 1.5
    assert found.largest("released", simulation.PLACE) == pytest.approx(0.25)
    by_text = {claim.text: claim for claim in judged(STATEMENTS, found)}
    claim = by_text["The largest difference of translation is below 1.9 mm"]
    assert claim.verdict == Verdict.PARTLY  # in x and y, not in z
    assert "largest x, y 1.5 mm, z 4 mm; means 0.25 and 0.67 mm" in claim.equations


@pytest.mark.parametrize(
    ("inside_mm", "everywhere_mm", "verdict"),
    [(1.0, 1.0, Verdict.HOLDS), (1.0, -65.0, Verdict.PARTLY), (2.0, 1.0, Verdict.FAILS)],
)
def test_the_image_centre_is_judged_inside_theta_and_everywhere(inside_mm, everywhere_mm, verdict, monkeypatch):
    monkeypatch.setattr(centres, "_everywhere", lambda: (0.0, everywhere_mm))
    values = np.zeros((2, 3, 6))
    values[1, 2, 4] = inside_mm
    found = Differences({(method, lens): values for method in METHODS for lens in simulation.LENSES})
    by_text = {claim.text: claim for claim in judged(STATEMENTS, found)}
    assert by_text["The principal point can be substituted by the image centre"].verdict == verdict


@pytest.mark.parametrize(
    ("near", "far", "verdict"),
    [(0.01, 0.02, Verdict.HOLDS), (0.01, 0.06, Verdict.PARTLY), (0.03, 0.06, Verdict.FAILS)],
)
def test_ratios_are_equal_where_they_differ_less_than_the_paper_accepts(near, far, verdict, monkeypatch):
    monkeypatch.setattr(centres, "_ratio_apart", lambda turn_deg: near if turn_deg == 0.0 else far)
    values = {(method, lens): np.zeros((1, 1, 6)) for method in METHODS for lens in simulation.LENSES}
    (claim,) = (one for one in judged(STATEMENTS, Differences(values)) if one.section == "II-B")
    assert claim.verdict == verdict


def outcome_with(x_mm: float) -> simulation.Outcome:
    error = np.zeros((1, 4, 6))
    error[..., 3] = x_mm
    nothing = np.zeros((1, 4), bool)
    return simulation.Outcome(error, error[0], nothing, nothing)


@pytest.mark.parametrize(
    ("at_centre", "at_point", "verdict"),
    [(3.0, 3.0, Verdict.HOLDS), (1.0, 3.0, Verdict.PARTLY), (1.0, 1.0, Verdict.FAILS)],
)
def test_solvers_are_judged_with_the_same_principal_point_both_ways(at_centre, at_point, verdict):
    ours = {
        f"EPOSIT, {method}, {point}": outcome_with(1.0)
        for method in METHODS
        for point in ("image centre", "principal point")
    }
    others = {"PnPfr, least distortion": outcome_with(at_centre), "PnPfr, principal point": outcome_with(at_point)}
    both = Alike.both(ours | others)
    assert judged_alike(both, lambda a, b: 1.25 * median_of(a, 3) < median_of(b, 3)) == verdict
    told = told_alike(both, "equations", lambda outcome: f"{median_of(outcome, 3):g} mm")
    assert told == (
        f"image centre: EPOSIT 1 mm, PnPfr {at_centre:g} mm; principal point: EPOSIT 1 mm, PnPfr {at_point:g} mm"
    )


def test_printed_ratios_are_identities_and_an_altered_one_is_not(monkeypatch):
    assert {claim.verdict for claim in ratios.measure()[1]} == {Verdict.HOLDS}
    monkeypatch.setitem(ratios.PRINTED, "equisolid", (ratios.PRINTED["equisolid"][0], lambda a: np.cos(a / 2.0) ** 2))
    assert {claim.verdict for claim in ratios.measure()[1]} == {Verdict.FAILS}


def test_what_the_derivation_claims_is_measured():
    (chosen,), told = choice.measure(1)[1], {claim.text.split(" ")[0]: claim for claim in advantages.measure(1)[1]}
    assert chosen.verdict == Verdict.PARTLY  # there are several solutions, and all reproduce their points
    assert told["Relative"].verdict == Verdict.PARTLY  # they suffice, for other methods, too
    assert told["The"].verdict == Verdict.PARTLY  # rotation, but not depth
    assert "z bias -4" in told["The"].equations  # 2.1 % of 2045 mm


@pytest.mark.parametrize(
    ("part", "seeds", "count"),
    [(precision, 2, 7), (principal_point, 2, 7), pytest.param(fisheye, 1, 4, marks=pytest.mark.full)],
)
def test_every_part_on_points_has_claims_with_figures(part, seeds, count):
    claims = part(seeds).claims
    assert len(claims) >= count
    for claim in claims:
        assert re.search(r"\d|yes|not used", claim.equations), claim.text
        assert claim.released
        assert claim.part


def test_the_sensitivity_has_its_table():
    section = sensitivity(1)
    assert section.claims == ()
    assert any(isinstance(item, Table) for item in section.items)


def test_the_files_are_written_and_the_table_keeps_its_columns(tmp_path, capsys):
    page, claims = reproduce(tmp_path / "paper", ["principal-point"], 1, True, 1)
    html = page.read_text()
    page_of_paper = Page(html)
    assert len(page_of_paper.of("svg")) == 1
    assert re.fullmatch(r"Of 7 claims .*\.", page_of_paper.of("h1")[0].text)
    claims_table, *tables = page_of_paper.of("table")
    assert len(page_of_paper.inside(claims_table, "tbody")) == 7
    assert all(page_of_paper.inside(table, "caption") for table in tables)
    assert "Stability to the principal point" in html
    rows = [line for line in claims.read_text().splitlines() if line.startswith("|")]
    assert len({len(re.findall(r"(?<!\\)\|", row)) for row in rows}) == 1
    assert len(rows) == 2 + 7


def test_bars_within_a_claim_are_escaped():
    claim = Claim("I", "a | b", "1", "2", "3", Verdict.HOLDS, "why", "precision")
    assert "a \\| b" in markdown([claim])


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--only", "nothing"], "unknown part 'nothing'; choose one of precision, "),
        (["--seeds", "0"], "0 draws of noise are not usable; give --seeds from 1 to 1000"),
        (["--points-only", "--only", "images"], "--points-only leaves out images; drop one of the two options"),
        (["--workers", "0"], "0 workers are not usable"),
    ],
)
def test_wrong_options_get_one_sentence(tmp_path, capsys, options, sentence):
    assert guarded(lambda: app(["paper", "--out", str(tmp_path / "out"), *options])) == 2
    told = capsys.readouterr().err
    assert sentence in told
    assert told.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_file_in_the_way_gets_one_sentence(tmp_path, capsys):
    (tmp_path / "out").write_text("mine")
    assert guarded(lambda: app(["paper", "--out", str(tmp_path / "out"), "--only", "precision"])) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert (tmp_path / "out").read_text() == "mine"
