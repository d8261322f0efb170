"""The pictures of a night. Pinned ones are made once and kept; fresh ones have tonight's seed.

Both are a dataset for each sensor regime. Whoever reads them, the candidate or the baseline's code, works on a folder
of its own that shares the pictures and their truth with the suite.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from datasets.errors import UserError
from datasets.recipe.model import Recipe, load_recipe, parse_recipe
from datasets.recipe.override import with_regime, with_values
from datasets.store.claim import claim
from datasets.store.dataset import RECIPE_FILE, Dataset
from datasets.store.digest import combined_digest, table_digest
from datasets.store.reuse import share_pictures
from pipelines.engines.engine import Engine
from pipelines.stages import run as stages
from pipelines.stages.missing import Execution
from pipelines.stages.settings import RUN_SETTINGS, Setting

PINNED, FRESH, CONFIRMING = "pinned", "fresh", "confirming"
FRESH_POSES = 20  # enough for every metric but the circle's, which the pinned pictures judge
CONFIRMING_SEED = 1_000_000_000  # added to a night's seed
SEED = "fresh seed"  # a night's seed among its data
EXACT = Setting(points="truth")
NOISY = Setting(points="truth+noise", draws=1)
READ = (RUN_SETTINGS[0], Setting(use="four"), EXACT, NOISY)  # what a night estimates
REPLAYED = (EXACT, NOISY)


@dataclass(frozen=True, slots=True)
class Suite:
    """Pictures of one kind in one sensor regime."""

    kind: str
    regime: str
    recipe: Recipe
    text: str

    @property
    def name(self) -> str:
        """Name of its folder, and in tables."""
        return f"{self.kind}-{self.regime}"

    def make(self, folder: Path, engine: Engine, console: Console) -> Dataset:
        """The pictures, rendered or resumed in a folder.

        Raises:
            UserError: the folder holds something else, or cannot be written.
        """
        with claim(folder, self.recipe, self.text) as dataset:
            stages.run_generate(dataset, Execution(engine, console))
        return dataset


def suites(kind: str, recipe: str, regimes: Sequence[str], seed: int | None = None) -> list[Suite]:
    """The suites of a recipe in several regimes. seed: instead of the recipe's; then scattered poses are fewer, too.

    Raises:
        UserError: no such recipe or regime.
    """
    loaded, text = load_recipe(recipe)
    if seed is not None:
        text = with_values(text, {("seed",): seed, **_fewer_poses(loaded)}, recipe)
    found: list[Suite] = []
    for regime in regimes:
        own = with_regime(text, regime, recipe)
        found.append(Suite(kind, regime, parse_recipe(own, f"recipe {recipe} with regime {regime}"), own))
    return found


def seed_of(kind: str, data: Mapping[str, str]) -> int | None:
    """The seed of a kind's pictures in a night with such data; None is the recipe's own."""
    added = {PINNED: None, FRESH: 0, CONFIRMING: CONFIRMING_SEED}[kind]
    return None if added is None else int(data[SEED]) + added


def _fewer_poses(recipe: Recipe) -> dict[tuple[str, ...], int]:
    count = getattr(recipe.trajectory, "count", None)
    return {} if count is None else {("trajectory", "count"): min(count, FRESH_POSES)}


def copy_pictures(pictures: Dataset, folder: Path) -> Path:
    """A new dataset's folder that shares the pictures and their truth of another."""
    with claim(folder, pictures.recipe, (pictures.root / RECIPE_FILE).read_text(encoding="utf-8")) as dataset:
        share_pictures(dataset, pictures)
    return folder


def pictures_digest(dataset: Dataset) -> str:
    """Hash of the decoded content of a dataset's pictures and their truth.

    Raises:
        UserError: it has none, or a shard is damaged.
    """
    paths = [path for table in ("frames", "keypoints") for path in dataset.shards(table)]
    if not paths:
        raise UserError(f"{dataset.root} holds no pictures; delete it, and the next night makes them again")
    return shards_digest(dataset, paths)


def shards_digest(dataset: Dataset, shards: Sequence[Path]) -> str:
    """Hash of the decoded content of some shards."""
    return combined_digest("", ((path.name, table_digest(dataset.read_shard(path))) for path in shards))
