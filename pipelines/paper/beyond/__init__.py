"""What goes beyond the paper, on points alone: one section a question."""

from __future__ import annotations

from pipelines.paper.beyond import assumed_lens, coverage, efficiency, field, robustness, uniqueness
from pipelines.paper.claims import PaperSection


def beyond() -> tuple[PaperSection, ...]:
    """All sections; that of rendered pictures takes a dataset: `field_images.field_of_images`."""
    return (
        field.field(),
        uniqueness.uniqueness(),
        coverage.coverage(),
        assumed_lens.assumed_lens(),
        efficiency.bound(),
        efficiency.more_points(),
        robustness.robustness(),
    )
