"""``./run mbfeat bench --growth``: measures axis after axis and keeps what it has."""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from growth import fits, report
from growth.axes import FIXED, SEED, THREADS, Axis, axes
from growth.measure import WARM, GrowthError, Kept, Stages, kept_in, measure_axis, run_process
from mbfeat.devtools.layout import this_layout
from mbfeat.files import write_whole
from mbfeat.machine import cpu_name, usable_cores

INTERACTIVE = "interactive"
LOGARITHMIC = ("triangles", "lights")
UNFITTED = (FIXED, THREADS)
MOVES = 12


@dataclass(frozen=True)
class Plan:
    """What is measured."""

    axes: list[Axis]
    interactive: bool
    rounds: int
    threads: int
    quick: bool


def run(options: argparse.Namespace) -> int:
    """Measures, or writes the page, as the options of the command line say; the exit code."""
    if options.page:
        from growth.page import write_page

        return write_page(options.page)
    if "MBFEAT_BUILD_DIR" not in os.environ:
        sys.stderr.write("mbfeat: bench: start it with ./run mbfeat bench, which sets it up\n")
        return 1
    try:
        plan = _plan(options)
    except ValueError as error:
        sys.stderr.write(f"mbfeat: bench: {error}\n")
        return 2
    result = _about(plan)
    begin = time.monotonic()

    def tell(text: str) -> None:
        sys.stderr.write(f"[{time.monotonic() - begin:5.0f} s] {text}\n")

    code = 0
    try:
        _measure(plan, result, kept_in(this_layout().made / "growth"), tell, options.json)
    except GrowthError as error:
        sys.stderr.write(f"mbfeat: bench: {error}\n")
        code = 1
    except KeyboardInterrupt:
        sys.stderr.write("\nmbfeat: bench: interrupted; start it again to go on from here\n")
        code = 130
    print(report.summary(result))
    if options.json:
        print(f"wrote {options.json}")
    return code


def _plan(options: argparse.Namespace) -> Plan:
    """Raises ValueError, for the user."""
    cores = usable_cores()
    if not 1 <= options.threads <= len(cores):
        raise ValueError(f"--threads is from 1 to {len(cores)} here")
    if options.json is not None and not options.json.resolve().parent.is_dir():
        raise ValueError(f"{options.json}: there is no folder {options.json.parent}; make it first")
    rounds = (1 if options.quick else 3) if options.rounds is None else options.rounds
    if rounds < 1:
        raise ValueError("--rounds has to be at least 1")
    known = {axis.name: axis for axis in axes(options.threads, options.quick)}
    if len(cores) < 2:
        del known[THREADS]
    every = [*known, INTERACTIVE]
    names = [name.strip() for name in (options.axes or "").split(",") if name.strip()] or every
    for name in names:
        if name not in every:
            raise ValueError(f"there is no axis {name!r}; there are {', '.join(every)}")
    chosen = [axis for name, axis in known.items() if name in names]
    return Plan(chosen, INTERACTIVE in names, rounds, options.threads, options.quick)


def _about(plan: Plan) -> dict[str, Any]:
    load = os.getloadavg()[0]
    return {
        "date": datetime.now(UTC).date().isoformat(),
        "command": " ".join(["./run", "mbfeat", *sys.argv[1:]]),
        "machine": {
            "cpu": cpu_name(),
            "cores": len(usable_cores()),
            "load_average": [load, load],  # lowest and highest that was seen
        },
        "threads": plan.threads,
        "rounds": plan.rounds,
        "quick": plan.quick,
        "seed": SEED,
        "axes": {},
        "aims": [],
    }


def _measure(
    plan: Plan, result: dict[str, Any], kept: Kept, tell: Callable[[str], None], file: Path | None
) -> None:
    """Measures into `result`, which is written after each axis. Raises GrowthError."""
    cores = usable_cores()[-max(plan.threads, 2) :]
    for axis in plan.axes:
        answers = measure_axis(axis, plan.rounds, kept, cores, tell)
        _add_axis(result, axis, answers)
        _save(result, file)
    if plan.interactive:
        size, width, moves = (10_000, 160, 2) if plan.quick else (1_000_000, 1280, MOVES)
        what = [INTERACTIVE, size, width, moves, plan.threads]
        _add_interactive(result, size, width, _interactive(what, plan, kept, cores, tell))
        _save(result, file)


def _save(result: dict[str, Any], file: Path | None) -> None:
    load, seen = os.getloadavg()[0], result["machine"]["load_average"]
    result["machine"]["load_average"] = [min(*seen, load), max(*seen, load)]
    if file:
        write_whole(file, json.dumps(result, indent=2) + "\n")


def _add_axis(
    result: dict[str, Any], axis: Axis, answers: Sequence[Sequence[dict[str, Any]]]
) -> None:
    entry: dict[str, Any] = {"unit": axis.unit, "points": fits.points(axis, answers)}
    entry["slopes"] = None if axis.name in UNFITTED else fits.slopes(axis, answers)
    if axis.name in LOGARITHMIC:
        entry["per_decade"] = fits.per_decade(axis, answers)
    result["axes"][axis.name] = entry
    if axis.name == FIXED:
        result["fixed_share"] = fits.fixed_share(axis, answers)
        for clock in ("cpu", "wall"):
            share = result["fixed_share"][clock]["outside"]
            percent = {key: 100 * value for key, value in share.items()}
            what = f"fixed cost at 16 {axis.unit}, % of the {clock} seconds"
            _add_aim(result, what, percent, most=2.0)
    if axis.name == THREADS:
        result["two_threads"] = fits.speed_up(answers)
        _add_aim(result, "two threads by one", result["two_threads"]["sampling"], least=1.95)


def _interactive(
    what: Sequence[Any], plan: Plan, kept: Kept, cores: Sequence[int], tell: Callable[[str], None]
) -> list[dict[str, Any]]:
    """Answers of growth.interactive, a process a round."""
    _, size, *numbers = what
    answers = []
    with tempfile.TemporaryDirectory(prefix="mbfeat-growth-") as folder:
        there = Stages(Path(folder))
        for turn in range(plan.rounds):
            tell(f"{INTERACTIVE}, round {turn + 1} of {plan.rounds}")
            answer = kept.load(what, turn)
            if answer is None:
                files = [there.path(WARM.kind, WARM.size), there.path("triangles", size)]
                arguments = [*map(str, files), *map(str, numbers)]
                answer = run_process(INTERACTIVE, arguments, cores[: plan.threads])
                kept.save(what, turn, answer)
            answers.append(answer)
    return answers


def _add_interactive(
    result: dict[str, Any], size: int, width: int, answers: Sequence[dict[str, Any]]
) -> None:
    found: dict[str, Any] = {
        "triangles": size,
        "width": width,
        "processes": len(answers),
        "moves": sum(len(answer["full"]) for answer in answers),
    }
    pairs = {name: [a[name] for a in answers] for name in ("open", "first_pixel", "first_image")}
    pairs |= {name: [p for a in answers for p in a[name]] for name in ("coarse", "full")}
    for name, both in pairs.items():
        found[name] = {
            clock: fits.spread(pair[i] for pair in both) for i, clock in enumerate(("wall", "cpu"))
        }
    result[INTERACTIVE] = found

    def milliseconds(name: str) -> fits.Spread:
        return {key: 1e3 * seconds for key, seconds in found[name]["wall"].items()}

    first = found["first_pixel"]["wall"]
    _add_aim(result, f"first pixel of {size:,} triangles, s", first, most=1.5)
    to = f"camera move at {width} x {width * 9 // 16} to"
    _add_aim(result, f"{to} reduced resolution, ms", milliseconds("coarse"), most=100.0)
    _add_aim(result, f"{to} one sample a pixel, ms", milliseconds("full"), most=1000.0)


def _add_aim(
    result: dict[str, Any],
    what: str,
    measured: fits.Spread,
    *,
    most: float | None = None,
    least: float | None = None,
) -> None:
    """Notes whether the median is at most or at least that."""
    met = (most is None or measured["median"] <= most) and (
        least is None or measured["median"] >= least
    )
    aim = f"at most {most:g}" if most is not None else f"at least {least:g}"
    result["aims"].append({"what": what, "aim": aim, "measured": measured, "met": met})
