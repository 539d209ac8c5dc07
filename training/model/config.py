"""Sizes and switches of a network, saved with its weights."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, TypeVar

T = TypeVar("T")

# Albedo, normal, depth and, where the configuration says so, roughness of the first vertex that is
# no mirror nor clear glass. Each group has a scale.
GUIDE_GROUPS = (3, 3, 1, 1)
# Of networks with one class, guides are summed up by the way to that vertex, see encoding.ways().
WAYS = 3
FEATURE_SETS = ("gbuffer", "paths", "extended")


class ConfigError(Exception):
    """A configuration has an unknown name or a value that cannot be used."""


@dataclass(frozen=True)
class ModelConfig:
    """A network; the defaults are the published hyper-parameters.

    `unet` are the widths of the U-Net's levels, `convs` its 3x3 convolutions a level and side.
    `log_scale` divides log(1 + x) of radiance. The switches from `valid_bits` on need the feature
    set ``extended``: `increments` gives radiance as what each vertex adds (throughput times direct
    light), `first_non_delta` the features of the first vertex that is no mirror nor clear glass,
    `vertex_encoder` the width of a network shared over vertices, whose outputs are summed, in place
    of the flat features (0: flat), `vertices` how many of them are looked at, from the camera on.
    `layers` reconstructs direct, reflected and transmitted paths
    apart with kernels of their own, and adds them. `pyramid` is the number of scales on which
    kernels of `kernel` pixels are splatted (1: full resolution only). `affinity` is the number of
    features, learned, in which a class at a pixel should be like itself where it is splatted to:
    their squared distance is taken off the logit (0: logits depend on the source alone). After
    Isik, Mullia, Fisher, Eisenmann and Gharbi, "Interactive Monte Carlo denoising using affinity of
    neural features", 2021. It needs `layers`.
    `demodulated` also splats radiance divided by the albedo of the first vertex that is no mirror
    nor clear glass, multiplies what arrives by the albedo there, and mixes both as it has learned
    to: textures need not be told from noise. It needs `layers` too.
    `guides` adds the class's mean albedo, normal and depth of that vertex to the features of
    `affinity`, scaled as learned, so that their edges need not be found by the network, and
    `guide_roughness` its roughness, too, by which metal is told from a wall of its colour.
    `atrous` are the dilations of passes that follow the splat, see training.model.atrous; they need
    features of at least one of both kinds.
    `classes` is how many kernels a pixel of `layers` has: 3, or 1 for all of its paths together,
    whose features are then summed up over all of them; `guides` are then those of the commonest way
    to that vertex, or a pane's few reflections would make noise of them.
    `first_hit` hides all but the radiance, the place in the pixel and what is recorded of the first
    hit (depth, albedo, normal, direct light, roughness; no events): the network is the same, and
    what it lacks is what the later vertices are worth.
    `first_hit_start` begins training with weights of zero for what the first layer is given of
    vertices behind the first hit, but for `first_non_delta`: ``gbuffer`` and ``paths`` begin as the
    same network, and features that are mostly noise do not have to be unlearned first. The output
    of a `vertex_encoder` begins with zero as a whole; `guides` and `demodulated` are as ever.
    `shrink` is 2 where the U-Net works on cells of 2 x 2 pixels, a quarter of the work; what each
    pixel's own samples tell goes past it. It needs `steps` of 1.
    """

    features: str = "paths"
    width: int = 128
    embedding_layers: int = 3
    steps: int = 3
    unet: tuple[int, ...] = (128, 256, 512)
    convs: int = 3
    regressor_layers: int = 3
    kernel: int = 21
    weight_norm: bool = True
    log_scale: float = 10.0
    valid_bits: bool = False
    increments: bool = False
    first_non_delta: bool = False
    vertex_encoder: int = 0
    vertices: int = 6
    layers: bool = False
    pyramid: int = 1
    affinity: int = 0
    demodulated: bool = False
    guides: bool = False
    guide_roughness: bool = False
    atrous: tuple[int, ...] = ()
    classes: int = 3
    first_hit: bool = False
    shrink: int = 1
    first_hit_start: bool = False

    def __post_init__(self) -> None:
        if self.features not in FEATURE_SETS:
            raise ConfigError(
                f"model.features is {self.features!r}; there are {', '.join(FEATURE_SETS)}"
            )
        if self.kernel % 2 == 0 or self.kernel < 1:
            raise ConfigError(f"model.kernel is {self.kernel}; it has to be odd")
        for name in ("width", "embedding_layers", "steps", "convs", "regressor_layers", "pyramid"):
            if getattr(self, name) < 1:
                raise ConfigError(f"model.{name} is {getattr(self, name)}; it has to be positive")
        if not 1 <= self.vertices <= 6:
            raise ConfigError(f"model.vertices is {self.vertices}; it has to be from 1 to 6")
        extended = (
            "valid_bits",
            "increments",
            "first_non_delta",
            "vertex_encoder",
            "layers",
            "first_hit",
        )
        on = [name for name in extended if getattr(self, name)]
        if on and self.features != "extended":
            raise ConfigError(f"model.{on[0]} needs the feature set extended, not {self.features}")
        if self.affinity and (self.affinity < 0 or self.pyramid > 1 or not self.layers):
            raise ConfigError(
                f"model.affinity is {self.affinity}; it needs to be positive, model.layers, and no "
                "pyramid"
            )
        if self.demodulated and (self.pyramid > 1 or not self.layers):
            raise ConfigError("model.demodulated needs model.layers, and no pyramid")
        if self.guides and (self.pyramid > 1 or not self.layers):
            raise ConfigError("model.guides needs model.layers, and no pyramid")
        if self.guide_roughness and not self.guides:
            raise ConfigError("model.guide_roughness needs model.guides")
        if self.atrous and (self.likeness == 0 or min(self.atrous) < 1):
            raise ConfigError(
                f"model.atrous is {list(self.atrous)}; it needs positive dilations, and "
                "model.affinity or model.guides"
            )
        if self.classes not in (1, 3) or (self.classes == 1 and not self.layers):
            raise ConfigError(
                f"model.classes is {self.classes}; it has to be 3, or with model.layers 1"
            )
        if self.shrink not in (1, 2) or (self.shrink == 2 and self.steps > 1):
            raise ConfigError(
                f"model.shrink is {self.shrink}; it has to be 1, or 2 where model.steps is 1"
            )
        if self.layers and self.steps > 1:
            raise ConfigError(f"model.layers needs model.steps=1, not {self.steps}")

    @property
    def guide_groups(self) -> tuple[int, ...]:
        """How many guides share a scale, group by group."""
        if not self.guides:
            return ()
        return GUIDE_GROUPS if self.guide_roughness else GUIDE_GROUPS[:-1]

    @property
    def guide_count(self) -> int:
        """Guides of a pixel."""
        return sum(self.guide_groups)

    @property
    def guide_planes(self) -> int:
        """Sums of guides and shares that a class has."""
        return (self.guide_count + 1) * (WAYS if self.guides and self.classes == 1 else 1)

    @property
    def unit(self) -> int:
        """Tiles have to begin at multiples of this, or pooling sees other cells."""
        return int(max(self.context_unit, 2 ** (self.pyramid - 1)))

    @property
    def context_unit(self) -> int:
        """The U-Net's sizes are multiples of this; what is missing is filled with zeros."""
        return int(self.shrink * 2 ** (len(self.unet) - 1))

    @property
    def context_width(self) -> int:
        """Features of a pixel that the U-Net gives."""
        return self.unet[0] if self.shrink == 1 else self.width

    @property
    def likeness(self) -> int:
        """Features by which a class's pixels are compared, learned ones and guides."""
        return self.affinity + self.guide_count

    @property
    def spread(self) -> int:
        """Pixels that light moves at most from its own, the splat and the passes after it."""
        return self.kernel // 2 + sum(2 * dilation for dilation in self.atrous)

    @property
    def receptive_field(self) -> int:
        """Pixels around an output pixel that can change it; tiles overlap by at least these."""
        splat = sum(2**level * (self.kernel // 2 + 2) for level in range(self.pyramid))
        return self.context_field + (splat if self.pyramid > 1 else self.spread)

    @property
    def context_field(self) -> int:
        """Pixels around a pixel that can change its hidden features."""
        context = 0
        for level in range(len(self.unet)):
            sides = 1 if level == len(self.unet) - 1 else 2
            # Convolutions, and for pooling and bilinear enlargement one cell of the level.
            context += 2**level * (self.convs * sides + (1 if level else 0))
        # Of cells, and the farther pixel of the first one.
        context = self.shrink * context + self.shrink - 1
        # Guides are filled from a mean of 5 x 5 pixels.
        return max(self.steps * context, 2 if self.guides else 0)


def from_dict(kind: type[T], values: dict[str, Any], where: str) -> T:
    """A configuration from plain values; raises ConfigError that names what is unknown."""
    known = {field.name: field for field in dataclasses.fields(kind)}  # type: ignore[arg-type]
    for name in values:
        if name not in known:
            raise ConfigError(f"{where}.{name} is unknown; there are {', '.join(known)}")
    converted = {n: tuple(v) if isinstance(v, list) else v for n, v in values.items()}
    return kind(**converted)
