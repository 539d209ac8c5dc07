"""Ways to an image, as data: what is set for the render, and what happens to it afterwards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

OWN = "mbfeat"
RAW = "raw"
WHOLE = "whole paths"
SPLITTING = "mbfeat:splitting"
DENOISE = "mbfeat:denoise:enabled"
FIRST_HIT = ("mbfeat:albedo:0", "mbfeat:normal:0")
FIRST_NON_DELTA = (
    "mbfeat:firstNonDelta:albedo",
    "mbfeat:firstNonDelta:normal",
    "mbfeat:firstNonDelta:tint",
)


class VariantError(ValueError):
    """A variant cannot be understood; the message says what to write."""


@dataclass(frozen=True)
class Variant:
    """One way to an image.

    `settings` are render settings over the stage's, `features` the AOVs that the render writes for
    the `filter` that is applied to it afterwards: a key of `filters.RECIPES`, or none. `version` is
    that of another renderer.
    """

    name: str  # in tables and in the JSON
    title: str
    settings: Mapping[str, str] = field(default_factory=dict)
    features: tuple[str, ...] = ()
    filter: str = ""
    renderer: str = OWN
    version: str = ""

    @property
    def records(self) -> bool:
        """Whether its render records features beside the image."""
        return bool(self.features) or DENOISE in self.settings

    @property
    def is_whole(self) -> bool:
        """Whether its paths never split, as recorded ones do not."""
        return self.records or self.settings.get(SPLITTING) == "1"

    @property
    def renders(self) -> dict[str, Any]:
        """All that its image depends on."""
        return {
            "settings": dict(self.settings),
            "features": list(self.features),
            "filter": self.filter,
            "renderer": self.renderer,
            "version": self.version,
        }


def raw() -> Variant:
    """The mean of the samples, as the renderer leaves it."""
    return Variant(RAW, "the mean of the samples")


def whole() -> Variant:
    """The same of paths that do not split: what shares its random numbers with those that record
    features, and with limited ones, of which a limit could change the number of branches.
    """
    return Variant(WHOLE, "the mean of the samples, of paths that do not split", {SPLITTING: "1"})


def denoise_models() -> list[Variant]:
    """The networks that MBFeat comes with and can run; each is applied by the render itself."""
    from mbfeat import denoise

    return [_model(name, model.features) for name, model in denoise.models().items()]


def _model(name: str, features: str) -> Variant:
    settings = {DENOISE: "true", "mbfeat:denoise:model": name}
    return Variant(name, f"the network {name} with features {features}", settings)


def open_image_denoise() -> list[Variant]:
    """Open Image Denoise guided by the first hit, and at its best."""
    return [
        Variant(
            "oidn first hit",
            "Open Image Denoise with albedo and normal of the first hit",
            features=FIRST_HIT,
            filter="plain",
        ),
        Variant(
            "oidn best",
            "Open Image Denoise with albedo and normal of the first vertex that is neither mirror "
            "nor clear glass, both filtered before",
            features=FIRST_NON_DELTA,
            filter="best",
        ),
    ]


def parsed(text: str) -> Variant:
    """A variant of the command line: NAME:SETTING=VALUE[,SETTING=VALUE...]."""
    name, colon, rest = text.partition(":")
    pairs = [part.partition("=") for part in rest.split(",") if part.strip()]
    if not name.strip() or not colon or not pairs or not all(equals for _, equals, _ in pairs):
        raise VariantError(
            f"--variant {text}: write NAME:SETTING=VALUE, as in 'few bounces:mbfeat:maxBounces=2'"
        )
    settings = {key.strip(): value.strip() for key, _, value in pairs}
    shown = ", ".join(f"{key}={value}" for key, value in settings.items())
    return Variant(name.strip(), f"the mean of the samples with {shown}", settings)


def check_names(variants: Sequence[Variant]) -> None:
    """Raises VariantError where two have one name."""
    names = [variant.name for variant in variants]
    for name in names:
        if names.count(name) > 1:
            raise VariantError(f"two variants are named {name!r}; give one another name")
