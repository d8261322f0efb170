"""Cameras that recipes take by name: what is named is what would be written out."""

import json
import tomllib

import pytest

from datasets.errors import UserError
from datasets.recipe.camera_sets import camera_rows
from datasets.recipe.model import load_recipe, parse_recipe, recipe_names, values
from datasets.recipe.written_out import written_out
from tests.cameras import PAPER_FISHEYE, PAPER_PINHOLE

LENSES = ("perspective", "stereographic", "equidistance", "equisolid", "orthogonal")
OWN = """\
[[cameras]]  # the first
name = "own"  # mine
lens = "perspective"
fx = 300  # px
fy = 300
cx = 400
cy = 300
"""


def explicit(lens, **more):
    """A camera of the paper as TOML, from values that stand in the tests."""
    intrinsics = PAPER_PINHOLE | {"nominal_f": 1353} if lens == "perspective" else PAPER_FISHEYE | {"nominal_f": 541}
    camera = {"name": lens, "lens": lens} | intrinsics | more
    return "\n[[cameras]]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in camera.items())


ALL = "".join(map(explicit, LENSES))
NAMED = {
    "a set": ('cameras = "paper"', ALL),
    "a set in a list": ('cameras = ["paper"]', ALL),
    "a set in a table": ('[[cameras]]\nfrom = "paper"', ALL),
    "one camera": ('cameras = "paper.equisolid"', explicit("equisolid")),
    "two cameras": (
        'cameras = ["paper.orthogonal", "paper.perspective"]',
        explicit("orthogonal") + explicit("perspective"),
    ),
    "values of its own": (
        'cameras = [{ from = "paper.equidistance", name = "a", max_field_deg = 30, nominal_f = 550 }]',
        explicit("equidistance", name="a", max_field_deg=30, nominal_f=550),
    ),
    "beside a camera that is written out": (
        f'{OWN}\n[[cameras]]\nfrom = "paper.orthogonal"',
        OWN + explicit("orthogonal"),
    ),
    "cameras apart from each other": (
        f'{OWN}[sensor]\ngamma = 2.2\n[[cameras]]\nfrom = "paper.orthogonal"',
        f"{OWN}{explicit('orthogonal')}[sensor]\ngamma = 2.2",
    ),
}


@pytest.mark.parametrize("name", NAMED)
def test_a_name_stands_for_its_values(name):
    short, long = (f'name = "x"\n{text}\n' for text in NAMED[name])
    recipe = parse_recipe(long, "long")
    assert parse_recipe(short, "short") == recipe
    assert parse_recipe(short, "short").digest() == recipe.digest()
    text = written_out(short, "short")
    assert "from" not in str(tomllib.loads(text))
    assert parse_recipe(text, "written out") == recipe
    assert written_out(text, "again") == text
    assert written_out(long, "long") == long


@pytest.mark.parametrize("name", recipe_names())
def test_the_text_of_a_recipe_that_comes_along_needs_no_other_file(name, monkeypatch):
    recipe, text = load_recipe(name)
    monkeypatch.setattr("datasets.recipe.camera_sets.camera_references", dict)
    assert parse_recipe(text, name) == recipe


def test_comments_stay_when_cameras_are_written_out():
    text = f"""\
# on top
name = "x"  # its name
{OWN}# below the first

# above the second
[[cameras]]  # the second
from = "paper.orthogonal"  # a fish-eye
max_field_deg = 40  # degrees

# above the sensor
[sensor]  # dark
gamma = 2.2  # bright
"""
    changed = written_out(text, "x")
    comments = [line.partition("#")[2].strip() for line in text.splitlines() if "#" in line]
    assert len(comments) == 13
    assert [comment for comment in comments if comment not in changed] == []
    inline = '# above\ncameras = [  # why\n    "paper.orthogonal",  # that one\n]  # end\nname = "x"\n'
    changed = written_out(inline, "x")
    assert all(f"# {comment}" in changed for comment in ("above", "why", "that one", "end"))


def test_a_user_takes_a_camera_by_name_and_the_dataset_holds_its_values(tmp_path, cli):
    path, out = tmp_path / "own.toml", tmp_path / "out"
    path.write_text(
        'name = "own"\nsamples = 4\ncameras = [{ from = "paper.perspective", nominal_f = 1350 }]\n'
        "[trajectory]\nstop = 0\nstep = 1\n"
    )
    assert cli("generate", path, "--out", out, "--regime", "typical", "--quiet").code == 0
    stored = tomllib.loads((out / "recipe.toml").read_text())
    assert stored["cameras"] == tomllib.loads(explicit("perspective", nominal_f=1350))["cameras"]
    assert stored["sensor"] == {"regime": "typical"}
    again = cli("generate", path, "--out", out, "--regime", "typical", "--quiet")
    assert again.code == 0  # the same recipe


WRONG = {
    '"papr"': "unknown cameras 'papr' (did you mean 'paper'?); known ones are paper, paper.perspective, ",
    '"stereographic"': "unknown cameras 'stereographic' (did you mean 'paper.stereographic'?)",
    '["paper.ortho"]': "(did you mean 'paper.orthogonal'?)",
    '[{ from = "mine" }]': "unknown cameras 'mine'; known ones are paper",
    "[{ from = 3 }]": "unknown cameras 3; known ones are paper",
    '[{ from = "paper.orthogonal", f_x = 3 }]': "'cameras.0.f_x' (did you mean 'fx'?); known keys there are from, name",
    '[{ from = "paper", name = "one" }]': "cameras are named one, one, one, one, one; give each its own name",
    '{ from = "paper" }': "key 'cameras' is {'from': 'paper'}",
    "3": "key 'cameras' is 3",
    "[3]": "key 'cameras.0' is 3",
}


@pytest.mark.parametrize("cameras", WRONG)
def test_an_unknown_name_is_refused_with_those_that_are_known(cameras):
    with pytest.raises(UserError) as refusal:
        parse_recipe(f'name = "x"\ncameras = {cameras}\n', "x.toml")
    assert str(refusal.value).startswith("x.toml: ")
    assert WRONG[cameras] in str(refusal.value)


def test_describe_shows_the_cameras_and_what_a_recipe_takes(cli):
    shown = cli("describe").out.split("Cameras that a recipe can name:")[1]
    told = json.loads(cli("describe", "--json").out)["cameras"]
    assert list(told) == [name for name, _ in camera_rows()]
    assert list(told) == [f"{group}.{lens}" for group in ("paper", "paper-half") for lens in LENSES]
    assert all(name in shown for name in told)
    assert told["paper.orthogonal"]["fx"] == PAPER_FISHEYE["fx"]
    assert values(load_recipe("wide")[0])["cameras.from"] == ", ".join(f'"paper.{lens}"' for lens in LENSES)
    assert values(load_recipe("experiment")[0])["cameras.from"] == '"own values"'
