"""Kernel splatting: every sample spreads its radiance over the pixels around it.

Tap (j, i) of a sample's k x k kernel belongs to the pixel r - j rows and r - i columns further,
r = k // 2. A pixel is the mean of all that reaches it, weighted by the softmax of the logits over
samples and taps (Gharbi et al. 2019, equation 3). The softmax is exact: each pixel carries the
largest logit so far, and its sums are scaled down when a later sample exceeds it, so that no logit
can overflow. Taps that would come from outside the image weigh nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import torch
from torch import Tensor
from torch.nn.functional import pad, unfold

from training.model.config import GUIDE_GROUPS

Area = tuple[slice, slice, slice, slice]
Border = tuple[int, int, int, int]

OUTSIDE = -1e4  # logit of what lies outside the image: exp() of it is 0 beside any other


def _gathered(logits: Tensor, k: int, height: int, width: int) -> Tensor:
    """A view [n, k, k, h, w] of padded logits [n, k k, h + k - 1, w + k - 1] by destination.

    A destination's tap (j, i) lies at row y + j and column x + i of its plane: a change of strides.
    """
    rows, columns = height + k - 1, width + k - 1
    plane = rows * columns
    return logits.as_strided(
        (logits.shape[0], k, k, height, width),
        (k * k * plane, k * plane + columns, plane + 1, columns, 1),
        logits.storage_offset(),
    )


def _windows(radiance: Tensor, k: int, height: int, width: int) -> Tensor:
    """A view [n, c, k, k, h, w] of padded radiance [n, c, h + k - 1, w + k - 1]."""
    rows, columns = height + k - 1, width + k - 1
    n, c = radiance.shape[:2]
    return radiance.as_strided(
        (n, c, k, k, height, width),
        (c * rows * columns, rows * columns, columns, 1, columns, 1),
        radiance.storage_offset(),
    )


class _Splat(torch.autograd.Function):
    """Streams over samples; keeps the logits, and remakes the weights for the gradient."""

    @staticmethod
    def forward(ctx: Any, logits: Tensor, radiance: Tensor) -> Tensor:
        n, samples, taps, height, width = logits.shape
        k, channels = round(taps**0.5), radiance.shape[2]
        r = k // 2
        largest = logits.new_full((n, height, width), OUTSIDE)
        total = logits.new_zeros((n, height, width))
        sums = logits.new_zeros((n, channels, height, width))
        for s in range(samples):
            padded = pad(logits[:, s], (r, r, r, r), value=OUTSIDE)
            # Copied into order, since reducing the view itself takes thirty times longer.
            weights = _gathered(padded, k, height, width).clone(
                memory_format=torch.contiguous_format
            )
            raised = torch.maximum(largest, weights.amax(dim=(1, 2)))
            fade = torch.exp(largest - raised)
            weights.sub_(raised[:, None, None]).exp_()
            values = _windows(pad(radiance[:, s], (r, r, r, r)), k, height, width)
            total = total * fade + weights.sum(dim=(1, 2))
            for c in range(channels):
                spread = (weights * values[:, c]).sum(dim=(1, 2))
                sums[:, c] = sums[:, c] * fade + spread
            largest = raised
        image = sums / total[:, None]
        ctx.save_for_backward(logits, radiance, largest, total, image)
        return image

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, Tensor | None]:
        (gradient,) = gradients
        logits, radiance, largest, total, image = ctx.saved_tensors
        samples, taps, height, width = logits.shape[1:]
        k, channels = round(taps**0.5), radiance.shape[2]
        r = k // 2
        to_logits = torch.empty_like(logits)
        to_radiance = torch.empty_like(radiance) if ctx.needs_input_grad[1] else None
        scaled = gradient / total[:, None]
        offset = (scaled * image).sum(dim=1)
        for s in range(samples):
            padded = pad(logits[:, s], (r, r, r, r), value=OUTSIDE)
            weights = torch.exp(_gathered(padded, k, height, width) - largest[:, None, None])
            values = _windows(pad(radiance[:, s], (r, r, r, r)), k, height, width)
            change = -offset[:, None, None].expand_as(weights).contiguous()
            for c in range(channels):
                change.addcmul_(values[:, c], scaled[:, c, None, None])
            change *= weights
            back = torch.zeros_like(padded)
            _gathered(back, k, height, width).copy_(change)
            to_logits[:, s] = back[..., r : r + height, r : r + width]
            if to_radiance is not None:
                for c in range(channels):
                    spread = torch.zeros_like(padded)
                    _gathered(spread, k, height, width).copy_(weights * scaled[:, c, None, None])
                    inner = spread[..., r : r + height, r : r + width]
                    to_radiance[:, s, c] = inner.sum(dim=1)
        return to_logits, to_radiance


class _Distances(torch.autograd.Function):
    """Tap by tap, since all at once would be `d` times the memory of all logits."""

    @staticmethod
    def forward(
        ctx: Any, features: Tensor, scales: Tensor | None, k: int, dilation: int, own: bool
    ) -> Tensor:
        n, _, height, width = features.shape
        found = features.new_zeros((n, k * k, height, width))
        for pair in pairs(k, height, width, dilation):
            first, second = pair.opposite(found, k)
            goes, comes = (pair.here, pair.there) if own else (pair.there, pair.here)
            for part, scale in scaled_parts(features, scales):
                apart = ((features[pair.here][:, part] - features[pair.there][:, part]) ** 2).sum(1)
                # Of a pair the one's tap goes to the other, whose scale counts, or its own.
                first += apart if scale is None else apart * scale[goes][:, 0] ** 2
                second += apart if scale is None else apart * scale[comes][:, 0] ** 2
        ctx.save_for_backward(features, scales)
        ctx.k, ctx.dilation, ctx.own = k, dilation, own
        return found

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, Tensor | None, None, None, None]:
        features, scales = ctx.saved_tensors
        (gradient,) = gradients
        height, width = features.shape[-2:]
        to_features = torch.zeros_like(features)
        to_scales = None if scales is None else torch.zeros_like(scales)
        for pair in pairs(ctx.k, height, width, ctx.dilation):
            first, second = pair.opposite(gradient, ctx.k)
            if ctx.own:  # whose scale counts is all that tells the two apart
                first, second = second, first
            of_scales = None if to_scales is None else scaled_parts(features, to_scales)
            for part, scale in scaled_parts(features, scales):
                to_scale = None if of_scales is None else next(of_scales)[1]
                change = features[pair.here][:, part] - features[pair.there][:, part]
                weight = first + second
                if scale is not None and to_scale is not None:
                    here, there = scale[pair.here][:, 0], scale[pair.there][:, 0]
                    apart = 2.0 * (change**2).sum(dim=1)
                    to_scale[pair.there][:, 0] += first * apart * there
                    to_scale[pair.here][:, 0] += second * apart * here
                    weight = first * there**2 + second * here**2
                change = 2.0 * change * weight[:, None]
                to_features[pair.here][:, part] += change
                to_features[pair.there][:, part] -= change
        return to_features, to_scales, None, None, None


def scaled_parts(features: Tensor, scales: Tensor | None) -> Iterator[tuple[slice, Tensor | None]]:
    """Features that have a scale in common, and it [n, 1, h, w].

    Learned ones, which have none, and with `scales` [n, groups, h, w] after them the guides, which
    are albedo, normal, depth and, of four groups, roughness.
    """
    groups = () if scales is None else GUIDE_GROUPS[: scales.shape[1]]
    first = features.shape[1] - sum(groups)
    if first:
        yield slice(0, first), None
    if scales is not None:
        for group, size in enumerate(groups):
            yield slice(first, first + size), scales[:, group : group + 1]
            first += size


class Pair(NamedTuple):
    """Pixels `here` that have tap number `tap`, and what they reach, of [n, c, h, w].

    What is reached, `there`, has the opposite tap, k k - 1 - tap, to go back. Borders are what has
    to be padded, in torch's order, to make an image of the area again.
    """

    tap: int
    here: Area
    there: Area
    border_here: Border
    border_there: Border

    def opposite(self, taps: Tensor, k: int) -> tuple[Tensor, Tensor]:
        """Views of [n, k k, h, w]: of `here` the tap that goes `there`, and the way back."""
        go, back = taps[:, k * k - 1 - self.tap], taps[:, self.tap]
        return go[self.here[0], *self.here[2:]], back[self.there[0], *self.there[2:]]


def pairs(k: int, height: int, width: int, dilation: int = 1) -> Iterator[Pair]:
    """Of the taps before the middle one those that stay inside the image."""
    r = k // 2
    every = slice(None)
    for tap in range(k * k // 2):
        up, aside = dilation * (r - tap // k), dilation * (r - tap % k)
        if up < height and abs(aside) < width:
            left, right = max(aside, 0), max(-aside, 0)
            here = (every, every, slice(up, None), slice(left, width - right))
            there = (every, every, slice(None, height - up), slice(right, width - left))
            yield Pair(tap, here, there, (left, right, up, 0), (right, left, 0, up))


def distances(
    features: Tensor,
    k: int,
    scales: Tensor | None = None,
    *,
    dilation: int = 1,
    own: bool = False,
) -> Tensor:
    """Squared distances [n, k k, h, w] of features [n, d, h, w] at a pixel from those at its taps.

    With `scales` [n, groups, h, w] the last features are guides, whose differences are multiplied
    by those of the pixel that a tap goes to, with `own` of the tap's own pixel. 0 where that is
    outside the image. Taps lie `dilation` pixels apart.
    """
    found: Tensor = _Distances.apply(
        features.contiguous(), None if scales is None else scales.contiguous(), k, dilation, own
    )
    return found


def plain_distances(features: Tensor, k: int, scales: Tensor | None = None) -> Tensor:
    """The same in plain operators, which ONNX has."""
    n, _, height, width = features.shape
    r = k // 2

    def around(planes: Tensor) -> Tensor:
        found = unfold(planes, k, padding=r).reshape(n, -1, k * k, height * width)
        return found.flip(2)

    inside = around(torch.ones_like(features[:, :1]))[:, 0]
    total = torch.zeros_like(inside)
    for part, scale in scaled_parts(features, scales):
        own = features[:, part].reshape(n, -1, 1, height * width)
        apart = ((own - around(features[:, part])) ** 2).sum(dim=1)
        total = total + (apart if scale is None else apart * around(scale)[:, 0] ** 2)
    return (total * inside).reshape(n, k * k, height, width)


def splat(logits: Tensor, radiance: Tensor) -> Tensor:
    """Image [n, c, h, w] of logits [n, samples, k k, h, w] and radiance [n, samples, c, h, w]."""
    image: Tensor = _Splat.apply(logits.contiguous(), radiance.contiguous())
    return image


def plain_splat(logits: Tensor, radiance: Tensor) -> Tensor:
    """The same in plain operators, which ONNX has; needs the memory of all kernels at once.

    Rows are brought to their destinations by padding every plane by one row more than it has and
    cutting the sequence of planes into lengths one greater: plane j is then shifted by j rows.
    """
    n, samples, taps = logits.shape[:3]
    height, width = logits.shape[3], logits.shape[4]
    k = round(int(taps) ** 0.5)
    r, channels = k // 2, radiance.shape[2]
    rows, columns = height + 2 * r, width + 2 * r
    planes = pad(logits, (r, r, r, r), value=OUTSIDE).reshape(n, samples, k, k, rows, columns)
    weights = _skewed(planes.permute(0, 1, 3, 5, 2, 4), k, rows, height)  # n s i columns j h
    weights = _skewed(weights.permute(0, 1, 4, 5, 2, 3), k, columns, width)  # n s j h i w
    largest = weights.amax(dim=(1, 2, 4), keepdim=True)
    weights = torch.exp(weights - largest)
    padded = pad(radiance, (r, r, r, r))
    rowwise = torch.stack([padded[..., j : j + height, :] for j in range(k)], dim=3)
    values = torch.stack([rowwise[..., i : i + width] for i in range(k)], dim=5)
    # values [n, s, c, j, h, i, w]
    sums = [(weights * values[:, :, c]).sum(dim=(1, 2, 4)) for c in range(int(channels))]
    total = weights.sum(dim=(1, 2, 4))
    return torch.stack(sums, dim=1) / total[:, None]


def _skewed(planes: Tensor, k: int, length: int, kept: int) -> Tensor:
    """[..., k, length] to [..., k, kept]: row j begins at its element j."""
    lead = planes.shape[:-2]
    flat = pad(planes.reshape(*lead, k * length), (0, k))
    return flat.reshape(*lead, k, length + 1)[..., :kept]
