"""The project's own commands behind ``./run test`` and ``./run lint``."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from mbfeat.devtools import environment
from mbfeat.devtools.layout import (
    PRESET,
    Layout,
    digest,
    read_stamp,
    this_layout,
    write_whole,
)

# pytest's exit status when it selected no test.
NO_TESTS_COLLECTED = 5


@dataclass
class Tally:
    """Tests by outcome; `broken` is set when a runner failed without a failed test."""

    passed: int = 0
    failed: int = 0
    skipped: int = 0
    broken: bool = False

    def add_report(self, report: Path, status: int) -> None:
        """Adds a JUnit XML report and the exit status of the runner that wrote it."""
        failed_before = self.failed
        try:
            cases = list(ElementTree.parse(report).getroot().iter("testcase"))
        except (OSError, ElementTree.ParseError):
            cases = []
        for case in cases:
            tags = {child.tag for child in case}
            if tags & {"failure", "error"} or case.get("status") == "fail":
                self.failed += 1
            elif "skipped" in tags:
                self.skipped += 1
            else:
                self.passed += 1
        if status not in (0, NO_TESTS_COLLECTED) and self.failed == failed_before:
            self.broken = True


def test(layout: Layout, arguments: list[str]) -> int:
    """Runs the C++ tests, then pytest once for each pxr; returns 0 when all passed.

    ``--cpp`` or ``--python`` select one kind; other arguments go to pytest and select Python.
    """
    kinds = {argument for argument in arguments if argument in ("--cpp", "--python")}
    rest = [argument for argument in arguments if argument not in kinds]
    if not kinds:
        kinds = {"--python"} if rest else {"--cpp", "--python"}
    tally = Tally()
    started = time.monotonic()
    os.chdir(layout.root)
    with tempfile.TemporaryDirectory(prefix="mbfeat-test-") as scratch:
        report = Path(scratch) / "report.xml"
        if "--cpp" in kinds:
            _test_cpp(PRESET, report, tally)
        if "--python" in kinds:
            for variables in (
                environment.for_runtime(layout, os.environ, Path(sys.prefix)),
                environment.for_usd_core(layout, os.environ, Path(sys.prefix)),
            ):
                report.unlink(missing_ok=True)
                _test_python(variables, rest, report, tally)
    seconds = time.monotonic() - started
    skipped = f", {tally.skipped} skipped" if tally.skipped else ""
    if tally.broken:
        print("a test runner ended with an error, see above")
    if not tally.passed and not tally.failed:
        print("no test was selected")
        tally.broken = True
    print(f"==== {tally.passed} passed, {tally.failed} failed{skipped} in {seconds:.1f}s ====")
    return 1 if tally.failed or tally.broken else 0


def _test_cpp(preset: str, report: Path, tally: Tally) -> None:
    print("==== C++ tests ====", flush=True)
    jobs = str(len(os.sched_getaffinity(0)))
    build = ["cmake", "--build", "--preset", preset, "--target", "mbfeat_tests", "-j", jobs]
    if subprocess.run(build, check=False).returncode != 0:
        print("the C++ tests could not be built")
        tally.broken = True
        return
    command = ["ctest", "--preset", preset, "-j", jobs, "--output-junit", str(report)]
    tally.add_report(report, subprocess.run(command, check=False).returncode)


def _test_python(
    variables: Mapping[str, str], arguments: list[str], report: Path, tally: Tally
) -> None:
    print(f"==== Python tests with the pxr of {variables['MBFEAT_PXR']} ====", flush=True)
    command = [sys.executable, "-m", "pytest", f"--junitxml={report}", *arguments]
    tally.add_report(report, subprocess.run(command, env=variables, check=False).returncode)


def sanitize(layout: Layout, arguments: list[str]) -> int:
    """Builds the asan preset and runs the C++ tests in it."""
    os.chdir(layout.root)
    jobs = str(len(os.sched_getaffinity(0)))
    for command in (
        ["cmake", "--preset", "asan"],
        ["cmake", "--build", "--preset", "asan", "--target", "mbfeat_tests", "-j", jobs],
        ["ctest", "--preset", "asan", "-j", jobs, *arguments],
    ):
        status = subprocess.run(command, check=False).returncode
        if status != 0:
            return status
    return 0


def lint(layout: Layout, arguments: list[str]) -> int:
    """Checks format, style and types.

    ``--fix`` rewrites what can be; ``--budget=SECONDS`` starts no clang-tidy after that time, and
    paths limit clang-tidy to what lies below them.
    """
    os.chdir(layout.root)
    fix = "--fix" in arguments
    budgets = [float(a.partition("=")[2]) for a in arguments if a.startswith("--budget=")]
    deadline = time.monotonic() + (budgets[-1] if budgets else math.inf)
    only = [argument for argument in arguments if not argument.startswith("--")]
    sources = _own_sources()
    python = ["python", "tests", "training"]
    clang_format = ["clang-format", *(["-i"] if fix else ["--dry-run", "-Werror"])]
    ruff_format = ["ruff", "format", *([] if fix else ["--check"])]
    ruff_check = ["ruff", "check", *(["--fix"] if fix else [])]
    checks: list[tuple[str, Callable[[], bool]]] = [
        ("clang-format", lambda: _passes([*clang_format, *sources])),
        ("ruff format", lambda: _passes([*ruff_format, *python])),
        ("ruff check", lambda: _passes([*ruff_check, *python])),
        ("mypy", lambda: _passes(["mypy"])),
        ("clang-tidy", lambda: _tidy(layout, only, deadline)),
    ]
    failed = []
    for name, check in checks:
        started = time.monotonic()
        print(f"==== {name} ====", flush=True)
        if not check():
            failed.append(name)
        print(f"{name}: {time.monotonic() - started:.1f} s", flush=True)
    print(f"==== lint: {'failed: ' + ', '.join(failed) if failed else 'clean'} ====")
    return 1 if failed else 0


def _own_sources() -> list[str]:
    """C++ files of the source folders."""
    folders = ["hdmbfeat", "plugin", "python/bindings", "tests/cpp", "tests/stability"]
    found = [path for folder in folders for path in Path(folder).rglob("*.*")]
    return sorted(str(path) for path in found if path.suffix in (".cpp", ".h"))


def _passes(command: list[str]) -> bool:
    return subprocess.run(command, check=False).returncode == 0


def _tidy(layout: Layout, only: list[str], deadline: float) -> bool:
    """clang-tidy on every compiled file, skipping those that passed with the same content.

    The key of a file covers the file, all headers of ours and the configuration, so a header edit
    checks everything again.
    """
    sources = [path for path in _own_sources() if path.endswith(".cpp")]
    headers = [path for path in _own_sources() if path.endswith(".h")]
    shared = [Path(path).read_bytes() for path in [".clang-tidy", *headers]]
    common = digest(*shared, (layout.build / "compile_commands.json").read_bytes())
    if only:
        sources = [path for path in sources if any(path.startswith(start) for start in only)]

    late: list[str] = []

    def check(source: str) -> bool:
        stamp = layout.made / "tidy" / source
        key = digest(common, Path(source).read_bytes())
        if read_stamp(stamp) == key:
            return True
        if time.monotonic() > deadline:
            late.append(source)
            return True
        command = ["clang-tidy", "-p", str(layout.build), "--quiet", source]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        if result.returncode != 0:
            print(result.stdout or result.stderr, flush=True)
            return False
        write_whole(stamp, key)
        return True

    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        clean = all(list(pool.map(check, sources)))
    if late:
        print(f"clang-tidy: no time left for {len(late)} of {len(sources)} files")
    return clean


def main(arguments: list[str]) -> int:
    tasks = {"test": test, "sanitize": sanitize, "lint": lint}
    return tasks[arguments[0]](this_layout(), arguments[1:])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
