"""A user's own solver, by name: how it is found and called, what it may give, what becomes of its failures."""

import shutil
from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as pq
import pytest

import eposit
from datasets.errors import UserError
from pipelines.adapters.registry import find_solver
from pipelines.adapters.user import attempt, file_name, load_function
from tests.cameras import PAPER_OBJECT, helix_pose, paper_camera
from tests.own import own_module
from tests.wrong_input import assert_one_sentence, files

OURS = """
    import eposit

    def solve(points_in_obj, points_px, camera, *, sigma_px=None):
        assert points_px.shape == (len(points_in_obj), 2)
        return eposit.solve(points_in_obj, points_px, camera, sigma_px=sigma_px)
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    return lambda text: own_module(tmp_path, monkeypatch, text)


@pytest.fixture
def root(tiny, tmp_path):
    shutil.copytree(tiny[1], tmp_path / "dataset")
    return tmp_path / "dataset"


def rows(root, table, variant):
    return [row for path in sorted((root / table).glob(f"{variant}-0*")) for row in pq.read_table(path).to_pylist()]


def outcome(result):
    """PoseResult to one result, and what was told."""
    notes = []
    return attempt(lambda: result, "--solver own:solve", notes.append), notes


@pytest.mark.parametrize(
    ("workers", "command"),
    [(1, "estimate"), *(pytest.param(*case, marks=pytest.mark.full) for case in ((2, "estimate"), (1, "run")))],
)
@pytest.mark.usefixtures("no_report")
def test_a_wrapper_of_our_solver_gets_our_rows(workers, command, own, root, cli):
    name = f"{own(OURS)}:solve"
    if command == "run":
        done = cli("run", root / "recipe.toml", "--out", root, "--solver", name)
    else:
        done = cli("estimate", root, "--solver", name, "--workers", workers)
        assert cli("score", root).code == 0
    assert done.code == 0
    assert done.err == ""
    variant = f"{file_name(name)}-detected-exact-all"
    for table in ("estimates", "scores"):
        theirs, ours = rows(root, table, variant), rows(root, table, "best-detected-exact-all")
        assert {row["solver"] for row in theirs} == {name}
        for mine, row in zip(ours, theirs, strict=True):
            # The same numbers but for the reprojection error, which is worked out here: rounding of 400 px, 1e-13 px.
            rmse = row.pop("reprojection_rmse_px"), mine.pop("reprojection_rmse_px")
            assert rmse[0] == pytest.approx(rmse[1], abs=1e-11)
            for unsaid in ("ambiguous", "covariance_unreliable"):  # by a function that returns a pose alone
                assert row.pop(unsaid, None) is None
                mine.pop(unsaid, None)
            np.testing.assert_equal(row | {"solver": "best"}, mine)
    before = contents(root)
    assert cli("estimate", root, "--solver", name).code == 0
    assert contents(root) == before
    assert (command == "run") == (f"{file_name(name)}-truth-exact-all-00000-of-00002.parquet" in names(root))


def contents(root):
    return {path: data for path, (_, data) in files(root).items()}


def names(root):
    return [path.name for path in (root / "estimates").iterdir()]


def test_names_make_files_that_any_system_takes():
    assert file_name("my.package:solve") == "my.package@solve"
    assert file_name("best") == "best"
    assert file_name("a.b:c") != file_name("a:b.c")


@pytest.mark.parametrize("shape", [(3,), (3, 1), (1, 3)])
def test_what_a_function_may_give(shape):
    pose = helix_pose(10.0)
    t = pose.t.reshape(shape)
    for result in (
        (pose.R, t),
        [pose.R.tolist(), t, "ok"],
        SimpleNamespace(status="ok", R=pose.R, t=t),
        SimpleNamespace(status=eposit.Status.OK, cam_from_obj=SimpleNamespace(R=pose.R, t=t), iterations=None),
    ):
        answer, notes = outcome(result)
        assert (answer.status, notes) == ("ok", [])
        np.testing.assert_array_equal(answer.R, pose.R)
        np.testing.assert_array_equal(answer.t, pose.t)
        assert np.isnan(answer.covariance).all()
    full = SimpleNamespace(status="ok", R=pose.R, t=t, iterations=np.int64(7), covariance=np.eye(6))
    assert outcome(full)[0].iterations == 7
    np.testing.assert_array_equal(outcome(full)[0].covariance, np.eye(6))


@pytest.mark.parametrize(
    ("result", "status"),
    [
        (None, "no_solution"),
        ((None, None), "no_solution"),
        ((np.eye(3), np.zeros(3), "too dark"), "too dark"),
        (SimpleNamespace(status="lost", R=None, t=None), "lost"),
    ],
)
def test_a_failure_is_a_status_without_a_pose(result, status):
    answer, notes = outcome(result)
    assert (answer.status, notes) == (status, [])
    assert np.isnan(answer.R).all()


@pytest.mark.parametrize(
    ("R", "t", "words"),
    [
        (np.full((3, 3), np.nan), np.ones(3), "not finite"),
        (np.eye(3), [0.0, np.inf, 0.0], "not finite"),
        (np.diag([1.0, 1.0, -1.0]), np.ones(3), "no rotation"),
        (1.001 * np.eye(3), np.ones(3), "no rotation"),
    ],
)
def test_a_pose_that_is_none_is_an_error_of_the_row(R, t, words):
    answer, notes = outcome((R, t))
    assert answer.status == "solver_error"
    assert words in notes[0]
    single = np.eye(3, dtype=np.float32) * np.float32(1.0 + 1e-6)
    assert outcome((single, t))[0].status == ("ok" if np.all(np.isfinite(t)) else "solver_error")


@pytest.mark.parametrize(
    ("result", "words"),
    [
        ((np.eye(3),), "gave 1 values; it must give R and t"),
        (7, "gave a int without status"),
        (SimpleNamespace(status="ok"), "gave a SimpleNamespace without R"),
        (SimpleNamespace(R=np.eye(3), t=np.zeros(3)), "without status"),
        ((np.eye(3), np.zeros(3), 0), "gave the status 0; it must be a text"),
        ((np.eye(3), np.zeros(3), ""), "gave the status ''"),
        ((np.eye(3), np.zeros(3), "OK"), "gave the status 'OK'; it must be a text, \"ok\" or the reason"),
        ((np.zeros((3, 1)), np.zeros(3)), r"R of shape \(3, 1\); .* cv2.Rodrigues"),
        ((np.eye(4), np.zeros(3)), r"gave R of shape \(4, 4\); it must be of shape \(3, 3\)"),
        ((np.eye(3), np.zeros(4)), r"gave t of shape \(4,\)"),
        ((np.eye(3), "far"), "gave t as a str; it must be numbers"),
        ((np.eye(3, dtype=complex), np.ones(3)), "gave R as a ndarray; it must be numbers"),
        (SimpleNamespace(status="ok", R=np.eye(3), t=np.ones(3), covariance=np.eye(3)), "gave a covariance of shape"),
        (SimpleNamespace(status="ok", R=np.eye(3), t=np.ones(3), iterations=[1]), "gave iterations of shape"),
        (SimpleNamespace(status="ok", R=np.eye(3), t=np.ones(3), iterations=np.nan), "gave iterations nan; it must"),
        (SimpleNamespace(status="ok", R=np.eye(3), t=np.ones(3), iterations=1e30), "gave iterations 1e.30; it must"),
    ],
)
def test_what_cannot_be_understood_names_the_function(result, words):
    with pytest.raises(UserError, match=f"^--solver own:solve .*{words}"):
        outcome(result)


WRONG = {
    "no such module": ("def solve(): pass", "nowhere_at_all:solve", "importing nowhere_at_all failed with ModuleNotFo"),
    "no such function": ("def solve(): pass", "{}:slove", "has no 'slove'; give a function that it defines"),
    "not a function": ("solve = 7", "{}:solve", "solve is a int; it must be a function"),
    "broken module": ("1 / 0", "{}:solve", "failed with ZeroDivisionError: division by zero; mend it"),
    "syntax error": ("def solve(:", "{}:solve", "failed with SyntaxError: invalid syntax"),
    "module that exits": ("raise SystemExit(3)", "{}:solve", "failed with SystemExit: 3"),
    "wrong arguments": ("def solve(image): pass", "{}:solve", "is (image); it must take (points_in_obj, points_px"),
    "to be awaited": ("async def solve(a, b, c): pass", "{}:solve", "is an async function; it must be one that gives"),
    "wrong result": ("def solve(*a, **k): return 1, 2, 3, 4", "{}:solve", "gave 4 values"),
    "wrong shape": ("import numpy as np\ndef solve(*a): return np.zeros(3), np.zeros(3)", "{}:solve", "cv2.Rodrigues"),
    "no function named": ("def solve(): pass", "{}", "or give your own as package.module:function"),
    "a path": ("def solve(): pass", "./{}.py:solve", "or give your own as package.module:function"),
    "empty": ("def solve(): pass", "", "unknown solver ''; choose one of best"),
}


@pytest.mark.parametrize("case", WRONG)
def test_an_unusable_function_gives_one_sentence(case, own, root, cli):
    text, form, words = WRONG[case]
    name, before = form.format(own(text)), files(root)
    done = cli("estimate", root, "--solver", name, "-q")
    assert_one_sentence(done.code, done.err, words)
    assert name in done.err
    assert files(root) == before


def test_an_unusable_function_is_refused_before_anything_is_rendered(own, tiny, tmp_path, cli):
    (tmp_path / "recipe.toml").write_text(tiny[0])
    done = cli("run", tmp_path / "recipe.toml", "--out", tmp_path / "new", "--solver", f"{own('x = 1')}:solve")
    assert_one_sentence(done.code, done.err, "has no 'solve'")
    assert not (tmp_path / "new").exists()


@pytest.mark.full
def test_an_unusable_result_in_another_process(own, root, cli):
    name = own("def solve(*a, **k): return 1, 2, 3, 4")
    done = cli("estimate", root, "--solver", f"{name}:solve", "--workers", 2, "-q")
    assert_one_sentence(done.code, done.err, "gave 4 values")


FAILS_ONCE = """
    import eposit

    def solve(points_in_obj, points_px, camera):
        if points_px[0, 0] {} 200.0:
            raise RuntimeError("singular,\\n  as it were")
        return eposit.solve(points_in_obj, points_px, camera)
"""


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.full)])
def test_an_exception_is_a_row_and_is_counted(workers, own, root, cli):
    corner = [row["x_px"] for row in rows(root, "detections", "detections") if row["point_id"] == 0]
    limit = np.mean(corner)  # of the two frames one is refused
    name = own(FAILS_ONCE.replace("{} 200.0", f"> {limit}"))
    done = cli("estimate", root, "--solver", f"{name}:solve", "--workers", workers, "-q")
    assert done.code == 0
    bad = int(np.argmax(corner))
    assert done.err == (
        f"estimate {name}@solve-detected-exact-all: 1 of 2 rows have the status solver_error; frame {bad}: "
        "RuntimeError: singular, as it were\n"
    )
    found = rows(root, "estimates", f"{name}@solve-detected-exact-all")
    assert [row["status"] for row in found] == ["solver_error" if i == bad else "ok" for i in range(2)]
    assert {found[bad][key] for key in ("q_w", "t_z_mm", "reprojection_rmse_px")} == {None}
    # On a resumed run the count is told again; the exception is gone with the process.
    assert cli("estimate", root, "--solver", f"{name}:solve", "-q").err.endswith("have the status solver_error\n")


def test_a_changed_function_is_run_again_when_asked(own, root, cli):
    name = own(OURS.replace("return eposit", "return None and eposit"))
    words = ("estimate", root, "--solver", f"{name}:solve", "-q")
    assert cli(*words).code == 0
    assert cli("score", root, "-q").code == 0
    assert {row["status"] for row in rows(root, "scores", f"{name}@solve-detected-exact-all")} == {"no_solution"}
    (root.parent / f"{name}.py").write_text(OURS.replace("\n    ", "\n"))
    assert cli(*words).code == 0
    assert {row["status"] for row in rows(root, "estimates", f"{name}@solve-detected-exact-all")} == {"no_solution"}
    assert cli(*words, "--overwrite").code == 0
    assert {row["status"] for row in rows(root, "estimates", f"{name}@solve-detected-exact-all")} == {"ok"}
    assert rows(root, "scores", f"{name}@solve-detected-exact-all") == []
    assert cli("score", root, "-q").code == 0
    assert {row["status"] for row in rows(root, "scores", f"{name}@solve-detected-exact-all")} == {"ok"}


def test_a_function_cannot_spoil_what_the_next_one_is_given(own):
    name = own("""
        import eposit

        def solve(points_in_obj, points_px, camera, *, sigma_px=None):
            found = eposit.solve(points_in_obj, points_px, camera)
            points_in_obj[:], points_px[:] = 0.0, 0.0
            return found
    """)
    camera, pose = paper_camera("equisolid"), helix_pose(0.0)
    pixels = camera.project(pose.apply(PAPER_OBJECT))
    found = find_solver(f"{name}:solve")(PAPER_OBJECT, np.stack([pixels, pixels]), camera)
    np.testing.assert_allclose(found.cam_from_obj.t, np.stack([pose.t, pose.t]), rtol=1e-9)
    # Solved to 1e-12 relative: the reprojection error is rounding, below 1e-9 px.
    assert found.reprojection_rmse_px.max() < 1e-9


def test_a_method_of_a_class_and_a_module_of_a_package(own, tmp_path):
    own("")
    (tmp_path / "pack").mkdir()
    (tmp_path / "pack" / "mine.py").write_text("class Tools:\n    @staticmethod\n    def solve(a, b, c): return None\n")
    assert load_function("pack.mine:Tools.solve", "--solver")(1, 2, 3) is None
