"""Pointwise networks and the U-Net of Gharbi et al. 2019, section 4.1."""

from __future__ import annotations

from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn.utils.parametrizations import weight_norm as normalised

SLOPE = 0.01  # of leaky ReLU, PyTorch's default


def convolution(inputs: int, outputs: int, size: int, *, weight_norm: bool) -> nn.Module:
    """A convolution that keeps the image's size; Xavier weights, zero bias."""
    layer = nn.Conv2d(inputs, outputs, size, padding=size // 2)
    nn.init.xavier_uniform_(layer.weight, nn.init.calculate_gain("leaky_relu", SLOPE))
    assert layer.bias is not None
    nn.init.zeros_(layer.bias)
    return normalised(layer) if weight_norm else layer


def pointwise(
    inputs: int, width: int, outputs: int, layers: int, *, weight_norm: bool
) -> nn.Sequential:
    """`layers` 1x1 convolutions, each followed by leaky ReLU."""
    widths = [inputs, *[width] * (layers - 1), outputs]
    steps: list[nn.Module] = []
    for a, b in pairwise(widths):
        steps += [convolution(a, b, 1, weight_norm=weight_norm), nn.LeakyReLU(SLOPE)]
    return nn.Sequential(*steps)


def _convolutions(inputs: int, outputs: int, count: int, *, weight_norm: bool) -> nn.Sequential:
    steps: list[nn.Module] = []
    for i in range(count):
        layer = convolution(inputs if i == 0 else outputs, outputs, 3, weight_norm=weight_norm)
        steps += [layer, nn.LeakyReLU(SLOPE)]
    return nn.Sequential(*steps)


class UNet(nn.Module):
    """From [n, inputs, h, w] to [n, widths[0], h, w], of any size.

    Max pooling down, bilinear enlargement up, the skipped features concatenated. Pooling takes a
    last odd row or column alone, and enlargement crops it again.
    """

    def __init__(
        self, inputs: int, widths: tuple[int, ...], convs: int, *, weight_norm: bool
    ) -> None:
        super().__init__()
        self.down = nn.ModuleList()
        self.up = nn.ModuleList()
        for level, width in enumerate(widths):
            before = inputs if level == 0 else widths[level - 1]
            self.down.append(_convolutions(before, width, convs, weight_norm=weight_norm))
        for width, below in pairwise(widths):
            self.up.append(_convolutions(width + below, width, convs, weight_norm=weight_norm))

    def forward(self, x: Tensor) -> Tensor:
        skipped: list[Tensor] = []
        for level, block in enumerate(self.down):
            if level:
                x = nn.functional.max_pool2d(x, 2, ceil_mode=True)
            x = block(x)
            skipped.append(x)
        for level in reversed(range(len(self.up))):
            skip = skipped[level]
            x = self.up[level](torch.cat([enlarged(x, skip), skip], dim=1))
        return x


def enlarged(x: Tensor, like: Tensor) -> Tensor:
    """Twice the size, bilinearly, cropped to the size of `like`."""
    twice = nn.functional.interpolate(x, scale_factor=2.0, mode="bilinear", align_corners=False)
    return twice[..., : like.shape[-2], : like.shape[-1]]
