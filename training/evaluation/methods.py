"""Ways to make an image of an item's first samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mbfeat import oidn
from training.dataset.reader import Item
from training.evaluation import auxiliary

Image = NDArray[np.float32]
RAW, BEST, OIDN_BEST = "raw", "best", "oidn"


@dataclass(frozen=True)
class Method:
    """A name for the tables, and image [3, h, w] of an item and a number of samples."""

    name: str
    image: Callable[[Item, int], Image]


def raw_image(item: Item, samples: int) -> Image:
    """The mean of the samples."""
    return np.asarray(item.half[:samples, :3].astype(np.float32).mean(axis=0))


def network(name: str, path: Path) -> Method:
    """A trained network; raises CheckpointError."""
    from training.checkpoints import load_model
    from training.inference import denoise

    model = load_model(path).model

    def image(item: Item, samples: int) -> Image:
        found = denoise(model, item, samples)
        return np.nan_to_num(found, nan=0.0, posinf=0.0, neginf=0.0)

    return Method(name, image)


def oidn_methods(threads: int = 0) -> list[Method]:
    """Open Image Denoise with first-hit features, and at its best; none where it is missing.

    At its best: albedo and normal of the first non-delta vertex, each filtered itself before.
    """
    if not oidn.available():
        return []
    device = oidn.Oidn(threads)

    def plain(item: Item, samples: int) -> Image:
        return device.plain(raw_image(item, samples), *auxiliary.first_hit(item, samples))

    def best(item: Item, samples: int) -> Image:
        return device.best(raw_image(item, samples), *auxiliary.first_non_delta(item, samples))

    return [Method("oidn plain", plain), Method(OIDN_BEST, best)]
