"""The scene classes, their shares and splits, and the stage of a given class and number."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from training.keyed import generator
from training.scenes import held_out, lit, reflective, transparent
from training.scenes.builder import Builder
from training.scenes.version import VERSION


@dataclass(frozen=True)
class SceneClass:
    """A kind of scene: `light` is what dominates it, `share` its part of the training scenes."""

    name: str
    make: Callable[[Builder], None]
    light: str  # "reflection", "refraction" or "diffuse"
    share: float = 0.0

    @property
    def is_held_out(self) -> bool:
        return self.share == 0.0

    @property
    def doc(self) -> str:
        return (self.make.__doc__ or "").strip()


def _entry(make: Callable[[Builder], None], light: str, share: float = 0.0) -> SceneClass:
    return SceneClass(make.__name__, make, light, share)


CLASSES: dict[str, SceneClass] = {
    entry.name: entry
    for entry in (
        _entry(reflective.plane_mirror, "reflection", 0.08),
        _entry(reflective.curved_mirror, "reflection", 0.07),
        _entry(reflective.mirror_in_mirror, "reflection", 0.06),
        _entry(reflective.metal_ladder, "reflection", 0.06),
        _entry(reflective.glossy_floor, "reflection", 0.05),
        _entry(transparent.pane, "refraction", 0.06),
        _entry(transparent.solid_glass, "refraction", 0.06),
        _entry(transparent.thin_shell, "refraction", 0.05),
        _entry(transparent.frosted, "refraction", 0.06),
        _entry(transparent.water, "refraction", 0.05),
        _entry(transparent.both, "refraction", 0.04),
        _entry(lit.small_lights, "refraction", 0.03),
        _entry(lit.sunlit, "diffuse", 0.03),
        _entry(lit.diffuse_room, "diffuse", 0.30),
        _entry(held_out.vitrine, "refraction"),
        _entry(held_out.aquarium, "refraction"),
        _entry(held_out.periscope, "reflection"),
        _entry(held_out.bathroom, "reflection"),
        _entry(held_out.gallery, "diffuse"),
    )
}
TRAINING = tuple(entry for entry in CLASSES.values() if not entry.is_held_out)
HELD_OUT = tuple(entry for entry in CLASSES.values() if entry.is_held_out)


def class_of(split: str, seed: int, index: int) -> SceneClass:
    """The class of scene `index` of a split: ``train``, ``validation`` or ``test``.

    Training classes come by a low-discrepancy sequence, so that any run of scenes has about the
    wanted shares; test scenes go round the held-out classes.
    """
    if split == "test":
        return HELD_OUT[index % len(HELD_OUT)]
    offset = float(generator("class", split, seed).random())
    place = (offset + (index + 1) * 0.6180339887498949) % 1.0
    total = sum(entry.share for entry in TRAINING)
    for entry in TRAINING:
        place -= entry.share / total
        if place < 0.0:
            return entry
    return TRAINING[-1]


def write_stage(folder: Path, split: str, seed: int, index: int) -> tuple[Path, SceneClass]:
    """Writes scene `index` of a split with its textures into `folder`, emptied first."""
    entry = class_of(split, seed, index)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    rng = generator("scene", VERSION, split, seed, index, entry.name)
    builder = Builder(folder, rng, held_out=split == "test")
    entry.make(builder)
    stage = folder / "stage.usda"
    builder.stage.GetRootLayer().documentation = entry.doc
    builder.stage.GetRootLayer().Export(str(stage))
    return stage, entry
