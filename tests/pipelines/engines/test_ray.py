"""Ray: every task once, errors as they are, and a node that is killed in the middle costs nothing."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from datasets.errors import UserError
from datasets.url_path import dataset_folder
from pipelines.engines.ray import RayEngine
from tests.conftest import TINY, command
from tests.timeless import timeless

pytestmark = pytest.mark.full

ROOT = Path(__file__).parents[3]
SHARDS, BEFORE_KILL = 10, 3
PATIENCE_S = 240.0


@pytest.fixture(scope="module")
def cluster():
    """A head and a second node, each of one processor and with processes of its own."""
    from ray.cluster_utils import Cluster  # pyright: ignore[reportMissingImports]

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        patch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]))
        node = {"num_cpus": 1, "object_store_memory": 100 * 2**20, "include_dashboard": False}
        made = Cluster(initialize_head=True, head_node_args=node)
        yield made
        made.shutdown()


@pytest.fixture
def second(cluster):
    """The second node, for the test to kill."""
    node = cluster.add_node(num_cpus=1, object_store_memory=100 * 2**20)
    yield node
    if node in cluster.worker_nodes:
        cluster.remove_node(node, allow_graceful=False)


@pytest.fixture(scope="module")
def engine(cluster):
    """The engine of the cluster, in this process."""
    import ray  # pyright: ignore[reportMissingImports]

    yield RayEngine(address=cluster.address)
    ray.shutdown()


def double(task):
    return 2 * task


def fails_at_two(task):
    if task == 2:
        raise UserError("two is wrong")


def folder_of(task):
    return str(Path.cwd())


def dies(task):
    os._exit(1)


def stays_on_its_node(folder, task):
    """Write which node and process have begun, and wait there until the test lets it go on."""
    import ray  # pyright: ignore[reportMissingImports]

    node = ray.get_runtime_context().get_node_id()
    (folder / f"{task}-{node}-{os.getpid()}").touch()
    while not (folder / "go on").exists():
        time.sleep(0.05)
    return node


def wait_until(condition):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def runs(process):
    """Whether a process is there and has not ended."""
    status = Path(f"/proc/{process}/stat")
    return status.exists() and status.read_text().rpartition(")")[2].split()[0] != "Z"


def test_every_task_is_done_once(engine):
    assert sorted(engine.map(double, range(5))) == [(0, 0), (1, 2), (2, 4), (3, 6), (4, 8)]


def test_an_error_in_a_task_reaches_the_caller_as_it_is(engine):
    with pytest.raises(UserError, match=r"^two is wrong$"):
        list(engine.map(fails_at_two, range(5)))


def test_tasks_run_in_the_folder_of_the_caller(engine, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert list(engine.map(folder_of, [1])) == [(1, str(tmp_path))]


def test_a_task_that_always_loses_its_process_is_a_sentence(engine):
    with pytest.raises(UserError, match="a shard was lost 6 times with its process or node"):
        list(engine.map(dies, [1]))


def test_a_task_whose_node_is_killed_runs_again_on_another(engine, cluster, second, tmp_path):
    with ThreadPoolExecutor(1) as thread:
        done = thread.submit(lambda: dict(engine.map(functools.partial(stays_on_its_node, tmp_path), range(2))))
        wait_until(lambda: len(list(tmp_path.iterdir())) == 2)
        began = {node: int(process) for _, node, process in (path.name.split("-") for path in tmp_path.iterdir())}
        cluster.remove_node(second, allow_graceful=False)
        wait_until(lambda: not runs(began[second.node_id]))  # a node's processes notice a little later
        (tmp_path / "go on").touch()
        nodes = done.result(PATIENCE_S)
    assert len(began) == 2
    (survivor,) = began.keys() - {second.node_id}
    assert nodes == {0: survivor, 1: survivor}


def test_a_run_loses_one_of_two_nodes_and_has_the_content_of_a_local_one(cluster, second, tmp_path, content):
    recipe, local, root = tmp_path / "ten.toml", tmp_path / "local", tmp_path / "ray"
    recipe.write_text(TINY.replace("step = 90", "step = 10"))
    assert command("run", recipe, "--out", local, "-q") == 0
    words = ["run", recipe, "--out", root, "-q", "--engine", "ray", "--ray-address", cluster.address]
    process = subprocess.Popen([sys.executable, "-m", "pipelines", *map(str, words)], cwd=ROOT)
    wait_until(lambda: len(list((root / "frames").glob("[!.]*"))) >= BEFORE_KILL or process.poll() is not None)
    cluster.remove_node(second, allow_graceful=False)
    assert len(list((root / "frames").glob("[!.]*"))) < SHARDS
    assert process.wait(PATIENCE_S) == 0
    assert content(root) == content(local)
    for name in ("manifest.json", "report.html"):
        assert timeless(root / name) == timeless(local / name)


def test_a_store_is_filled_though_a_node_is_lost(cluster, second, server, tmp_path, content):
    """The URL tells the nodes the access keys."""
    recipe, local, url = tmp_path / "many.toml", tmp_path / "local", f"s3://a:b@bucket/ray/demo?{server}"
    recipe.write_text(TINY.replace("step = 90", "step = 5"))
    assert command("generate", recipe, "--out", local, "-q") == 0
    words = ["generate", recipe, "--out", url, "-q", "--engine", "ray", "--ray-address", cluster.address]
    process = subprocess.Popen([sys.executable, "-m", "pipelines", *map(str, words)], cwd=ROOT)
    root = dataset_folder(url)
    wait_until(lambda: len(list((root / "frames").glob("*"))) >= BEFORE_KILL or process.poll() is not None)
    cluster.remove_node(second, allow_graceful=False)
    assert len(list((root / "frames").glob("*"))) < len(list((local / "frames").glob("*")))
    assert process.wait(2 * PATIENCE_S) == 0
    assert content(root) == content(local)
