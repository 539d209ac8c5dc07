"""Pointwise networks and the U-Net of Gharbi et al. 2019, section 4.1."""

from __future__ import annotations

from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn.utils.parametrizations import weight_norm as normalised

SLOPE = 0.01  # of leaky ReLU, PyTorch's default


def convolution(inputs: int, outputs: int, size: int, *, weight_norm: bool) -> nn.Module:
    """A convolution that keeps the image's size; Xavier weights, zero bias."""
    return _begun(nn.Conv2d(inputs, outputs, size, padding=size // 2), weight_norm=weight_norm)


def _begun(layer: nn.Conv2d | nn.ConvTranspose2d, *, weight_norm: bool) -> nn.Module:
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
    """From [n, inputs, h, w] to [n, widths[0], h, w]; sizes are multiples of 2^(levels - 1).

    Max pooling down, bilinear enlargement up, the skipped features concatenated.
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
                x = nn.functional.max_pool2d(x, 2)
            x = block(x)
            skipped.append(x)
        for level in reversed(range(len(self.up))):
            x = self.up[level](torch.cat([enlarged(x), skipped[level]], dim=1))
        return x


def enlarged(x: Tensor) -> Tensor:
    """Twice the size, bilinearly."""
    return nn.functional.interpolate(x, scale_factor=2.0, mode="bilinear", align_corners=False)


class ShrunkUNet(nn.Module):
    """A U-Net on cells of 2 x 2 pixels, a quarter of its work.

    From [n, inputs, h, w] to [n, outputs, h, w]; sizes are multiples of 2^levels. A convolution of
    2 x 2 gathers each cell, and one that is its transpose writes it out, so that no pixel is lost;
    what only the pixel itself tells should be kept beside.
    """

    def __init__(
        self,
        inputs: int,
        outputs: int,
        widths: tuple[int, ...],
        convs: int,
        *,
        weight_norm: bool,
    ) -> None:
        super().__init__()
        cells = nn.Conv2d(inputs, widths[0], 2, stride=2)
        pixels = nn.ConvTranspose2d(widths[0], outputs, 2, stride=2)
        self.cells = _begun(cells, weight_norm=weight_norm)
        self.pixels = _begun(pixels, weight_norm=weight_norm)
        self.unet = UNet(widths[0], widths, convs, weight_norm=weight_norm)

    def forward(self, x: Tensor) -> Tensor:
        found = self.unet(nn.functional.leaky_relu(self.cells(x), SLOPE))
        return nn.functional.leaky_relu(self.pixels(found), SLOPE)
