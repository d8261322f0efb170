"""Google's object store, and access keys that are missing or wrong: what a folder would have, or one sentence."""

from __future__ import annotations

import os

import pytest

from datasets.store_access import NO_METADATA, ask_no_silent_metadata, patient_for_a_while
from datasets.url_path import dataset_folder
from tests.pipelines.stages.test_at_a_url import pipelines
from tests.wrong_input import assert_one_sentence

KEYS = ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_PROFILE", "GOOGLE_APPLICATION_CREDENTIALS", NO_METADATA)


@pytest.fixture
def no_keys(monkeypatch, tmp_path):
    """An environment without access keys."""
    for name in KEYS:
        monkeypatch.setenv(name, "")  # so that what the tested code sets is undone
        monkeypatch.delenv(name)
    monkeypatch.setenv("HOME", str(tmp_path))


@pytest.mark.usefixtures("no_keys")
def test_a_silent_metadata_server_is_asked_once(silent_server, refusing_server, monkeypatch):
    monkeypatch.setattr("datasets.store_access.METADATA_S", 0.05)
    for address, told in ((refusing_server, None), (silent_server, "true"), ("127.0.0.1:1", "true")):
        monkeypatch.delenv(NO_METADATA, raising=False)
        monkeypatch.setenv("AWS_EC2_METADATA_SERVICE_ENDPOINT", f"http://{address}/")
        ask_no_silent_metadata()
        assert os.environ.get(NO_METADATA) == told
    monkeypatch.setattr("datasets.store_access._answers", lambda *_: pytest.fail("asked"))
    ask_no_silent_metadata()


def test_google_s_store_is_not_tried_for_long():
    assert patient_for_a_while("gs", "") == "retry_limit_seconds=30"
    assert patient_for_a_while("gs", "scheme=http") == "scheme=http&retry_limit_seconds=30"
    assert patient_for_a_while("gs", "retry_limit_seconds=5") == "retry_limit_seconds=5"
    assert patient_for_a_while("s3", "scheme=http") == "scheme=http"


@pytest.mark.full
@pytest.mark.usefixtures("no_keys")
@pytest.mark.parametrize("keys", ["", "wrong:keys@"])
def test_missing_or_wrong_keys_of_s3_are_a_sentence(keys, silent_server, refusing_server, monkeypatch):
    monkeypatch.setenv("AWS_EC2_METADATA_SERVICE_ENDPOINT", f"http://{silent_server}/")
    monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://{refusing_server}")
    code, error = pipelines("verify", f"s3://{keys}bucket/demo")
    assert_one_sentence(code, error, "ACCESS_DENIED")
    assert "correct URL, access keys or network" in error
    assert "wrong:keys" not in error


@pytest.mark.full
@pytest.mark.usefixtures("no_keys")
def test_missing_keys_of_google_are_a_sentence(silent_server, monkeypatch):
    monkeypatch.setenv("GCE_METADATA_HOST", silent_server)
    code, error = pipelines("verify", "gs://bucket/demo?retry_limit_seconds=1")
    assert_one_sentence(code, error, "access token is required")


@pytest.mark.full
def test_every_stage_ends_with_a_folder_s_content_in_google_s_store(root, tiny, tmp_path, content, google_server):
    recipe, url = tmp_path / "tiny.toml", f"gs://anonymous@bucket/made/demo?{google_server}"
    recipe.write_text(tiny[0])
    assert pipelines("generate", recipe, "--out", url, "--workers", 2, "-q") == (0, "")
    for words in (["detect", "--workers", 2], ["estimate"], ["score"], ["report"], ["verify"]):
        quiet = [] if words[0] in ("report", "verify") else ["-q"]
        assert pipelines(words[0], url, *words[1:], *quiet) == (0, "")
    place = dataset_folder(url)
    assert content(place) == content(root)
    assert {path.name for path in place.iterdir()} >= {"frames", "masters", "scores", "recipe.toml"}
    assert list(place.glob("s*")) == []
    other = tmp_path / "other.toml"
    other.write_text(tiny[0].replace("seed = 5", "seed = 6"))
    assert_one_sentence(*pipelines("generate", other, "--out", url, "-q"), "holds a dataset of anot")
    (place / "recipe.toml").unlink()
    assert_one_sentence(*pipelines("generate", other, "--out", url, "-q"), "gs://bucket/made/demo")
    missing = f"gs://anonymous@no-bucket/demo?{google_server}"
    assert_one_sentence(*pipelines("generate", recipe, "--out", missing, "-q"), "gs://no-bucket/demo")
