"""Run test files with a changed source in memory, and learn which tests come by which statements.

The process that calls :func:`run` has loaded what is not odori's; each run is a fork of it that loads odori anew. A
mutant lives in that fork alone: nothing is written, so nothing is left behind by a kill.
"""

import ast
import builtins
import contextlib
import gc
import importlib
import importlib.machinery
import io
import json
import os
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from draw import REPOSITORY, blocks

LOADED = "numpy scipy.signal scipy.optimize scipy.sparse scipy.spatial scipy.ndimage pyarrow.parquet pxr.UsdSkel"
MOST_BYTES = 12 * 2**30
TIMES, SPARE_S = 5, 10
"""A run may take this many times the CPU-seconds of the clean one, and as many seconds more."""
QUIET = ["-q", "-x", "--assert=plain", "--tb=no", "-p", "no:cacheprovider", "-p", "no:faulthandler"]


@dataclass(frozen=True)
class Outcome:
    """How a run of tests ended."""

    code: int
    """pytest's exit status; -1 where the process was ended: out of time, of memory, or by a signal."""
    failed: str
    """The test that failed first; empty where none did or the process was ended."""
    running: str
    """The test that ran last."""


def load_first() -> None:
    """Load what every run needs and no mutant changes."""
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(threads, "1")
    sys.dont_write_bytecode = False  # what is not changed is compiled once
    os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"  # plugins of other projects cost a second each time
    for name in LOADED.split():
        importlib.import_module(name)
    with contextlib.redirect_stdout(io.StringIO()):
        pytest.main(["--version", "--version", "--noconftest"])
    if loaded := sorted(n for n in sys.modules if n.split(".")[0] in {"kernels", "assets", "schemas", "pipelines"}):
        raise RuntimeError(f"want nothing of odori loaded before a fork, got {loaded}")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that a fork ends with it
    gc.collect()
    gc.freeze()


def _seconds() -> float:
    return sum(os.times()[:4])


class _Reporter:
    """Writes the test that runs, and the first to fail."""

    def __init__(self, write: Callable[[str, Any], None]) -> None:
        self.write = write

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.write("running", nodeid)

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed:
            self.write("failed", report.nodeid)

    def pytest_collectreport(self, report: Any) -> None:
        if report.failed:
            self.write("failed", report.nodeid)


class _Mapper(_Reporter):
    """Writes of each test that passes its CPU-seconds and the blocks it came by."""

    def __init__(self, write: Callable[[str, Any], None], reached: set[str]) -> None:
        super().__init__(write)
        self.reached, self.shared, self.passed, self.skipped = reached, set[str](), False, 0

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Any:
        before = set(self.reached)
        self.reached.clear()
        try:
            return (yield)
        finally:
            if fixturedef.scope != "function":
                self.write("shared", sorted(self.reached))
            self.reached |= before

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Any:
        self.reached.clear()
        self.passed = True
        start = _seconds()
        done = yield
        if self.passed:
            self.write("test", [item.nodeid, round(_seconds() - start, 3), sorted(self.reached)])
        return done

    def pytest_runtest_logreport(self, report: Any) -> None:
        super().pytest_runtest_logreport(report)
        if not report.passed:
            self.passed = False
            self.write("unusable", report.nodeid)


def _instrumented(path: Path, name: str) -> Any:
    tree = ast.parse(path.read_bytes())
    for _, block, run in list(blocks(tree)):
        call = ast.parse(f"__reached__({f'{name} {block}'!r})").body[0]
        for node in ast.walk(call):
            ast.copy_location(node, run[0])
        is_words = isinstance(run[0], ast.Expr) and isinstance(run[0].value, ast.Constant)
        run.insert(1 if is_words else 0, call)
    return compile(tree, str(path), "exec")


def _loading(code_of: Callable[[str], Any]) -> None:
    """Let ``code_of`` say what code a file has; ``None`` leaves it as it is."""
    usual = importlib.machinery.SourceFileLoader.get_code

    def get_code(self: Any, fullname: str) -> Any:
        own = code_of(self.path)
        return usual(self, fullname) if own is None else own

    importlib.machinery.SourceFileLoader.get_code = get_code  # type: ignore[method-assign]


def _fork(work: Callable[[Callable[[str, Any], None]], int], limit_s: float) -> tuple[int, list[tuple[str, Any]]]:
    """Do some work in a fork; its status, and what it wrote."""
    with tempfile.NamedTemporaryFile("r", encoding="utf-8") as notes:
        child = os.fork()
        if child == 0:
            code = 70
            try:
                os.setsid()
                with Path(os.devnull).open("r+b") as nowhere:
                    for stream in (0, 1, 2):
                        os.dup2(nowhere.fileno(), stream)
                if limit_s:
                    resource.setrlimit(resource.RLIMIT_CPU, (int(limit_s) + 1, int(limit_s) + 5))
                resource.setrlimit(resource.RLIMIT_DATA, (MOST_BYTES, MOST_BYTES))
                out = Path(notes.name).open("w", encoding="utf-8", buffering=1)  # noqa: SIM115
                code = work(lambda what, value: print(json.dumps([what, value]), file=out))
            finally:
                os._exit(code)
        status = _wait(child, limit_s)
        return status, [json.loads(line) for line in notes.read().splitlines() if line.endswith("]")]


def _wait(child: int, limit_s: float) -> int:
    """Wait; one that neither computes nor ends is ended after ten times as long by the clock."""
    last = time.monotonic() + 10 * limit_s + 300
    pause_s = 0.01
    try:
        while time.monotonic() < last or not limit_s:
            done, status = os.waitpid(child, os.WNOHANG)
            if done:
                return os.waitstatus_to_exitcode(status)
            time.sleep(pause_s)
            pause_s = min(pause_s * 1.5, 0.2)
    except BaseException:
        os.killpg(child, signal.SIGKILL)
        raise
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return -signal.SIGKILL


def run(path: str, source: bytes, tests: Iterable[str], clean_s: float) -> Outcome:
    """Run tests with one file changed.

    Parameters
    ----------
    path : str, the file, from the repository's root
    source : bytes, what it holds instead
    tests : of str, tests or files, in the order they run
    clean_s : float, CPU-seconds they take on the file as it is
    """
    whole = str(REPOSITORY / path)

    def work(write: Callable[[str, Any], None]) -> int:
        _loading(lambda name: compile(source, name, "exec") if name == whole else None)
        return int(pytest.main([*QUIET, *tests], plugins=[_Reporter(write)]))

    code, notes = _fork(work, TIMES * clean_s + SPARE_S)
    failed = [value for what, value in notes if what == "failed"]
    running = [value for what, value in notes if what == "running"]
    return Outcome(code if 0 <= code < 6 else -1, failed[0] if failed else "", running[-1] if running else "")


def reach(test_file: str, mutated: set[str]) -> dict[str, Any]:
    """Run one test file on the sources as they are.

    Returns
    -------
    dict
        ``tests``: of each that passes its CPU-seconds and blocks; ``shared``: blocks of fixtures that outlive a test;
        ``unusable``: tests that fail or are skipped here.
    """

    def work(write: Callable[[str, Any], None]) -> int:
        reached: set[str] = set()
        builtins.__reached__ = reached.add  # type: ignore[attr-defined]
        names = {str(REPOSITORY / name): name for name in mutated}
        _loading(lambda name: _instrumented(Path(name), names[name]) if name in names else None)
        arguments = [a for a in QUIET if a != "-x"]
        return int(pytest.main([*arguments, test_file], plugins=[_Mapper(write, reached)]))

    _, notes = _fork(work, 0)
    return {
        "tests": {value[0]: value[1:] for what, value in notes if what == "test"},
        "shared": sorted({block for what, value in notes if what == "shared" for block in value}),
        "unusable": sorted({value for what, value in notes if what == "unusable"}),
    }
