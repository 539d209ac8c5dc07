"""The part of the image that is shown enlarged, and what of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mbfeat.metrics import EPSILON, srgb
from mbfeat.tradeoff.analysis import Rung
from mbfeat.tradeoff.measure import Measured
from mbfeat.tradeoff.reference import Reference
from mbfeat.tradeoff.variants import OWN, RAW
from mbfeat.tradeoff.wording import number, samples

Image = NDArray[np.floating]
LEAST_CONTRAST = 0.02  # counts for flat parts


@dataclass(frozen=True)
class Window:
    """Pixels: left, top, width, height."""

    x: int
    y: int
    width: int
    height: int

    def of(self, image: Image) -> Image:
        """That part of [3, h, w]."""
        return image[:, self.y : self.y + self.height, self.x : self.x + self.width]


@dataclass(frozen=True)
class Crop:
    """A display image [height, width, 3] in 0..1 and what it is of."""

    title: str
    note: str
    pixels: NDArray[np.float64]


def windows(height: int, width: int) -> list[Window]:
    """Squares of a fifth of the width that overlap and cover an image, but for a rest."""
    side = max(min(width // 5, height, width), min(8, width, height))
    step = max(side // 2, 1)
    return [
        Window(x, y, side, side)
        for y in range(0, height - side + 1, step)
        for x in range(0, width - side + 1, step)
    ]


def most_changed(image: Image, other: Image) -> Window:
    """Where two images of the same noise differ most, as a display shows them."""
    change = np.abs(srgb(np.asarray(image, np.float64)) - srgb(np.asarray(other, np.float64)))
    return max(windows(*other.shape[1:]), key=lambda window: float(window.of(change).mean()))


def hardest(image: Image, reference: Image) -> Window:
    """Where the error is large and there is something to see.

    Windows are weighed by the median of their relative error, which a few odd pixels do not move,
    times the contrast of the reference as a display shows it.
    """
    error = np.asarray((image - reference) ** 2 / (reference**2 + EPSILON)).mean(axis=0)
    shown = srgb(np.asarray(reference, dtype=np.float64))

    def weight(window: Window) -> float:
        contrast = window.of(shown).std(axis=(1, 2)).mean()
        return float(np.median(window.of(error[None])) * (LEAST_CONTRAST + contrast))

    return max(windows(*reference.shape[1:]), key=weight)


def equal_time(rows: Sequence[Rung]) -> tuple[float, list[Rung]]:
    """A time, and the best of each variant within it.

    The time is in the middle, on a logarithmic scale, of those of the raw image, or that of the
    slowest of the fastest rungs where that is later, so that every variant has an image.
    """
    raw = [row["total_seconds"]["median"] for row in rows if row["variant"] == RAW]
    names = list(dict.fromkeys(row["variant"] for row in rows))
    first = [
        min(row["total_seconds"]["median"] for row in rows if row["variant"] == name)
        for name in names
    ]
    seconds = max(math.sqrt(min(raw) * max(raw)), *first)
    chosen = []
    for name in names:
        mine = [row for row in rows if row["variant"] == name]
        fitting = [row for row in mine if row["total_seconds"]["median"] <= seconds]
        chosen.append(max(fitting, key=lambda row: row["samples_per_pixel"]))
    return seconds, chosen


def crops(
    rows: Sequence[Rung], measured: Measured, references: Mapping[str, Reference], metric: str
) -> tuple[float, Window, list[Crop]]:
    """The time, the window, and the crops: the reference, then each variant at equal time."""
    seconds, chosen = equal_time(rows)
    own = references[OWN].image
    raw = next(row for row in chosen if row["variant"] == RAW)
    window = hardest(measured.images[RAW, raw["samples_per_pixel"]][0], own)
    beside = f"the others: what {number(seconds)} s\nbuy at most, first seed"
    shown = [Crop("reference", beside, displayed(window.of(own)))]
    for row in chosen:
        image = measured.images[row["variant"], row["samples_per_pixel"]][0]
        note = (
            f"{samples(row['samples_per_pixel'])}, {number(row['total_seconds']['median'])} s\n"
            f"{metric} {number(row['errors'][metric]['median'])}"
        )
        shown.append(Crop(row["variant"], note, displayed(window.of(image))))
    return seconds, window, shown


def displayed(image: Image) -> NDArray[np.float64]:
    """[height, width, 3] in 0..1 for a display."""
    return np.asarray(srgb(np.asarray(image, dtype=np.float64)).transpose(1, 2, 0))
