"""The error of an image, and the samples that reach a given one.

Errors are relative mean squared errors, mean((x - r)^2 / (r^2 + 0.01)) over pixels and colours.
That of independent samples falls as c / n with the n samples of a pixel, and a reference of m
samples adds c / m of its own, which the fit knows.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

REGULARISER = 0.01
NEAREST = 3  # rungs of a ladder that the fit uses: those nearest to the target

Image = NDArray[np.floating]


def relative_mse(image: Image, reference: Image) -> float:
    """The error of an image against a reference."""
    r = reference.astype(np.float64)
    return float(np.mean((image - r) ** 2 / (r * r + REGULARISER)))


def spread_mse(images: Sequence[Image]) -> float:
    """The error of one of several images of independent noise, against what all would become.

    Needs no reference; with few images it is rough.
    """
    if len(images) < 2:
        raise ValueError("the spread of an error needs two images")
    mean = np.mean([image.astype(np.float64) for image in images], axis=0)
    within = statistics.fmean(relative_mse(image, mean) for image in images)
    return within * len(images) / (len(images) - 1)


@dataclass(frozen=True)
class Fit:
    """error = constant / spp near the target."""

    target: float
    constant: float
    low: float  # of the constant, over the seeds
    high: float
    exponent: float  # p of error = c / spp^p, fitted freely; NaN with a single rung
    extrapolated: bool  # no rung reached the target

    @property
    def spp(self) -> float:
        """Samples of a pixel to the target."""
        return self.constant / self.target

    @property
    def spp_range(self) -> tuple[float, float]:
        return self.low / self.target, self.high / self.target


def fit(errors: Mapping[int, Sequence[float]], reference_spp: float, target: float) -> Fit:
    """Fits the errors of several seeds at several numbers of samples.

    `errors` are against a reference of `reference_spp` samples of a pixel (may be infinite). Each
    rung counts by the median of its seeds, which a stray bright pixel in one of them does not move.
    """
    if not errors or reference_spp <= 0:
        raise ValueError("a fit needs errors and a reference")

    def constant(spp: int, error: float) -> float:
        return error / (1.0 / spp + 1.0 / reference_spp)

    medians = {spp: statistics.median(row) for spp, row in sorted(errors.items())}
    corrected = {spp: constant(spp, error) / spp for spp, error in medians.items()}
    if min(corrected.values()) <= 0.0:  # an image without noise
        return Fit(target, 0.0, 0.0, 0.0, math.nan, False)

    def distance(spp: int) -> float:
        return abs(math.log(corrected[spp] / target))

    used = sorted(sorted(corrected, key=distance)[:NEAREST])
    exponent = math.nan
    if len(used) > 1:
        x = np.log(used)
        y = np.log([corrected[spp] for spp in used])
        exponent = -float(np.polyfit(x, y, 1)[0])

    def combined(choose: Callable[[Sequence[float]], float]) -> float:
        """Geometric mean over the rungs of a median, lowest or highest constant."""
        logs = [math.log(constant(spp, max(choose(errors[spp]), 1e-30))) for spp in used]
        return math.exp(statistics.fmean(logs))

    return Fit(
        target,
        combined(statistics.median),
        combined(min),
        combined(max),
        exponent,
        extrapolated=min(corrected.values()) > target,
    )


def relative_difference(a: Image, b: Image, block: int = 8) -> float:
    """Mean of |a - b| / (b + 0.01) over blocks of block x block pixels, which averages noise.

    What is left over at the right and the bottom is cut.
    """
    rows, columns = a.shape[0] // block, a.shape[1] // block

    def blocks(image: Image) -> Image:
        cut = image[: rows * block, : columns * block].astype(np.float64)
        return cut.reshape(rows, block, columns, block, -1).mean(axis=(1, 3))

    first, second = blocks(a), blocks(b)
    return float(np.mean(np.abs(first - second) / (np.abs(second) + REGULARISER)))
