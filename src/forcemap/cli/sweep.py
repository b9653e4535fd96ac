"""forcemap sweep."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from forcemap import InputError
from forcemap.answers.sweep import NotComputed, SweepAnswer
from forcemap.cli.check import shortened
from forcemap.cli.options import Json
from forcemap.cli.output import Progress, counted, emit, listing
from forcemap.sweeps.cluster import TlsFiles, cluster
from forcemap.sweeps.folder import SUMMARY_FILE, SweepFolder
from forcemap.sweeps.pool import pool
from forcemap.sweeps.run import Sweep, missing, of_part, run
from forcemap.sweeps.study import Study, read_study


def sweep(
    study: Annotated[str, Argument(help="What to go through (TOML).")],
    folder: Annotated[str, Option("-o", "--folder", help="Folder of the parts: new, or to be continued.")],
    workers: Annotated[int, Option("--workers", help="Processes on this machine; 1: this one.")] = 1,
    part: Annotated[str, Option("--part", help="k/N: every N-th block from the k-th, for a job array.")] = "",
    dask: Annotated[
        str | None, Option("--dask", help="Dask scheduler: tls://HOST:PORT, or tcp://127.0.0.1:PORT on this machine.")
    ] = None,
    authority: Annotated[str, Option("--tls-ca", help="With tls://: certificate of the authority (PEM).")] = "",
    certificate: Annotated[str, Option("--tls-cert", help="With tls://: own certificate (PEM).")] = "",
    key: Annotated[str, Option("--tls-key", help="With tls://: own key (PEM).")] = "",
    list_missing: Annotated[
        bool, Option("--missing", help="Compute nothing: name the blocks that are missing.")
    ] = False,
    as_json: Json = False,
) -> int:
    """Compute what of a study is not there yet: simulated impacts, placements of a table, validity of plans and bounds.

    Stopped at any moment it goes on where it was. Exit code: 0 everything asked for is there, 1 something is missing.

    Example: forcemap sweep study.toml -o sweep --workers 2
    """
    tls = TlsFiles(authority, certificate, key)
    if dask is None and tls != TlsFiles():
        raise InputError("sweep: TLS files go with --dask tls://HOST:PORT")
    if dask is not None and workers != 1:
        raise InputError("sweep: expected --workers or --dask; the workers of a cluster are its own")
    stated = read_study(study)
    wanted = of_part(len(stated), part)
    parts = SweepFolder.of(folder, stated)
    if list_missing:
        done = Sweep(len(parts.files()), 0, {}, missing(parts), 0.0, 0.0)
    else:
        with _executor(workers, dask, tls) as executor, Progress(f"blocks of {stated.name}", len(wanted)) as progress:
            done = run(parts, part, executor, progress.show)
    answer = _answer(stated, folder, done)
    emit(answer, _lines(answer, named=list_missing), as_json=as_json)
    return 1 if done.failed or (list_missing and done.missing) else 0


@contextmanager
def _executor(workers: int, dask: str | None, tls: TlsFiles) -> Iterator[Executor | None]:
    if dask is not None:
        with cluster(dask, tls) as executor:
            yield executor
    elif workers != 1:
        with pool(workers, preload=["forcemap.sweeps.study"]) as executor:
            yield executor
    else:
        yield None


def _answer(study: Study, folder: str, done: Sweep) -> SweepAnswer:
    tried = done.computed + len(done.failed)
    each = done.processor / tried if tried else None
    return SweepAnswer(
        study=study.name,
        kind=study.kind,
        study_sha256=study.sha256,
        folder=folder,
        blocks=len(study),
        there_before=done.there,
        computed=done.computed,
        failed=[NotComputed(block=block, reason=reason) for block, reason in done.failed.items()],
        left=len(done.missing),
        missing=list(done.missing),
        processor_s=done.processor,
        wall_s=done.wall,
        processor_s_per_block=each,
        left_processor_s=None if each is None else each * len(done.missing),
        summary=None if done.missing else str(Path(folder, SUMMARY_FILE)),
    )


def _lines(answer: SweepAnswer, *, named: bool) -> list[str]:
    failed = [f"{each.block}: {each.reason}" for each in answer.failed]
    lines = [
        f"{answer.study}: {answer.computed} of {counted(answer.blocks, 'block')} computed, {answer.there_before} were "
        f"there, {answer.left} left",
        *(listing("NOTHING from these blocks", shortened(failed)) if failed else []),
    ]
    if answer.processor_s_per_block is not None:
        ahead = f", about {answer.left_processor_s:.0f} s for what is left" if answer.left else ""
        lines.append(
            f"Cost: {answer.processor_s:.1f} s of processor time in {answer.wall_s:.1f} s, "
            f"{answer.processor_s_per_block:.3f} s a block{ahead}"
        )
    lines += listing("Missing", shortened(answer.missing)) if named and answer.left else []
    lines.append(f"Summary: {answer.summary}" if answer.summary else "The same again goes on with what is left")
    return lines
