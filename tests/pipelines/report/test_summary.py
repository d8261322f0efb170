"""The summary: silent about a run that is as it should be, and naming each fault that is planted."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.recipe.model import load_recipe
from pipelines.report.data import ERRORS, Series
from pipelines.report.frame_points import by_frame
from pipelines.report.points import PointErrors
from pipelines.report.run import Run
from pipelines.report.summary import summarised

POSES, CAMERAS, POINTS, SIGMA = 8, ("perspective", "equisolid"), 55, 0.004
FRAMES = [
    {"frame_id": len(CAMERAS) * pose + i, "pose_id": pose, "camera_name": name}
    for pose in range(POSES)
    for i, name in enumerate(CAMERAS)
]


def _points(seed):
    rng = np.random.default_rng(seed)
    normalised = rng.standard_normal((len(FRAMES), POINTS, 2))
    shape = normalised.shape[:2]
    radius = rng.standard_normal(normalised.shape)
    radius /= np.linalg.norm(radius, axis=-1, keepdims=True)
    error = SIGMA * normalised
    return PointErrors(
        "edge-fit", error, normalised, np.sum(error * radius, axis=-1), error[..., 0], np.zeros(shape),
        np.full(shape, 30.0), np.ones(shape, bool), np.zeros(shape, bool), np.full(shape, "ok"),
    )  # fmt: skip


def _scores(seed, key=("best", "detected", "exact", "all")):
    rng = np.random.default_rng(100 + seed)
    n = len(FRAMES)
    errors = {name: 0.01 * rng.standard_normal(n) for name in ERRORS}
    errors["rotation_error_deg"] = np.abs(errors["rotation_error_deg"])
    named = dict(zip(("solver", "point_source", "assumed_camera", "point_set"), key, strict=True))
    frame_id = np.array([frame["frame_id"] for frame in FRAMES])
    normalised = rng.standard_normal((n, 6))
    return Series(" ".join(key), named, frame_id, errors, normalised, np.full(n, "ok", "U20"), *np.zeros((3, n), bool))


def _run(seed=0):
    return Run(load_recipe("demo")[0], FRAMES, [_points(seed)], [_scores(seed)])


def _summary(run):
    return summarised(replace(run, points=[by_frame(item) for item in run.points]))


def _moved(item, own, step):
    error = item.error.copy()
    error[own, :-1] += step
    return replace(item, error=error)


def test_a_run_as_it_should_be_is_told_in_sentences():
    found = _summary(_run())
    assert found.attention == ()
    assert found.sentence.startswith("Nothing stands out: every board was found")
    rendered, boards, corners, poses, failed = found.facts
    assert rendered == "16 frames rendered: 8 poses through 2 cameras (perspective, equisolid), sensor regime clean."
    assert boards == (
        "edge-fit found 16 of 16 boards (100 [80.6, 100] %), 864 of the 864 corners that can be seen, and 16 "
        "of 16 circles."
    )
    # The planted deviation, and errors as large as stated; 1728 values know them to 2 %.
    assert corners.startswith("Corner error by edge-fit: 0.0040 [0.00")
    assert " Bias: " in corners
    assert "the Cramér-Rao bound" in poses
    assert failed == "No pose failed, of 16 estimates by 1 setting."


def test_chance_alone_calls_for_attention_in_few_runs():
    """Four kinds of tests at 5 % each, of which two look outside 0.8 to 1.3 only: at most a tenth, here with margin."""
    called = [bool(_summary(_run(seed)).attention) for seed in range(100)]
    assert np.mean(called) <= 0.1 + 2.0 * 0.03  # two standard errors of a rate of 0.1 over 100 runs


OF_EQUISOLID = np.array([frame["camera_name"] == "equisolid" for frame in FRAMES])


def _lost(run):
    error = run.points[0].error.copy()
    error[3] = np.nan
    return replace(run, points=[replace(run.points[0], error=error)])


def _left_out(run):
    error = run.points[0].error.copy()
    error[[3, 5], 7] = np.nan
    return replace(run, points=[replace(run.points[0], error=error)])


def _without_circle(run):
    error = run.points[0].error.copy()
    error[4, -1] = np.nan
    return replace(run, points=[replace(run.points[0], error=error)])


def _biased(run):
    return replace(run, points=[_moved(run.points[0], OF_EQUISOLID, [0.002, 0.0])])


def _too_small_a_covariance(run):
    normalised = run.points[0].normalised.copy()
    normalised[OF_EQUISOLID, :-1] *= 1.5
    return replace(run, points=[replace(run.points[0], normalised=normalised)])


def _failing(run):
    item = run.found[0]
    status, gross = item.status.copy(), item.gross.copy()
    status[2], gross[2] = "not_converged", True
    gross[6] = True
    return replace(run, found=[replace(item, status=status, gross=gross)])


def _ambiguous(run):
    flags = np.zeros(len(run.found[0].status), bool)
    flags[[2, 6]] = True
    return replace(run, found=[replace(run.found[0], ambiguous=flags)])


def _unreliable(run):
    flags = np.zeros(len(run.found[0].status), bool)
    flags[[1, 4, 6]] = True
    return replace(run, found=[replace(run.found[0], unreliable=flags)])


def _wrong_poses(run):
    return replace(run, found=[replace(run.found[0], normalised=1.6 * run.found[0].normalised)])


@pytest.mark.parametrize(
    ("plant", "told"),
    [
        (_lost, ["edge-fit found no board in 1 frame: 1 of equisolid (frames 3)"]),
        (_left_out, ["edge-fit left out 2 corners of boards that it found, in 2 frames: 2 of equisolid (frames 3, 5)"]),
        (_without_circle, ["edge-fit found the board and not the circle in 1 frame: 1 of perspective (frames 4)"]),
        (_biased, ["corners of edge-fit in equisolid are off by +0.00"]),
        (_too_small_a_covariance, ["corners of edge-fit in equisolid are off by 1."]),
        (
            _failing,
            [
                "best detected exact all failed in 1 of 16 estimates: 1 not_converged",
                "best detected exact all gave 1 pose as ok whose position is wrong by its own length or more: frames ",
            ],
        ),
        (_ambiguous, ["best detected exact all says of 2 poses that the points allow another as well: frames "]),
        (_unreliable, ["best detected exact all says of 3 poses that its covariance is unreliable: frames "]),
        (_wrong_poses, ["poses of best detected exact all are off by 1."]),
    ],
    ids=lambda item: item.__name__ if callable(item) else "",
)
def test_each_fault_deserves_attention(plant, told):
    found = _summary(plant(_run()))
    assert len(found.attention) == len(told)
    for one, wanted in zip(found.attention, told, strict=True):
        assert one.startswith(wanted)
    assert found.sentence.startswith(told[0])


def test_another_camera_than_the_true_one_may_be_off():
    run = _run()
    nominal = _unreliable(_wrong_poses(replace(run, found=[_scores(0, ("eposit", "detected", "nominal", "four"))])))
    assert _summary(nominal).attention == ()


def test_a_run_without_detections_or_covariances_has_its_sentences():
    item = replace(_scores(0), normalised=np.full((len(FRAMES), 6), np.nan))
    found = _summary(replace(_run(), points=[], found=[item]))
    assert found.attention == ()
    assert found.facts[1].endswith("no standard deviations are stated.")
    lost = replace(item, status=np.full(len(FRAMES), "no_solution", "U20"))
    assert _summary(replace(_run(), points=[], found=[lost])).facts[-1] == "16 of 16 estimates by 1 setting failed."
