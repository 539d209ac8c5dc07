"""``mbfeat stability``: runs the catalogue of hard cases and shows what each found.

Families of cases come from :data:`FAMILIES`: the compiled ones of ``tests/stability``, and others
that yield rows like :class:`Row`. Works in a checkout, with ``tests/bench`` on ``sys.path``.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypedDict

from mbfeat.devtools.layout import PRESET, Layout, this_layout, write_whole
from mbfeat.machine import cpu_name

PAGE = Path(__file__).parent / "docs" / "hard-cases.md"
TARGET = "mbfeat_stability"
THREADS = 2  # of the renders, see tests/stability/rendering.cpp
BEYOND_MEASURE = 1e300  # stands for errors that are infinite or not a number
NO_SUCH_CASE = 2  # exit code of the executable, and of the command


class StabilityError(Exception):
    """The catalogue cannot be run; the message says why."""


class Row(TypedDict):
    """What a case found. Errors are in the unit that `check` names."""

    case: str
    check: str
    worst: float
    budget: float
    verdict: str  # pass or fail
    reason: str  # of the budget
    where: str  # the worst error was at
    measured: int
    traps: list[str]
    pictures: list[str]  # files in the folder of the run
    seconds: float


Family = Callable[[Layout, argparse.Namespace, Path], Iterator[Row]]


def compiled_cases(layout: Layout, options: argparse.Namespace, folder: Path) -> Iterator[Row]:
    """Builds the cases of ``tests/stability``, runs those of the filter, yields as they end."""
    executable = build_cases(layout, "debug" if options.traps else PRESET)
    command = [str(executable), "--filter", options.filter, "--pictures", str(folder)]
    command += ["--traps"] if options.traps else []
    last = "the start"
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            row: Row = json.loads(line)
            last = row["case"]
            yield row
    if process.returncode not in (0, 1, NO_SUCH_CASE):
        yield {
            "case": f"after {last}",
            "check": "the next case ends",
            "worst": BEYOND_MEASURE,
            "budget": 0.0,
            "verdict": "fail",
            "reason": "",
            "where": f"{TARGET} ended with {process.returncode}",
            "measured": 0,
            "traps": [],
            "pictures": [],
            "seconds": 0.0,
        }


def build_cases(layout: Layout, preset: str) -> Path:
    """Builds the executable of the cases in ``tests/stability``; returns its path."""
    build = layout.build.parent / preset
    if not (build / "build.ninja").exists():
        _make(layout, ["cmake", "--preset", preset])
    _make(layout, ["cmake", "--build", str(build), "--target", TARGET, "-j", str(_cores())])
    return build / "bin" / TARGET


# The denoiser's family joins here: its network runs in Python.
FAMILIES: tuple[Family, ...] = (compiled_cases,)


def run(options: argparse.Namespace) -> int:
    """Runs what the options ask for; returns the exit code: 1 when a case failed, 2 for usage."""
    layout = this_layout()
    try:
        if options.page is not None:
            return _write_page(options.page)
        folder = (options.out or layout.made / "stability").resolve()
        folder.mkdir(parents=True, exist_ok=True)
        result = _measure(layout, options, folder)
        if options.json is not None:
            write_whole(options.json, json.dumps(result, indent=2) + "\n")
    except (StabilityError, OSError) as error:
        sys.stderr.write(f"mbfeat: stability: {error}\n")
        return 1
    rows = result["cases"]
    if not rows:
        sys.stderr.write(f"mbfeat: stability: no case is named {options.filter}\n")
        return NO_SUCH_CASE
    write_whole(folder / "table.md", "\n".join(table(rows)) + "\n")
    failed = [row for row in rows if row["verdict"] != "pass"]
    print(f"{len(rows) - len(failed)} passed, {len(failed)} failed; table: {folder / 'table.md'}")
    for row in failed:
        print("\n".join(failure(row, folder)))
    return 1 if failed else 0


def _measure(layout: Layout, options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    started = datetime.now(UTC)
    rows: list[Row] = []
    for family in FAMILIES:
        for row in family(layout, options, folder):
            rows.append(row)
            print(line(row), flush=True)
    return {
        "date": started.strftime("%Y-%m-%d"),
        "processor": cpu_name(),
        "threads": THREADS,
        "traps": bool(options.traps),
        "seconds": (datetime.now(UTC) - started).total_seconds(),
        "cases": rows,
    }


def _make(layout: Layout, command: Sequence[str]) -> None:
    answer = subprocess.run(command, cwd=layout.root, capture_output=True, text=True, check=False)
    if answer.returncode != 0:
        raise StabilityError(
            f"the hard cases could not be built ({' '.join(command)}):\n"
            f"{answer.stdout}{answer.stderr}"
        )


def _cores() -> int:
    return len(os.sched_getaffinity(0))


def number(value: float) -> str:
    """Two digits are enough for an error."""
    return "no number" if value >= BEYOND_MEASURE else f"{value:.2g}"


def line(row: Row) -> str:
    """A case on one line, as it ends."""
    return (
        f"{row['verdict']:4}  {row['case']:<52} {number(row['worst']):>9} of "
        f"{number(row['budget']):<8} {row['check']}"
    )


def failure(row: Row, folder: Path) -> list[str]:
    """All that is known of a case that failed."""
    lines = [
        f"FAILED {row['case']}: {row['check']}",
        f"    worst {number(row['worst'])}, budget {number(row['budget'])} ({row['reason']})",
    ]
    lines += [f"    at {row['where']}"] if row["where"] else []
    lines += [f"    trap: {text}" for text in row["traps"]]
    lines += [f"    picture: {folder / name}" for name in row["pictures"]]
    return lines


def table(rows: Sequence[Row]) -> list[str]:
    """The cases as Markdown."""
    lines = ["| case | check | worst error | budget | verdict |", "|---|---|---|---|---|"]
    for row in rows:
        check = row["check"].replace("|", "\\|")
        lines.append(
            f"| `{row['case']}` | {check} | {number(row['worst'])} | {number(row['budget'])} "
            f"| {row['verdict']} |"
        )
    return lines


def _write_page(source: Path) -> int:
    result = json.loads(source.read_text(encoding="utf-8"))
    PAGE.write_text(page(result), encoding="utf-8")
    print(f"wrote {PAGE}")
    return 0


def page(result: Mapping[str, Any]) -> str:
    """The page 'hard cases' from the JSON of a run."""
    rows: list[Row] = result["cases"]
    failed = sum(row["verdict"] != "pass" for row in rows)
    families: dict[str, list[Row]] = {}
    for row in rows:
        families.setdefault(row["case"].partition("/")[0], []).append(row)
    lines = [
        "# Hard cases",
        "",
        "Where rounding, overflow or a division by nothing would show. Every case measures an",
        "error against a closed form, the same formula in double, an invariant or another",
        "estimator, and compares the worst with a budget whose reason is written down. No clamp is",
        "on.",
        "",
        "    ./run mbfeat stability --json FILE",
        "    ./run mbfeat stability --traps",
        "    ./run mbfeat stability --page FILE",
        "",
        "run the catalogue, run it in a debug build in which invalid operations, divisions by zero",
        "and overflows of our scalar code trap, and write this page. `--filter 'closure/*'` runs a",
        "part. The exit code is 1 when a case fails; `.mbfeat/stability`, or `--out`, then holds",
        "pictures of it. *No number* stands for an infinity or a NaN.",
        "",
        f"This run: {result['date']}, {result['processor']}, {result['threads']} threads, "
        f"{result['seconds']:.0f} s; {len(rows)} cases, {failed} failed"
        + ("; traps were on." if result["traps"] else "."),
    ]
    for family, members in families.items():
        lines += ["", f"## {family}", "", *table(members), ""]
        lines += _reasons(members)
    return "\n".join(lines).rstrip() + "\n"


def _reasons(rows: Sequence[Row]) -> list[str]:
    """Where the budgets come from, each reason once with the cases that have it."""
    reasons: dict[str, list[str]] = {}
    for row in rows:
        reasons.setdefault(row["reason"], []).append(row["case"].partition("/")[2])
    lines = ["Budgets:", ""]
    for reason, names in reasons.items():
        listed = ", ".join(names) if len(names) < len(rows) else "all"
        lines.append(f"- {listed}: {reason}.")
    return lines
