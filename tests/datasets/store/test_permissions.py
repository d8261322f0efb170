"""Files and folders that are closed to the user: one sentence, and no advice to delete what may be sound."""

from __future__ import annotations

import os
import tempfile
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.wrong_input import Place, assert_one_sentence, files, first

NOBODY = 65534  # any user but root, who is refused nothing


@contextmanager
def another_user():
    """Whom the permissions of files bind: this user, or for root a user without rights."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)


@pytest.fixture
def public(place):
    """A place that every user can reach; at the end its files can be removed again."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        yield Place(folder, place.text, place.source, place.patch)
        for path in (folder, *folder.rglob("*")):
            path.chmod(0o755)


def lock(folder, mode):
    """Set the rights on a folder and all folders in it."""
    for path in (*(path for path in folder.rglob("*") if path.is_dir()), folder):
        path.chmod(mode)


def test_a_new_dataset_in_a_read_only_folder(public, cli):
    arguments = "generate", public.recipe(), "--out", public.new()
    lock(public.folder, 0o555)
    with another_user():
        outcome = cli(*arguments)
    assert_one_sentence(
        outcome.code, outcome.err, "read-only for this user; make it writable, choose another --out, or work"
    )
    assert not public.new().exists()


@pytest.mark.parametrize(
    ("words", "without"),
    [
        (("estimate", "--solver", "posit"), ()),
        (("estimate", "--overwrite"), ()),
        (("score",), ("scores",)),
        pytest.param(("report",), (), marks=pytest.mark.full),  # draws its figures before it writes
    ],
)
def test_a_stage_on_a_read_only_dataset(words, without, public, cli):
    root = public.dataset(without)
    before = files(root)
    lock(root, 0o555)
    with another_user():
        outcome = cli(words[0], root, *words[1:])
    assert_one_sentence(outcome.code, outcome.err, "the folder is read-only for this user")
    assert files(root) == before


@pytest.mark.parametrize("words", [("verify",), ("detect",), ("generate", "--out")])
def test_a_folder_that_is_closed_to_the_user(words, public, cli):
    arguments = (words[0], public.recipe(), words[1]) if len(words) > 1 else words
    root = public.dataset()
    root.chmod(0o000)
    with another_user():
        outcome = cli(*arguments, root)
    assert_one_sentence(outcome.code, outcome.err, "this user has no permission")


@pytest.mark.parametrize(
    ("table", "words"),
    [("estimates", ("score",)), ("estimates", ("estimate",)), ("scores", ("estimate", "--solver", "posit"))],
)
def test_an_unreadable_shard_is_not_called_damaged(table, words, public, cli):
    root = public.dataset(["scores"] if words == ("score",) else [])
    lock(root, 0o777)
    path = first(root, table)
    path.chmod(0o000)
    with another_user():
        outcome = cli(words[0], root, *words[1:])
    assert_one_sentence(outcome.code, outcome.err, f"cannot read {path}")
    assert "delete" not in outcome.err
    assert path.exists()
