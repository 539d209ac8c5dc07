"""``mbfeat denoise``: reconstructs the image of a deep product with a trained network."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mbfeat import _core
from mbfeat.images import ColorCorrection, problem_with_folder, problem_with_format, write_image

RAW = "mbfeat:raw"
FEATURES = {
    "auto": _core.DenoiseFeatures.AUTO,
    "none": _core.DenoiseFeatures.NONE,
    "firstHit": _core.DenoiseFeatures.FIRST_HIT,
    "multiBounce": _core.DenoiseFeatures.MULTI_BOUNCE,
}


class DenoiseError(Exception):
    """The image could not be denoised or written; the message is for the user."""


@dataclass(frozen=True)
class Model:
    """A network that MBFeat comes with; `training` is what its file says of how it was made."""

    name: str
    file: Path
    features: str
    training: dict[str, Any]


def models() -> dict[str, Model]:
    """The networks that MBFeat comes with and this machine can run, by name.

    Empty where ONNX Runtime is not installed.
    """
    found: dict[str, Model] = {}
    for name, file in _core.installed_models():
        try:
            model = _core.DenoiseModel.open(file, 1)
        except _core.Error:
            continue
        training = json.loads(model.training or "{}")
        found[name] = Model(name, Path(file), model.features, training)
    return found


def denoise(
    source: Path,
    target: Path,
    *,
    model: str = "",
    features: str = "auto",
    threads: int = 0,
    tile: int = 0,
    memory: float = 1.0,
    raw: bool = False,
    preview: Path | None = None,
    correction: ColorCorrection | None = None,
) -> _core.RenderReport:
    """Reconstructs `source`, a deep EXR, into `target`; returns what it took.

    With `raw` an EXR also has the image before, as the layer ``mbfeat:raw``. `preview` is an image
    for people, corrected as `correction` says. Raises DenoiseError.
    """
    for path in (target, preview):
        if path is None:
            continue
        if problem := problem_with_folder(str(path)) or problem_with_format(str(path)):
            raise DenoiseError(problem)
    try:
        film, report = _core.denoise_file(
            str(source), model, FEATURES[features], threads, tile, memory, [RAW]
        )
        color = correction or ColorCorrection(mode="sRGB")
        if target.suffix.lower() == ".exr" and raw:
            layers = [_core.ProductLayer("color"), _core.ProductLayer(RAW, RAW)]
            _core.write_product(_core.ProductSpec(str(target), layers), film, report)
        else:
            write_image(str(target), film, report, color)
        if preview is not None:
            write_image(str(preview), film, report, color)
    except _core.Error as error:
        raise DenoiseError(str(error)) from error
    return report
