"""What comes out of a measurement: plain values, four files, and what is printed."""

from __future__ import annotations

import argparse
import json
import math
import os
import shlex
import sys
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mbfeat.files import write_whole
from mbfeat.machine import cpu_name
from mbfeat.metrics import EPSILON, NAMES
from mbfeat.tradeoff import analysis, limits
from mbfeat.tradeoff.measure import Measured
from mbfeat.tradeoff.reference import Reference
from mbfeat.tradeoff.renders import Subject
from mbfeat.tradeoff.request import FIXED, Scale
from mbfeat.tradeoff.variants import OWN, RAW, WHOLE, Variant, whole
from mbfeat.tradeoff.wording import duration, number

LIMITS_PICTURE = "limits.png"
EPSILONS = {"relMSE": EPSILON, "tonemappedRelMSE": EPSILON, "relL1": EPSILON}


def result(
    options: argparse.Namespace,
    subject: Subject,
    scale: Scale,
    chosen: Sequence[Variant],
    measured: Measured,
    references: Mapping[str, Reference],
    loads: Sequence[float],
) -> dict[str, Any]:
    """Everything that was found, as plain values: the content of tradeoff.json."""
    rows = analysis.rungs(measured, chosen, references, scale.metric)
    own = references[OWN]
    return {
        "date": datetime.now(UTC).date().isoformat(),
        "command": _again(),
        "scene": subject.stage.stem,
        "stage": str(options.stage or os.path.relpath(subject.stage)),
        "camera": subject.facts.camera,
        "width": subject.width,
        "height": subject.height,
        "settings": dict(subject.settings),
        "missing": list(subject.facts.missing),
        "machine": {"cpu": cpu_name(), "cores": os.cpu_count(), "load_average": list(loads)},
        "threads": subject.threads,
        "seeds": scale.seeds,
        "metric": scale.metric,
        "epsilons": EPSILONS,
        "variants": {
            variant.name: {"title": variant.title, **variant.renders} for variant in chosen
        },
        "reference": reference_entry(own),
        "references": {name: reference_entry(one) for name, one in references.items()},
        "points": measured.points,
        "pareto": analysis.pareto(measured.points, scale.metric),
        "rungs": rows,
        "answers": answers(options, subject, chosen, scale.metric, rows, own),
        "left_out": dict(measured.left_out),
    }


def reference_entry(one: Reference) -> dict[str, Any]:
    """A reference as plain values, with a sentence."""
    about = dict(one.about)
    if about["kind"] == "given":
        text = f"Reference: {', '.join(about['files'])}, given."
    else:
        text = (
            f"Reference: {about['samples_per_pixel']} samples a pixel of the same renderer from "
            f"seeds of their own, rendered in {duration(about['seconds'])}."
        )
    if one.floor is None:
        text += " Its own noise is not known: give a second, independent one to see it."
    else:
        text += f" Its own noise is relMSE {number(one.floor['relMSE'])}, from two halves."
    return {**about, "noise": dict(one.floor) if one.floor is not None else None, "text": text}


def answers(
    options: argparse.Namespace,
    subject: Subject,
    chosen: Sequence[Variant],
    metric: str,
    rows: Sequence[analysis.Rung],
    own: Reference,
) -> list[dict[str, Any]]:
    """Those to the questions of the command line; without any, one of each kind."""
    found = analysis.curves(rows, metric, OWN)
    floor = (own.floor or {}).get(metric)
    seconds, errors = list(options.seconds), list(options.error)
    if not seconds and not errors:
        raw = next(curve for curve in found if curve.variant == RAW)
        seconds = [_round(math.sqrt(raw.seconds[0] * raw.seconds[-1]))]
        errors = [_round(math.sqrt(raw.errors[0] * raw.errors[-1]))]
    answered = [analysis.answer_seconds(found, value, metric, floor) for value in seconds]
    answered += [analysis.answer_error(found, value, metric, floor) for value in errors]
    for answer in answered:
        if answer["best"] is not None:
            variant = next(v for v in chosen if v.name == answer["best"]["variant"])
            answer["command"] = _usdrecord(options, subject, variant, answer["best"])
            if variant.filter:
                answer["text"] += (
                    f" The image is filtered afterwards, see mbfeat.oidn.Oidn.{variant.filter}; it "
                    f"needs the AOVs {', '.join(variant.features)} of the same render."
                )
    return answered


def _round(value: float) -> float:
    """Two digits, upwards: nobody asks for 3.1623."""
    digit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / digit) * digit:.1e}")


def _usdrecord(
    options: argparse.Namespace,
    subject: Subject,
    variant: Variant,
    best: Mapping[str, Any],
) -> str:
    """The render of an answer; a filter's comes after it."""
    every = {
        name: value
        for name, value in subject.settings
        if FIXED.get(name) != value or name in subject.facts.authored
    }
    every |= variant.settings
    every["mbfeat:samplesPerPixel"] = str(best["spp"])
    pairs = [part for name, value in every.items() for part in ("--set", f"{name}={value}")]
    stage = str(options.stage or os.path.relpath(subject.stage))
    view = ["--camera", subject.facts.camera, "--imageWidth", str(subject.width)]
    return shlex.join(["usdrecord", "--renderer", "MBFeat", *view, *pairs, stage, "image.exr"])


def _again() -> str:
    return shlex.join(["./run", "mbfeat", *sys.argv[1:]])


def write(
    out: Path, made: dict[str, Any], measured: Measured, references: Mapping[str, Reference]
) -> None:
    """Writes JSON, CSV, PNG and HTML; `made` gets what the crops are."""
    from mbfeat.tradeoff import charts, crops, web

    seconds, window, shown = crops.crops(made["rungs"], measured, references, made["metric"])
    made["crops"] = {
        "seconds": seconds,
        "window": [window.x, window.y, window.width, window.height],
        "text": f"What {number(seconds)} s buy at most: the last measured number of "
        "samples of each variant within that time, first seed.",
    }
    chart = charts.png(made, shown)
    compared = limits.pictures(measured, made["limits"])
    if compared:
        write_whole(out / LIMITS_PICTURE, charts.crops_png(compared))
    write_whole(out / "tradeoff.json", json.dumps(made, indent=1) + "\n")
    write_whole(out / "tradeoff.csv", web.csv_text(made["points"]))
    write_whole(out / "tradeoff.png", chart)
    write_whole(out / "tradeoff.html", web.page(made, chart, shown, compared))


def show(out: Path, made: Mapping[str, Any]) -> None:
    """Prints the table and the answers."""
    print(f"\n{made['reference']['text']}")
    print(f"epsilons: {', '.join(f'{name} {value:g}' for name, value in EPSILONS.items())}")
    head = f"{'variant':<18}{'spp':>6}{'seconds':>9}" + "".join(f"{n:>17}" for n in NAMES)
    print(f"{head}{'bias':>9}")
    for row in made["rungs"]:
        numbers = "".join(f"{number(row['errors'][n]['median']):>17}" for n in NAMES)
        print(
            f"{row['variant']:<18}{row['samples_per_pixel']:>6}"
            f"{row['total_seconds']['median']:>9.2f}{numbers}{100 * row['bias']['median']:>8.2f}%"
            f"{' *' if row['on_front'] else ''}"
        )
    print("* on the Pareto front")
    if any(row["variant"] == WHOLE for row in made["rungs"]):
        print(f"{WHOLE}: {whole().title}; what recording and limits cost is told from it")
    print()
    if made["limits"]:
        _show_limits(made["limits"])
    for answer in made["answers"]:
        print(answer["text"])
        if "command" in answer:
            print(f"    {answer['command']}")
    for name, reason in made["left_out"].items():
        print(f"left out: {name}: {reason}")
    files = [f"tradeoff.{end}" for end in ("json", "csv", "html", "png")]
    files += [LIMITS_PICTURE] if made["limits"] else []
    print(f"wrote {', '.join(str(out / file) for file in files)}")


def _show_limits(found: Sequence[Mapping[str, Any]]) -> None:
    head, lines = limits.cells(found)
    widths = [max(len(line[i]) for line in (head, *lines)) for i in range(len(head))]
    print("What limits save and lose:")
    for line in (head, *lines):
        print("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)))
    print(limits.meaning(found) + "\n")
