"""Means, ratios and bootstrap intervals of metrics."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from training.keyed import generator

RESAMPLES = 2000
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Row:
    """One image by one method: `group` is its class or stage, `light` what dominates it."""

    method: str
    group: str
    light: str
    samples: int
    image: int
    metrics: Mapping[str, float]
    seconds: float


@dataclass(frozen=True)
class Interval:
    """A number with its bootstrap interval."""

    value: float
    low: float
    high: float


def values(rows: Iterable[Row], method: str, metric: str) -> NDArray[np.float64]:
    """The metric of a method's images, in the order of the images."""
    chosen = sorted((r for r in rows if r.method == method), key=lambda r: r.image)
    return np.array([r.metrics[metric] for r in chosen])


def mean(rows: Iterable[Row], method: str, metric: str) -> float:
    found = values(rows, method, metric)
    return float(found.mean()) if found.size else float("nan")


def ratio(rows: Sequence[Row], first: str, second: str, metric: str) -> Interval:
    """Mean metric of one method over that of another, with the interval of resampled images."""
    a, b = values(rows, first, metric), values(rows, second, metric)
    if a.size != b.size or not a.size:
        raise ValueError(f"{first} and {second} were not run on the same images")
    rng = generator("bootstrap", first, second, metric)
    chosen = rng.integers(0, a.size, (RESAMPLES, a.size))
    below = b[chosen].mean(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = a[chosen].mean(axis=1) / below
        value = float(a.mean() / b.mean())
    tail = 50 * (1 - CONFIDENCE)
    low, high = np.percentile(found, [tail, 100 - tail])
    return Interval(value, float(low), float(high))
