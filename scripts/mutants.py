"""Do the tests notice an error? A seeded sample of mutants of the source, each held against the tests that run it.

    make mutants                                    # 300 drawn ones and those that the project names
    .venv/bin/python scripts/mutants.py --seed 7 --count 100 --room speeds

What is mutated: scripts/mutations.py. Named mutants, tests left out and reasons of survivors: scripts/mutants.toml.
A mutant is killed when a test fails or does not end. Exit code 1 below 90 % or if a named one survives.
"""

from __future__ import annotations

import argparse
import ast
import dataclasses
import functools
import importlib
import json
import multiprocessing
import os
import re
import shutil
import sys
import time
import tomllib
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from covering_tests import Recorder, Tests, digest, functions_of, in_a_child, measured, run_tests
from mutations import ROOMS, Mutant, drawn, named

ROOT = Path(__file__).parents[1]
HOME = ROOT / "build" / "mutants"
TABLE = tomllib.loads((ROOT / "scripts" / "mutants.toml").read_text())
WANTED = 0.9
FIRST, WHOLE = 3.0, 60.0  # [s] of tests tried at first, and at most, the quickest first
IMPORT, NO_END = "its import", "no end"  # what kills, beside tests
HEAVY = ("numpy", "scipy.stats", "scipy.optimize", "scipy.interpolate", "scipy.signal", "matplotlib.figure", "pandas")


@dataclass(frozen=True)
class Result:
    """What became of a mutant."""

    mutant: Mutant
    killed_by: str  # empty: it survived
    seconds: float


def copy_of_the_project(number: int) -> Path:
    """A copy of its own for each worker, with the bytecode of an earlier one."""
    copy = HOME / str(number)
    for name in ("src", "tests", "docs", "examples", "scripts", "benchmarks"):
        kept = shutil.ignore_patterns("__pycache__", "site")
        shutil.rmtree(copy / name, ignore_errors=True)
        shutil.copytree(ROOT / name, copy / name, ignore=kept)
    for path in ROOT.iterdir():
        if path.is_file():
            shutil.copy2(path, copy / path.name)
    return copy


def worker_number() -> int:
    """Workers count from 1."""
    return multiprocessing.current_process()._identity[0]


def measure(file: str, keep: bool = False) -> Tests:
    """What the tests of a file run: measured, unless that is known for this file and these sources."""
    copy = HOME / str(worker_number())
    known = HOME / "covering" / f"{Path(file).stem}-{digest([copy / file])}-{digest((copy / 'src').rglob('*.py'))}.json"
    older = known.parent.glob(f"{known.stem.rpartition('-')[0]}-*.json") if keep else ()
    if not known.exists() and not (known := max(older, key=os.path.getmtime, default=known)).exists():
        measured(copy, file, known)
    found = json.loads(known.read_text())
    for test in found["failed"]:
        print(f"{test} fails before anything is mutated, and is left out", flush=True)
    passed: Tests = found["passed"]
    return passed


def covering(mutant: Mutant, tests: Tests) -> list[str]:
    """The tests that run the mutated function, or those that use what is mutated.

    First the quick ones that run little outside its room; behind them those whose fixtures run it. If there are none,
    those that run anything of the file.
    """
    path = ROOT / mutant.path
    spans = functions_of(path, mutant.path)
    inside = [name for first, last, name in spans if first <= mutant.line <= last]
    wanted = set(inside[-1:] or _users(path, mutant.line) or (name for *_, name in spans))
    room = str(Path(mutant.path).parent)
    found: list[tuple[int, float, str]] = []
    for test, (taken, runs, shared) in tests.items():
        share = sum(each.startswith(room) for each in runs) / max(1, len(runs))
        cost = (taken + 0.05) / max(share, 0.01) ** 2
        if wanted & {*runs, *shared}:
            found.append((0 if wanted & set(runs) else 1, cost, test))
        elif any(each.startswith(mutant.path) for each in runs):
            found.append((2, cost, test))
    near = sorted(each for each in found if each[0] < 2) or sorted(found)
    quick = [] if inside else [test for test in tests if test.startswith(tuple(TABLE["at_import"]))]
    return [*quick, *(test for *_, test in near)]


@functools.cache
def _users(path: Path, line: int) -> frozenset[str]:
    """Functions in which a name stands that the statement at a line of the module's level binds."""
    source = path.read_text()
    bound = {
        name.id if isinstance(name, ast.Name) else getattr(name, "name", "")
        for statement in ast.parse(source).body
        if statement.lineno <= line <= (statement.end_lineno or line)
        for name in (ast.walk(statement) if isinstance(statement, ast.Assign | ast.AnnAssign) else [statement])
        if isinstance(name, ast.ClassDef) or (isinstance(name, ast.Name) and isinstance(name.ctx, ast.Store))
    }
    found = set()
    for each in (ROOT / "src").rglob("*.py"):
        lines = each.read_text().splitlines()
        for first, last, function in functions_of(each, str(each.relative_to(ROOT))):
            if bound & set(re.findall(r"\w+", "\n".join(lines[first:last]))):
                found.add(function)
    return frozenset(found)


def try_one(job: tuple[int, Mutant, list[tuple[float, str]]]) -> Result:
    """Put a mutant in a worker's copy and run tests on it until one fails."""
    number, mutant, tests = job
    copy = HOME / str(worker_number())
    target, failed = copy / mutant.path, copy.parent / f"{copy.name}-failed"
    original, begun, killed_by, total = target.read_text(), time.monotonic(), "", 0.0
    stages: list[list[str]] = [[], []]
    for taken, test in tests:
        total += taken
        stages[total > FIRST].append(test)
        if total > WHOLE:
            break
    try:
        target.write_text(mutant.text)
        os.utime(target, (number + 1, number + 1))  # no bytecode of another mutant passes for this one's
        for stage, limit in zip(stages, (60 + 5 * FIRST, 120 + 5 * WHOLE), strict=True):
            if stage and not killed_by:
                failed.write_text("")
                recorder = Recorder(None)

                def work(stage: list[str] = stage, recorder: Recorder = recorder) -> None:
                    sys.path.insert(0, str(copy / "src"))
                    try:
                        importlib.import_module(".".join(Path(mutant.path).with_suffix("").parts[1:]))
                    except Exception:
                        recorder.failed.append(IMPORT)
                    else:
                        run_tests(copy, stage, recorder)
                    failed.write_text("".join(recorder.failed[:1]))

                done = in_a_child(work, HOME / f"{copy.name}.log", limit)
                killed_by = failed.read_text() if done else NO_END
    finally:
        target.write_text(original)
    return Result(mutant, killed_by, time.monotonic() - begun)


def fails_unmutated(tests: list[str]) -> list[str]:
    """Those of some tests that fail on the source as it is, and so killed nothing."""
    copy = HOME / str(worker_number())
    failed = copy.parent / f"{copy.name}-failed"
    failed.write_text("\n".join(tests))

    def work() -> None:
        recorder = Recorder(None)
        run_tests(copy, tests, recorder, "--maxfail=1000000")
        failed.write_text("\n".join(recorder.failed))

    in_a_child(work, HOME / f"{copy.name}.log", 3600)
    return failed.read_text().splitlines()


def reason(mutant: Mutant) -> str:
    """Why a survivor may live, as the table says; empty if it does not."""
    before, after = mutant.difference(ROOT)
    for entry in TABLE.get("survivor", []):
        if entry["file"] == mutant.path and entry["old"] in before and entry["new"] in after:
            return str(entry["why"])
    return ""


def main() -> int:
    """Draw, try, tell."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--room", choices=ROOMS, action="append")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--keep", action="store_true", help="use what was measured on older sources")
    given = parser.parse_args()
    for name in HEAVY:
        importlib.import_module(name)
    (HOME / "covering").mkdir(parents=True, exist_ok=True)
    for number in range(1, given.workers + 1):
        copy_of_the_project(number)
    mutants = named(ROOT, TABLE["named"]) + drawn(ROOT, tuple(given.room or ROOMS), given.seed, given.count)
    files = [str(path.relative_to(ROOT)) for path in sorted((ROOT / "tests").glob("test_*.py"))]
    files = [file for file in files if Path(file).stem not in TABLE["left_out"]]
    with ProcessPoolExecutor(given.workers, multiprocessing.get_context("fork")) as pool:
        tests = {
            test: each
            for found in pool.map(functools.partial(measure, keep=given.keep), files)
            for test, each in found.items()
        }
        print(f"{len(tests)} tests of {len(files)} files measured, {len(mutants)} mutants", flush=True)
        jobs = [(i, each, [(tests[test][0], test) for test in covering(each, tests)]) for i, each in enumerate(mutants)]
        results = []
        for result in pool.map(try_one, jobs):
            results.append(result)
            before, after = result.mutant.difference(ROOT)
            fate = f"killed by {result.killed_by}" if result.killed_by else f"SURVIVED\n    {before}\n    {after}"
            print(f"{result.mutant.path}:{result.mutant.line} {result.seconds:.1f} s {fate}", flush=True)
        killers = sorted({each.killed_by for each in results if "::" in each.killed_by})
        halves = [killers[i :: given.workers] for i in range(given.workers)]
        broken = {test for found in pool.map(fails_unmutated, filter(None, halves)) for test in found}
    results = [dataclasses.replace(each, killed_by="") if each.killed_by in broken else each for each in results]
    return told(results, given.seed)


def told(results: list[Result], seed: int) -> int:
    """Print and keep the survivors as a table with their reasons; the exit code."""
    alive = [each for each in results if not each.killed_by]
    sample = [each for each in results if not each.mutant.named]
    killed = sum(bool(each.killed_by) for each in sample)
    lines = [f"Seed {seed}: {killed} of {len(sample)} killed ({killed / max(1, len(sample)):.1%}).", ""]
    lines += ["| survivor | as it is | as it was mutated | why it may |", "|---|---|---|---|"]
    for each in sorted(alive, key=lambda each: (each.mutant.path, each.mutant.line)):
        before, after = (text.replace("|", "\\|") for text in each.mutant.difference(ROOT))
        place = each.mutant.path.removeprefix("src/forcemap/")
        lines.append(f"| {place}:{each.mutant.line} | `{before}` | `{after}` | {reason(each.mutant) or '?'} |")
    (HOME / "survivors.md").write_text("\n".join([*lines, ""]))
    print("\n".join(lines))
    lost = [each.mutant.named for each in alive if each.mutant.named]
    print("".join(f"survived, though named: {name}\n" for name in lost), end="")
    return int(killed < WANTED * len(sample) or bool(lost))


if __name__ == "__main__":
    sys.exit(main())
