"""The network: samples in, image out."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn.utils import parametrize

from training.model.atrous import ATrous, Likeness
from training.model.blocks import ShrunkUNet, UNet, pointwise
from training.model.config import WAYS, ModelConfig
from training.model.encoding import (
    Encoding,
    Vertices,
    demodulator,
    first_non_delta,
    found_guides,
    guides,
    path_class,
    ways,
)
from training.model.inputs import CHANNELS, first_hit_channels
from training.model.pyramid import Pyramid
from training.model.splat import distances, plain_distances, plain_splat, splat

# Of guides in an untrained network: what is apart by one over this counts as 1 in the logit.
GUIDE_SCALES = (4.0, 2.0, 10.0, 6.0)
# What pixels around count for in the guides of a pixel: nothing beside samples of its own, all
# where its class has none.
FILLED = 0.02
GATE_BIAS = -1.0  # training begins with little demodulation
Splatter = Callable[[Tensor, Tensor], Tensor]


class Hidden(NamedTuple):
    """What the last layer and the splat work on.

    `hidden` [n, units, width, h, w] and `radiance` [n, units, 3, h, w]; units are the samples, or
    with `layers` the classes, splatted apart and added. `embedding` [n, width, h, w] is the
    mean over samples after the first step, for the manifold loss. With `demodulated` radiance has
    three more channels, divided by the albedo, whose mean is `albedo` [n, units, 3, h, w], 0 in
    units that have no sample. `alike` [n units, likeness, h, w] are the features of `affinity` and
    `guides`, `scales` [n units, groups, h, w] those of the guides.
    """

    hidden: Tensor
    radiance: Tensor
    embedding: Tensor
    albedo: Tensor | None = None
    alike: Tensor | None = None
    scales: Tensor | None = None


class Sksn(nn.Module):
    """From a feature set's channels [n, samples, channels, h, w] to linear radiance [n, 3, h, w].

    Any number of samples, any size. Raises ValueError for another number of channels.
    """

    def __init__(self, config: ModelConfig) -> None:
        super().__init__()
        self.config = config
        wide, norm = config.width, config.weight_norm
        self.encoding = Encoding(config)
        if config.first_hit:
            seen = torch.zeros(len(CHANNELS[config.features]), 1, 1)
            seen[first_hit_channels(config.features)] = 1.0
            self.register_buffer("seen", seen, persistent=False)
        self.embeddings = nn.ModuleList()
        self.contexts = nn.ModuleList()
        inputs = self.encoding.width
        for _ in range(config.steps):
            layers = config.embedding_layers
            self.embeddings.append(pointwise(inputs, wide, wide, layers, weight_norm=norm))
            self.contexts.append(
                UNet(wide, config.unet, config.convs, weight_norm=norm)
                if config.shrink == 1
                else ShrunkUNet(
                    wide, config.context_width, config.unet, config.convs, weight_norm=norm
                )
            )
            inputs = wide + config.context_width
        if config.layers:
            inputs += 1 + config.guide_count
        hidden = config.regressor_layers - 1
        self.regressor = (
            pointwise(inputs, wide, wide, hidden, weight_norm=norm) if hidden else nn.Identity()
        )
        last = wide if hidden else inputs
        if config.pyramid > 1:
            self.kernels: nn.Module = Pyramid(last, config.kernel, config.pyramid)
        else:
            self.kernels = nn.Conv2d(last, config.kernel**2, 1)
        self._start_narrow()
        if config.first_hit_start:
            self._start_with_first_hit()
        self.alike = nn.Conv2d(last, config.affinity, 1, bias=False) if config.affinity else None
        groups = len(config.guide_groups)
        self.scales = nn.Conv2d(last, groups, 1) if config.guides else None
        if self.scales is not None and self.scales.bias is not None:
            nn.init.normal_(self.scales.weight, std=0.01)
            with torch.no_grad():
                self.scales.bias.copy_(torch.tensor(GUIDE_SCALES[:groups]))
        self.atrous = ATrous(last, config.atrous) if config.atrous else None
        self.gate = nn.Conv2d(last, 1, 1) if config.demodulated else None
        if self.gate is not None and self.gate.bias is not None:
            nn.init.constant_(self.gate.bias, GATE_BIAS)

    def _start_narrow(self) -> None:
        """Untrained kernels are about a pixel wide, from which training goes faster than a box."""
        for module in self.kernels.modules():
            if isinstance(module, nn.Conv2d) and module.bias is not None:
                k = round(module.out_channels**0.5)
                nn.init.normal_(module.weight, std=0.01)
                nn.init.zeros_(module.bias)
                if k * k == module.out_channels and k > 1:
                    axis = torch.arange(k, dtype=torch.float32) - k // 2
                    square = axis[:, None] ** 2 + axis[None, :] ** 2
                    with torch.no_grad():
                        module.bias.copy_((-0.5 * square).clamp(min=-8.0).flatten())

    def _start_with_first_hit(self) -> None:
        first = self.embeddings[0][0]
        weight = first.weight.detach().clone()
        weight[:, self.encoding.first_hit :] = 0.0
        with torch.no_grad():
            first.weight = weight if parametrize.is_parametrized(first) else nn.Parameter(weight)

    def forward(self, x: Tensor, splatter: Splatter = splat) -> Tensor:
        return self.splatted(self.hidden(x), splatter)

    def hidden(self, x: Tensor, share: Tensor | None = None) -> Hidden:
        """Everything before the last layer.

        `share` [n, samples, 1, h, w] is what each sample counts for in its pixel, adding up to 1;
        by default all the same.
        """
        self._check(x)
        n, samples = x.shape[:2]
        height, width = x.shape[-2:]
        if share is None:
            share = x.new_full((n, samples, 1, 1, 1), 1.0 / samples)
        unit = self.config.context_unit
        below, right = -height % unit, -width % unit
        # A traced size is not known yet.
        if torch.jit.is_tracing() or below or right:
            border = (0, right, 0, below)
            share = nn.functional.pad(share.expand(n, samples, 1, height, width), border)
            x = nn.functional.pad(x, border)
        return Hidden(
            *(
                None if part is None else part[..., :height, :width]
                for part in self.of_whole_cells(x, share)
            )
        )

    def of_whole_cells(self, x: Tensor, share: Tensor) -> Hidden:
        """What hidden() gives, of sizes that are multiples of the configuration's context_unit."""
        n, samples = x.shape[:2]
        if self.config.layers:
            classes, mask = self.class_sums(x, share)
            weight = (share * mask)[:, :, :, None]
            light = (weight * x[:, :, None, :3]).sum(dim=1)
            albedo = None
            if self.config.demodulated:
                divisor = self.divisors(x)
                divided = (weight * (x[:, :, :3] / divisor)[:, :, None]).sum(dim=1)
                light = torch.cat([light, divided], dim=2)
                albedo = mean_albedo(divisor, share * mask)
            flat, alike, scales = self.of_classes(classes)
            hidden = flat.reshape(n, self.config.classes, *flat.shape[1:])
            return Hidden(hidden, light, self._embedding(classes), albedo, alike, scales)
        e = self.encoding(self._flat(x))
        context, first = e, e
        for step, (embed, unet) in enumerate(zip(self.embeddings, self.contexts, strict=True)):
            e = embed(e if step == 0 else torch.cat([e, context], dim=1))
            reduced = (share * e.reshape(n, samples, *e.shape[1:])).sum(dim=1)
            first = reduced if step == 0 else first
            context = _repeated(unet(reduced), samples)
        regressed = self.regressor(torch.cat([e, context], dim=1))
        hidden = regressed.reshape(n, samples, *regressed.shape[1:])
        return Hidden(hidden, x[:, :, :3], first)

    def class_sums(self, x: Tensor, share: Tensor) -> tuple[Tensor, Tensor]:
        """What layers know of the samples: all that is computed for each of them, pixel by pixel.

        Sums [n, classes, planes, h, w] over the samples of a class of their embeddings, of their
        guides, if there are, and last of their shares; and who is in it, mask [n, samples,
        classes, h, w].
        """
        n, samples = x.shape[:2]
        count = self.config.classes
        flat = self._flat(x)
        e = self.embeddings[0](self.encoding(flat))
        if self.config.guides:
            e = torch.cat([e, *self._guides(Vertices(flat))], dim=1)
        of_three = path_class(Vertices(flat))
        mask = of_three if count > 1 else of_three.sum(dim=1, keepdim=True)
        mask = mask.reshape(n, samples, count, *x.shape[3:])
        weights = mask * share
        rows = e.reshape(n, samples, *e.shape[1:])
        sums = []
        for c in range(count):
            weight = weights[:, :, c : c + 1]
            sums.append(torch.cat([(weight * rows).sum(dim=1), weight.sum(dim=1)], dim=1))
        if self._has_ways():  # their shares are among the rows
            sums = [found[:, :-1] for found in sums]
        return torch.stack(sums, dim=1), mask

    def _has_ways(self) -> bool:
        return self.config.guides and self.config.classes == 1

    def _guides(self, v: Vertices) -> list[Tensor]:
        """What is summed up of guides: they, or by each way they and its share."""
        count = self.config.guide_count
        if not self._has_ways():
            return [found_guides(first_non_delta(v))[:, :count]]
        found = torch.nn.functional.pad(guides(v)[:, :count], (0, 0, 0, 0, 0, 1), value=1.0)
        way = ways(v)
        return [way[:, i : i + 1] * found for i in range(WAYS)]

    def divisors(self, x: Tensor) -> Tensor:
        """What radiance is divided by [n, samples, 3, h, w]."""
        n, samples = x.shape[:2]
        return demodulator(Vertices(self._flat(x))).reshape(n, samples, 3, *x.shape[3:])

    def of_classes(self, classes: Tensor) -> tuple[Tensor, Tensor | None, Tensor | None]:
        """Hidden features [n classes, width, h, w], Hidden.alike and its scales.

        Of what class_sums() gives, of sizes that are multiples of the configuration's context_unit.
        """
        context = self.contexts[0](self._embedding(classes))
        flat = classes.flatten(0, 1)
        own, count = self.config.width, self.config.guide_count
        guide = guide_means(flat, own, count) if self.config.guides else None
        if guide is not None and self._has_ways():
            straight = flat[:, own + count : own + count + 1]
            flat = torch.cat([flat[:, :own], guide, straight], dim=1)
        regressed = self._regressed(flat, context)
        parts = [] if self.alike is None else [self.alike(regressed)]
        if guide is not None:
            parts.append(guide)
        alike = torch.cat(parts, dim=1) if parts else None
        scales = None if self.scales is None else self.scales(regressed)
        return regressed, alike, scales

    def _regressed(self, flat: Tensor, context: Tensor) -> Tensor:
        """Hidden features [n classes, width, h, w] of the classes' own and of what they share."""
        own, count = self.config.width, self.config.classes
        if not isinstance(self.regressor, nn.Sequential):
            return torch.cat([flat[:, :own], _repeated(context, count), flat[:, own:]], dim=1)
        # The first layer of the classes and of what they share apart: nothing is copied together.
        first = self.regressor[0]
        shared = slice(own, own + context.shape[1])
        weight = torch.cat([first.weight[:, :own], first.weight[:, shared.stop :]], dim=1)
        per_class = nn.functional.conv2d(flat, weight, first.bias)
        per_pixel = nn.functional.conv2d(context, first.weight[:, shared])
        if count == 1:
            sums = per_class + per_pixel
        else:
            n = context.shape[0]
            sums = per_class.reshape(n, count, *per_class.shape[1:]) + per_pixel[:, None]
            sums = sums.flatten(0, 1)
        regressed: Tensor = self.regressor[1:](sums)
        return regressed

    def _flat(self, x: Tensor) -> Tensor:
        """The samples of all images one after the other, and of them what the network may see."""
        flat = x.flatten(0, 1)
        return flat * self.seen if self.config.first_hit else flat

    def _embedding(self, classes: Tensor) -> Tensor:
        """The mean embedding of all samples: every sample is in one class."""
        if self.config.classes == 1:  # ONNX Runtime copies for a sum over one
            return classes.flatten(0, 1)[:, : self.config.width]
        return classes[:, :, : self.config.width].sum(dim=1)

    def _check(self, x: Tensor) -> None:
        wanted = len(CHANNELS[self.config.features])
        if x.dim() != 5 or x.shape[2] != wanted:
            raise ValueError(
                f"the network takes [n, samples, {wanted}, h, w] of {self.config.features}, "
                f"not {tuple(x.shape)}"
            )

    def splatted(self, state: Hidden, splatter: Splatter = splat) -> Tensor:
        """The last layer and the splat."""
        hidden, radiance = state.hidden, state.radiance
        n, units = hidden.shape[:2]
        if self.config.layers:  # each class has a softmax of its own
            hidden, radiance = hidden.flatten(0, 1)[:, None], radiance.flatten(0, 1)[:, None]
        if isinstance(self.kernels, Pyramid):
            image = self.kernels(hidden, radiance, splatter)
        else:
            logits = self.kernels(hidden.flatten(0, 1))
            logits = logits.reshape(*hidden.shape[:2], *logits.shape[1:])
            if state.alike is not None:
                apart = plain_distances if splatter is plain_splat else distances
                logits = logits - apart(state.alike, self.config.kernel, state.scales)[:, None]
            image = splatter(logits, radiance)
            if self.atrous is not None and state.alike is not None:
                likeness = Likeness(state.alike, state.scales)
                plain = splatter is plain_splat
                image = self.atrous(image, likeness, hidden[:, 0], plain=plain)
        if self.config.layers:
            parts = image.reshape(n, units, *image.shape[1:])
            if self.gate is not None and state.albedo is not None:
                gate = self.gates(state.hidden.flatten(0, 1)).reshape(n, units, 1, *parts.shape[3:])
                parts = modulated(parts, gate, state.albedo)
            image = parts.sum(dim=1)
        return image

    def gates(self, hidden: Tensor) -> Tensor:
        """How much of what is splatted is demodulated, 0..1 [n, 1, h, w]."""
        assert self.gate is not None
        return torch.sigmoid(self.gate(hidden))

    @property
    def parameter_count(self) -> int:
        """Trained numbers."""
        return sum(p.numel() for p in self.parameters())


def mean_albedo(divisor: Tensor, weight: Tensor) -> Tensor:
    """Means [n, units, 3, h, w] of divisor [n, samples, 3, h, w]; 0 where a unit has no sample.

    By weight [n, samples, units, h, w].
    """
    total = (weight[:, :, :, None] * divisor[:, :, None]).sum(dim=1)
    return total / weight.sum(dim=1)[:, :, None].clamp(min=1e-9)


def modulated(parts: Tensor, gate: Tensor, albedo: Tensor) -> Tensor:
    """Radiance of splatted plain and divided radiance [n, units, 6, h, w]."""
    gate = gate * (albedo > 0.0)
    return (1.0 - gate) * parts[:, :, :3] + gate * albedo * parts[:, :, 3:]


def guide_means(sums: Tensor, first: int, count: int) -> Tensor:
    """Mean guides [n, count, h, w] of sums over samples [n, planes, h, w], from plane `first` on.

    Guides are followed by their share. Where a class has no sample, those of the pixels around. Of
    sums by ways, which are more planes, about those of the commonest one: each mean counts by the
    cube of its share.
    """
    rows = [sums[:, i : i + count + 1] for i in range(first, sums.shape[1], count + 1)]
    own = rows[0]
    if len(rows) > 1:
        weighted = [row * row[:, count:] ** 2 for row in rows]
        own = weighted[0]
        for row in weighted[1:]:
            own = own + row
    around = nn.functional.avg_pool2d(own, 5, stride=1, padding=2)
    filled = own + FILLED * around
    return filled[:, :count] / (filled[:, count:] + 1e-6)


def _repeated(x: Tensor, samples: int) -> Tensor:
    """[n, c, h, w] for each of the samples: [n samples, c, h, w]."""
    n, c, height, width = x.shape
    return x[:, None].expand(n, samples, c, height, width).reshape(n * samples, c, height, width)


def fold_weight_norm(model: nn.Module) -> None:
    """Makes plain weights of normalised ones, in place."""
    for module in model.modules():
        if parametrize.is_parametrized(module, "weight"):
            parametrize.remove_parametrizations(module, "weight")
