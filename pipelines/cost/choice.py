"""Which figures a forecast is made from: those measured here for such frames, else another machine's."""

from __future__ import annotations

from datasets.recipe.model import Recipe
from datasets.store.kept_masters import Kept
from pipelines.cost.figures import read_figures
from pipelines.cost.forecast import Forecast, forecast
from pipelines.cost.reference import reference_figures


def forecast_of(recipe: Recipe, *, frames: int, workers: int, kept: Kept) -> Forecast:
    """What `run` takes for `frames` frames like the recipe's. kept: how linear images are."""
    figures = read_figures(recipe) or reference_figures(recipe)
    return forecast(recipe, figures, frames=frames, workers=workers, kept=kept)
