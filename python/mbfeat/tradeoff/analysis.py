"""Medians and ranges of the measured, the Pareto front, and the two answers."""

from __future__ import annotations

import itertools
import math
import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mbfeat.metrics.bias import squared_bias
from mbfeat.tradeoff.measure import Measured, Point
from mbfeat.tradeoff.reference import Reference
from mbfeat.tradeoff.renders import PHASES
from mbfeat.tradeoff.variants import RAW, Variant
from mbfeat.tradeoff.wording import number, samples

Rung = dict[str, Any]

# A reference with noise adds its own error to every measured one. Below this many times that,
# more than a quarter of what was measured is the reference's.
NEAR_FLOOR = 4.0


def spread(values: Iterable[float]) -> dict[str, float]:
    """Median and range."""
    ordered = sorted(values)
    return {"median": statistics.median(ordered), "low": ordered[0], "high": ordered[-1]}


def rungs(
    measured: Measured,
    variants: Sequence[Variant],
    references: Mapping[str, Reference],
    metric: str,
) -> list[Rung]:
    """One row for each variant and number of samples, over its seeds; the front is of `metric`."""
    rows = []
    for variant in variants:
        reference = references.get(variant.renderer)
        mine = [point for point in measured.points if point["variant"] == variant.name]
        for spp in sorted({point["samples_per_pixel"] for point in mine}):
            if reference is not None:
                rows.append(_rung(variant, spp, mine, measured, reference))
    mark_front(rows, metric)
    return rows


def _rung(
    variant: Variant, spp: int, mine: Sequence[Point], measured: Measured, reference: Reference
) -> Rung:
    points = [point for point in mine if point["samples_per_pixel"] == spp]
    errors = {
        name: spread(point["errors"][name] for point in points) for name in points[0]["errors"]
    }
    floor = reference.floor or {}
    return {
        "variant": variant.name,
        "renderer": variant.renderer,
        "samples_per_pixel": spp,
        "seeds": len(points),
        "total_seconds": spread(point["total_seconds"] for point in points),
        "seconds": middle_seconds(points),
        "errors": errors,
        "bias": spread(point["bias"] for point in points),
        "squared_bias": squared_bias(
            measured.images[variant.name, spp], reference.image, floor.get("relMSE", 0.0)
        ),
        "near_floor": {
            name: errors[name]["median"] < NEAR_FLOOR * own for name, own in floor.items()
        },
    }


def middle_seconds(points: Sequence[Point]) -> dict[str, float]:
    """Where the seconds went in the render of the median total, so that they add up to it.

    Of an even number of renders it is the mean of the two in the middle.
    """
    ordered = sorted(points, key=lambda point: float(point["total_seconds"]))
    middle = ordered[(len(ordered) - 1) // 2 : len(ordered) // 2 + 1]
    return {
        phase: statistics.fmean(point["seconds"].get(phase, 0.0) for point in middle)
        for phase in PHASES
    }


def dominated(row: tuple[float, float], others: Iterable[tuple[float, float]]) -> bool:
    """Whether another (seconds, error) is no worse in both and better in one."""
    return any(other[0] <= row[0] and other[1] <= row[1] and other != row for other in others)


def pareto(points: Sequence[Point], metric: str) -> list[Point]:
    """The measurements that no other beats in both seconds and error, by seconds."""
    places = [(point["total_seconds"], point["errors"][metric]) for point in points]
    kept = [p for p, place in zip(points, places, strict=True) if not dominated(place, places)]
    return sorted(kept, key=lambda point: point["total_seconds"])


def mark_front(rows: Sequence[Rung], metric: str) -> None:
    """Sets `on_front` of the rungs whose medians no other beats."""
    places = [(row["total_seconds"]["median"], row["errors"][metric]["median"]) for row in rows]
    for row, place in zip(rows, places, strict=True):
        row["on_front"] = not dominated(place, places)


# ---- the two answers


@dataclass(frozen=True)
class Estimate:
    """What a variant does with some number of samples."""

    variant: str
    spp: int
    seconds: float
    error: float
    basis: str  # "measured", "interpolated" or "extrapolated"


class Curve:
    """Seconds and error of one variant by samples: lines between the medians of its rungs.

    Seconds are linear in samples, errors are powers of them. Beyond the last rung only the raw
    mean is followed, whose squared errors fall as 1 / samples; of a reconstruction nobody knows.
    """

    REACH = 16  # times the last rung

    def __init__(self, rows: Sequence[Rung], metric: str) -> None:
        ordered = sorted(rows, key=lambda row: row["samples_per_pixel"])
        self.variant = str(ordered[0]["variant"])
        self.spp = [int(row["samples_per_pixel"]) for row in ordered]
        self.seconds = [float(row["total_seconds"]["median"]) for row in ordered]
        self.errors = [max(float(row["errors"][metric]["median"]), 1e-30) for row in ordered]
        last = ordered[-1]["seconds"]
        self._each = (last["sampling"] + last["recording"]) / self.spp[-1]
        # Time never falls with samples; where it was measured so, that is the machine's noise, and
        # fewer samples would have been had in the time of the more. So no answer is worse than a
        # rung that was measured.
        self._measured = list(self.seconds)
        for i in reversed(range(len(self.seconds) - 1)):
            self.seconds[i] = min(self.seconds[i], self.seconds[i + 1])
        self._exponent = 1.0 if metric in ("relMSE", "tonemappedRelMSE", "MSE") else 0.5
        self._extends = self.variant == RAW and len(self.spp) > 1

    def at_samples(self, spp: float) -> Estimate:
        """Linear in samples, and a power law of them, between the rungs around."""
        whole = max(int(spp), 1)
        if whole in self.spp:
            i = self.spp.index(whole)
            return self._rung(i)
        if whole > self.spp[-1]:
            seconds = self.seconds[-1] + (whole - self.spp[-1]) * self._each
            error = self.errors[-1] * (self.spp[-1] / whole) ** self._exponent
            return Estimate(self.variant, whole, seconds, error, "extrapolated")
        high = next(i for i, rung in enumerate(self.spp) if rung > whole)
        low = max(high - 1, 0)
        if low == high:  # below the first rung nothing is known
            return self._rung(0)
        a, b = self.spp[low], self.spp[high]
        seconds = self.seconds[low] + (whole - a) / (b - a) * (
            self.seconds[high] - self.seconds[low]
        )
        along = math.log(whole / a) / math.log(b / a)
        logs = [math.log(self.errors[i]) for i in (low, high)]
        error = math.exp(logs[0] + along * (logs[1] - logs[0]))
        return Estimate(self.variant, whole, seconds, error, "interpolated")

    def _rung(self, i: int) -> Estimate:
        basis = "measured" if self.seconds[i] == self._measured[i] else "interpolated"
        return Estimate(self.variant, self.spp[i], self.seconds[i], self.errors[i], basis)

    @property
    def most(self) -> int:
        """Samples up to which an answer goes."""
        return self.spp[-1] * self.REACH if self._extends else self.spp[-1]

    def within_seconds(self, seconds: float) -> Estimate | None:
        """The best that is done in that time; None where even the first rung takes longer."""
        if self.seconds[0] > seconds:
            return None
        return min(self._candidates(lambda e: e.seconds <= seconds), key=lambda e: e.error)

    def to_error(self, error: float) -> Estimate | None:
        """The fastest that reaches the error; None where that cannot be told or done."""
        found = self._candidates(lambda e: e.error <= error)
        return min(found, key=lambda e: e.seconds, default=None)

    def _candidates(self, fits: Any) -> list[Estimate]:
        """Of the rungs, and of the numbers of samples between and beyond, those that fit.

        Both seconds and, from rung to rung, error are monotonic, so bisection finds the edges.
        """
        ends = [*self.spp, *([self.most] if self._extends else [])]
        found = [e for e in (self.at_samples(spp) for spp in ends) if fits(e)]
        for a, b in itertools.pairwise(ends):
            low, high = a, b
            first = fits(self.at_samples(low))
            if first == fits(self.at_samples(high)):
                continue
            while high - low > 1:
                middle = (low + high) // 2
                low, high = (
                    (middle, high) if fits(self.at_samples(middle)) == first else (low, middle)
                )
            found.append(self.at_samples(low if first else high))
        return found


def curves(rows: Sequence[Rung], metric: str, renderer: str) -> list[Curve]:
    """One for each variant of a renderer."""
    names = list(dict.fromkeys(row["variant"] for row in rows if row["renderer"] == renderer))
    return [Curve([row for row in rows if row["variant"] == name], metric) for name in names]


def answer_seconds(
    found: Sequence[Curve], seconds: float, metric: str, floor: float | None
) -> dict[str, Any]:
    """With S seconds, what is the best I get and how?"""
    estimates = [e for e in (curve.within_seconds(seconds) for curve in found) if e is not None]
    best = min(estimates, key=lambda e: e.error, default=None)
    answer = _answer("seconds", seconds, metric, best, estimates)
    if best is None:
        least = min(curve.seconds[0] for curve in found)
        answer["text"] = (
            f"With {number(seconds)} s there is no image: the fastest one that was measured took "
            f"{number(least)} s."
        )
        return answer
    answer["text"] = (
        f"With {number(seconds)} s the least {metric} is {number(best.error)}, by {best.variant} "
        f"at {samples(best.spp)} in {number(best.seconds)} s ({best.basis})."
        + _rivals(best, estimates, metric)
        + _caution(best.error, floor)
    )
    return answer


def answer_error(
    found: Sequence[Curve], error: float, metric: str, floor: float | None
) -> dict[str, Any]:
    """To reach error E, how long and how?"""
    estimates = [e for e in (curve.to_error(error) for curve in found) if e is not None]
    best = min(estimates, key=lambda e: e.seconds, default=None)
    answer = _answer("error", error, metric, best, estimates)
    if best is None:
        least = min(min(curve.errors) for curve in found)
        answer["text"] = (
            f"No variant was seen to reach {metric} {number(error)}; the lowest measured is "
            f"{number(least)}. Measure more samples with --spp."
        )
        return answer
    answer["text"] = (
        f"To {metric} {number(error)} it takes {number(best.seconds)} s, by {best.variant} at "
        f"{samples(best.spp)} ({best.basis})."
        + _rivals(best, estimates, metric)
        + _caution(error, floor)
    )
    return answer


def _answer(
    question: str, asked: float, metric: str, best: Estimate | None, all_of: Sequence[Estimate]
) -> dict[str, Any]:
    return {
        "question": question,
        "asked": asked,
        "metric": metric,
        "best": vars(best) if best is not None else None,
        "variants": [vars(estimate) for estimate in all_of],
    }


def _rivals(best: Estimate, estimates: Sequence[Estimate], metric: str) -> str:
    others = [
        f"{e.variant} {number(e.error)} in {number(e.seconds)} s at {samples(e.spp)} ({e.basis})"
        for e in estimates
        if e.variant != best.variant
    ]
    return f" The others, {metric}: {'; '.join(others)}." if others else ""


def _caution(error: float, floor: float | None) -> str:
    if floor is None:
        return " What noise the reference has itself is not known."
    if error >= NEAR_FLOOR * floor:
        return ""
    return (
        f" The reference has an error of {number(floor)} itself, so that this is more of a guess: "
        "give or render one of more samples."
    )
