"""A picture that was made again, as a file and a sentence."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from pipelines.stages.one_frame import Remade


def show(found: Remade, out: Path, what: str) -> None:
    """Write a PNG and tell what was found in it. what: the frame, in words.

    Raises:
        UserError: the disk refuses.
    """
    from datasets.store.images import encode_png
    from datasets.store.refusals import refused

    try:
        out.write_bytes(encode_png(found.image))
    except OSError as error:
        raise refused(out, error) from error
    typer.echo(f"{out}: {what}, camera {found.camera}\n{found.told}")
