"""Kernels: functions of arrays that numba compiles, where it is installed; the one place that names it."""

from __future__ import annotations

import contextlib
import hashlib
import pickle
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

_TYPES = {"f": "float64", "i": "int64"}
_ARRAYS = {"F": "float64", "I": "int64"}


@cache
def kernel(function: Callable[..., None], arguments: str) -> Callable[..., None] | None:
    """The function compiled, which takes a second where it was not compiled before; None where numpy has to do.

    The function uses nothing but its arguments, numpy and constants of its own file: what is compiled is kept beside
    the source or, where nothing can be written there, in the user's cache folder, until that file changes. Damaged
    files are made again; where nothing can be kept, every process compiles for itself.

    Parameters
    ----------
    function : callable
        A function of arrays that gives nothing back.
    arguments : str
        A word for each argument: "f" or "i" for a float or whole number, "F2" or "I2" for an array of them with two
        axes, contiguous and writeable.

    Returns
    -------
    callable or None
        None if numba is missing, broken or switched off (NUMBA_DISABLE_JIT), or cannot compile the function.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of numba about itself: what it gives is compared with numpy
        try:
            return _compiled(function, arguments)
        except Exception:  # whatever is wrong with it: numpy is the reference, and there
            return None


def in_threads(work: Callable[[range], None], items: range) -> None:
    """Do the work of all items, cut into one share for each of numba's threads (NUMBA_NUM_THREADS).

    Compiled kernels and numpy's functions of large arrays run beside each other; the threads end with this call.
    """
    numba: Any = import_module("numba")
    threads = min(numba.config.NUMBA_NUM_THREADS, len(items))
    shares = [items[len(items) * k // threads : len(items) * (k + 1) // threads] for k in range(threads)]
    if len(shares) < 2:
        work(items)
        return
    with ThreadPoolExecutor(threads - 1) as executor:
        others = [executor.submit(copy_context().run, work, share) for share in shares[1:]]
        work(shares[0])
        for other in others:
            other.result()


def _compiled(function: Callable[..., None], arguments: str) -> Callable[..., None] | None:
    numba: Any = import_module("numba")
    if numba.config.DISABLE_JIT:
        return None
    types = [_type(word) for word in arguments.split()]
    dispatcher = numba.njit(error_model="numpy", nogil=True)(function)
    with contextlib.suppress(Exception):  # no folder to write in, or a numba that keeps things otherwise: none is kept
        dispatcher._cache = _kept(function)
    dispatcher.compile(f"void({', '.join(types)})")
    dispatcher.disable_compile()
    compiled: Callable[..., None] = dispatcher
    return compiled


def _type(word: str) -> str:
    return _TYPES[word] if word in _TYPES else f"Array({_ARRAYS[word[0]]}, {word[1]}, 'C')"


def _kept(function: Callable[..., None]) -> Any:
    """What numba keeps of a function in files; one that is damaged, or not of this source, counts as none."""
    caching: Any = import_module("numba.core.caching")

    class Files(caching.IndexDataCacheFile):  # type: ignore[misc]
        def _digest(self, payload: bytes) -> bytes:
            return hashlib.sha256(repr((self._version, self._source_stamp)).encode() + payload).digest()

        def _dump(self, obj: Any) -> bytes:
            payload: bytes = super()._dump(obj)
            return payload + self._digest(payload)  # what stands behind a pickle is not read with it

        def _load_data(self, name: str) -> Any:
            content = Path(self._data_path(name)).read_bytes()
            payload, digest = content[:-32], content[-32:]
            if digest != self._digest(payload):
                raise OSError(f"{name}: not what was written")
            return pickle.loads(payload)

    class Kept(caching.FunctionCache):  # type: ignore[misc]
        def __init__(self, function: Callable[..., None]) -> None:
            super().__init__(function)
            place = self._impl.locator
            stamp = place.get_source_stamp()
            self._cache_file: Any = Files(place.get_cache_path(), self._impl.filename_base, stamp)

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            try:
                return super().load_overload(sig, target_context)
            except Exception:
                Path(self._cache_file._index_path).unlink(missing_ok=True)
                return None

        def save_overload(self, sig: Any, data: Any) -> None:
            try:
                super().save_overload(sig, data)
            except Exception:  # a full disk, a folder that became read-only: compiled it is
                return

    return Kept(function)
