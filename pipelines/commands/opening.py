"""What a command works on: a recipe, a new or resumed dataset, a finished one."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipelines.endings import UnfinishedError, own_command

if TYPE_CHECKING:
    from datasets.recipe.model import Recipe
    from datasets.store.dataset import Dataset
    from datasets.store.kept_masters import Kept
    from pipelines.stages.missing import Execution


def load(recipe: str, regime: str | None) -> tuple[Recipe, str]:
    """A recipe and its text, with another regime if one is given.

    Raises:
        UserError: no such recipe or regime, or a wrong one.
    """
    from datasets.recipe.model import load_recipe, parse_recipe
    from datasets.recipe.override import with_regime

    loaded, text = load_recipe(recipe)
    if regime is None:
        return loaded, text
    text = with_regime(text, regime, recipe)
    return parse_recipe(text, f"recipe {recipe} with --regime {regime}"), text


def kept_by(no_masters: bool, pack_masters: bool) -> Kept:
    """How options say that linear images are kept.

    Raises:
        UserError: they exclude each other.
    """
    from datasets.errors import UserError
    from datasets.store.kept_masters import Kept

    if no_masters and pack_masters:
        raise UserError("--no-masters and --pack-masters exclude each other; leave out one of them")
    if pack_masters:
        return Kept.ARCHIVES
    return Kept.NOT if no_masters else Kept.FILES


@contextmanager
def begin(
    loaded: tuple[Recipe, str], out: Path, reuse: Path | None, execution: Execution, kept: Kept
) -> Iterator[Dataset]:
    """The dataset of a recipe, begun or resumed in `out`, with linear light from `reuse` where it fits.

    Nobody else writes it while the body runs, but others that share it, with the same recipe. loaded: the recipe and
    its text. kept: as for `claim`.

    Raises:
        UserError: a folder or plan that is not usable, or another process writes the folder.
    """
    from datasets.plan import plan
    from datasets.store.claim import claim
    from datasets.store.kept_masters import OPTIONS, Kept, kept_of
    from datasets.store.reuse import reuse_linear_images, source_of
    from pipelines.machine import provenance

    recipe, text = loaded
    console, shared = execution.console, not execution.part.is_whole
    plan(recipe)
    if reuse is not None:
        source_of(reuse)  # before anything is written
    with claim(out, recipe, text, shared=shared, provenance=provenance(), kept=kept) as dataset:
        begun = kept_of(out)
        if kept is Kept.FILES and begun in OPTIONS:
            told = f"linear images are {begun.value}, as this dataset was begun with {OPTIONS[begun]}"
            console.print(told, soft_wrap=True)
        if reuse is not None:
            taken, lacking = reuse_linear_images(dataset, reuse)
            console.print(f"linear images: {taken} of {lacking} taken from {reuse}; the rest is rendered")
        yield dataset


@contextmanager
def writing(folder: Path, *, shared: bool = False) -> Iterator[Dataset]:
    """The dataset in a folder; nobody else writes it while the body runs, but others that share it.

    Raises:
        UserError: there is none, or another process writes it.
    """
    from datasets.store.dataset import open_dataset
    from datasets.store.lock import hold
    from pipelines.machine import provenance

    dataset = open_dataset(folder, provenance())
    _tell_unchecked(folder)
    with hold(folder, shared=shared):
        yield dataset


def finish(execution: Execution) -> None:
    """Refuse to end well where some shards could not be made.

    Raises:
        UnfinishedError: with the first reason and what to do.
    """
    if not execution.failures:
        return
    first, count = execution.failures[0], len(execution.failures)
    more = f", and {count - 1} more" if count > 1 else ""
    raise UnfinishedError(
        f"{count} {'shard' if count == 1 else 'shards'} could not be made, each tried twice ({first.reason}{more}; "
        f"{first.note}); everything else is done, and this tries them again: {own_command()}"
    )


def complete_manifest(dataset: Dataset) -> None:
    """List in the manifest what parts of a run have made; nothing while another process goes on making more.

    Raises:
        UserError: a shard is damaged, or the folder cannot be written.
    """
    from datasets.store.lock import HeldError, hold
    from pipelines.machine import provenance

    with ExitStack() as stack:
        try:
            stack.enter_context(hold(dataset.root))
        except HeldError as error:
            print(f"the manifest stays as it is, as {error}", file=sys.stderr)
            return
        replace(dataset, provenance=provenance()).write_manifest()


def opened(folder: Path) -> Dataset:
    """The dataset in a folder.

    Raises:
        UserError: there is none.
    """
    from datasets.store.dataset import open_dataset

    dataset = open_dataset(folder)
    _tell_unchecked(folder)
    return dataset


def _tell_unchecked(folder: Path) -> None:
    """Say that a dataset has no digests by which what is read could be checked."""
    from datasets.store.versions import without_digests

    if without_digests(folder):
        told = f"{folder} was begun by an earlier version, which wrote no digests: what is read of it is not checked"
        print(f"{told}; `verify {folder}` checks it as a whole", file=sys.stderr)
