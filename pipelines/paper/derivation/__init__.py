"""What the paper derives and claims of its method in sections I and II, held against numbers."""

from __future__ import annotations

from pipelines.paper.claims import PaperSection
from pipelines.paper.derivation import advantages, choice, efficiency, ratios

INTRO = "The equations that EPOSIT rests on, and the advantages that the paper derives from them."


def derivation(seeds: int) -> PaperSection:
    """Ratios of table I and equation 6; coordinates, focal length, efficiency, and how PnPfr chooses."""
    parts = [ratios.measure(), *(part.measure(seeds) for part in (choice, advantages, efficiency))]
    items = tuple(item for shown, _ in parts for item in shown)
    claims = tuple(claim for _, told in parts for claim in told)
    return PaperSection("The derivation (I, II)", INTRO, items, claims)
