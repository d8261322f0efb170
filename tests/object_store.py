"""Servers of objects on this machine, for the tests: S3's and Google's kind, one that refuses, one that is silent."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from pyarrow.fs import S3FileSystem

BUILD = Path(__file__).resolve().parents[1] / "build"  # where `make test-full` installs the servers
MOTO, GOOGLE = BUILD / "moto", BUILD / "gcs"
PATIENCE_S = 60.0


@pytest.fixture(scope="session")
def server():
    """Options of a URL that lead to an S3 server on this machine."""
    with _served(MOTO, "moto.server", "-H", "127.0.0.1", "-p") as port:
        files = S3FileSystem(
            access_key="a", secret_key="b", endpoint_override=f"127.0.0.1:{port}", scheme="http", region="us-east-1",
            allow_bucket_creation=True,
        )  # fmt: skip
        files.create_dir("bucket")
        yield f"endpoint_override=127.0.0.1%3A{port}&scheme=http&region=us-east-1"


@pytest.fixture(scope="session")
def google_server():
    """Options of a URL that lead to a server of Google's kind on this machine, with one bucket, `bucket`."""
    words = ("start", "--host", "127.0.0.1", "--quiet", "--in-memory", "--default-bucket", "bucket", "--port")
    with _served(GOOGLE, "gcp_storage_emulator", *words) as port:
        yield f"endpoint_override=127.0.0.1%3A{port}&scheme=http"


@pytest.fixture
def refusing_server():
    """The address of a server that refuses everything, as one that does not know the access keys."""
    made = ThreadingHTTPServer(("127.0.0.1", 0), _Refuse)
    thread = threading.Thread(target=made.serve_forever, daemon=True)
    thread.start()
    yield f"127.0.0.1:{made.server_port}"
    made.shutdown()
    thread.join()
    made.server_close()


@pytest.fixture
def silent_server():
    """The address of a server that takes connections and never answers."""
    with socket.create_server(("127.0.0.1", 0), backlog=100) as made:
        yield f"127.0.0.1:{made.getsockname()[1]}"


class _Refuse(BaseHTTPRequestHandler):
    def do_GET(self):
        body = b"<Error><Code>InvalidAccessKeyId</Code><Message>The key does not exist.</Message></Error>"
        self.send_response(403)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    do_HEAD = do_PUT = do_POST = do_DELETE = do_GET

    def log_message(self, *_):
        pass


@contextmanager
def _served(place, *words):
    """The port of a server that runs in the body: a module that `make test-full` has put into a folder."""
    if not place.is_dir():
        pytest.skip("`make test-full` installs the server")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    running = subprocess.Popen(
        [sys.executable, "-m", *words, str(port)],
        env=os.environ | {"PYTHONPATH": str(place)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        _wait_for(port, running)
        yield port
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
    raise AssertionError("the server does not start")
