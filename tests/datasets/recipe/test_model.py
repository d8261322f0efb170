"""Recipes, plans and seeds."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tomlkit import TOMLDocument

from datasets.errors import UserError
from datasets.plan import Stream, frame_count, plan, rng_for, shard_count, shard_frames
from datasets.recipe.model import describe, load_recipe, parse_recipe, recipe_names, values
from datasets.recipe.override import with_regime
from datasets.recipe.quality import QUALITIES
from datasets.recipe.written_out import written_out
from datasets.schema import MEANING, TABLES, dictionary
from datasets.trajectories.helix import Helix
from render.sensor.presets import regimes
from render.targets.chessboard import Chessboard

CAMERA = '[[cameras]]\nname = "a"\nlens = "perspective"\nfx = 300\nfy = 300\ncx = 400\ncy = 300  # px\n'


# A plan places and checks every frame: seconds from hundreds of frames on.
LARGE = {"accuracy", "accuracy-near", "accuracy-steep", "nightly", "paper"}
IN_TIERS = [pytest.param(name, marks=pytest.mark.full) if name in LARGE else name for name in recipe_names()]


@pytest.mark.parametrize("name", recipe_names())
def test_every_recipe_loads(name):
    recipe, text = load_recipe(name)
    assert parse_recipe(text, name).digest() == recipe.digest()
    assert 0 <= shard_count(recipe) * shard_frames(recipe) - frame_count(recipe) < shard_frames(recipe)


@pytest.mark.parametrize("name", IN_TIERS)
def test_every_recipe_plans_the_frames_that_it_counts(name):
    recipe, _ = load_recipe(name)
    frames = plan(recipe)
    assert [frames[i].frame_id for i in (0, -1)] == [0, len(frames) - 1]
    assert frame_count(recipe) == len(frames)


def test_the_demo_is_the_papers_helix_with_five_lenses():
    recipe, _ = load_recipe("demo")
    frames = plan(recipe)
    assert len(frames) == 40
    assert [camera.lens for camera in recipe.cameras] == [
        "perspective", "stereographic", "equidistance", "equisolid", "orthogonal",
    ]  # fmt: skip
    first = frames[0].cam_from_obj
    np.testing.assert_allclose(first.apply(recipe.target.board_centre[None])[0], [100.0, 100.0, 2000.0], atol=1e-9)
    last = frames[-1]
    assert last.time_s == 315.0
    # t = 315: back on the positive x axis of the helix, 78.75 mm deeper.
    centre = last.cam_from_obj.apply(recipe.target.board_centre[None])[0]
    np.testing.assert_allclose(centre, [100.0 * np.sqrt(2.0), 0.0, 2078.75], atol=1e-9)


@pytest.mark.parametrize(
    ("point", "carried"),
    [("origin", (0, 0, 0)), ("board_centre", (400, 250, 0)), ((-50.0, 50.0, -10.0), (-50, 50, -10))],
)
def test_the_trajectory_carries_the_point_it_names(point, carried):
    pose = Helix(point=point).cam_from_obj(30.0, Chessboard())
    where = pose.apply(np.array([carried], float))[0]
    expected = 100 * np.sqrt(2) * np.array([np.cos(np.deg2rad(75.0)), np.sin(np.deg2rad(75.0))])
    np.testing.assert_allclose(where, [*expected, 2007.5], atol=1e-9)


def test_times_include_the_last_step():
    np.testing.assert_allclose(Helix(start=0.0, stop=0.3, step=0.1).times(), [0.0, 0.1, 0.2, 0.3])


def test_every_key_is_described_and_shown():
    keys = [key for key, _, _ in describe()]
    assert len(keys) == len(set(keys)) > 40
    assert all(meaning for _, _, meaning in describe())
    recipe, _ = load_recipe("demo")
    assert set(values(recipe)) == {
        key
        for key, _, meaning in describe()
        if not meaning.startswith(("field", "scatter", "listed", "plain_chessboard", "charuco", "aprilgrid", "circles"))
    }
    assert values(recipe)["trajectory.step"] == "45.0"


def test_name_and_description_do_not_change_the_content():
    _, text = load_recipe("smoke")
    recipe = parse_recipe(text, "a")
    renamed = parse_recipe(text.replace('name = "smoke"', 'name = "other"', 1), "b")
    reseeded = parse_recipe(text.replace("seed = 0", "seed = 1", 1), "c")
    assert renamed.digest() == recipe.digest() != reseeded.digest()


@settings(max_examples=30)
@given(st.integers(0, 2**62), st.permutations(range(6)))
def test_random_numbers_do_not_depend_on_order(seed, order):
    def draw(i):
        return rng_for(seed, Stream.POINT_NOISE, i).random()

    assert {i: draw(i) for i in range(6)} == {i: draw(i) for i in order}


def test_streams_and_keys_are_independent():
    draws = [rng_for(0, stream, i).random() for stream in Stream for i in range(3)]
    assert len(set(draws)) == len(draws)
    assert rng_for(0, Stream.RENDER, 1).random() != rng_for(1, Stream.RENDER, 1).random()


def test_small_boards_have_four_points_of_their_own():
    _, text = load_recipe("smoke")
    small = text.replace("four = ", "# four = ") + "\n[target]\ncolumns = 5\nrows = 4\n"
    recipe = parse_recipe(small, "small")
    assert recipe.four_indices() == [0, 3, 8, 12]


def test_a_quality_stands_for_its_samples():
    _, text = load_recipe("smoke")
    for name, quality in QUALITIES.items():
        named = parse_recipe(text.replace('quality = "draft"', f'quality = "{name}"'), "named")
        given = parse_recipe(text.replace('quality = "draft"', f"samples = {quality.samples}"), "given")
        assert named.sample_count() == given.sample_count() == quality.samples
        assert named.digest() == given.digest()
    meaning = next(meaning for key, _, meaning in describe() if key == "quality")
    assert all(f"{name} ({quality.samples} samples" in meaning for name, quality in QUALITIES.items())
    assert parse_recipe(text.replace('quality = "draft"', "samples = 25"), "x").sample_count() == 25
    with pytest.raises(UserError, match=r"key 'quality' is 'best'.*'draft', 'standard' or 'reference'"):
        parse_recipe(text.replace('quality = "draft"', 'quality = "best"'), "x")


def test_a_suggestion_is_made():
    _, text = load_recipe("smoke")
    with pytest.raises(UserError, match="did you mean 'samples'"):
        parse_recipe("smaples = 4\n" + text, "x")


def test_every_column_has_a_meaning_in_the_dictionary():
    for name, schema in TABLES.items():
        assert f"### {name}" in dictionary()
        for field in schema:
            assert field.metadata[MEANING], field.name
            assert f"| `{field.name}` |" in dictionary()


@pytest.mark.parametrize(
    "sensor",
    ["", "[sensor]\n", "[sensor]\ngamma = 2.2\n", '[ sensor ] # mine\nregime = "typical"  # theirs\ngamma = 2.2\n'],
)
def test_a_regime_is_put_into_a_recipe_as_if_it_had_been_written(sensor):
    _, text = load_recipe("smoke")
    gamma = 2.2 if "gamma" in sensor else 1.0
    for before in (f"{text}\n{sensor}", text.replace("[trajectory]", f"{sensor}\n[trajectory]")):
        recipe = parse_recipe(with_regime(before, "harsh", "x"), "x")
        assert recipe.sensor == dataclasses.replace(regimes()["harsh"], gamma=gamma)
        assert recipe.model_copy(update={"sensor": regimes()["clean"]}).digest() == load_recipe("smoke")[0].digest()


def test_a_digest_that_has_been_asked_for_is_the_recipes_alone():
    recipe = load_recipe("smoke")[0]
    digest = recipe.digest()
    assert recipe == load_recipe("smoke")[0]  # which has not been asked
    changed = recipe.model_copy(update={"seed": recipe.seed + 1})
    assert changed.digest() != digest == recipe.digest() == recipe.model_copy().digest()


def test_comments_stay_when_a_regime_is_put_in():
    for sensor in ("", "[sensor]  # dark\n# how dark\ngamma = 2.2  # bright\n", "sensor = { gamma = 2.2 }  # short\n"):
        top, rest = (sensor, "") if "{" in sensor else ("", sensor)
        text = f'# on top\nname = "x"  # its name\n{top}{rest}\n# a lens\n{CAMERA}# at the end\n'
        changed = with_regime(text, "harsh", "x")
        assert parse_recipe(changed, "x").sensor.exposure == regimes()["harsh"].exposure
        assert [line for line in text.splitlines() if line not in changed and "{" not in line] == []
        assert changed.count("#") == text.count("#")


@pytest.mark.parametrize(
    "write", [lambda text: with_regime(text, "harsh", "mine"), lambda text: written_out(text, "mine")]
)
def test_a_text_that_cannot_be_edited_is_refused(write, monkeypatch):
    monkeypatch.setattr("tomlkit.parse", lambda text: TOMLDocument())
    with pytest.raises(UserError, match=r"cannot .* mine; (write|give) "):
        write('name = "x"\ncameras = "paper"\n')


def test_a_regime_is_the_default_of_keys_that_are_left_out():
    _, text = load_recipe("smoke")
    recipe = parse_recipe(f'{text}\n[sensor]\nregime = "typical"\nread_noise_e = 5\n', "x")
    assert recipe.sensor == dataclasses.replace(regimes()["typical"], read_noise_e=5.0)
    assert values(recipe)["sensor.regime"] == '"own values"'
    named = parse_recipe(f'{text}\n[sensor]\nregime = "typical"\n', "x")
    assert values(named)["sensor.regime"] == '"typical"'
    spelled = parse_recipe(
        f"{text}\n[sensor]\n"
        + "\n".join(f"{name} = {value}" for name, value in dataclasses.asdict(regimes()["typical"]).items()),
        "x",
    )
    assert spelled.digest() == named.digest()  # a regime is a name for values


def test_describe_shows_the_regimes(cli):
    told = cli("describe").out
    for name in regimes():
        assert name in told.split("The sensor's regimes:")[1]
    assert "[column, row]" in " ".join(told.split())  # brackets are text, not markup
