"""``mbfeat effects STAGE``: prints what the stage calls for and what each effect costs."""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mbfeat.effects.measure import Plan, measure
from mbfeat.effects.rendering import EffectsError, Rendering
from mbfeat.machine import cpu_name, usable_cores

USAGE = 2
CAMERA_LIGHT = "the light at the camera, since the stage has none that lights"
Result = dict[str, Any]


def run(options: argparse.Namespace) -> int:
    """Does what the options ask for; returns the exit code."""
    if options.page is not None:
        from mbfeat.effects.page import write_page

        return write_page([Path(file) for file in (options.stage, *options.more) if file])
    if not options.stage or options.more:
        return _fail("name one stage", USAGE)
    problem = _wrong(options)
    if problem:
        return _fail(problem, USAGE)
    try:
        result = examine(options)
    except EffectsError as error:
        return _fail(str(error)) if str(error) else 1
    if options.chart is not None:
        try:
            from mbfeat.effects.chart import write_chart
        except ImportError:
            return _fail("--chart needs matplotlib: pip install 'mbfeat[charts]'")
        write_chart(options.chart, result)
    print(json.dumps(result, indent=2) if options.json else "\n".join(table(result)))
    return 0


def _wrong(options: argparse.Namespace) -> str:
    """What is wrong with the options, before anything is rendered; else nothing."""
    for name in ("width", "rounds", "threads"):
        if getattr(options, name) < 1:
            return f"--{name} {getattr(options, name)}: at least 1"
    cores = len(usable_cores())
    if options.threads > cores:
        return f"--threads {options.threads}: there are {cores} cores"
    if not (options.seconds > 0.0 and math.isfinite(options.seconds)):
        return f"--seconds {options.seconds:g}: give a number above zero"
    chart = options.chart
    if chart is None:
        return ""
    if chart.suffix.lower() not in (".png", ".svg"):
        return f"--chart {chart}: the name must end in .png or .svg"
    if not chart.absolute().parent.is_dir():
        return f"--chart {chart}: there is no folder {chart.parent}; make it first"
    return "" if options.measure else "--chart shows what was measured: give --measure too"


def examine(options: argparse.Namespace) -> Result:
    """Renders a little of the stage, measures if that was asked for; what was found."""
    plan = Plan(options.rounds, options.seconds, options.threads, options.clock)
    cores = usable_cores()[-plan.threads :] if options.measure else None
    with Rendering(
        options.stage,
        settings=options.settings or "",
        camera=options.camera or "",
        width=options.width,
        cores=cores,
    ) as rendering:
        own = rendering.own
        report = rendering.render(own, samplesPerPixel="1", threads=str(plan.threads))
        result = {
            "stage": str(options.stage),
            "date": datetime.now(UTC).date().isoformat(),
            "processor": cpu_name(),
            "threads": plan.threads,
            "width": options.width,
            "camera": rendering.camera,
            "aovs": list(own.aovs),
            **found(report),
            "cost": {},
        }
        if options.measure:
            result["load_average"] = os.getloadavg()[0]
            result |= measure(rendering, report, plan)
    return result


def found(report: Mapping[str, Any]) -> Result:
    """What a report says of effects, the kernel and the memory."""
    from mbfeat import _core

    effects = report["effects"]
    docs = {row.name: row for row in _core.effect_table()}
    return {
        "effects": [
            {
                "name": name,
                "meaning": docs[name].doc,
                "count": effects["askedBy"][name]["count"],
                "prims": [askers_name(path) for path in effects["askedBy"][name]["first"]],
            }
            for name in effects["present"]
        ],
        "absent": list(effects["absent"]),
        "kernel": report["kernel"],
        "scene": report["scene"],
        "memory": report["memory"],
    }


def askers_name(path: str) -> str:
    """What asks for an effect, as users know it: Hydra's own light has a path that they do not."""
    return CAMERA_LIGHT if path.startswith("/_UsdImaging_") else path


def table(result: Mapping[str, Any]) -> list[str]:
    """The result as text."""
    kernel = result["kernel"]
    lines = [
        f"{result['stage']}: kernel {kernel['instructions']}, built for {kernel['prebuilt']} "
        "surfaces",
        "",
    ]
    cost = result["cost"]
    rows = [("effect", "asked for by", *(("s per million samples",) if cost else ()))]
    for effect in result["effects"]:
        rows.append((effect["name"], askers(effect), *_cost_of(cost, effect["name"])))
    lines += aligned(rows)
    if not cost:
        lines += ["", f"absent: {', '.join(result['absent'])}"]
        return lines
    lines += ["", "absent, and what it costs to handle or to record them all the same:"]
    lines += aligned([(name, *_cost_of(cost, name)) for name in result["absent"]])
    low, high = result["specialised_over_full_range"]
    lines += [
        "",
        f"time by that of the full kernel: {result['specialised_over_full']:.3f} "
        f"({low:.3f} .. {high:.3f}), {result['rounds']} rounds, {result['threads']} thread"
        f"{'s' if result['threads'] > 1 else ''}, {result['clock']} seconds",
    ]
    return lines


def askers(effect: Mapping[str, Any], most: int = 2) -> str:
    """The first prims or AOVs that ask for an effect, and how many more do."""
    shown = effect["prims"][:most]
    more = effect["count"] - len(shown)
    return ", ".join(shown) + (f" and {more} more" if more > 0 else "")


def _cost_of(cost: Mapping[str, Any], name: str) -> tuple[str, ...]:
    if not cost:
        return ()
    return (cost_text(cost[name]) if name in cost else "not measured: nothing can stand for it",)


def cost_text(row: Mapping[str, Any]) -> str:
    """A measured cost with its range, and how it was measured."""
    s = row["seconds_per_million"]
    return f"{s['median']:+.4f} ({s['low']:+.4f} .. {s['high']:+.4f}), {row['how']}"


def aligned(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Columns of text."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))] if rows else []
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def _fail(text: str, code: int = 1) -> int:
    sys.stderr.write(f"mbfeat: effects: {text}\n")
    return code
