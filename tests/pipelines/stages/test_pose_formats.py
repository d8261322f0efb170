"""Files of poses in the forms of other programs: the same poses come out of each, or one sentence."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.spatial.transform import Rotation

from datasets.errors import UserError
from eposit import Pose
from pipelines.commands import options
from pipelines.stages.import_poses import read_poses
from pipelines.stages.pose_formats import FORMATS

ROTATIONS = Rotation.from_rotvec([[0.3, -0.2, 0.1], [0.1, 0.5, -0.4], [-2.0, 0.2, 0.3]])
CAM_FROM_OBJ = Pose(ROTATIONS.as_matrix(), np.array([[10.0, -20.0, 900.0], [50.0, 60.0, 1500.0], [-7.0, 8.0, 700.0]]))
CAMERA = CAM_FROM_OBJ.inverse()  # in the world, which is the board's frame


def text(*values):
    return " ".join(repr(float(value)) for value in values)


def xyzw(pose, i):
    return Rotation.from_matrix(pose.R[i]).as_quat()


def wxyz(pose, i):
    return np.roll(xyzw(pose, i), 1)


def lines(row, first=""):
    return first + "".join(row(i) + "\n" for i in range(3))


def kitti():
    return lines(lambda i: text(*np.column_stack((CAMERA.R[i], CAMERA.t[i] / 1000.0)).ravel()))


def tum():
    return lines(lambda i: f"{i}.000 {text(*CAMERA.t[i] / 1000.0, *xyzw(CAMERA, i))}", "# timestamp tx ty tz q\n\n")


def tum_table():
    return tum().replace("# timestamp tx ty tz q", "timestamp tx ty tz qx qy qz qw").replace(" ", ",")


def colmap():
    def row(i):
        pose = text(*wxyz(CAM_FROM_OBJ, i), *CAM_FROM_OBJ.t[i])
        points = "" if i == 1 else "1.5 2.5 -1 3.5 4.5 7"
        return f"{9 - i} {pose} 1 camera 1/frame_{i:05}.png\n{points}"

    return lines(row, "# Image list\n#   POINTS2D[]\n")


def bop():
    def row(i):
        return f"1,{i},1,1.0,{text(*CAM_FROM_OBJ.R[i].ravel())},{text(*CAM_FROM_OBJ.t[i])},-1"

    return lines(row, "scene_id,im_id,obj_id,score,R,t,time\n")


def euroc():
    def row(i):
        return f"{i},{text(*CAMERA.t[i] / 1000.0, *wxyz(CAMERA, i), 1, 2, 3).replace(' ', ',')}"

    return lines(row, "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w []\n")


GOOD = {"kitti": kitti, "tum": tum, "tum table": tum_table, "colmap": colmap, "bop": bop, "euroc": euroc}


def assert_ours(found, frames=(0, 1, 2)):
    assert list(found) == list(frames)
    for pose, R, t in zip(found.values(), CAM_FROM_OBJ.R, CAM_FROM_OBJ.t, strict=True):
        assert pose.status == "ok"
        # Each number has all of its digits; an inverse and a quaternion round a few times, at up to 1500 mm.
        np.testing.assert_allclose(pose.R, R, atol=1e-14)
        np.testing.assert_allclose(pose.t, t, atol=1e-11)


@pytest.mark.parametrize("case", GOOD)
def test_each_format_gives_the_same_poses(case, tmp_path):
    path = tmp_path / "poses.txt"
    path.write_text(GOOD[case]())
    assert_ours(read_poses(path, case.split()[0]))


def test_help_names_every_format():
    (option,) = options.PoseFormat.__metadata__
    assert all(name in option.help for name in FORMATS)


WRONG = {
    "unknown format": ("itk", kitti, "unknown --pose-format 'itk'; give one of table, kitti, tum"),
    "of another format": ("tum", kitti, "line 1 has 12 values; TUM has 8"),
    "a line too short": ("kitti", lambda: kitti() + "1 2 3\n", "line 4 has 3 values; KITTI has 12"),
    "a word": ("kitti", lambda: kitti().replace(" ", "far ", 1), "far', which is not a number"),
    "times for frames": ("tum", lambda: tum().replace("1.000", "1305031102.17", 1), "has the timestamp 1305031102.17"),
    "nanoseconds": ("euroc", lambda: euroc().replace("\n1,", "\n1403636580838555648,"), "write each image's frame_id"),
    "no name": ("colmap", lambda: colmap().replace("frame_00001", "frame"), "line 5 is no image's line of COLMAP's"),
    "no lines of points": (
        "colmap",
        lambda: colmap().replace("\n1.5 2.5 -1 3.5 4.5 7", "", 1),
        "line 4 is no line of points",
    ),
    "no image's number": ("bop", lambda: bop().replace("im_id", "image"), "has no column im_id; BOP has"),
    "part of a matrix": ("bop", lambda: bop().replace(",1.0,", ",1.0,1 ", 1), "row 1 has 10 values in R and 3 in t"),
    "mirrored": ("kitti", lambda: lines(lambda i: "1 0 0 0 0 1 0 0 0 0 -1 1"), "it mirrors"),
    "nothing": ("kitti", lambda: "# none\n", "holds no poses"),
    "two of an image": ("bop", lambda: bop() + bop().splitlines()[1] + "\n", "has frame_id 0 more than once"),
    "not named": ("table", kitti, "is neither .csv nor .parquet; give --poses one of them, or tell its --pose-format"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_files_give_a_sentence(case, tmp_path):
    name, content, words = WRONG[case]
    (tmp_path / "poses.txt").write_text(content())
    with pytest.raises(UserError) as told:
        read_poses(tmp_path / "poses.txt", name)
    assert words in str(told.value)
    assert "\n" not in str(told.value)


def vectors():
    return {"rvec": ROTATIONS.as_rotvec().tolist(), "tvec": CAM_FROM_OBJ.t.tolist()}


def written(tmp_path, columns, index=None):
    table = pa.table(columns)
    if index is not None:
        table = table.replace_schema_metadata({"pandas": json.dumps({"index_columns": [index]})})
    pq.write_table(table, tmp_path / "poses.parquet")
    return tmp_path / "poses.parquet"


def test_vectors_of_opencv_are_read(tmp_path):
    assert_ours(read_poses(written(tmp_path, {"frame_id": [0, 1, 2], **vectors()})))
    names = ",".join(("frame_id", *(f"{kind}_{axis}" for kind in ("rvec", "tvec") for axis in "xyz")))
    rows = [f"{i}," + text(*vectors()["rvec"][i], *vectors()["tvec"][i]).replace(" ", ",") for i in range(3)]
    (tmp_path / "poses.csv").write_text("\n".join((names, *rows)))
    assert_ours(read_poses(tmp_path / "poses.csv"))


def test_a_list_of_two_numbers_gives_a_sentence(tmp_path):
    path = written(tmp_path, {"frame_id": [0], "rvec": [[0.0, 0.0]], "tvec": [[0.0, 0.0, 1.0]]})
    with pytest.raises(UserError, match="row 1: rvec is no list of three numbers; mend it"):
        read_poses(path)


def test_an_index_of_pandas_gives_the_frames(tmp_path):
    index = {"kind": "range", "name": "frame_id", "start": 4, "stop": 10, "step": 2}
    assert_ours(read_poses(written(tmp_path, vectors(), index)), (4, 6, 8))


@pytest.mark.parametrize("change", [{"name": None}, {"stop": 2}, {"step": 0}, {"stop": "x"}, {"stop": 10**30}], ids=str)
def test_an_index_that_is_not_one_of_frames_is_not_taken(change, tmp_path):
    index = {"kind": "range", "name": "frame_id", "start": 0, "stop": 3, "step": 1} | change
    with pytest.raises(UserError, match="a file of poses needs frame_id"):
        read_poses(written(tmp_path, vectors(), index))
