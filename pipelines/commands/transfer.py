"""Datasets to and from an object store, as commands."""

from __future__ import annotations

from pathlib import Path

import typer

from datasets.errors import UserError
from datasets.url_path import dataset_folder
from pipelines.commands import options as o


def upload(folder: o.Folder, url: o.Url) -> None:
    """Put a dataset into an object store, file by file; what is there already is left, another dataset refused."""
    from datasets.remote.transfer import upload as put

    store = _store(url)
    typer.echo(f"{put(folder, store)} new files in {store}")


def download(url: o.Url, folder: o.Folder) -> None:
    """Fetch a dataset from an object store into a folder; what is there already is left. Then run `verify`."""
    from datasets.remote.transfer import download as fetch

    store = _store(url)
    typer.echo(f"{fetch(store, folder)} new files in {folder}; `verify {folder}` compares them with plan and manifest")


def _store(url: str) -> Path:
    if "://" not in url:
        raise UserError(f"{url!r} is no URL; give one such as s3://bucket/demo or file:///data/demo")
    return dataset_folder(url)
