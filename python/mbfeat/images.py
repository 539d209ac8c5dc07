"""The image of a finished film: linear in an EXR, corrected for a display in other formats."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mbfeat import _core

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LINEAR_EXTENSIONS = (".exr", ".hdr")


@dataclass(frozen=True)
class ColorCorrection:
    """How linear values become those of a display.

    `mode` is ``disabled``, ``sRGB`` (the curve alone) or ``openColorIO``. For the last, `config` is
    a file or ``ocio://NAME`` (empty: what $OCIO or the set-up names), `display` and `view` are
    names in it (empty: its defaults), and `from_space` is the colour space that was rendered in
    (empty: linear Rec.709).
    """

    mode: str = "sRGB"
    config: str = ""
    display: str = ""
    view: str = ""
    from_space: str = ""


def problem_with_format(path: str) -> str:
    """Why no image of that name can be written, as a sentence; empty when one can."""
    target = Path(path)
    known = [".exr", *(part.strip() for part in _core.image_extensions().split(","))]
    if target.suffix.lower() not in known:
        return (
            f"{path}: no image format has the extension {target.suffix!r}; use {', '.join(known)}"
        )
    return ""


def problem_with_folder(path: str) -> str:
    """Why no file can be written there, as a sentence; empty when one probably can."""
    target = Path(path)
    if not target.parent.is_dir():
        return f"{path}: there is no folder {target.parent}; make it first, or name another"
    if target.is_dir():
        return f"{path}: it is a folder; name a file"
    if not os.access(target.parent, os.W_OK):
        return f"{path}: the folder {target.parent} cannot be written; name another"
    return ""


def check_correction(correction: ColorCorrection) -> list[str]:
    """Opens what the correction needs, so that mistakes show before the render.

    Returns warnings. Raises _core.Error for a config, display or view that cannot be used.
    """
    import numpy as np

    if correction.mode != "openColorIO":
        return []
    config, warnings = _config(correction)
    pixel = np.zeros((1, 1, 3), dtype=np.float32)
    config.to_display(pixel, correction.from_space, correction.display, correction.view)
    return warnings


def write_image(
    path: str, film: _core.Film, report: _core.RenderReport, correction: ColorCorrection
) -> None:
    """Writes what viewers get: the film's ``color``, or the AOV that ``mbfeat:viewAov`` names.

    The file is there whole or, on an error, as it was before. EXR and HDR files hold linear values
    whatever `correction` says; an EXR has the AOV's own channel names. Raises _core.Error, which
    names the file.
    """
    aov = _viewed_aov(film, report)
    extension = Path(path).suffix.lower()
    if extension == ".exr":
        product = _core.ProductSpec(path, [_core.ProductLayer(aov)])
        _core.write_product(product, film, report)
        return
    image = _as_rgba(film, aov)
    if extension not in LINEAR_EXTENSIONS:
        correct(image, correction)
    _core.write_image(path, image)


def _viewed_aov(film: _core.Film, report: _core.RenderReport) -> str:
    """The name that mbfeat:viewAov has, where the film holds it; else ``color``."""
    wanted = next((value for name, value, _ in report.settings if name == "mbfeat:viewAov"), "")
    return wanted if wanted in {aov.name for aov in film.aovs} else "color"


def _as_rgba(film: _core.Film, aov: str) -> NDArray[np.float32]:
    """float32 [height, width, 4]: one channel becomes grey, two leave blue at 0; alpha is 1."""
    import numpy as np

    values = np.asarray(film.resolve(aov), dtype=np.float32)
    if values.shape[-1] == 4:
        return np.ascontiguousarray(values)
    image = np.zeros((*values.shape[:2], 4), dtype=np.float32)
    width = values.shape[-1]
    image[..., : 3 if width == 1 else width] = values
    image[..., 3] = 1.0
    return image


def correct(image: NDArray[np.float32], correction: ColorCorrection) -> None:
    """Corrects float32 [height, width, 3 or 4] in place; alpha is kept."""
    if correction.mode == "sRGB":
        _core.encode_srgb(image)
    elif correction.mode == "openColorIO":
        config, _ = _config(correction)
        config.to_display(image, correction.from_space, correction.display, correction.view)


def _config(correction: ColorCorrection) -> tuple[_core.ColorConfig, list[str]]:
    if correction.config:
        return _core.ColorConfig.open(correction.config), []
    return _core.ColorConfig.from_environment()
