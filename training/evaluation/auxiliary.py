"""Auxiliary images of a window, [3, h, w] float32, as Open Image Denoise wants them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from training.dataset import layout
from training.dataset.layout import VERTICES
from training.dataset.reader import Item

Image = NDArray[np.float32]


def first_hit(item: Item, samples: int) -> tuple[Image, Image]:
    """Albedo and world-space normal of the first vertex, means over the samples."""
    half = item.half[:samples].astype(np.float32)
    return (
        half[:, layout.channels("mbfeat:albedo:0")].mean(axis=0),
        half[:, layout.channels("mbfeat:normal:0")].mean(axis=0),
    )


def first_non_delta(item: Item, samples: int) -> tuple[Image, Image]:
    """The same of the first vertex that is neither mirror nor clear glass.

    Albedo is tinted by what the path met before it; the mean over samples blends what is reflected
    and what is transmitted by how often paths went there.
    """
    half = item.half[:samples].astype(np.float32)
    valid = item.bytes[:samples, 0]
    albedo = np.zeros((half.shape[0], 3, *half.shape[2:]), dtype=np.float32)
    normal = np.zeros_like(albedo)
    before = np.ones((half.shape[0], 1, *half.shape[2:]), dtype=bool)
    for k in VERTICES:
        delta = (item.bytes[:samples, 1 + k] & layout.SPECULAR) != 0
        here = before & (((valid >> k) & 1 != 0) & ~delta)[:, None]
        tint = np.clip(half[:, layout.channels(f"mbfeat:throughput:{k}")], 0.0, 1.0)
        albedo += here * tint * half[:, layout.channels(f"mbfeat:albedo:{k}")]
        normal += here * half[:, layout.channels(f"mbfeat:normal:{k}")]
        before &= ~here
    return np.clip(albedo.mean(axis=0), 0.0, 1.0), normal.mean(axis=0)
