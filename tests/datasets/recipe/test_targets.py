"""The kinds of target in a recipe: defaults, hashes and wrong values."""

import pytest

from datasets.errors import UserError
from datasets.plan import plan
from datasets.recipe.model import load_recipe, parse_recipe, values
from pipelines.stages.settings import check_target, run_settings
from render.targets.charuco import Charuco
from render.targets.chessboard import Chessboard
from render.targets.plain_chessboard import PlainChessboard

DEMO = "b5a31a2772627188"
TEXT = load_recipe("charuco")[1]


def with_target(*lines):
    before, _, rest = TEXT.partition("[target]")
    return parse_recipe("\n".join([before + "[target]", *lines, rest[rest.index("[trajectory]") :]]), "r")


def test_the_chessboard_is_the_default_and_its_name_changes_no_hash():
    named, unnamed = with_target('pattern = "chessboard"'), with_target()
    assert isinstance(unnamed.target, Chessboard)
    assert named.digest() == unnamed.digest()
    # As it was before there were other kinds.
    assert load_recipe("demo")[0].digest().startswith(DEMO)


def test_what_decides_a_target_decides_the_hash():
    digests = {
        with_target(*lines).digest()
        for lines in (
            ['pattern = "charuco"'],
            ['pattern = "plain_chessboard"'],
            ['pattern = "charuco"', "bend_sag_mm = 1.0"],
            ['pattern = "charuco"', 'dictionary = "4X4_100"'],
        )
    }
    assert len(digests) == 4


def test_values_have_the_keys_of_their_kind_only():
    shown = values(load_recipe("charuco")[0])
    assert shown["target.pattern"] == '"charuco"'
    assert shown["target.marker_mm"] == "75.0"
    assert "target.tag_mm" not in shown
    assert "target.circle_radius_mm" not in shown


def test_four_points_of_a_flat_target_are_its_outermost():
    assert with_target('pattern = "charuco"', "columns = 5", "rows = 4").four_indices() == [0, 3, 8, 11]


def test_run_leaves_out_what_a_flat_target_has_no_pose_for():
    assert {setting.use for setting in run_settings(Charuco())} == {"all"}
    assert {setting.use for setting in run_settings(Chessboard())} == {"all", "four"}


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (['pattern = "dots"'], "r: target pattern is 'dots'; choose one of chessboard, plain_chessboard, charuco"),
        (['pattern = "charuco"', "tag_mm = 3.0"], "unknown key 'target.tag_mm'"),
        (['pattern = "circles"', "spacing_m = 3.0"], "did you mean 'spacing_mm'?"),
        (
            ['pattern = "aprilgrid"', 'bend_axis = "z"'],
            "(input should be 'x', 'y' or 'both')",
        ),
        (['pattern = "aprilgrid"', "print_scale = [1.0]"], "print_scale"),
        (
            ['pattern = "circles"', "diameter_mm = 59.0"],
            "it must lie in 0.1 to 0.9 spacings, 6 to 54 mm",
        ),
    ],
)
def test_wrong_targets_give_one_sentence(lines, words):
    with pytest.raises(UserError) as caught:
        with_target(*lines)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_four_is_refused_for_a_target_without_a_circle():
    with pytest.raises(UserError, match="four is for pattern \"chessboard\"; leave it out for 'charuco'"):
        parse_recipe('four = [[0, 0], [1, 0], [0, 1], "circle"]\n' + TEXT, "r")


def test_a_pose_that_shows_a_bent_board_from_behind_is_refused():
    steep = TEXT.replace("tilt_range_deg = [0, 45]", "tilt_range_deg = [80, 80]").replace("count = 8", "count = 1")
    assert len(plan(parse_recipe(steep, "r"))) == 3
    bent = steep.replace('dictionary = "5X5_50"', 'dictionary = "5X5_50"\nbend_sag_mm = 74.0\nbend_axis = "both"')
    with pytest.raises(UserError, match="none of 2000 random poses"):
        plan(parse_recipe(bent, "r"))


def test_what_needs_the_circle_says_so():
    with pytest.raises(UserError, match="recipe charuco has the target 'charuco'; this needs pattern = \"chessboard\""):
        load_recipe("charuco")[0].chessboard()
    with pytest.raises(UserError, match="detector 'opencv-sb' does not find the target 'plain_chessboard'"):
        check_target("opencv-sb", PlainChessboard())
