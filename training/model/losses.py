"""Losses of training, on linear radiance [n, 3, h, w]; their epsilon is not that of `metrics`."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class LossConfig:
    """Weights of the terms; the default is the published loss.

    `manifold` is that of the path-disentangling loss, and `manifold_until` the share of training
    after which it is off. `epsilon` is added to what errors are relative to: the smaller, the more
    does the dark count.
    """

    tonemapped_relmse: float = 1.0
    smape: float = 0.0
    log_l1: float = 0.0
    manifold: float = 0.0
    manifold_until: float = 0.6
    epsilon: float = 1e-2


def tonemapped(x: Tensor) -> Tensor:
    """x / (1 + x) of what is positive (Reinhard)."""
    positive = torch.clamp(x, min=0.0)
    return positive / (1.0 + positive)


def tonemapped_relmse(image: Tensor, reference: Tensor, epsilon: float) -> Tensor:
    """Gharbi et al. 2019, equation 4."""
    a, b = tonemapped(image), tonemapped(reference)
    return 0.5 * ((a - b) ** 2 / (b**2 + epsilon)).mean()


def smape(image: Tensor, reference: Tensor, epsilon: float) -> Tensor:
    """Symmetric mean absolute percentage error, the denominator held fixed."""
    below = (image.abs() + reference.abs() + epsilon).detach()
    return ((image - reference).abs() / below).mean()


def log_l1(image: Tensor, reference: Tensor) -> Tensor:
    """Mean absolute difference of log(1 + x)."""
    a, b = torch.clamp(image, min=0.0), torch.clamp(reference, min=0.0)
    return (torch.log1p(a) - torch.log1p(b)).abs().mean()


def manifold(embedding: Tensor, reference: Tensor, pairs: Tensor) -> Tensor:
    """Distances of embeddings follow those of reference colours, for pairs of pixels.

    The path-disentangling loss of Cho, Huo and Yoon 2021. `embedding` [n, c, h, w]; `pairs` int64
    [n, 2, count] are pixel indices.
    """
    colours = (tonemapped(reference) + 1e-6) ** (1 / 2.2)

    def distance(values: Tensor) -> Tensor:
        flat = values.flatten(2)
        first, second = (
            torch.gather(flat, 2, pairs[:, side, None].expand(-1, flat.shape[1], -1))
            for side in (0, 1)
        )
        return 0.5 * ((first - second) ** 2).sum(dim=1)

    return 0.5 * ((distance(embedding) - distance(colours)) ** 2).mean()


def image_loss(config: LossConfig, image: Tensor, reference: Tensor) -> Tensor:
    """The weighted sum of the terms that compare images."""
    total = image.new_zeros(())
    if config.tonemapped_relmse:
        term = tonemapped_relmse(image, reference, config.epsilon)
        total = total + config.tonemapped_relmse * term
    if config.smape:
        total = total + config.smape * smape(image, reference, config.epsilon)
    if config.log_l1:
        total = total + config.log_l1 * log_l1(image, reference)
    return total
