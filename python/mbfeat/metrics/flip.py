"""FLIP: the difference that a person sees when two images are shown in turn.

After Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom and Fairchild, "FLIP: A Difference
Evaluator for Alternating Images", Proceedings of the ACM on Computer Graphics and Interactive
Techniques 3(2), 2020; the numbers of sections and tables below are theirs.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float64]

# A monitor 0.7 m wide with 3840 pixels, seen from 0.7 m (section 3).
PIXELS_PER_DEGREE = 0.7 * 3840 / 0.7 * math.pi / 180

# Contrast sensitivity in YCxCz as sums of Gaussians a sqrt(pi / b) exp(-pi^2 d^2 / b) (table 1).
SENSITIVITY = (((1.0, 0.0047),), ((1.0, 0.0053),), ((34.1, 0.04), (13.5, 0.025)))
EXPONENT = 0.7  # q_c
KNEE, KNEE_VALUE = 0.4, 0.95  # p_c and p_t
FEATURE_WIDTH, FEATURE_EXPONENT = 0.082, 0.5  # w in degrees, q_f

TO_XYZ = np.array(
    [
        [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
        [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
        [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
    ]
)
WHITE = TO_XYZ.sum(axis=1)


def flip(image: Image, reference: Image, pixels_per_degree: float = PIXELS_PER_DEGREE) -> Image:
    """Difference [h, w] in 0..1 of two sRGB images [3, h, w] in 0..1 (section 4)."""
    a, b = _opponent(image), _opponent(reference)
    colour = _colour_difference(a, b, pixels_per_degree)
    features = _feature_difference(a[0], b[0], pixels_per_degree)
    return np.asarray(colour ** (1.0 - features))


def _linear(x: Image) -> Image:
    return np.where(x <= 0.04045, x / 12.92, ((np.maximum(x, 0.04045) + 0.055) / 1.055) ** 2.4)


def _opponent(srgb: Image) -> Image:
    """YCxCz [3, h, w] (equation 1)."""
    x, y, z = np.tensordot(TO_XYZ, _linear(srgb), axes=1) / WHITE[:, None, None]
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


def _rgb(opponent: Image) -> Image:
    y = (opponent[0] + 16.0) / 116.0
    xyz = np.stack([opponent[1] / 500.0 + y, y, y - opponent[2] / 200.0]) * WHITE[:, None, None]
    return np.asarray(np.tensordot(np.linalg.inv(TO_XYZ), xyz, axes=1))


def _lab(rgb: Image) -> Image:
    """L*a*b* with the Hunt effect: chroma counts less in the dark (equation 4)."""
    xyz = np.tensordot(TO_XYZ, rgb, axes=1) / WHITE[:, None, None]
    limit = 6 / 29
    root = np.where(xyz > limit**3, np.cbrt(np.maximum(xyz, 0)), xyz / (3 * limit**2) + 4 / 29)
    lightness = 116.0 * root[1] - 16.0
    a, b = 500.0 * (root[0] - root[1]), 200.0 * (root[1] - root[2])
    return np.stack([lightness, 0.01 * lightness * a, 0.01 * lightness * b])


def _hyab(a: Image, b: Image) -> Image:
    """Abasi et al. 2020: city block in lightness, Euclidean in chroma (equation 5)."""
    d = a - b
    return np.asarray(np.abs(d[0]) + np.hypot(d[1], d[2]))


def _colour_difference(a: Image, b: Image, pixels_per_degree: float) -> Image:
    widest = max(b for row in SENSITIVITY for _, b in row)
    radius = math.ceil(3 * math.sqrt(widest / (2 * math.pi**2)) * pixels_per_degree)
    d2 = (np.arange(-radius, radius + 1) / pixels_per_degree) ** 2
    seen = []
    for image in (a, b):
        channels = []
        for values, gaussians in zip(image, SENSITIVITY, strict=True):
            # A sum of Gaussians, each of which is separable.
            parts = [
                (s * math.sqrt(math.pi / w), np.exp(-(math.pi**2) * d2 / w)) for s, w in gaussians
            ]
            total = sum(s * g.sum() ** 2 for s, g in parts)
            channels.append(sum(s * _separable(values, g, g) for s, g in parts) / total)
        seen.append(_lab(np.clip(_rgb(np.stack(channels)), 0.0, 1.0)))
    difference = _hyab(*seen) ** EXPONENT
    green = _lab(np.array([0.0, 1.0, 0.0]).reshape(3, 1, 1))
    blue = _lab(np.array([0.0, 0.0, 1.0]).reshape(3, 1, 1))
    largest = float(_hyab(green, blue)[0, 0]) ** EXPONENT
    knee = KNEE * largest
    low = KNEE_VALUE / knee * difference
    high = KNEE_VALUE + (difference - knee) / (largest - knee) * (1.0 - KNEE_VALUE)
    return np.where(difference < knee, low, np.clip(high, 0.0, 1.0))


def _feature_difference(a: Image, b: Image, pixels_per_degree: float) -> Image:
    """Of edges and points, in Y (section 4.2)."""
    deviation = 0.5 * FEATURE_WIDTH * pixels_per_degree
    radius = math.ceil(3 * deviation)
    axis = np.arange(-radius, radius + 1)
    g = np.exp(-(axis**2) / (2 * deviation**2))
    smooth = g / g.sum()
    edge = -axis * g
    point = (axis**2 / deviation**2 - 1) * g
    # Positive and negative weights each sum to one.
    filters = [np.where(f > 0, f / f[f > 0].sum(), f / -f[f < 0].sum()) for f in (edge, point)]
    strengths = []
    for y in (a, b):
        normalised = (y + 16.0) / 116.0
        strengths.append(
            [
                np.hypot(_separable(normalised, smooth, f), _separable(normalised, f, smooth))
                for f in filters
            ]
        )
    differences = [np.abs(x - y) for x, y in zip(*strengths, strict=True)]
    return np.asarray((np.maximum(*differences) / math.sqrt(2)) ** FEATURE_EXPONENT)


def _separable(image: Image, vertical: Image, horizontal: Image) -> Image:
    """Correlates with the outer product of two filters; the border is repeated."""
    radius = len(vertical) // 2
    height, width = image.shape
    padded = np.pad(image, radius, mode="edge")
    rows = sum(w * padded[i : i + height] for i, w in enumerate(vertical))
    return np.asarray(sum(w * rows[:, i : i + width] for i, w in enumerate(horizontal)))
