"""What the measuring side asks of a renderer, and what it gets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

BUILD = ", build "  # what comes before a version's hash of the program itself


@dataclass(frozen=True)
class Job:
    """What stays the same over all renders of a process."""

    width: int
    height: int
    bounces: int  # scattering events after the camera ray
    threads: int


@dataclass(frozen=True)
class Rendered:
    """One finished render."""

    image: NDArray[np.float32]  # [height, width, 3], linear, top row first
    seconds: float  # wall; of the sampling, and of what cannot be told from it
    cpu: float  # CPU seconds of the process over the same time, all threads


class Renderer(Protocol):
    """A renderer with a scene loaded."""

    version: str

    def render(self, spp: int, seed: int) -> Rendered:
        """Renders; equal seeds give equal noise, different ones independent noise."""
        ...
