"""`repair` makes again what is damaged or missing, keeps what it replaces, and touches nothing else."""

from __future__ import annotations

import shutil

import numpy as np
import pyarrow as pa
import pytest

from datasets.errors import UserError
from datasets.store.dataset import open_dataset
from datasets.store.images import decode_png, encode_png
from datasets.store.known_shards import KNOWN_FILE
from pipelines.detection import Detector
from pipelines.stages.repair import answers_of
from pipelines.stages.settings import RUN_SETTINGS, Setting, System
from tests.tables import OF_A_RUN
from tests.wrong_input import assert_one_sentence, files, first

DERIVED = ("manifest.json", "README.md", KNOWN_FILE)


def made(root):
    """Every file but what is derived from the others, and what was put aside."""
    found = files(root)
    return {path: data for path, data in found.items() if path.name not in DERIVED and "quarantine" not in path.parts}


def contents(root):
    return {path.relative_to(root): data for path, (_, data) in made(root).items()}


def half(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flipped(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 8] ^= 16  # among the values: Parquet's footer behind them has bytes that nobody reads
    path.write_bytes(data)


@pytest.mark.parametrize("folder", [*OF_A_RUN, "masters"])
@pytest.mark.parametrize(
    "damage",
    [pytest.param(half, marks=pytest.mark.full), flipped, lambda path: path.unlink()],
    ids=["half", "flip", "gone"],
)
def test_one_file_is_made_again(folder, damage, root, cli):
    before, bytes_before = made(root), contents(root)
    path = first(root, folder)
    damage(path)
    damaged = path.read_bytes() if path.exists() else None
    done = cli("repair", root, "-q")
    assert (done.code, done.err) == (0, "")
    after = made(root)
    assert contents(root) == bytes_before
    assert {other for other, found in after.items() if found != before[other]} == {path}
    aside = root / "quarantine" / folder / path.name
    assert (aside.read_bytes() if aside.exists() else None) == damaged
    assert cli("verify", root).code == 0


def test_a_sound_dataset_is_left_alone(root, cli):
    before = made(root)
    assert cli("repair", root, "-q").code == 0
    assert made(root) == before


def test_everything_at_once(root, cli, content):
    before, whole = content(root), contents(root)
    one, other = sorted((root / "estimates").iterdir())
    data = one.read_bytes()
    one.write_bytes(other.read_bytes())
    other.write_bytes(data)
    shutil.rmtree(root / "detections")
    shutil.rmtree(root / "scores")
    half(first(root, "keypoints"))
    flipped(first(root, "masters"))
    (root / "scores").mkdir()
    (root / "scores" / "mine.parquet").write_bytes(b"mine")
    (root / "recipe.toml").write_text("name = [")
    assert_one_sentence(
        *(lambda done: (done.code, done.err))(cli("verify", root)), "puts back the one that the manifest"
    )
    assert cli("repair", root, "-q").code == 0
    assert content(root) == before
    assert contents(root) == whole
    kept = {path.relative_to(root / "quarantine").as_posix() for path in (root / "quarantine").rglob("*.*")}
    assert {"recipe.toml", "scores/mine.parquet", "keypoints/keypoints-00000-of-00002.parquet"} <= kept
    assert len(kept) == 6


def test_the_second_of_a_name_is_kept_beside_the_first(root, cli):
    for _ in range(2):
        half(first(root, "scores"))
        assert cli("repair", root, "-q").code == 0
    assert len(list((root / "quarantine" / "scores").iterdir())) == 2


def test_poses_of_a_file_cannot_be_made_again(root, cli, tmp_path):
    csv = tmp_path / "poses.csv"
    csv.write_text("frame_id,q_w,q_x,q_y,q_z,t_x_mm,t_y_mm,t_z_mm\n0,1,0,0,0,0,0,900\n")
    assert cli("score", root, "--poses", csv, "--name", "theirs", "-q").code == 0
    path = root / "estimates" / "theirs-image-exact-all-00000-of-00002.parquet"
    half(path)
    before = made(root)
    done = cli("repair", root, "-q")
    assert_one_sentence(done.code, done.err, "came from a file; run `score DIR --poses FILE --name theirs`")
    assert made(root) == before
    path.unlink()
    assert cli("score", root, "--poses", csv, "--name", "theirs", "-q").code == 0
    assert cli("verify", root).code == 0


@pytest.mark.parametrize(
    "answers",
    [
        *RUN_SETTINGS,
        Setting("opencv-sqpnp", points="truth+noise", noise_px=0.25, draws=7, use="four", camera="paper"),
        Setting("best", points="truth+noise", noise_px=1e-05, draws=1),
        *(Setting("posit", detector=name) for name in Detector),
        System("photometric"),
        System("my.package:estimate", "nominal"),
    ],
    ids=lambda answers: answers.name,
)
def test_the_name_of_shards_tells_what_makes_them(answers):
    assert answers_of(answers.name if isinstance(answers, Setting) else answers.shard_name) == answers


@pytest.mark.parametrize("variant", ["x", "best-all", "best-detected-exact-some", "best-guess-exact-all"])
def test_a_name_that_no_setting_makes(variant):
    with pytest.raises(UserError, match="a name that no setting makes"):
        answers_of(variant)


def test_pictures_are_held_against_pictures_rendered_now(root, cli):
    assert cli("verify", root, "--rerender", "2").code == 0
    dataset, path = open_dataset(root), first(root, "frames")
    rows = dataset.read_shard(path).to_pylist()
    image = np.array(decode_png(rows[0]["image"]["bytes"]))
    image[150:153, 200:203] += 9
    rows[0]["image"]["bytes"] = encode_png(image)
    dataset.write_shard(path, pa.Table.from_pylist(rows, schema=OF_A_RUN["frames"]))
    dataset.write_manifest()
    assert cli("verify", root).code == 0
    done = cli("verify", root, "--rerender", "2")
    assert_one_sentence(done.code, done.err, "frame 0: its picture differs by up to 9 grey levels")
