"""Compiled solution of a small symmetric system, as every step of Levenberg and Marquardt needs one."""

from __future__ import annotations

import math

from eposit.arrays import Array
from pipelines.detection.kernels import compiled_part, inlined

TINY = 1e-300  # added to the diagonal, so that a parameter without any information is no division by zero


@inlined
def _factorise(normal: Array, damping: float, lower: Array) -> bool:
    """Cholesky factor of N + damping diag N in `lower`; False where that is not positive definite."""
    for i in range(len(normal)):
        for j in range(i + 1):
            rest = normal[i, j]
            if i == j:
                rest += damping * normal[i, i] + TINY
            for k in range(j):
                rest -= lower[i, k] * lower[j, k]
            if i != j:
                lower[i, j] = rest / lower[j, j]
            elif rest > 0.0:
                lower[i, i] = math.sqrt(rest)
            else:
                return False
    return True


@compiled_part
def solve_damped(normal: Array, right: Array, damping: float, lower: Array, out: Array) -> bool:
    """Solution of (N + damping diag N) x = b in `out` (n,); False where N is not positive definite.

    normal: (n, n), its lower triangle. lower: (n, n) workspace, which holds the Cholesky factor afterwards.
    """
    if not _factorise(normal, damping, lower):
        return False
    n = len(right)
    for i in range(n):
        rest = right[i]
        for k in range(i):
            rest -= lower[i, k] * out[k]
        out[i] = rest / lower[i, i]
    for i in range(n - 1, -1, -1):
        rest = out[i]
        for k in range(i + 1, n):
            rest -= lower[k, i] * out[k]
        out[i] = rest / lower[i, i]
    return True
