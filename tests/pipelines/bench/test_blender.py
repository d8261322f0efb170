"""The benchmark against Blender, without Blender: what it is told, how it is talked to, what is said if it lacks."""

import json
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from datasets.plan import plan
from datasets.recipe.model import load_recipe
from pipelines.bench.blender import NO_BPY, SCRIPT, VARIABLE, cycles
from pipelines.bench.blender.scene import LENS, description
from pipelines.timing import Times, in_turn, mean_of
from render.light import SMOOTH_SAMPLES, lamp_irradiance


@pytest.fixture(scope="module")
def told():
    """Recipe, frame, and the description after its way through a file."""
    recipe, _ = load_recipe("demo")
    frame = next(frame for frame in plan(recipe) if frame.camera.lens == LENS)
    return recipe, frame, json.loads(json.dumps(description(recipe, frame, samples=64, threads=2)))


def test_blender_is_told_a_camera_that_shows_points_where_ours_does(told):
    """By its manual: r = 2 f sin(theta / 2) on the sensor, which is as wide as the picture; the camera looks along -z
    with y up; a shift is a share of the picture by which the view moves."""
    recipe, frame, scene = told
    camera, blender = frame.camera.true_camera(), scene["camera"]
    world_from_camera = np.array(blender["to_world"])
    points = recipe.target.points * 1e-3
    x, y, z = ((points - world_from_camera[:3, 3]) @ world_from_camera[:3, :3]).T
    radius = 2.0 * blender["lens_mm"] * np.sin(np.arctan2(np.hypot(x, y), -z) / 2.0)
    width, height = blender["size"]
    tall = blender["pixel_aspect"][1] / blender["pixel_aspect"][0]
    share = radius / np.hypot(x, y) / blender["sensor_width_mm"]
    right = x * share + 0.5 - blender["shift"][0]
    up = y * share * width / (height * tall) + 0.5 - blender["shift"][1]
    found = np.stack((right * width, (1.0 - up) * height), axis=1) - 0.5
    # Double precision over 1600 px.
    np.testing.assert_allclose(found, camera.project(frame.cam_from_obj.apply(recipe.target.points)), atol=1e-9)


def test_blender_is_told_the_board_and_the_lamp(told):
    recipe, _, scene = told
    target, board, lamp = recipe.target, scene["board"], scene["lamp"]
    (left, low), (right, high) = board["corners"][0][:2], board["corners"][2][:2]
    (u0, v0), (u1, v1) = board["uv"][0], board["uv"][2]
    texels = np.array(board["reflectance"])
    for column in range(target.columns):
        for row in range(target.rows):
            x, y = (column - 0.5) * 0.1, (row - 0.5) * 0.1  # the middle of the square, metres
            u, v = u0 + (x - left) / (right - left) * (u1 - u0), v0 + (y - low) / (high - low) * (v1 - v0)
            grey = texels[int(v * len(texels)), int(u * len(texels[0]))]
            assert grey == pytest.approx(target.black if (column + row) % 2 == 0 else target.white, rel=1e-6)  # float32
    np.testing.assert_allclose(np.mean(scene["disc"]["rim"], axis=0), target.circle_centre * 1e-3, atol=1e-12)
    axes = np.array(lamp["to_world"])
    np.testing.assert_allclose(axes[:3, :3].T @ axes[:3, :3], np.eye(3), atol=1e-12)
    assert np.linalg.det(axes[:3, :3]) == pytest.approx(1.0)
    distance = np.linalg.norm(axes[:3, 3] - target.board_centre * 1e-3)
    np.testing.assert_allclose(axes[:3, 3] - distance * axes[:3, 2], target.board_centre * 1e-3, atol=1e-12)
    # Power over pi and area is the radiance; lamp and surrounding together give the white board's centre radiance 1.
    radiance = lamp["watts"] / np.pi / lamp["side"] ** 2
    lit = lamp_irradiance(target, recipe.light, target.board_centre[None], SMOOTH_SAMPLES, shadowed=False)[0]
    whole = target.white * (radiance * lit / np.pi + scene["surrounding"] * (1.0 - lit / np.pi))
    assert whole == pytest.approx(1.0, abs=1e-12)


def test_a_lens_that_cycles_lacks_is_a_sentence(told):
    recipe, _, _ = told
    with pytest.raises(ValueError, match="'perspective'; Cycles is compared through 'equisolid' only"):
        description(recipe, plan(recipe)[0], samples=64, threads=2)


def test_requests_and_answers(tmp_path, monkeypatch):
    """A stand-in for Blender: it tells how many requests came, and the last of them."""
    stand_in = tmp_path / "stand_in.py"
    stand_in.write_text(
        "import json, sys\n"
        "scene = json.load(open(sys.argv[1]))\n"
        "print(json.dumps({'blender': scene['version']}), flush=True)\n"
        "for count, line in enumerate(sys.stdin, 1):\n"
        "    request = json.loads(line)\n"
        "    print(json.dumps({'wall': count, 'cpu': sum(request['region'] or [0])}), flush=True)\n"
        "    if request['save']:\n"
        "        print(json.dumps({'saved': request['save']}), flush=True)\n"
    )
    monkeypatch.setattr("pipelines.bench.blender.SCRIPT", stand_in)
    with cycles(sys.executable, {"version": "1.2"}, tmp_path) as (blender, version):
        assert version == "1.2"
        assert blender.render((1, 2, 3, 4), tmp_path / "saved.exr") == Times(1.0, 10.0)
        assert blender.render(None) == Times(2.0, 0.0)
        (times,) = in_turn(lambda: blender.render((0, 0, 5, 5)), repeats=3, warm_up=False)
        assert times == Times(4.0, 10.0)  # Blender's own: the median of 3, 4, 5
    assert blender.process.poll() is not None


def test_the_mean_of_calls_in_a_row(monkeypatch):
    made, wall, cpu = [], iter((100.0, 110.0)), iter((7.0, 22.0))
    clocks = SimpleNamespace(perf_counter=lambda: next(wall), process_time=lambda: next(cpu))
    monkeypatch.setattr("pipelines.timing.time", clocks)
    assert mean_of(lambda: made.append(0), 5) == Times(2.0, 3.0)
    assert len(made) == 5


def test_no_interpreter_is_a_sentence(cli, monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    _refused(cli("bench", "demo", "--only", "blender"), f"part 'blender' needs {VARIABLE}")


@pytest.mark.parametrize(
    ("python", "reason"),
    [
        ("/nowhere/python", "which cannot be run (No such file or directory)"),
        (sys.executable, "a Python without Blender's bpy"),
        ("/bin/true", "which does not run Blender"),
    ],
)
def test_an_interpreter_without_blender_is_a_sentence(cli, monkeypatch, python, reason):
    monkeypatch.setenv(VARIABLE, python)
    _refused(cli("bench", "demo", "--only", "blender"), f"{VARIABLE} is {python!r}, {reason}")


def test_a_recipe_without_the_lens_is_a_sentence(cli, monkeypatch):
    monkeypatch.setenv(VARIABLE, sys.executable)
    _refused(cli("bench", "smoke", "--only", "blender"), "recipe 'smoke' has no equisolid camera")


def _refused(outcome, reason):
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1
    assert reason in outcome.err
    assert "`" in outcome.err  # what to do


def test_the_script_stops_without_blender(tmp_path):
    assert subprocess.run([sys.executable, SCRIPT, tmp_path / "none.json"], check=False).returncode == NO_BPY
