"""Which tests run which function of the source, and how long each takes: measured once, kept in build/mutants."""

from __future__ import annotations

import ast
import contextlib
import hashlib
import json
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import coverage
import pytest

Tests = dict[str, tuple[float, list[str], list[str]]]  # a test: seconds, functions that it runs, that fixtures run
_FIXTURES = "fixtures"
_QUIET = ("-q", "-x", "-p", "no:cacheprovider", "--hypothesis-profile=mutants", "-W", "ignore::pytest.PytestWarning")


def functions_of(path: Path, name: str) -> list[tuple[int, int, str]]:
    """First and last line of each function of a file, and its name below that of the file; innermost last."""
    found = []

    def walk(node: ast.AST, above: str) -> None:
        for child in ast.iter_child_nodes(node):
            below = above
            if isinstance(child, ast.FunctionDef | ast.ClassDef):
                below = f"{above}.{child.name}"
                if isinstance(child, ast.FunctionDef):
                    found.append((child.lineno, child.end_lineno or child.lineno, below))
            walk(child, below)

    walk(ast.parse(path.read_text()), name)
    return sorted(found, key=lambda each: (each[0], -each[1]))


class Recorder:
    """A plugin: the lines that each test runs, its time, what failed first."""

    def __init__(self, measure: coverage.Coverage | None) -> None:
        self.measure = measure
        self.seconds: dict[str, float] = {}
        self.failed: list[str] = []

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self) -> None:
        """Lines from here on are those of fixtures, which all tests of the file may share."""
        if self.measure is not None:
            self.measure.switch_context(_FIXTURES)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_call(self, item: pytest.Item) -> None:
        """Lines from here on are this test's."""
        if self.measure is not None:
            self.measure.switch_context(item.nodeid)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """A file of tests that cannot be imported."""
        if report.failed:
            self.failed.append(report.nodeid)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """What a test took, its fixtures too."""
        test = report.nodeid
        self.seconds[test] = self.seconds.get(test, 0.0) + report.duration
        if report.failed:
            self.failed.append(test)


def in_a_child(work: Callable[[], Any], log: Path, limit: float) -> bool:
    """Whether a forked process did the work in time; it and all that it started are ended then."""
    child = os.fork()
    if child == 0:
        os.setsid()
        with log.open("w") as out:
            os.dup2(out.fileno(), 1)
            os.dup2(out.fileno(), 2)
            try:
                work()
            except Exception:
                traceback.print_exc()
            finally:
                os._exit(0)
    end = time.monotonic() + limit
    while (done := os.waitpid(child, os.WNOHANG)[0] == child) is False and time.monotonic() < end:
        time.sleep(0.02)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    if not done:
        os.waitpid(child, 0)
    return done


def run_tests(copy: Path, tests: Iterable[str], recorder: Recorder, *options: str) -> None:
    """Run tests of a copy of the project in this process, which imported nothing of it yet."""
    from hypothesis import HealthCheck, Phase, settings

    quick = {"deadline": None, "derandomize": True, "database": None, "phases": (Phase.explicit, Phase.generate)}
    settings.register_profile("mutants", suppress_health_check=list(HealthCheck), **quick)  # type: ignore[arg-type]
    os.chdir(copy)
    os.environ["PYTHONPATH"] = str(copy / "src")
    sys.path[:0] = [str(copy / "src")]
    temporary = f"--basetemp={copy.parent / (copy.name + '-tmp')}"
    pytest.main([*_QUIET, temporary, *options, *tests], plugins=[recorder])


def measured(copy: Path, file: str, keep: Path) -> None:
    """Write down what each test of a file runs; a test that fails before anything is mutated is none to rely on."""

    def work() -> None:
        measure = coverage.Coverage(data_file=None, source=[str(copy / "src")], config_file=False)
        recorder = Recorder(measure)
        measure.start()
        run_tests(copy, [file], recorder, "--maxfail=1000000")
        measure.stop()
        data = measure.get_data()
        lines: dict[str, set[str]] = {}
        for path in (each for each in map(Path, data.measured_files()) if each.suffix == ".py"):
            name = str(path.relative_to(copy))
            spans = functions_of(path, name)
            for line, contexts in data.contexts_by_lineno(str(path)).items():
                # The line that names a function runs when the file is imported.
                inner = [each for first, last, each in spans if first < line <= last]
                for test in contexts:
                    lines.setdefault(test, set()).update(inner[-1:])
        shared = sorted(lines.get(_FIXTURES, ()))
        runs = {test: (taken, sorted(lines.get(test, ())), shared) for test, taken in recorder.seconds.items()}
        passed = {test: each for test, each in runs.items() if test not in recorder.failed}
        keep.write_text(json.dumps({"passed": passed, "failed": recorder.failed or ([] if passed else [file])}))

    keep.write_text(json.dumps({"passed": {}, "failed": [file]}))
    in_a_child(work, keep.with_suffix(".log"), 3600)


def digest(paths: Iterable[Path]) -> str:
    """What stands in files, short."""
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in sorted(paths))).hexdigest()[:16]
