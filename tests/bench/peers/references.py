"""Converged images of each renderer, kept from run to run and extended where more is asked for.

A reference is a sum of renders of different seeds, none of which the measured images use. It is
kept as two halves, whose difference shows its noise.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mbfeat.devtools.layout import digest

FIRST_SEED = 1_000_000  # measured images have smaller ones


@dataclass
class Reference:
    """Sums of images times their samples, in two halves; `chunks` is the renders so far."""

    sums: NDArray[np.float64]  # [2, height, width, 3]
    samples: list[int] = field(default_factory=lambda: [0, 0])
    chunks: int = 0

    @property
    def spp(self) -> int:
        """Samples of a pixel."""
        return sum(self.samples)

    @property
    def image(self) -> NDArray[np.float64]:
        return np.asarray(self.sums.sum(axis=0) / max(self.spp, 1))

    @property
    def halves(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Two images of independent noise; needs two chunks."""
        first, second = (self.sums[i] / max(self.samples[i], 1) for i in (0, 1))
        return first, second

    def add(self, image: NDArray[np.float32], spp: int) -> None:
        half = self.chunks % 2
        self.sums[half] += image.astype(np.float64) * spp
        self.samples[half] += spp
        self.chunks += 1

    @property
    def next_seed(self) -> int:
        return FIRST_SEED + self.chunks


class ReferenceStore:
    """A folder of references."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def path(self, scene: str, renderer: str, size: str, *parts: str | bytes) -> Path:
        """The file of a reference, keyed by all that its image depends on."""
        return self._folder / f"{scene}-{renderer}-{size}-{digest(*parts)}.npz"

    def load(self, path: Path, shape: tuple[int, int]) -> Reference:
        """What is kept there, or an empty reference of [height, width] pixels."""
        try:
            with np.load(path) as archive:
                about = json.loads(str(archive["about"]))
                sums = archive["sums"]
        except (OSError, ValueError, KeyError):  # none, or a damaged one: it is made again
            return Reference(np.zeros((2, *shape, 3)))
        return Reference(sums, list(about["samples"]), about["chunks"])

    def save(self, path: Path, reference: Reference) -> None:
        """Writes it whole or not at all; it takes the place of those that differ in key alone."""
        self._folder.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f"{path.stem}.{os.getpid()}.partial.npz")
        about = json.dumps({"samples": reference.samples, "chunks": reference.chunks})
        np.savez(partial, sums=reference.sums, about=np.array(about))
        partial.replace(path)
        for old in self._folder.glob(f"{path.stem.rpartition('-')[0]}-*.npz"):
            if old != path and ".partial" not in old.name:
                old.unlink(missing_ok=True)
