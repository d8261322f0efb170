"""Files of poses that other systems made: their forms, what is missing or wrong in them, and the same scores."""

import csv

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.spatial.transform import Rotation

from pipelines.report.page import REPORT
from tests.own import image_rows
from tests.wrong_input import assert_one_sentence, files

Q, T = ("q_w", "q_x", "q_y", "q_z"), ("t_x_mm", "t_y_mm", "t_z_mm")
R = tuple(f"r{i}{j}" for i in "123" for j in "123")


@pytest.fixture
def poses(root):
    """frame_id and pose columns of the true poses, moved by a tenth of a degree and a millimetre each."""
    made = []
    for path in sorted((root / "frames").iterdir()):
        for row in pq.read_table(path, columns=["frame_id", *Q, *T]).to_pylist():
            x = Rotation.from_quat([row[name] for name in (*Q[1:], Q[0])])
            moved = (Rotation.from_rotvec([0.0, 0.0, np.deg2rad(0.1)]) * x).as_quat()
            row |= dict(zip((*Q[1:], Q[0]), map(float, moved), strict=True))
            row |= {name: row[name] + 1.0 for name in T}
            made.append(row)
    return made


def matrices(rows):
    """The same poses with matrices and short names."""
    out = []
    for row in rows:
        matrix = Rotation.from_quat([row[name] for name in (*Q[1:], Q[0])]).as_matrix()
        pose = dict(zip(R, map(float, matrix.ravel()), strict=True))
        out.append(
            {"frame_id": row["frame_id"], **pose, **dict(zip(("tx", "ty", "tz"), (row[n] for n in T), strict=True))}
        )
    return out


def write(path, rows):
    if path.suffix == ".parquet":
        pq.write_table(pa.Table.from_pylist(rows), path)
        return path
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return path


def made(root, table, name="theirs", camera="exact"):
    return image_rows(root, table, name, camera)


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".CSV"])
@pytest.mark.parametrize("form", [list, matrices], ids=["quaternion", "matrix"])
def test_poses_of_a_file_are_scored(suffix, form, poses, root, tmp_path, cli):
    path = write(tmp_path / f"poses{suffix}", form(poses)[::-1])
    done = cli("score", root, "--poses", path, "--name", "theirs", "-q")
    assert (done.code, done.err) == (0, "")
    rows, scores = made(root, "estimates"), made(root, "scores")
    assert [row["frame_id"] for row in rows] == [0, 1]
    for row, score, pose in zip(rows, scores, poses, strict=True):
        key = {
            "solver": "theirs",
            "point_source": "image",
            "assumed_camera": "exact",
            "point_set": "all",
            "noise_draw": 0,
            "status": "ok",
        }
        assert key.items() <= row.items()
        assert key.items() <= score.items()
        # Text and matrices keep 1e-16; the sign of a quaternion is free.
        sign = np.sign(pose["q_w"])
        np.testing.assert_allclose([row[name] for name in Q], [sign * pose[name] for name in Q], atol=1e-12)
        assert [row[name] for name in T] == [pose[name] for name in T]
        # The move that the file was given; the difference of rotations keeps about 1e-15 rad.
        assert score["rotation_error_deg"] == pytest.approx(0.1, abs=1e-10)
        np.testing.assert_allclose([score[f"t{axis}_error_mm"] for axis in "xyz"], 1.0, atol=1e-9)


@pytest.mark.usefixtures("no_figures")
def test_they_stand_in_the_report_beside_the_others(poses, root, tmp_path, cli, content):
    path = write(tmp_path / "poses.csv", poses)
    words = ("score", root, "--poses", path, "--name", "theirs", "--camera", "nominal", "-q")
    assert cli(*words).code == 0
    assert cli("report", root).code == 0
    text = (root / REPORT).read_text()
    for setting in ("theirs image nominal all", "best detected exact all"):
        assert f'<th scope="row" data-value="{setting}">' in text
        assert f"<summary>{setting}</summary>" in text
    before, digest = files(root), content(root)
    assert cli(*words).code == 0
    kept = {path: found for path, found in before.items() if path.suffix == ".parquet"}
    assert {path: found for path, found in files(root).items() if path.suffix == ".parquet"} == kept
    assert content(root) == digest
    # Another pose of one frame: its scores are made again, the other shard's are not.
    poses[1]["t_z_mm"] += 5.0
    write(path, poses)
    assert cli(*words).code == 0
    after = files(root)
    assert (
        sorted(p.name for p in kept if after[p] != kept[p]) == ["theirs-image-nominal-all-00001-of-00002.parquet"] * 2
    )
    assert made(root, "scores", camera="nominal")[1]["tz_error_mm"] == pytest.approx(6.0, abs=1e-9)
    poses[1]["t_z_mm"] -= 5.0
    write(path, poses)
    assert cli(*words).code == 0
    assert content(root) == digest


def test_missing_rows_and_empty_poses_are_failures(poses, root, tmp_path, cli):
    done = cli("score", root, "--poses", write(tmp_path / "poses.csv", poses[1:]), "--name", "theirs")
    assert done.code == 0
    assert "has no pose for 1 of 2 frames; they count as failures" in done.out
    scores = made(root, "scores")
    assert [(row["status"], row["gross_failure"]) for row in scores] == [("missing", True), ("ok", False)]
    assert scores[0]["rotation_error_deg"] is None
    empty = dict.fromkeys((*Q, *T), "")
    assert (
        cli("score", root, "--poses", write(tmp_path / "p.csv", [poses[0] | empty, poses[1]]), "--name", "b").code == 0
    )
    assert [row["status"] for row in made(root, "scores", "b")] == ["no_solution", "ok"]
    none = dict.fromkeys((*Q, *T), None)
    path = write(tmp_path / "p.parquet", [poses[0], poses[1] | none])
    assert cli("score", root, "--poses", path, "--name", "c").code == 0
    assert [row["status"] for row in made(root, "scores", "c")] == ["ok", "no_solution"]


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_status_in_the_file_is_kept(suffix, poses, root, tmp_path, cli):
    zero = dict.fromkeys((*Q, *T), 0.0)
    path = write(tmp_path / f"p{suffix}", [poses[0] | zero | {"status": "lost"}, poses[1] | {"status": "ok"}])
    assert cli("score", root, "--poses", path, "--name", "theirs", "-q").code == 0
    rows = made(root, "scores")
    assert [row["status"] for row in rows] == ["lost", "ok"]
    assert rows[0]["rotation_error_deg"] is None
    path = write(tmp_path / f"p{suffix}", [poses[0] | {"status": "OK"}, poses[1] | {"status": None}])
    assert cli("score", root, "--poses", path, "--name", "theirs", "-q").code == 0
    assert [row["status"] for row in made(root, "scores")] == ["ok", "ok"]


@pytest.mark.parametrize("decimals", [4, 15])
def test_rounded_poses_are_taken(decimals, poses, root, tmp_path, cli):
    text = "frame_id, q_w, q_x, q_y, q_z, tx, ty, tz, note\r\n\r\n"
    for row in poses:
        numbers = ", ".join(f"{-row[name]:.{decimals}f}" for name in Q) + "," + ",".join(f"{row[n]:.3f}" for n in T)
        text += f"{row['frame_id']}.0, {numbers}, hello\r\n"
    (tmp_path / "poses.csv").write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert cli("score", root, "--poses", tmp_path / "poses.csv", "--name", "theirs").code == 0
    # Four decimals of a quaternion: 5e-5 each, 1e-4 rad or 0.006 degrees; twice that.
    limit = {4: 0.012, 15: 1e-10}[decimals]
    assert all(abs(row["rotation_error_deg"] - 0.1) < limit for row in made(root, "scores"))


@pytest.mark.parametrize("quiet", [(), ("-q",)])
def test_positions_in_metres_are_told_and_scored_as_they_are(quiet, poses, root, tmp_path, cli):
    metres = [row | {name: row[name] / 1000.0 for name in T} for row in poses]
    done = cli("score", root, "--poses", write(tmp_path / "p.csv", metres), "--name", "theirs", *quiet)
    assert done.code == 0
    assert done.err.startswith(f"warning: {tmp_path / 'p.csv'} seems to hold positions in metres instead of mm: ")
    assert done.err.count("\n") == 1
    assert [[row[name] for name in T] for row in made(root, "estimates")] == [[row[n] for n in T] for row in metres]
    # Two millimetres instead of two metres.
    assert all(row["tz_error_mm"] < -500.0 for row in made(root, "scores"))


def changed(**values):
    return lambda rows: [rows[0] | values, rows[1]]


def mirrored(rows):
    return [{name: -value if name in R else value for name, value in row.items()} for row in matrices(rows)]


def without(*names):
    return lambda rows: [{name: row[name] for name in row if name not in names} for row in rows]


WRONG_ROWS = {
    "extra frame": (lambda rows: [*rows, rows[0] | {"frame_id": 7}], "has frame_id 7, which"),
    "extra frames": (
        lambda rows: [*rows, rows[0] | {"frame_id": 7}, rows[0] | {"frame_id": -1}],
        "has frame_id -1 and 1 more, which",
    ),
    "frame twice": (lambda rows: [*rows, rows[1]], "has frame_id 1 more than once; give one pose for each frame"),
    "fraction of a frame": (changed(frame_id=0.5), "row 1: frame_id is 0.5; it must be a whole number"),
    "no frame": (changed(frame_id=None), "row 1: frame_id is nan; it must be a whole number"),
    "long quaternion": (changed(q_w=1.5), "frame_id 0: the quaternion has length"),
    "zero quaternion": (changed(**dict.fromkeys(Q, 0.0)), "the quaternion has length 0; it must be 1 to within 0.001"),
    "half a pose": (changed(q_w=None), "frame_id 0: the pose has values that are not finite"),
    "infinite": (changed(t_z_mm=float("inf")), "frame_id 0: the pose has values that are not finite"),
    "no frame column": (without("frame_id"), "has the columns q_w, q_x"),
    "no rotation": (without("q_w"), "a file of poses needs frame_id, q_w q_x q_y q_z or r11 to r33, and t_x_mm"),
    "no position": (without("t_z_mm"), "has the columns frame_id, q_w"),
    "two positions": (changed(tx=1.0, ty=1.0, tz=1.0), "has columns t_x_mm and tx, two forms of the same"),
    "mirrored": (
        lambda rows: [matrices(rows)[0] | {n: -v for n, v in matrices(rows)[0].items() if n in R}],
        "it mirrors",
    ),
    "stretched": (
        lambda rows: [row | {"r11": 2.0} for row in matrices(rows)],
        "frame_id 0: r11 to r33 are no rotation: R^T R is off by",
    ),
}


@pytest.mark.parametrize("suffix", [".csv", pytest.param(".parquet", marks=pytest.mark.full)])
@pytest.mark.parametrize("case", WRONG_ROWS)
def test_wrong_poses_give_one_sentence(case, suffix, poses, root, tmp_path, cli):
    change, words = WRONG_ROWS[case]
    rows = change(poses)
    rows = [dict.fromkeys(name for row in rows for name in row) | row for row in rows]
    path, before = write(tmp_path / f"poses{suffix}", rows), files(root)
    done = cli("score", root, "--poses", path, "--name", "theirs")
    assert_one_sentence(done.code, done.err, words)
    assert str(path) in done.err
    assert files(root) == before


GOOD = "frame_id,q_w,q_x,q_y,q_z,tx,ty,tz\n0,1,0,0,0,0,0,1000\n"
WRONG_FILES = {
    "no file": ("p.csv", None, "cannot read"),
    "folder": (".", None, "is neither .csv nor .parquet"),
    "other kind": ("p.txt", GOOD.encode(), "is neither .csv nor .parquet; give --poses one of them"),
    "empty": ("p.csv", b"", "has the columns none; a file of poses needs"),
    "only a header": ("p.csv", GOOD.split("\n")[0].encode(), "holds no poses"),
    "not UTF-8": ("p.csv", b"\xff\xfe\x00", "it is not UTF-8 text"),
    "not text": ("p.csv", b"frame_id\n\0\n", "p.csv"),
    "a word": ("p.csv", GOOD.replace("1000", "far").encode(), "row 1: tz is 'far', which is not a number"),
    "comma for a point": ("p.csv", GOOD.replace("1000", "1,5").encode(), "line 2 has 9 values under 8 columns"),
    "column twice": ("p.csv", GOOD.replace("q_x", "q_w").encode(), "has the column 'q_w' twice"),
    "no Parquet": ("p.parquet", GOOD.encode(), "cannot read"),
    "half a Parquet": ("p.parquet", b"PAR1" + b"\0" * 40, "cannot read"),
}


@pytest.mark.parametrize("case", WRONG_FILES)
def test_a_wrong_file_gives_one_sentence(case, root, tmp_path, cli):
    name, data, words = WRONG_FILES[case]
    if data is not None:
        (tmp_path / name).write_bytes(data)
    before = files(root)
    done = cli("score", root, "--poses", tmp_path / name, "--name", "theirs")
    assert_one_sentence(done.code, done.err, words)
    assert files(root) == before


def test_a_small_file_that_unpacks_to_gigabytes_is_refused_before_it_does(root, tmp_path, cli):
    """One text of a megabyte that stands in 4000 rows: the file has a few kB."""
    path = tmp_path / "p.parquet"
    texts = pa.DictionaryArray.from_arrays(pa.array([0] * 4000, pa.int32()), pa.array(["x" * 1_000_000]))
    columns = {"frame_id": pa.array(range(4000)), **dict.fromkeys((*Q, *T), texts)}
    pq.write_table(pa.table(columns), path, compression="zstd", store_schema=False)
    before = pa.total_allocated_bytes()
    done = cli("score", root, "--poses", path, "--name", "theirs")
    assert_one_sentence(done.code, done.err, "the texts of q_w have more than 200 MB; mend them")
    assert pa.total_allocated_bytes() - before < 100_000_000


WRONG_WORDS = {
    "no name": (("--poses", "{}"), "--poses and --name go together"),
    "no poses": (("--name", "theirs"), "--poses and --name go together"),
    "a solver's name": (("--poses", "{}", "--name", "opencv-p3p"), "name 'opencv-p3p' is a solver's"),
    "a path for a name": (("--poses", "{}", "--name", "../x"), "name '../x' is not usable; give --name of letters"),
    "an empty name": (("--poses", "{}", "--name", ""), "name '' is not usable"),
    "a hidden name": (("--poses", "{}", "--name", ".x"), "name '.x' is not usable"),
    "unknown camera": (("--poses", "{}", "--name", "x", "--camera", "wide"), "unknown camera 'wide'"),
    "camera without poses": (("--camera", "nominal"), "--camera goes with --poses"),
}


@pytest.mark.parametrize("case", WRONG_WORDS)
def test_wrong_words_give_one_sentence(case, root, tmp_path, cli):
    words, sentence = WRONG_WORDS[case]
    (tmp_path / "p.csv").write_text(GOOD)
    before = files(root)
    done = cli("score", root, *(word.format(tmp_path / "p.csv") for word in words))
    assert_one_sentence(done.code, done.err, sentence)
    assert files(root) == before
