"""Edge-stopping passes after the splat, wider from pass to pass (the à-trous wavelet transform).

Each pass makes a pixel the weighted mean of 5 x 5 pixels that lie `dilation` apart. Weights are
exp(spatial - sharpness |f(x) - f(y)|^2) with the classes' features f (`distances`), so that light
spreads over what is alike and stops at edges; a pixel's own logit `centre` is the network's, which
keeps what is already clean. After Dammertz, Sewtz, Hanika and Lensch, "Edge-avoiding À-Trous
wavelet transform for fast global illumination filtering", 2010, with the learned features of Isik,
Mullia, Fisher, Eisenmann and Gharbi, "Interactive Monte Carlo denoising using affinity of neural
features", 2021.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn
from torch.nn.functional import pad

from training.model.splat import OUTSIDE, Area, distances, pairs, scaled_parts

SIDE = 5
RADIUS = SIDE // 2
TAPS = SIDE**2
MIDDLE = TAPS // 2
CENTRE = 2.0  # of an untrained pass, beside taps that reach 1 in all at most 24 times


class ATrous(nn.Module):
    """Passes with the given dilations, over images [n, c, h, w]."""

    def __init__(self, hidden: int, dilations: tuple[int, ...]) -> None:
        super().__init__()
        self.dilations = dilations
        self.centre = nn.Conv2d(hidden, len(dilations), 1)
        nn.init.normal_(self.centre.weight, std=0.01)
        assert self.centre.bias is not None
        nn.init.constant_(self.centre.bias, CENTRE)
        axis = torch.arange(SIDE, dtype=torch.float32) - RADIUS
        square = (axis[:, None] ** 2 + axis[None, :] ** 2).flatten()
        self.spatial = nn.Parameter((-0.25 * square).repeat(len(dilations), 1))
        self.sharpness = nn.Parameter(torch.ones(len(dilations), 1))

    def table(self) -> Tensor:
        """What does not depend on the image: [passes, TAPS + 1], spatial logits and sharpness."""
        return torch.cat([self.spatial, self.sharpness], dim=1)

    def forward(
        self, image: Tensor, likeness: Likeness, hidden: Tensor, *, plain: bool = False
    ) -> Tensor:
        """`plain`: in operators that ONNX has."""
        centre, table = self.centre(hidden), self.table()
        return filtered(image, likeness, centre, table, self.dilations, plain=plain)


class Likeness(NamedTuple):
    """Features [n, d, h, w], and where the last are guides their scales [n, groups, h, w]."""

    features: Tensor
    scales: Tensor | None = None


def filtered(
    image: Tensor,
    likeness: Likeness,
    centre: Tensor,
    table: Tensor,
    dilations: tuple[int, ...],
    *,
    plain: bool = False,
) -> Tensor:
    """All passes over `image` [n, c, h, w], with `centre` [n, passes, h, w] and ATrous.table()."""
    one_pass = _plain_pass if plain else _pass
    for level, dilation in enumerate(dilations):
        image = one_pass(image, likeness, centre[:, level], table[level], dilation)
    return image


class _WeightedSum(torch.autograd.Function):
    """Of weights [n, TAPS, h, w] and an image, at taps `dilation` apart; 0 outside the image.

    Without it the gradient of every tap would be an image of its own.
    """

    @staticmethod
    def forward(ctx: Any, weights: Tensor, image: Tensor, dilation: int) -> Tensor:
        ctx.save_for_backward(weights, image)
        ctx.dilation = dilation
        total = torch.zeros_like(image)
        for tap, here, there in _areas(image, dilation):
            total[here] += weights[here][:, tap, None] * image[there]
        return total

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, Tensor, None]:
        weights, image = ctx.saved_tensors
        (gradient,) = gradients
        to_weights, to_image = torch.zeros_like(weights), torch.zeros_like(image)
        for tap, here, there in _areas(image, ctx.dilation):
            torch.sum(gradient[here] * image[there], dim=1, out=to_weights[here][:, tap])
            to_image[there] += weights[here][:, tap, None] * gradient[here]
        return to_weights, to_image, None


def _areas(image: Tensor, dilation: int) -> Iterator[tuple[int, Area, Area]]:
    """Of each tap the pixels that have it inside the image, and where it is."""
    height, width = image.shape[-2:]
    every = slice(None)
    for tap in range(TAPS):
        down, right = dilation * (tap // SIDE - RADIUS), dilation * (tap % SIDE - RADIUS)
        if abs(down) < height and abs(right) < width:
            rows = slice(max(-down, 0), height - max(down, 0))
            columns = slice(max(-right, 0), width - max(right, 0))
            there = (
                slice(rows.start + down, rows.stop + down),
                slice(columns.start + right, columns.stop + right),
            )
            yield tap, (every, every, rows, columns), (every, every, *there)


def _pass(
    image: Tensor, likeness: Likeness, centre: Tensor, table: Tensor, dilation: int
) -> Tensor:
    features, scales = likeness
    # In the order of a splat's taps, which are those of a gathering the other way round.
    apart = distances(features, SIDE, scales, dilation=dilation, own=True).flip(1)
    outside = torch.full_like(apart[:1], OUTSIDE)
    for tap, here, _ in _areas(image, dilation):
        outside[here][:, tap] = 0.0
    own = torch.nn.functional.pad(centre[:, None], (0, 0, 0, 0, MIDDLE, MIDDLE))
    logits = table[:TAPS, None, None] - table[TAPS] * apart + outside + own
    total: Tensor = _WeightedSum.apply(torch.softmax(logits, dim=1), image, dilation)
    return total


def _plain_pass(
    image: Tensor, likeness: Likeness, centre: Tensor, table: Tensor, dilation: int
) -> Tensor:
    features, scales = likeness
    height, width = image.shape[-2:]
    spatial, sharpness = table[:TAPS], table[TAPS]
    logits = [torch.full_like(centre, OUTSIDE)] * TAPS
    logits[MIDDLE] = centre + spatial[MIDDLE]
    for pair in pairs(SIDE, height, width, dilation):
        tap, opposite = pair.tap, TAPS - 1 - pair.tap
        here, there = torch.zeros(()), torch.zeros(())
        for part, scale in scaled_parts(features, scales):
            apart = ((features[pair.here][:, part] - features[pair.there][:, part]) ** 2).sum(dim=1)
            # A pixel's own scales count.
            here = here + (apart if scale is None else apart * scale[pair.here][:, 0] ** 2)
            there = there + (apart if scale is None else apart * scale[pair.there][:, 0] ** 2)
        logits[tap] = pad(spatial[tap] - sharpness * here, pair.border_here, value=OUTSIDE)
        logits[opposite] = pad(
            spatial[opposite] - sharpness * there, pair.border_there, value=OUTSIDE
        )
    weights = torch.softmax(torch.stack(logits, dim=1), dim=1)
    reach = RADIUS * dilation
    wide = pad(image, (reach, reach, reach, reach))
    total = torch.zeros_like(image)
    for tap in range(TAPS):
        y, x = dilation * (tap // SIDE), dilation * (tap % SIDE)
        total = total + weights[:, tap, None] * wide[..., y : y + height, x : x + width]
    return total
