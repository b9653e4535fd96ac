"""Types of arrays; evaluation in blocks that fit the processor's cache; scalar in, float out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcemap.errors import InputError

FloatArray = NDArray[np.float64]

Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]
Objects = NDArray[np.object_]
Texts = NDArray[np.str_]

BLOCK = 65536
"""Elements that are evaluated at once: half a megabyte an array, so that some of them fit in a processor's cache."""

# glibc returns freed memory above a threshold to the system, so that every block pays for fresh pages; freeing one
# large array first raises that threshold (mallopt(3), "dynamic mmap threshold"). Elsewhere this does nothing.
_RAISING = 30 * 2**20 // 8  # elements: 30 MB, below the 32 MB to which the threshold may rise
_MANY_BLOCKS = 4  # blocks of a result for which that pays; a choice


def columns(values: FloatArray) -> FloatArray:
    """Values of shape (n,) or (n, k) as columns, shape (n, 1) or (n, k)."""
    return values.reshape(len(values), -1)


def in_blocks(function: Callable[..., FloatArray], *arguments: ArrayLike) -> Any:
    """Apply an elementwise function of broadcasting arrays block by block.

    Scalars in, a float out; the result does not depend on how the arrays are cut.
    """
    if any(np.ma.is_masked(argument) for argument in arguments):
        raise InputError("found masked entries, expected numbers")
    arrays = [np.asarray(argument, dtype=np.float64) for argument in arguments]
    shape = np.broadcast_shapes(*(array.shape for array in arrays))
    if not shape:
        return float(function(*(array.reshape(1) for array in arrays))[0])
    result = large_result(shape)
    _fill(result, function, [array.reshape((1,) * (len(shape) - array.ndim) + array.shape) for array in arrays])
    return result


def large_result(shape: tuple[int, ...]) -> FloatArray:
    """An array to be filled block by block."""
    result = np.empty(shape)
    if result.size > _MANY_BLOCKS * BLOCK:
        np.empty(_RAISING)
    return result


def _fill(result: FloatArray, function: Callable[..., FloatArray], arrays: list[FloatArray]) -> None:
    if result.size <= BLOCK:
        result[...] = function(*arrays)
        return
    step = max(1, BLOCK * len(result) // result.size)
    for start in range(0, len(result), step):
        part = slice(start, start + step)
        parts = [array if len(array) == 1 else array[part] for array in arrays]
        if len(result[part]) == 1 and result.ndim > 1 and result[part].size > BLOCK:
            _fill(result[start], function, [array[0] for array in parts])
        else:
            result[part] = function(*parts)
