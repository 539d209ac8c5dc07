"""Batches: patches of data sets, cut and augmented by random numbers keyed on step and place.

What a step sees depends on nothing but the seed and the step, so that a resumed run sees the same,
and so do several processes that share a batch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from training.config import DataConfig
from training.dataset.reader import Dataset
from training.keyed import generator
from training.model import inputs
from training.scenes.textures import Generator

HIGHEST_VERTEX = 5


@dataclass
class Batch:
    """`x` [n, samples, channels, h, w], `reference` [n, 3, h, w], `pairs` [n, 2, count] int64."""

    x: Tensor
    reference: Tensor
    pairs: Tensor


class Batches:
    """The batches of a run on some data sets; raises ValueError where they cannot serve."""

    PAIRS = 2048

    def __init__(
        self, datasets: Sequence[Dataset], config: DataConfig, features: str, seed: int
    ) -> None:
        self._datasets, self._config = datasets, config
        self._features, self._seed = features, seed
        self._places = [(d, i) for d in datasets for i in range(len(d))]
        for dataset in datasets:
            if dataset.plan.size < config.patch:
                raise ValueError(
                    f"{dataset.folder} has windows of {dataset.plan.size} pixels, too small for "
                    f"data.patch={config.patch}"
                )
            if dataset.plan.spp < config.spp_max:
                raise ValueError(
                    f"{dataset.folder} has {dataset.plan.spp} samples, fewer than "
                    f"data.spp_max={config.spp_max}"
                )

    def __len__(self) -> int:
        return len(self._places)

    def batch(self, step: int, slots: Sequence[int]) -> Batch:
        """These places of the batch of a step; all of a step have the same number of samples."""
        c = self._config
        rng = generator("spp", self._seed, step)
        spp = int(rng.integers(c.spp_min, c.spp_max + 1))
        patches = [self._patch(generator("patch", self._seed, step, s), spp) for s in slots]
        xs, references, pairs = zip(*patches, strict=True)
        return Batch(torch.stack(xs), torch.stack(references), torch.stack(pairs))

    def _patch(self, rng: Generator, spp: int) -> tuple[Tensor, Tensor, Tensor]:
        c = self._config
        dataset, index = self._places[int(rng.integers(len(self._places)))]
        item = dataset[index]
        height, width = item.reference.shape[-2:]
        top = int(rng.integers(height - c.patch + 1))
        left = int(rng.integers(width - c.patch + 1))
        area = (..., slice(top, top + c.patch), slice(left, left + c.patch))
        chosen = rng.choice(item.half.shape[0], spp, replace=False)
        x = inputs.network_input(
            np.stack([item.half[s][area] for s in chosen]),
            np.stack([item.bytes[s][area] for s in chosen]),
            item.world_to_camera,
            self._features,
        )
        reference = torch.from_numpy(np.array(item.reference[area]))
        x, reference = self._augmented(rng, x, reference)
        pairs = torch.from_numpy(rng.integers(0, c.patch**2, (2, self.PAIRS)))
        return x, reference, pairs

    def _augmented(self, rng: Generator, x: Tensor, reference: Tensor) -> tuple[Tensor, Tensor]:
        # All numbers are drawn, whatever is switched on, so that a switch changes nothing else.
        c = self._config
        horizontal, vertical, diagonal = (bool(v) for v in rng.random(3) < 0.5)
        colours = torch.from_numpy(rng.permutation(3))
        stops = float(rng.uniform(-1.0, 1.0))
        drop_vertices, drop_all = rng.random(2)
        vertex = int(rng.integers(1, HIGHEST_VERTEX + 1))
        if c.flips:
            x, reference = turned(x, reference, self._features, horizontal, vertical, diagonal)
        if c.permute_colours:
            for first in inputs.colour_channels(self._features):
                x[:, first : first + 3] = x[:, first : first + 3][:, colours]
            reference = reference[colours]
        if c.exposure:
            gain = 2.0 ** (c.exposure * stops)
            x[:, inputs.radiance_channels(self._features)] *= gain
            reference = reference * gain
        if drop_all < c.feature_dropout:
            x[:, len(inputs.COMMON) - 1 :] = 0.0
        elif drop_vertices < c.vertex_dropout:
            names = inputs.CHANNELS[self._features]
            lost = [i for i, name in enumerate(names) if _vertex_of(name) >= vertex]
            x[:, lost] = 0.0
        return x, reference


def _vertex_of(name: str) -> int:
    """The vertex that a channel tells of; -1 for those of the whole path."""
    part = name.partition(".")[0].rpartition(":")[2]
    return int(part) if part.isdigit() else -1


def turned(
    x: Tensor,
    reference: Tensor,
    features: str,
    horizontal: bool,
    vertical: bool,
    diagonal: bool,
) -> tuple[Tensor, Tensor]:
    """Mirrors input and reference, and what has a direction in them with it.

    Rows run downwards, the camera's y upwards: the diagonal exchanges x and y and turns both round.
    """
    normals = inputs.normal_channels(features)
    sub_x, sub_y = inputs.COMMON.index("subpixel.X"), inputs.COMMON.index("subpixel.Y")
    if horizontal:  # flip() copies
        x, reference = x.flip(-1), reference.flip(-1)
        x[:, sub_x] = 1.0 - x[:, sub_x]
        x[:, normals] = -x[:, normals]
    if vertical:
        x, reference = x.flip(-2), reference.flip(-2)
        x[:, sub_y] = 1.0 - x[:, sub_y]
        upward = [first + 1 for first in normals]
        x[:, upward] = -x[:, upward]
    if diagonal:
        x, reference = x.transpose(-1, -2).clone(), reference.transpose(-1, -2)
        x[:, [sub_x, sub_y]] = x[:, [sub_y, sub_x]]
        both = [i for first in normals for i in (first, first + 1)]
        swapped = [i for first in normals for i in (first + 1, first)]
        x[:, both] = -x[:, swapped]
    return x.contiguous(), reference.contiguous()
