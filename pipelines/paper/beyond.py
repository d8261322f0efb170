"""What goes beyond the paper, on points alone: one section a question."""

from __future__ import annotations

from pipelines.paper.assumed_lens import assumed_lens
from pipelines.paper.coverage import coverage
from pipelines.paper.efficiency import bound, more_points
from pipelines.paper.field import field
from pipelines.paper.parts import Section
from pipelines.paper.robustness import robustness
from pipelines.paper.uniqueness import uniqueness


def beyond() -> tuple[Section, ...]:
    """All sections; that of rendered pictures takes a dataset: `field_images.field_of_images`."""
    return field(), uniqueness(), coverage(), assumed_lens(), bound(), more_points(), robustness()
