"""What the measurements say: spreads, slopes, cost per decade, fixed cost, speed-up."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from growth.axes import Axis

Answer = dict[str, Any]
Spread = dict[str, float]

LEAST_GROWTH = 0.05  # of the first value's cost; what grows less is not told from noise
NS = 1e9

# What is measured of each value: the name in the JSON, and how it comes from an answer.
METRICS: dict[str, Callable[[Answer], float]] = {
    "open_s": lambda a: a["seconds"]["open"],
    "translate_s": lambda a: a["seconds"]["translate"],
    "build_s": lambda a: a["seconds"]["build"],
    "sampling_s": lambda a: a["seconds"]["sampling"],
    "write_s": lambda a: a["seconds"]["write"],
    "wall_s": lambda a: a["wall"],
    "cpu_s": lambda a: a["cpu"],
    "prepare_cpu_s": lambda a: a["cpu"] - a["sampling_cpu"],
    "sampling_cpu_s": lambda a: a["sampling_cpu"],
    "sample_ns": lambda a: NS * a["sampling_cpu"] / a["paths"],
    "ray_ns": lambda a: NS * a["sampling_cpu"] / (a["rays"]),
    "resident_mb": lambda a: 1e-6 * a["resident_bytes"],
    "peak_mb": lambda a: 1e-6 * a["peak_bytes"],
    "film_mb": lambda a: 1e-6 * a["memory"]["filmBytes"],
    "image_mb": lambda a: 1e-6 * a["memory"]["imageBytes"],
}
# Whose growth is fitted: seconds and bytes; not those of one sample, which have a row of their own.
FITTED = ("prepare_cpu_s", "sampling_cpu_s", "cpu_s", "peak_mb")


def spread(values: Iterable[float]) -> Spread:
    """Median and range."""
    ordered = sorted(values)
    return {"median": statistics.median(ordered), "low": ordered[0], "high": ordered[-1]}


def points(axis: Axis, answers: Sequence[Sequence[Answer]]) -> list[dict[str, Any]]:
    """One object a value: the value, and the spread of each metric over the rounds."""
    found = []
    for value, rounds in zip(axis.values, answers, strict=True):
        point: dict[str, Any] = {"value": value, "scene": rounds[0]["scene"]}
        point |= {name: spread(map(metric, rounds)) for name, metric in METRICS.items()}
        found.append(point)
    return found


def slope(values: Sequence[float], costs: Sequence[Sequence[float]]) -> dict[str, Any] | None:
    """Log-log slope of what is added to the cost of the first value, by what is added to it.

    `costs` are [value][round]. Each round has a slope of its own, by least squares; given are their
    median and range, and the first value that counts: smaller ones add less than 5 % or less than
    twice the range of the first value's own cost. None where fewer than two values add more.
    """
    first = [float(c) for c in costs[0]]
    noise = max(LEAST_GROWTH * statistics.median(first), 2 * (max(first) - min(first)))
    grown = [
        i
        for i in range(1, len(values))
        if statistics.median(costs[i]) - statistics.median(first) > noise
    ]
    if len(grown) < 2:
        return None
    slopes = []
    for turn, base in enumerate(first):
        added = [(values[i] - values[0], costs[i][turn] - base) for i in grown]
        logs = [(math.log(x), math.log(y)) for x, y in added if y > 0]
        if len(logs) >= 2:
            x, y = np.array(logs).T
            slopes.append(float(np.polyfit(x, y, 1)[0]))
    return {**spread(slopes), "from": values[grown[0]]} if slopes else None


def slopes(axis: Axis, answers: Sequence[Sequence[Answer]]) -> dict[str, Any]:
    """The slope of each fitted metric."""
    return {
        name: slope(axis.values, [[METRICS[name](a) for a in rounds] for rounds in answers])
        for name in FITTED
    }


def per_decade(axis: Axis, answers: Sequence[Sequence[Answer]]) -> list[dict[str, Any]]:
    """How many ns of CPU time a sample gets dearer from value to value, per factor of ten."""
    sample = METRICS["sample_ns"]
    steps = []
    for i in range(1, len(axis.values)):
        decades = math.log10(axis.values[i] / axis.values[i - 1])
        added = [
            (sample(after) - sample(before)) / decades
            for before, after in zip(answers[i - 1], answers[i], strict=True)
        ]
        steps.append({"from": axis.values[i - 1], "to": axis.values[i], "ns": spread(added)})
    return steps


def fixed_share(axis: Axis, answers: Sequence[Sequence[Answer]]) -> dict[str, Any]:
    """What an image of 16 samples a pixel costs beside samples, as a share of its whole.

    `outside` are the phases beside sampling: opening, translating, building, writing. `intercept`
    is that of the line through the whole costs at 1 and 16 samples, which has the fixed part of the
    sampling in it too, and whatever makes the first sample dearer than the others.
    """
    i, j = axis.values.index(1), axis.values.index(16)
    pairs = list(zip(answers[i], answers[j], strict=True))
    result: dict[str, Any] = {}
    for clock in ("cpu", "wall"):
        sampling = "sampling_cpu_s" if clock == "cpu" else "sampling_s"
        outside = [1 - METRICS[sampling](b) / b[clock] for _, b in pairs]
        line = [(16 * a[clock] - b[clock]) / 15 / b[clock] for a, b in pairs]
        result[clock] = {"outside": spread(outside), "intercept": spread(line)}
    return result


def speed_up(answers: Sequence[Sequence[Answer]]) -> dict[str, Any]:
    """Wall seconds of sampling by one thread over those by two; and the CPU seconds of two."""
    one, two = answers
    wall, cpu = METRICS["sampling_s"], METRICS["sampling_cpu_s"]
    pairs = list(zip(one, two, strict=True))
    return {
        "sampling": spread(wall(a) / wall(b) for a, b in pairs),
        "cpu_of_two_by_one": spread(cpu(b) / cpu(a) for a, b in pairs),
    }
