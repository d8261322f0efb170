"""The dataset's card, README.md: what it is, and for Hugging Face's `datasets` which files belong to which table."""

from __future__ import annotations

from collections.abc import Sequence

from datasets.recipe.model import Recipe
from datasets.schema import dictionary
from datasets.store.kept_masters import Kept

DEFAULT_TABLE = "frames"  # of `load_dataset(folder)`
CONVENTIONS = (
    "Camera axes x right, y down, z forward; pixel centres at integers; lengths in mm; cam_from_obj carries object "
    "points into the camera frame. Failed rows keep their place with a status and nulls."
)

NOTES = {
    Kept.NOT: "Linear images were not kept: `master` names files that are not there.",
    Kept.ARCHIVES: "Linear images are packed: the last part of `master` is the name in its shard's ZIP archive, "
    "masters/FIRST-LAST.zip, which is named by its first and last frame.",
}


def card(recipe: Recipe, frames: int, tables: Sequence[str], kept: Kept) -> str:
    """The card as Markdown behind YAML.

    tables: those that have shards, as a configuration without files is an error for who loads any of them.
    kept: how linear images are.
    """
    note = f" {NOTES[kept]}" if kept in NOTES else ""
    return (
        f"{_configurations(tables)}# {recipe.name}\n\n{recipe.description}\n\n{frames} frames. {CONVENTIONS}{note}\n\n"
        f"## Tables\n\n{dictionary()}"
    )


def _configurations(tables: Sequence[str]) -> str:
    lines = ["---", "configs:"] if tables else []
    for name in tables:
        lines += [f"- config_name: {name}", f"  data_files: {name}/*.parquet"]
        lines += ["  default: true"] if name == DEFAULT_TABLE else []
    return "\n".join([*lines, "---", "", ""]) if tables else ""
