"""Errors of an image against its reference: linear radiance [3, h, w], float64 inside.

| name | definition | source |
|---|---|---|
| relMSE | mean (x - y)^2 / (y^2 + 1e-4) | Rousselle et al. 2011; epsilon as in the paper's table |
| tonemappedRelMSE | the same of t(x) = x / (1 + x) of what is positive | Gharbi et al. 2019 |
| MSE, L1 | mean (x - y)^2, mean abs(x - y) | |
| relL1 | mean abs(x - y) / (abs(y) + 1e-4) | |
| DSSIM | (1 - SSIM) / 2 of the sRGB image, Gaussian window of sigma 1.5 | Wang et al. 2004 |
| FLIP | the LDR metric of mbfeat.metrics.flip on the sRGB image | Andersson et al. 2020 |

The first five are the paper's table 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mbfeat.metrics.flip import flip as seen_difference

Image = NDArray[np.float64]
EPSILON = 1e-4
PAPER = ("relMSE", "tonemappedRelMSE", "MSE", "relL1", "L1")
NAMES = (*PAPER, "DSSIM", "FLIP")


def tonemapped(x: Image) -> Image:
    """x / (1 + x) of what is positive."""
    positive = np.maximum(x, 0.0)
    return np.asarray(positive / (1.0 + positive))


def srgb(x: Image) -> Image:
    """Linear values as display values, clamped to 0..1."""
    linear = np.clip(x, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def relative_mse(x: Image, y: Image) -> float:
    """Squares of differences by the square of y and epsilon."""
    return float(((x - y) ** 2 / (y**2 + EPSILON)).mean())


def ssim(x: Image, y: Image) -> float:
    """Mean SSIM of display values [c, h, w] in 0..1 (Wang, Bovik, Sheikh and Simoncelli 2004)."""
    axis = np.arange(-5, 6)
    window = np.exp(-0.5 * (axis / 1.5) ** 2)
    window /= window.sum()
    c1, c2 = 0.01**2, 0.03**2

    def blurred(a: Image) -> Image:
        padded = np.pad(a, ((0, 0), (5, 5), (5, 5)), mode="reflect")
        height, width = a.shape[-2:]
        rows = sum(w * padded[:, i : i + height] for i, w in enumerate(window))
        return np.asarray(sum(w * rows[..., i : i + width] for i, w in enumerate(window)))

    mx, my = blurred(x), blurred(y)
    vx, vy = blurred(x * x) - mx * mx, blurred(y * y) - my * my
    covariance = blurred(x * y) - mx * my
    top = (2 * mx * my + c1) * (2 * covariance + c2)
    return float((top / ((mx**2 + my**2 + c1) * (vx + vy + c2))).mean())


def all_metrics(image: NDArray[np.floating], reference: NDArray[np.floating]) -> dict[str, float]:
    """Every metric by name. Raises ValueError where shapes differ or a value is not finite."""
    x, y = np.asarray(image, dtype=np.float64), np.asarray(reference, dtype=np.float64)
    if x.shape != y.shape or x.ndim != 3 or x.shape[0] != 3:
        raise ValueError(f"images have to be [3, h, w] of one size, not {x.shape} and {y.shape}")
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise ValueError("an image has values that are not finite")
    shown, wanted = srgb(x), srgb(y)
    return {
        "relMSE": relative_mse(x, y),
        "tonemappedRelMSE": relative_mse(tonemapped(x), tonemapped(y)),
        "MSE": float(((x - y) ** 2).mean()),
        "relL1": float((np.abs(x - y) / (np.abs(y) + EPSILON)).mean()),
        "L1": float(np.abs(x - y).mean()),
        "DSSIM": (1.0 - ssim(shown, wanted)) / 2.0,
        "FLIP": float(seen_difference(shown, wanted).mean()),
    }
