"""Files that claim to be enormous, or never end, are refused before anything is allocated or waited for."""

from __future__ import annotations

import os
import struct

import numpy as np
import pytest

from datasets.store.exr_file import DamagedExrError, read_exr, write_exr
from datasets.store.images import decode_pixels, encode_png
from tests.wrong_input import assert_one_sentence


def test_a_png_that_claims_too_many_pixels():
    data = bytearray(encode_png(np.zeros((20, 20), np.uint8)))
    data[16:24] = struct.pack(">II", 60_000, 60_000)
    with pytest.raises(ValueError, match="no PNG of at most 100000000 pixels"):
        decode_pixels(bytes(data))
    for cut in range(0, 40, 3):
        with pytest.raises(ValueError, match="PNG"):
            decode_pixels(bytes(data[:cut]))


@pytest.mark.parametrize("last", [(20_000, 20_000), (2**31 - 1, 5), (9_000, 9_000), (-5, 3)])
def test_an_exr_that_claims_too_many_pixels(last, tmp_path):
    path = tmp_path / "a.exr"
    write_exr(path, {"key": "k"}, {"Y": np.ones((8, 8), np.float32)})
    data = path.read_bytes()
    at = data.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    path.write_bytes(data[:at] + struct.pack("<4i", 0, 0, *last) + data[at + 16 :])
    with pytest.raises(DamagedExrError):
        read_exr(path)


def test_an_exr_whose_header_has_a_type_that_nobody_knows(tmp_path):
    """A library keeps such a value as bytes: it is none of ours."""
    path = tmp_path / "a.exr"
    write_exr(path, {"key": "k", "background": 0.25}, {"Y": np.ones((8, 8), np.float32)})
    path.write_bytes(path.read_bytes().replace(b"background\0float\0", b"background\0flo.t\0"))
    with pytest.raises(DamagedExrError, match="another kind"):
        read_exr(path)


@pytest.mark.parametrize("kind", ["fifo", "large", "deep"])
def test_a_recipe_that_never_ends(kind, tmp_path, cli):
    path = tmp_path / "recipe.toml"
    if kind == "fifo":
        os.mkfifo(path)
    else:
        path.write_text("#" * 4_000_001 if kind == "large" else "a = " + "[" * 100_000)
    done = cli("run", path, "--out", tmp_path / "out")
    words = {"fifo": "it is a device or a pipe", "large": "it has more than 4 MB", "deep": "too deep"}
    assert_one_sentence(done.code, done.err, words[kind])


def test_poses_from_a_pipe(root, cli, tmp_path):
    os.mkfifo(tmp_path / "poses.csv")
    done = cli("score", root, "--poses", tmp_path / "poses.csv", "--name", "theirs")
    assert_one_sentence(done.code, done.err, "it is no regular file, and may never end")
