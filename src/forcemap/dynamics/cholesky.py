"""Forward substitution with the Cholesky factor of many small matrices at once."""

from __future__ import annotations

import numpy as np

from forcemap.arrays import FloatArray
from forcemap.errors import InputError

_LEAST_PIVOT = 1e-14  # of the diagonal entry; below it rounding decides the sign


def whiten(matrix: FloatArray, vectors: FloatArray) -> FloatArray:
    """L^-1 V for matrix = L L^T, so that V^T matrix^-1 V is a product of the result with itself.

    The loops run over the few rows; every step works on all matrices, whose axis is therefore the last one.

    Parameters
    ----------
    matrix : array, shape (n, n, batch)
        Symmetric, positive definite.
    vectors : array, shape (n, k, batch)
        Columns V.

    Raises
    ------
    InputError
        A matrix that is not positive definite.
    """
    n = len(matrix)
    factor: list[list[FloatArray]] = []
    rows: list[FloatArray] = []
    for i in range(n):
        row: list[FloatArray] = []
        for j in range(i):
            entry = matrix[i, j].copy()
            for a, b in zip(row, factor[j], strict=False):
                entry -= a * b
            row.append(entry / factor[j][j])
        pivot = matrix[i, i].copy()
        for a in row:
            pivot -= a * a
        if not np.all(pivot > _LEAST_PIVOT * np.abs(matrix[i, i])):
            raise InputError(
                f"mass matrix: joint {i + 1} of {n} moves no inertia of its own, expected a positive definite matrix; "
                "give its link a mass and an inertia, or the joint a drive inertia"
            )
        row.append(np.sqrt(pivot))
        right = vectors[i].copy()
        for a, solved in zip(row, rows, strict=False):
            right -= a * solved
        factor.append(row)
        rows.append(right / row[i])
    return np.stack(rows)
