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

from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn.functional import pad

from training.model.splat import OUTSIDE, pairs, scaled_parts

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
        self, image: Tensor, features: Tensor, scales: Tensor | None, hidden: Tensor
    ) -> Tensor:
        likeness = Likeness(features, scales)
        return filtered(image, likeness, self.centre(hidden), self.table(), self.dilations)


class Likeness(NamedTuple):
    """Features [n, d, h, w], and where the last are guides their scales [n, 3, h, w]."""

    features: Tensor
    scales: Tensor | None = None


def filtered(
    image: Tensor, likeness: Likeness, centre: Tensor, table: Tensor, dilations: tuple[int, ...]
) -> Tensor:
    """All passes over `image` [n, c, h, w], with `centre` [n, passes, h, w] and ATrous.table()."""
    for level, dilation in enumerate(dilations):
        image = _pass(image, likeness, centre[:, level], table[level], dilation)
    return image


def _pass(
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
