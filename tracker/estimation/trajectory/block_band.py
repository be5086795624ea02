"""Symmetric positive definite matrices of square blocks that are zero beyond some blocks from the diagonal.

Normal equations of a path are such matrices: frames that are farther apart than a difference reaches share no residual.
The factor is Cholesky's by blocks. Blocks of the inverse within the band follow from it without the others (K.
Takahashi, J. Fagan, M.-S. Chin 1973, Proc. 8th PICA Conference: 63).
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs, dtrtrs

from tracker.geometry.arrays import Array


class BlockFactor(NamedTuple):
    """Cholesky factor L of a block-banded matrix L L^T."""

    diagonal: Array
    """Lower triangles of the diagonal blocks, (T, n, n)."""
    below: Array
    """Block d of row t + d and column t at [d - 1, t], (m, T, n, n); zero beyond the last row."""

    def solve(self, right: Array) -> Array:
        """Return the solution for a right side, (T, n)."""
        T, (m, *_), out = len(self.diagonal), self.below.shape, np.array(right)
        for t in range(T):
            for d in range(1, min(m, t) + 1):
                out[t] -= self.below[d - 1, t - d] @ out[t - d]
            out[t] = dtrtrs(self.diagonal[t], out[t], lower=1)[0]
        for t in range(T - 1, -1, -1):
            for d in range(1, min(m, T - 1 - t) + 1):
                out[t] -= self.below[d - 1, t].T @ out[t + d]
            out[t] = dtrtrs(self.diagonal[t], out[t], lower=1, trans=1)[0]
        return out

    def inverse(self) -> Array:
        """Return the blocks of the inverse within the band: that of row t + d, column t at [d, t], (m + 1, T, n, n)."""
        T, n = self.diagonal.shape[:2]
        m = len(self.below)
        out, eye = np.zeros((m + 1, T, n, n)), np.eye(n)
        for t in range(T - 1, -1, -1):
            reach = min(m, T - 1 - t)
            unit = [dtrtrs(self.diagonal[t], self.below[d, t].T, lower=1, trans=1)[0].T for d in range(reach)]
            for i in range(1, reach + 1):
                for d in range(1, reach + 1):
                    low, high = min(i, d), max(i, d)
                    block = out[high - low, t + low]
                    out[i, t] -= (block if i >= d else block.T) @ unit[d - 1]
            own = dpotrs(self.diagonal[t], eye, lower=1)[0]
            for d in range(1, reach + 1):
                own = own - unit[d - 1].T @ out[d, t]
            out[0, t] = (own + own.T) / 2
        return out


def factor(blocks: Array) -> BlockFactor | None:
    """Return the factor of a matrix; None if it is not positive definite.

    Args:
        blocks: block of row t + d and column t at [d, t], (m + 1, T, n, n); those beyond the last row are not read.
    """
    m, T = len(blocks) - 1, blocks.shape[1]
    diagonal, below = np.array(blocks[0]), np.zeros_like(blocks[1:])
    for t in range(T):
        for j in range(1, min(m, t) + 1):
            diagonal[t] -= below[j - 1, t - j] @ below[j - 1, t - j].T
        diagonal[t], info = dpotrf(diagonal[t], lower=1, clean=1)
        if info:
            return None
        for d in range(1, min(m, T - 1 - t) + 1):
            own = np.array(blocks[d, t])
            for j in range(1, min(m - d, t) + 1):
                own -= below[d + j - 1, t - j] @ below[j - 1, t - j].T
            below[d - 1, t] = dtrtrs(diagonal[t], own.T, lower=1)[0].T
    return BlockFactor(diagonal, below)


def product(blocks: Array, vector: Array) -> Array:
    """Return a matrix, with blocks as `factor` reads them, times a vector, (T, n)."""
    out = np.einsum("tij,tj->ti", blocks[0], vector)
    for d in range(1, min(len(blocks), len(vector))):
        own = blocks[d, : len(vector) - d]
        out[d:] += np.einsum("tij,tj->ti", own, vector[:-d])
        out[:-d] += np.einsum("tij,ti->tj", own, vector[d:])
    return out
