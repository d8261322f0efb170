"""An S3 server on this machine, for the tests that need one."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from pyarrow.fs import S3FileSystem

MOTO = Path(__file__).resolve().parents[1] / "build" / "moto"  # where `make test-full` installs the server
PATIENCE_S = 60.0


@pytest.fixture(scope="session")
def server():
    """Options of a URL that lead to an S3 server on this machine."""
    if not MOTO.is_dir():
        pytest.skip("`make test-full` installs the server")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    running = subprocess.Popen(
        command, env=os.environ | {"PYTHONPATH": str(MOTO)}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        _wait_for(port, running)
        files = S3FileSystem(
            access_key="a", secret_key="b", endpoint_override=f"127.0.0.1:{port}", scheme="http", region="us-east-1",
            allow_bucket_creation=True,
        )  # fmt: skip
        files.create_dir("bucket")
        yield f"endpoint_override=127.0.0.1%3A{port}&scheme=http&region=us-east-1"
    finally:
        running.kill()
        running.wait()


def _wait_for(port, running):
    deadline = time.monotonic() + PATIENCE_S
    while running.poll() is None and time.monotonic() < deadline:
        with socket.socket() as trial:
            if trial.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    raise AssertionError("the S3 server does not start")
