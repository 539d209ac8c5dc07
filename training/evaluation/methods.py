"""Ways to make an image of an item's first samples."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbfeat import metrics, oidn
from training.dataset.reader import Item
from training.evaluation import auxiliary
from training.evaluation.statistics import Row

Image = NDArray[np.float32]
RAW, BEST, OIDN_BEST = "raw", "best", "oidn"


@dataclass(frozen=True)
class Method:
    """A name for the tables, and image [3, h, w] of an item and a number of samples.

    What `prepared` gives is what a renderer has at hand when it is done, in the method's layout;
    `image` makes the image of it, and is what is timed.
    """

    name: str
    prepared: Callable[[Item, int], Any]
    image: Callable[[Any], Image]


def measured(method: Method, item: Item, number: int, samples: int) -> tuple[Row, Image]:
    """What a method makes of an item's first samples, and how far that is from its reference.

    `number` tells windows apart. Only the method's `image` is timed.
    """
    prepared = method.prepared(item, samples)
    started = time.perf_counter()
    image = method.image(prepared)
    seconds = time.perf_counter() - started
    about = item.about
    found = metrics.all_metrics(image, item.reference)
    return Row(method.name, about["class"], about["light"], samples, number, found, seconds), image


def raw_image(item: Item, samples: int) -> Image:
    """The mean of the samples."""
    return np.asarray(item.half[:samples, :3].astype(np.float32).mean(axis=0))


def raw() -> Method:
    """The image as it was rendered."""
    return Method(RAW, raw_image, lambda image: image)


def oidn_methods(threads: int = 0) -> list[Method]:
    """Open Image Denoise with first-hit features, and at its best; none where it is missing.

    At its best: albedo and normal of the first non-delta vertex, each filtered itself before.
    """
    if not oidn.available():
        return []
    device = oidn.Oidn(threads)

    def plain(item: Item, samples: int) -> Any:
        return raw_image(item, samples), *auxiliary.first_hit(item, samples)

    def best(item: Item, samples: int) -> Any:
        return raw_image(item, samples), *auxiliary.first_non_delta(item, samples)

    return [
        Method("oidn plain", plain, lambda given: device.plain(*given)),
        Method(OIDN_BEST, best, lambda given: device.best(*given)),
    ]
