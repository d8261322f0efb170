"""Names of files that belong to one process tell the host; a file of another host is never called abandoned."""

import os
import platform

import pytest

from datasets.store.atomic import OWN_NAME, State, create_owned, host, own_name, state_of


@pytest.mark.parametrize(
    ("node", "expected"), [("node-7.rack", "node-7.rack"), ("a b/c", "a_b_c"), ("", "unknown"), ("n" * 100, "n" * 64)]
)
def test_the_host_is_this_machines_name_in_letters_of_a_file(monkeypatch, node, expected):
    monkeypatch.setattr(platform, "node", lambda: node)
    assert host() == expected
    assert OWN_NAME.match(own_name(".tmp-"))["host"] == expected


def test_a_file_of_another_host_is_not_known_to_be_abandoned(monkeypatch, tmp_path):
    monkeypatch.setattr(platform, "node", lambda: "elsewhere")
    theirs = tmp_path / own_name(".tmp-")
    theirs.touch()
    monkeypatch.setattr(platform, "node", lambda: "here")
    ours = tmp_path / own_name(".tmp-")
    ours.touch()
    assert state_of(theirs) is State.UNKNOWN
    assert state_of(ours) is State.GONE
    path, descriptor = create_owned(tmp_path, ".tmp-")
    assert state_of(path) is State.LIVE
    os.close(descriptor)
