"""The image that errors are against, and the error that it has itself."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbfeat.metrics.bias import noise_floor
from mbfeat.tradeoff.exr import ImageFileError, read_color
from mbfeat.tradeoff.kept import Keep, digest
from mbfeat.tradeoff.renders import Renderer
from mbfeat.tradeoff.variants import Variant

FIRST_SEED, SEEDS = 1_000_000, 1_000_000  # no measured image has one of them, see measure.Task
LARGEST_CHUNK = 1024  # samples; an interrupted reference loses at most one render of so many

Tell = Callable[[str], None]


class ReferenceError(Exception):
    """There is no image to measure against; the message says why."""


@dataclass(frozen=True)
class Reference:
    """An image [3, height, width] as the truth.

    `floor` is its own error by metric, None where that cannot be told; `about` goes into the JSON,
    `key` changes with the image.
    """

    image: NDArray[np.float64]
    floor: Mapping[str, float] | None
    about: Mapping[str, Any]
    key: str


def given(files: Sequence[Path], size: tuple[int, int] | None = None) -> Reference:
    """The mean of EXR files; the noise of several, which have to be independent, shows.

    `size` is the width and height that it has to have. Raises ReferenceError.
    """
    try:
        images = [read_color(file).astype(np.float64) for file in files]
    except ImageFileError as error:
        raise ReferenceError(f"--reference: {error}") from error
    for file, image in zip(files, images, strict=True):
        height, width = image.shape[1:]
        wanted = size or (images[0].shape[2], images[0].shape[1])
        if (width, height) != wanted:
            raise ReferenceError(
                f"--reference {file}: it is {width} x {height} pixels and the renders are "
                f"{wanted[0]} x {wanted[1]}; render it again at that size, or leave out --width"
            )
    half = (len(images) + 1) // 2
    floor = None
    if len(images) > 1:
        first, second = (np.mean(part, axis=0) for part in (images[:half], images[half:]))
        floor = noise_floor(first, second)
    mean = np.asarray(np.mean(images, axis=0))
    about = {"kind": "given", "files": [str(file) for file in files]}
    return Reference(mean, floor, about, digest([about, [float(image.sum()) for image in images]]))


def chunks_of(spp: int) -> tuple[int, int]:
    """Samples and number of the renders that make a reference of at least `spp`.

    Powers of 4, which every renderer's sampler takes; an even number, for two halves.
    """
    chunk = min(LARGEST_CHUNK, 4 ** int(math.log(max(spp // 2, 1), 4) + 1e-9))
    return chunk, 2 * math.ceil(spp / (2 * chunk))


def is_rendered(variant: Variant, spp: int, keep: Keep, subject: str) -> bool:
    """Whether rendered() has nothing left to render."""
    chunk, count = chunks_of(spp)
    old = keep.load_arrays(_name(variant, chunk, subject))
    return old is not None and int(old["done"]) >= count


def _name(variant: Variant, chunk: int, subject: str) -> str:
    return "reference-" + digest([subject, variant.renders, chunk])


def rendered(
    renderer: Renderer, variant: Variant, spp: int, keep: Keep, subject: str, tell: Tell
) -> Reference:
    """Renders one of about `spp` samples a pixel from seeds of its own, in two halves.

    Goes on from what `keep` holds. `subject` is the key of what is rendered.
    """
    chunk, count = chunks_of(spp)
    key = _name(variant, chunk, subject)
    sums: NDArray[np.float64] | None = None
    done, seconds = 0, 0.0
    old = keep.load_arrays(key)
    if old is not None:
        sums, done, seconds = old["sums"], int(old["done"]), float(old["seconds"])
    while done < count:
        tell(f"reference of {variant.renderer}, {done * chunk} of {count * chunk} samples a pixel")
        shot = renderer.render(variant, chunk, FIRST_SEED + done)
        if sums is None:
            sums = np.zeros((2, *shot.image.shape))
        sums[done % 2] += shot.image
        done += 1
        seconds += shot.total
        keep.save_arrays(key, sums=sums, done=np.array(done), seconds=np.array(seconds))
    assert sums is not None
    first, second = sums[0] / ((done + 1) // 2), sums[1] / (done // 2)
    about = {
        "kind": "rendered",
        "samples_per_pixel": done * chunk,
        "seeds": [FIRST_SEED, FIRST_SEED + done - 1],
        "seconds": seconds,
    }
    floor = noise_floor(first, second)
    return Reference((first + second) / 2.0, floor, about, f"{key}-{done}")
