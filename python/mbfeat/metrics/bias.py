"""What averaging takes away from an error and what it leaves: noise and bias.

The mean of n images of independent noise has an n-th of the noise of one, and all of its bias.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mbfeat.metrics import EPSILON, NAMES, Image, all_metrics

# How a metric of the difference of two halves of a reference relates to that of the whole: the
# difference has four times the variance of the mean. Exact for squares, and for magnitudes where
# noise is normal; FLIP and DSSIM follow neither law, and are taken as magnitudes.
SQUARES = ("relMSE", "tonemappedRelMSE", "MSE")


def brightness_bias(image: NDArray[np.floating], reference: NDArray[np.floating]) -> float:
    """Mean of the difference by the mean of the reference, with its sign; 0 for a black one."""
    wanted = float(np.asarray(reference, dtype=np.float64).mean())
    difference = float(np.asarray(image, dtype=np.float64).mean()) - wanted
    return difference / wanted if wanted != 0.0 else 0.0


def squared_bias(
    images: Sequence[NDArray[np.floating]],
    reference: NDArray[np.floating],
    floor: float = 0.0,
) -> float | None:
    """The part of the relMSE that averaging images of more seeds would not take away.

    An unbiased estimate, so it is around zero, and may be below it, where there is none. `floor` is
    the relMSE of the reference itself, which is no bias of the images. None for a single image.
    """
    if len(images) < 2:
        return None
    stack = np.stack([np.asarray(image, dtype=np.float64) for image in images])
    y = np.asarray(reference, dtype=np.float64)
    noise = stack.var(axis=0, ddof=1) / len(images)
    found = ((stack.mean(axis=0) - y) ** 2 - noise) / (y**2 + EPSILON)
    return float(found.mean()) - floor


def noise_floor(first: Image, second: Image) -> dict[str, float]:
    """The error of the mean of two images of independent noise, by every metric."""
    found = all_metrics(first, second)
    return {name: found[name] / (4.0 if name in SQUARES else 2.0) for name in NAMES}
