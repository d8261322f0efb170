"""What a user's function may take: time for one image, and memory of its process."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from datasets.errors import UserError

LIMIT_S, MOST_LIMIT_S = 300.0, 86_400.0  # for one image: what is taken without `--timeout`, and its largest value
MEMORY_MB = 1500  # without `--memory-mb`: with what the process has at its start, below 2 GiB
LEAST_MEMORY_MB, MOST_MEMORY_MB = 100, 10_000_000
MB = 10**6
SPARE = 32 * MB  # bytes beyond the limit, for telling that it was reached


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of a user's function.

    Raises:
        UserError: a number that is not usable.
    """

    seconds: float = LIMIT_S  # for one image
    memory_mb: int = MEMORY_MB  # 1e6 bytes, of its process, beyond what that has at its start

    def __post_init__(self) -> None:
        if not 0.0 < self.seconds <= MOST_LIMIT_S:
            raise UserError(f"--timeout {self.seconds:g}: give seconds above 0 and at most {MOST_LIMIT_S:g}, as 60")
        if not LEAST_MEMORY_MB <= self.memory_mb <= MOST_MEMORY_MB:
            raise UserError(
                f"--memory-mb {self.memory_mb}: give MB from {LEAST_MEMORY_MB} to {MOST_MEMORY_MB}, as {MEMORY_MB}"
            )


DEFAULT = Limits()


def limit_memory(limits: Limits) -> None:
    """From now on what this process, or one that it starts, asks for beyond the limit is a MemoryError, on Linux.

    Counted is what it may write to and shares with no other (RLIMIT_DATA): libraries and files that are mapped for
    reading are not, nor are addresses that are reserved only, which the address space as a whole (RLIMIT_AS) holds.
    """
    if sys.platform != "linux":
        return
    import resource

    lines = Path("/proc/self/status").read_text().splitlines()
    now = next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmData:"))
    limit, allowed = now + limits.memory_mb * MB, resource.getrlimit(resource.RLIMIT_DATA)[1]
    hard = limit + SPARE if allowed == resource.RLIM_INFINITY else min(limit + SPARE, allowed)
    resource.setrlimit(resource.RLIMIT_DATA, (min(limit, hard), hard))


def lift_memory_limit() -> None:
    """Allow what `limit_memory` has spared."""
    if sys.platform == "linux":
        import resource

        hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
        resource.setrlimit(resource.RLIMIT_DATA, (hard, hard))
