"""Working a study off: all of it or one part of it, in this process, in a pool or on a cluster."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass

from forcemap.errors import InputError
from forcemap.sweeps.block import Outcome, compute
from forcemap.sweeps.folder import SweepFolder
from forcemap.sweeps.pool import results


@dataclass(frozen=True)
class Sweep:
    """What a sweep has done.

    Parameters
    ----------
    there : int
        Blocks that were there before.
    computed : int
        Blocks that were computed now.
    failed : dict of str to str
        Blocks that gave nothing, with the reason.
    missing : tuple of str
        Blocks of the whole study that are not there, those of other parts too.
    processor, wall : float
        Time of all processors, and of the clock [s].
    """

    there: int
    computed: int
    failed: dict[str, str]
    missing: tuple[str, ...]
    processor: float
    wall: float


def of_part(count: int, part: str = "") -> range:
    """Indices of part k of n of a job array, written k/n: every n-th from the k-th.

    Raises
    ------
    InputError
        Not of that form, or not 1 <= k <= n.
    """
    if not part:
        return range(count)
    found = re.fullmatch(r"(\d{1,6})/(\d{1,6})", part, re.ASCII)
    k, n = map(int, found.groups()) if found else (0, 0)
    if not 1 <= k <= n:
        raise InputError(f"part: found {part!r}, expected k/n, such as 3/10, k from 1 to n")
    return range(k - 1, count, n)


def missing(folder: SweepFolder) -> tuple[str, ...]:
    """Names of the blocks that are not there."""
    there, study = folder.files(), folder.study
    return tuple(study.block(index).name for index in range(len(study)) if index not in there)


def run(
    folder: SweepFolder, part: str = "", executor: Executor | None = None, progress: Callable[[int], None] | None = None
) -> Sweep:
    """Compute the blocks of a study, or of a part of it, that are not there; the last writes the summary.

    Every part is written by this process, as soon as it is computed: what is there stays there whatever ends.

    Parameters
    ----------
    folder : SweepFolder
    part : str
        k/n of a job array; empty for all.
    executor : Executor, optional
        Where blocks are computed; here if not given.
    progress : callable, optional
        Called with the number of blocks done.

    Raises
    ------
    ForcemapError
        A part cannot be written; pool or cluster are gone.
    """
    begun, study, there = time.perf_counter(), folder.study, folder.files()
    wanted = of_part(len(study), part)
    left = [index for index in wanted if index not in there]
    computed, processor, failed = 0, 0.0, dict[str, str]()
    for done, (block, outcome, lost) in enumerate(results(executor, compute, map(study.block, left)), start=1):
        outcome = outcome or Outcome(reason=lost)
        processor += outcome.processor
        if outcome.text:
            folder.write(block, outcome.text)
            computed += 1
        else:
            failed[block.name] = outcome.reason
        if progress:
            progress(done)
    still = missing(folder)
    if not still:
        folder.write_summary()
    return Sweep(len(wanted) - len(left), computed, failed, still, processor, time.perf_counter() - begun)
