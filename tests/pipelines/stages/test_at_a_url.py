"""Stages on a dataset in an object store: its content is that of a folder, whatever was killed on the way."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time

import pytest
from rich.console import Console

from datasets.errors import UserError
from datasets.recipe.model import parse_recipe
from datasets.store.atomic import copy_file, write_text
from datasets.store.claim import INTENT_PREFIX, claim
from datasets.store.dataset import open_dataset
from datasets.store.refusals import RECIPE_FILE
from datasets.url_path import UnreachableError, UrlPath, dataset_folder
from datasets.verify import verify
from pipelines.engines.local import LocalEngine
from pipelines.report.page import write_report
from pipelines.stages import run as stages
from pipelines.stages.missing import Execution
from pipelines.stages.repair import repair
from pipelines.stages.settings import Setting
from tests.wrong_input import assert_one_sentence, first

PATIENCE_S = 120.0
ROUNDS = 20


@pytest.fixture
def stored(tmp_path):
    """A place of an object store's kind, in a folder of this machine."""
    return UrlPath("file:", *(tmp_path / "store" / "demo").parts[1:])


def put(root, stored, tables):
    """The recipe and some tables of a dataset in a store."""
    for path in [root / RECIPE_FILE, *(path for table in tables for path in (root / table).iterdir())]:
        copy_file(path, stored / path.relative_to(root))


def test_a_path_of_a_store_is_used_as_a_local_one_is(stored):
    assert str(stored / "frames" / "x.parquet") == f"{stored}/frames/x.parquet"
    assert (stored / "frames" / "x.parquet").relative_to(stored).as_posix() == "frames/x.parquet"
    assert not stored.exists()
    assert list(stored.glob("*")) == []
    for action in (UrlPath.read_bytes, UrlPath.unlink, UrlPath.stat):
        with pytest.raises(FileNotFoundError):
            action(stored / "missing")
    with pytest.raises(TypeError):
        open(stored / "local", "w")  # noqa: SIM115
    write_text(stored / "a" / "told", "told")
    assert (stored / "a" / "told").rename(stored / "b" / "told").read_text() == "told"
    assert stored.sizes() == {"b/told": 4}
    assert {path.name for path in stored.iterdir()} == {"a", "b"}


def test_what_is_no_place_for_a_dataset_is_told():
    assert str(dataset_folder("s3://key:secret@bucket/a/b?region=x")) == "s3://bucket/a/b"
    assert not isinstance(dataset_folder("file:///data/demo"), UrlPath)
    for text in ("ftp://host/demo", "s3://bucket", "s3:///demo", "file://host/demo", "s3://bucket/demo?colour=red"):
        with pytest.raises(UserError):
            dataset_folder(text)


@pytest.mark.usefixtures("no_figures")
def test_every_stage_works_at_a_url(root, stored, tiny, content):
    execution = Execution(LocalEngine(), Console(quiet=True))
    put(root, stored, ["frames", "masters"])
    recipe = parse_recipe(tiny[0], "test")
    with claim(stored, recipe, tiny[0]) as dataset:
        stages.run_generate(dataset, execution)
        stages.run_detect(dataset, execution)
        stages.run_estimate(dataset, [Setting()], execution)
        stages.run_score(dataset, execution)
    assert content(stored) == content(root)
    write_report(dataset)
    local, there = (
        (folder / "report.html").stat().st_size for folder in (write_report(open_dataset(root)).parent, stored)
    )
    assert there == pytest.approx(local, rel=0.01)  # it tells no paths
    damaged = stored / "scores" / first(root, "scores").name
    write_text(damaged, "no shard")
    (stored / "masters" / "000000.exr").unlink()
    assert {str(problem.path) for problem in verify(dataset)[1]} == {str(damaged), f"{stored}/masters/000000.exr"}
    aside, left = repair(dataset, execution)
    assert ([path.read_text() for path in aside], left) == (["no shard"], [])
    assert content(stored) == content(root)


def test_a_store_that_does_not_answer_is_not_taken_for_damage(root, stored, monkeypatch):
    put(root, stored, ["frames"])
    dataset = open_dataset(stored)

    def refuse(*_):
        raise OSError("no answer")

    monkeypatch.setattr("datasets.url_path._Ranges.read", lambda self, size=-1: self._path._ask(refuse))
    for action in (dataset.read_shard, dataset.is_done):
        with pytest.raises(UnreachableError, match="no answer"):
            action(dataset.shards("frames")[0])


def test_of_two_recipes_at_one_url_one_is_refused(stored, tiny, monkeypatch):
    monkeypatch.setattr("datasets.store.claim.PATIENCE_S", 0.2)
    texts = [tiny[0], tiny[0].replace("seed = 5", "seed = 6")]
    recipes = [parse_recipe(text, "test") for text in texts]
    with claim(stored, recipes[0], texts[0]), claim(stored, recipes[0], texts[0]):
        pass
    with pytest.raises(UserError, match="another recipe"), claim(stored, recipes[1], texts[1]):
        pass
    left = stored.parent / "left" / f"{INTENT_PREFIX}0123456789abcdef-0"  # of a process that was killed
    write_text(left, "")
    with pytest.raises(UserError, match=f"delete {left}"), claim(left.parent, recipes[1], texts[1]):
        pass


def test_of_two_recipes_that_begin_at_once_at_most_one_succeeds(stored, tiny, monkeypatch):
    monkeypatch.setattr("datasets.store.claim.PAUSE_S", 0.02)
    texts = [tiny[0], tiny[0].replace("seed = 5", "seed = 6")]
    recipes = [parse_recipe(text, "test") for text in texts]
    for number in range(ROUNDS):
        place, start, done = stored / str(number), threading.Barrier(2), []

        def begin(i, place=place, start=start, done=done):
            start.wait()
            try:
                with claim(place, recipes[i], texts[i]):
                    done.append(i)
            except UserError:
                pass

        threads = [threading.Thread(target=begin, args=(i,)) for i in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(done) == 1
        assert (place / RECIPE_FILE).read_text() == texts[done[0]]
        assert list(place.glob(f"{INTENT_PREFIX}*")) == []


@pytest.fixture
def environment(server, monkeypatch):
    """Access keys and the server's address where Amazon's own tools look for them."""
    address = server.split("&")[0].removeprefix("endpoint_override=").replace("%3A", ":")
    told = {
        "AWS_ACCESS_KEY_ID": "a",
        "AWS_SECRET_ACCESS_KEY": "b",
        "AWS_REGION": "us-east-1",
        "AWS_ENDPOINT_URL": f"http://{address}",
        "AWS_EC2_METADATA_DISABLED": "true",
    }
    for name, value in told.items():
        monkeypatch.setenv(name, value)


def pipelines(*words):
    """Exit code and errors of a command in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-m", "pipelines", *map(str, words)], capture_output=True, text=True, check=False
    )
    return done.returncode, done.stderr


@pytest.mark.full
@pytest.mark.usefixtures("environment")
def test_a_dataset_is_made_on_an_s3_server(root, tiny, tmp_path, content):
    recipe, url = tmp_path / "tiny.toml", "s3://bucket/made/demo"
    recipe.write_text(tiny[0])
    assert pipelines("generate", recipe, "--out", url, "--workers", 2, "-q") == (0, "")
    for words in (["detect", "--workers", 2], ["estimate"], ["score"]):
        assert pipelines(words[0], url, *words[1:], "-q") == (0, "")
    assert content(dataset_folder(url)) == content(root)
    for words in (["report"], ["verify"]):
        assert pipelines(*words, url) == (0, "")
    other = tmp_path / "other.toml"
    other.write_text(tiny[0].replace("seed = 5", "seed = 6"))
    assert_one_sentence(
        *pipelines("generate", other, "--out", url, "-q"), "s3://bucket/made/demo holds a dataset of anot"
    )


@pytest.mark.full
def test_a_wrong_bucket_and_no_access_are_told(root, tiny, tmp_path, environment, monkeypatch):
    recipe = tmp_path / "tiny.toml"
    recipe.write_text(tiny[0])
    assert_one_sentence(*pipelines("detect", "s3://no-bucket/demo"), "s3://no-bucket/demo holds no dataset")
    assert_one_sentence(*pipelines("generate", recipe, "--out", "s3://no-bucket/demo", "-q"), "cannot be used")
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:1")
    assert_one_sentence(*pipelines("verify", "s3://bucket/demo"), "correct URL, access keys or network")


@pytest.mark.full
@pytest.mark.usefixtures("environment")
@pytest.mark.parametrize("files", [1, 3, 5, 7])
@pytest.mark.parametrize("options", [(), ("--pack-masters",)], ids=["single", "packed"])
def test_a_run_that_is_killed_while_it_puts_goes_on(options, files, tiny, tmp_path, content, server):
    recipe, place = tmp_path / "tiny.toml", dataset_folder(f"s3://bucket/killed{files}{len(options)}/demo")
    recipe.write_text(tiny[0])
    words = ["generate", recipe, "--out", place, "--workers", 2, "-q", *options]
    running = subprocess.Popen([sys.executable, "-m", "pipelines", *map(str, words)], start_new_session=True)
    deadline = time.monotonic() + PATIENCE_S
    while len(place.sizes()) < files and running.poll() is None and time.monotonic() < deadline:
        pass
    os.killpg(running.pid, signal.SIGKILL)
    running.wait()
    problems = verify(open_dataset(place))[1] if (place / RECIPE_FILE).is_file() else []
    assert {problem.kind for problem in problems} <= {"missing"}
    assert pipelines(*words) == (0, "")
    kept = tmp_path / "kept"
    assert pipelines("generate", recipe, "--out", kept, "-q", *options) == (0, "")
    assert content(place) == content(kept)
    linear = [{path.name: path.read_bytes() for path in (root / "masters").glob("*")} for root in (place, kept)]
    assert linear[0] == linear[1]
