"""Datasets to and from an object store, as commands."""

from __future__ import annotations

import typer

from pipelines.commands import options as o


def upload(folder: o.Folder, url: o.Url) -> None:
    """Put a dataset into an object store, file by file; what is there already is left, another dataset refused."""
    from datasets.remote.stores import store_of
    from datasets.remote.transfer import upload as put

    store = store_of(url)
    typer.echo(f"{put(folder, store)} new files in {store.shown}")


def download(url: o.Url, folder: o.Folder) -> None:
    """Fetch a dataset from an object store into a folder; what is there already is left. Then run `verify`."""
    from datasets.remote.stores import store_of
    from datasets.remote.transfer import download as fetch

    store = store_of(url)
    typer.echo(f"{fetch(store, folder)} new files in {folder}; `verify {folder}` compares them with plan and manifest")
