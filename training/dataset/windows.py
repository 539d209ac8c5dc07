"""Where in an image a sample of the data set is taken: rather where paths are hard to guess.

Follows the importance sampling of patches of WCMC (Cho et al., "Weakly-supervised contrastive
learning in path manifold for Monte Carlo image reconstruction", 2021), with more weight on specular
chains.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from training.dataset import layout
from training.dataset.rendering import Samples, Window
from training.scenes.textures import Generator

RESOLUTIONS = ((320, 180), (480, 270), (640, 360), (960, 540))
PREVIEW_WIDTH, PREVIEW_SPP = 64, 8


def preview_window(resolution: tuple[int, int]) -> Window:
    """The whole image, small."""
    return Window.whole(PREVIEW_WIDTH, max(8, PREVIEW_WIDTH * resolution[1] // resolution[0]))


def chain_fraction(samples: Samples) -> NDArray[np.float64]:
    """Share of a pixel's paths whose first vertex is a mirror, glass or glossy [h, w]."""
    event = samples.bytes[:, layout.BYTES.index("mbfeat:event:0.Y")]
    not_diffuse = (event & (layout.SPECULAR | layout.GLOSSY)) != 0
    return np.asarray(not_diffuse.mean(axis=0))


def importance(samples: Samples) -> NDArray[np.float64]:
    """Weights [h, w], about 0.1 to 1: specular chains, edges of colour, noise."""
    radiance = samples.half[:, :3].astype(np.float64)
    mapped = radiance / (1 + np.abs(radiance))
    mean = mapped.mean(axis=(0, 1))
    edges = np.hypot(*np.gradient(mean))
    noise = mapped.mean(axis=1).std(axis=0)
    weight = 0.1 + 2.0 * chain_fraction(samples)
    weight += edges / (edges.mean() + 1e-6) * 0.15 + noise / (noise.mean() + 1e-6) * 0.15
    return np.asarray(weight * (mean > 1e-4))


def choose(
    rng: Generator, samples: Samples, resolution: tuple[int, int], size: int, count: int
) -> list[Window]:
    """`count` windows of `size` pixels a side, by the importance of their centres.

    Of a few candidates for each the one that overlaps least with those before it is taken.
    """
    weight = importance(samples)
    rows, columns = weight.shape
    total = weight.sum()
    flat = weight.ravel() / total if total > 0 else np.full(weight.size, 1 / weight.size)
    found: list[Window] = []
    for _ in range(count):
        candidates = []
        for cell in rng.choice(flat.size, 4, p=flat):
            cx = (cell % columns + rng.random()) / columns * resolution[0]
            cy = (cell // columns + rng.random()) / rows * resolution[1]
            x = int(np.clip(cx - size / 2, 0, max(resolution[0] - size, 0)))
            y = int(np.clip(cy - size / 2, 0, max(resolution[1] - size, 0)))
            candidates.append(
                Window(resolution, x, y, min(size, resolution[0]), min(size, resolution[1]))
            )
        found.append(min(candidates, key=lambda w: sum(_overlap(w, other) for other in found)))
    return found


def _overlap(a: Window, b: Window) -> int:
    width = min(a.x + a.width, b.x + b.width) - max(a.x, b.x)
    height = min(a.y + a.height, b.y + b.height) - max(a.y, b.y)
    return max(width, 0) * max(height, 0)
