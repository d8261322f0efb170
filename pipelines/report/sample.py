"""Values of which only so many are kept, for medians of more than memory should hold."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from eposit.arrays import Array

MOST = 200_000  # values: the median of half as many is known to 0.4 % of the values' scatter


@dataclass(slots=True)
class Sample:
    """All values up to `MOST`; of more, every second, fourth, ... in the order in which they come."""

    step: int = 1
    seen: int = 0
    parts: list[Array] = field(default_factory=list)

    def add(self, values: Array) -> None:
        """values: (n,)"""
        first = -self.seen % self.step
        self.parts.append(values[first :: self.step])
        self.seen += len(values)
        while sum(map(len, self.parts)) > MOST:
            self.parts = [np.concatenate(self.parts)[::2]]
            self.step *= 2

    def median(self) -> float:
        """Of the values that are kept; NaN without any."""
        values = np.concatenate(self.parts) if self.parts else np.empty(0)
        return float(np.median(values)) if len(values) else np.nan
