"""The network: samples in, image out."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn.utils import parametrize

from training.model.blocks import UNet, pointwise
from training.model.config import ModelConfig
from training.model.encoding import CLASSES, Encoding, Vertices, path_class
from training.model.inputs import CHANNELS
from training.model.pyramid import Pyramid
from training.model.splat import splat

Splatter = Callable[[Tensor, Tensor], Tensor]


class Hidden(NamedTuple):
    """What the last layer and the splat work on.

    `hidden` [n, units, width, h, w] and `radiance` [n, units, 3, h, w]; units are the samples, or
    with `layers` the three classes, splatted apart and added. `embedding` [n, width, h, w] is the
    mean over samples after the first step, for the manifold loss.
    """

    hidden: Tensor
    radiance: Tensor
    embedding: Tensor


class Sksn(nn.Module):
    """From a feature set's channels [n, samples, channels, h, w] to linear radiance [n, 3, h, w].

    Any number of samples, any size. Raises ValueError for another number of channels.
    """

    def __init__(self, config: ModelConfig) -> None:
        super().__init__()
        self.config = config
        wide, norm = config.width, config.weight_norm
        self.encoding = Encoding(config)
        self.embeddings = nn.ModuleList()
        self.contexts = nn.ModuleList()
        inputs = self.encoding.width
        for _ in range(config.steps):
            layers = config.embedding_layers
            self.embeddings.append(pointwise(inputs, wide, wide, layers, weight_norm=norm))
            self.contexts.append(UNet(wide, config.unet, config.convs, weight_norm=norm))
            inputs = wide + config.unet[0]
        if config.layers:
            inputs += 1
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

    def forward(self, x: Tensor, splatter: Splatter = splat) -> Tensor:
        return self.splatted(self.hidden(x), splatter)

    def hidden(self, x: Tensor) -> Hidden:
        """Everything before the last layer."""
        wanted = len(CHANNELS[self.config.features])
        if x.dim() != 5 or x.shape[2] != wanted:
            raise ValueError(
                f"the network takes [n, samples, {wanted}, h, w] of {self.config.features}, "
                f"not {tuple(x.shape)}"
            )
        n, samples = x.shape[:2]
        flat = x.flatten(0, 1)
        e = self.encoding(flat)
        context, first = e, e
        for step, (embed, unet) in enumerate(zip(self.embeddings, self.contexts, strict=True)):
            e = embed(e if step == 0 else torch.cat([e, context], dim=1))
            reduced = e.reshape(n, samples, *e.shape[1:]).mean(dim=1)
            first = reduced if step == 0 else first
            per_pixel = unet(reduced)
            context = _repeated(per_pixel, samples)
        if self.config.layers:
            # One kernel a pixel and class: from the class's share of the samples and their mean.
            mask = path_class(Vertices(flat))
            units, parts, radiance = CLASSES, [], []
            for c in range(units):
                chosen = mask[:, c : c + 1]
                chosen_e = (chosen * e).reshape(n, samples, *e.shape[1:]).mean(dim=1)
                share = chosen.reshape(n, samples, *chosen.shape[1:]).mean(dim=1)
                parts.append(torch.cat([chosen_e, per_pixel, share], dim=1))
                light = (chosen * flat[:, :3]).reshape(n, samples, 3, *flat.shape[2:])
                radiance.append(light.mean(dim=1))
            regressed = self.regressor(torch.stack(parts, dim=1).flatten(0, 1))
            hidden = regressed.reshape(n, units, *regressed.shape[1:])
            return Hidden(hidden, torch.stack(radiance, dim=1), first)
        regressed = self.regressor(torch.cat([e, context], dim=1))
        hidden = regressed.reshape(n, samples, *regressed.shape[1:])
        return Hidden(hidden, x[:, :, :3], first)

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
            image = splatter(logits.reshape(*hidden.shape[:2], *logits.shape[1:]), radiance)
        if self.config.layers:
            image = image.reshape(n, units, *image.shape[1:]).sum(dim=1)
        return image

    @property
    def parameter_count(self) -> int:
        """Trained numbers."""
        return sum(p.numel() for p in self.parameters())


def _repeated(x: Tensor, samples: int) -> Tensor:
    """[n, c, h, w] for each of the samples: [n samples, c, h, w]."""
    n, c, height, width = x.shape
    return x[:, None].expand(n, samples, c, height, width).reshape(n * samples, c, height, width)


def fold_weight_norm(model: nn.Module) -> None:
    """Makes plain weights of normalised ones, in place."""
    for module in model.modules():
        if parametrize.is_parametrized(module, "weight"):
            parametrize.remove_parametrizations(module, "weight")
