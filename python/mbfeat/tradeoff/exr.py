"""Reading images back from EXR files, by the package OpenEXR."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float32]
TRIPLES = (("R", "G", "B"), ("X", "Y", "Z"))


class ImageFileError(Exception):
    """A file holds no image that can be used; the message says what is wrong."""


def read_layers(path: Path) -> dict[str, Image]:
    """The layers of three channels, [3, height, width] float32; that without a name is `color`.

    Values that are not finite become zero. Raises ImageFileError.
    """
    layers = _stored_layers(path)
    return {name: np.nan_to_num(a, nan=0.0, posinf=0.0, neginf=0.0) for name, a in layers.items()}


def _stored_layers(path: Path) -> dict[str, Image]:
    import OpenEXR

    found: dict[str, dict[str, Image]] = {}
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            for part in file.parts:
                for name, channel in part.channels.items():
                    layer, _, component = name.rpartition(".")
                    pixels = np.asarray(channel.pixels, dtype=np.float32)
                    found.setdefault(layer or "color", {})[component] = pixels
    except (OSError, RuntimeError, ValueError, TypeError) as error:
        raise ImageFileError(f"{path} could not be read as an EXR file: {error}") from error
    layers = {}
    for layer, channels in found.items():
        for triple in TRIPLES:
            if all(component in channels for component in triple):
                layers[layer] = np.stack([channels[component] for component in triple])
    return layers


def read_color(path: Path) -> Image:
    """The image of an EXR file, [3, height, width], all finite. Raises ImageFileError."""
    layers = _stored_layers(path)
    if "color" not in layers:
        raise ImageFileError(f"{path} has no channels R, G and B; name a file of the image itself")
    color = layers["color"]
    bad = int((~np.isfinite(color)).any(axis=0).sum())
    if bad:
        raise ImageFileError(
            f"{path} is not finite: {bad} of {color[0].size} pixels, against which no error can "
            "be told; render it again, or mend them"
        )
    return color
