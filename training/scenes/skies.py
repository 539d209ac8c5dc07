"""Seeded latitude-longitude skies, as Radiance HDR files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from training.scenes.textures import Generator, value_noise

Sky = NDArray[np.float64]


def sky(rng: Generator, height: int, *, sun: bool) -> Sky:
    """Linear radiance [height, 2 height, 3]: gradient, clouds, ground, and where asked a sun.

    The sun covers some pixels and is three to four decades brighter than the sky.
    """
    elevation = np.linspace(np.pi / 2, -np.pi / 2, height)[:, None]
    azimuth = np.linspace(-np.pi, np.pi, 2 * height)[None, :]
    up = np.clip(np.sin(elevation), 0, 1)
    zenith = np.array([0.15, 0.3, 0.75]) * rng.uniform(0.4, 1.2)
    horizon = np.array([0.8, 0.75, 0.7]) * rng.uniform(0.4, 1.2)
    ground = np.full(3, rng.uniform(0.05, 0.25))
    image = horizon + (zenith - horizon) * (up**0.5)[..., None]
    image = np.broadcast_to(image, (height, 2 * height, 3)).copy()
    noise = value_noise(rng, 2 * height, 4)[:height]
    cloud = np.clip((noise - rng.uniform(0.45, 0.65)) * 4, 0, 1)[..., None]
    image += cloud * (rng.uniform(0.8, 1.6) - image)
    image[np.broadcast_to(elevation < 0, image.shape[:2])] = ground
    if sun:
        height_of_sun, side = rng.uniform(0.15, 1.2), rng.uniform(-np.pi, np.pi)
        cosine = np.sin(elevation) * np.sin(height_of_sun) + np.cos(elevation) * np.cos(
            height_of_sun
        ) * np.cos(azimuth - side)
        image += (
            (10 ** rng.uniform(2.8, 4.0))
            * (cosine > np.cos(1.6 * np.pi / height))[..., None]
            * np.array([1.0, 0.9, 0.75])
        )
        image += 3.0 * (np.clip(cosine, 0, 1) ** 200)[..., None]
    return np.asarray(image)


def write_hdr(path: Path, image: Sky) -> None:
    """Writes [height, width, 3] as uncompressed RGBE (Ward, Real Pixels, Graphics Gems II)."""
    largest = np.maximum(image.max(axis=-1), 1e-32)
    mantissa, exponent = np.frexp(largest)
    scale = mantissa * 256.0 / largest
    pixels = np.empty((*image.shape[:2], 4), dtype=np.uint8)
    pixels[..., :3] = np.clip(image * scale[..., None], 0, 255).astype(np.uint8)
    pixels[..., 3] = np.clip(exponent + 128, 0, 255).astype(np.uint8)
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {image.shape[0]} +X {image.shape[1]}\n"
    path.write_bytes(header.encode("ascii") + pixels.tobytes())
