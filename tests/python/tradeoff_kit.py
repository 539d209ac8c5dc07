"""A renderer whose noise and seconds are known, for tests of what is measured of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from mbfeat import denoise
from mbfeat.tradeoff import analysis, reference, variants
from mbfeat.tradeoff.kept import Keep
from mbfeat.tradeoff.measure import Ladder, Measured, split_recording, tasks
from mbfeat.tradeoff.reference import Reference
from mbfeat.tradeoff.renders import RenderError, Shot
from mbfeat.tradeoff.variants import OWN, Variant

HEIGHT, WIDTH = 36, 64
NOISE = 0.5  # variance of a sample by the square of the value
START, EACH, RECORDING, INFERENCE = 1.0, 0.25, 0.125, 2.0  # seconds; two of them a sample
BIAS = 0.05  # of the model
RUNGS = (1, 4, 16, 64)
SUBJECT = "subject"


def truth() -> np.ndarray:
    """A picture without black."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] / 32.0
    return np.stack([0.4 + 0.2 * np.sin(3 * x), 0.5 + 0.2 * np.cos(2 * y), 0.3 + 0.1 * x * y])


class KnownRenderer:
    """Noise of variance NOISE / samples, a tenth of it and a bias where a model is applied.

    `calls` are what it was asked for; from `fails_at` calls on it raises `failure`, and always for
    variants in `broken`. Variants in `dark` show, and take, that share of light and seconds.
    """

    def __init__(self, broken: Sequence[str] = (), dark: Mapping[str, float] | None = None) -> None:
        self.calls: list[tuple[str, int, int]] = []
        self.failure: BaseException | None = None
        self.fails_at = 0
        self.broken = broken
        self.dark = dict(dark or {})

    def render(self, variant: Variant, spp: int, seed: int) -> Shot:
        if self.failure is not None and len(self.calls) >= self.fails_at:
            raise self.failure
        if variant.name in self.broken:
            raise RenderError(f"{variant.name}: out of memory")
        self.calls.append((variant.name, spp, seed))
        rng = np.random.default_rng([spp, seed])
        model = variant.records
        scale = np.sqrt(NOISE / spp * (0.1 if model else 1.0))
        image = truth() * (1.0 + scale * rng.standard_normal((3, HEIGHT, WIDTH)))
        left = self.dark.get(variant.name, 1.0)
        image *= left * (1.0 + (BIAS if model else 0.0))
        seconds = {"load": START, "sampling": left * spp * (EACH + (RECORDING if model else 0.0))}
        seconds["inference"] = INFERENCE if model else 0.0
        return Shot(image.astype(np.float32), seconds)


def install_models(monkeypatch: pytest.MonkeyPatch, features: Mapping[str, str]) -> None:
    """Makes MBFeat come with these models: names, and what they look at."""
    models = {n: denoise.Model(n, Path(f"{n}.onnx"), text, {}) for n, text in features.items()}
    monkeypatch.setattr(denoise, "models", lambda: models)


MODEL = Variant("paths", "a model", {variants.DENOISE: "true", "mbfeat:denoise:model": "paths"})
BOTH = [variants.raw(), MODEL]


def exact_reference() -> Reference:
    return Reference(truth(), None, {"kind": "given", "files": ["truth.exr"]}, "truth")


def measure(
    renderer: KnownRenderer,
    folder: Path,
    *,
    chosen: Sequence[Variant] = BOTH,
    rungs: Sequence[int] = RUNGS,
    seeds: int = 3,
    against: Reference | None = None,
) -> Measured:
    """Measures the known renderer as the command does."""
    references = {OWN: against or exact_reference()}
    told: list[str] = []
    ladder = Ladder({OWN: renderer}, references, Keep(folder), SUBJECT, told.append)
    measured = ladder.run(tasks(chosen, rungs, seeds))
    split_recording(measured.points)
    assert told
    return measured


def rows_of(measured: Measured, chosen: Sequence[Variant] = BOTH) -> list[analysis.Rung]:
    return analysis.rungs(measured, chosen, {OWN: exact_reference()}, "relMSE")


def rendered_reference(renderer: KnownRenderer, spp: int, folder: Path) -> Reference:
    keep = Keep(folder)
    return reference.rendered(renderer, variants.raw(), spp, keep, SUBJECT, lambda _: None)
