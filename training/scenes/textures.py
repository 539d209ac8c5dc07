"""Seeded textures as arrays, in families of which some are kept for the held-out scenes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Generator = np.random.Generator


def palette(rng: Generator, count: int) -> Array:
    """Colours [count, 3] of clearly different brightness, 0.02 to 0.95, linear."""
    value = np.linspace(0.04, 0.9, count) + rng.uniform(-0.02, 0.05, count)
    hue = rng.random() + rng.random(count) * rng.choice([0.1, 0.5, 1.0])
    saturation = rng.uniform(0.0, 0.8, count)
    wave = 0.5 + 0.5 * np.cos(2 * np.pi * (hue[:, None] + np.array([0.0, 1 / 3, 2 / 3])))
    colours = value[:, None] * (1 - saturation[:, None] * (1 - wave))
    return rng.permutation(np.clip(colours, 0.02, 0.95))


def _grid(size: int) -> tuple[Array, Array]:
    y, x = np.mgrid[0:size, 0:size] / size
    return x, y


def value_noise(rng: Generator, size: int, cells: int, octaves: int = 4) -> Array:
    """Tileable smooth noise [size, size], about 0..1."""
    total, weight = np.zeros((size, size)), 0.0
    for octave in range(octaves):
        n = cells * 2**octave
        if n > size:
            break
        lattice = rng.random((n, n))
        position = np.arange(size) * n / size
        low = position.astype(int)
        fraction = position - low
        fraction = fraction * fraction * (3 - 2 * fraction)
        high = (low + 1) % n
        rows = lattice[low] * (1 - fraction)[:, None] + lattice[high] * fraction[:, None]
        total += 0.5**octave * (rows[:, low] * (1 - fraction) + rows[:, high] * fraction)
        weight += 0.5**octave
    return total / weight


def checker(rng: Generator, size: int) -> Array:
    n = int(rng.choice([4, 8, 16]))
    x, y = _grid(size)
    return palette(rng, 2)[((x * n).astype(int) + (y * n).astype(int)) % 2]


def stripes(rng: Generator, size: int) -> Array:
    x, y = _grid(size)
    a, b = rng.integers(1, 8, 2)
    count = int(rng.integers(2, 5))
    return palette(rng, count)[(((x * a + y * b) % 1.0) * count).astype(int)]


def dots(rng: Generator, size: int) -> Array:
    n = int(rng.choice([4, 6, 10]))
    x, y = _grid(size)
    inside = np.hypot((x * n) % 1 - 0.5, (y * n) % 1 - 0.5) < rng.uniform(0.2, 0.45)
    return palette(rng, 2)[inside.astype(int)]


def bricks(rng: Generator, size: int) -> Array:
    x, y = _grid(size)
    rows = int(rng.choice([6, 8, 12]))
    row = (y * rows).astype(int)
    u = x * rows / 2 + 0.5 * (row % 2)
    mortar = ((y * rows) % 1 < 0.1) | (u % 1 < 0.05)
    tone = rng.random((rows, rows + 1))[row, u.astype(int) % (rows // 2)]
    colours = palette(rng, 2)
    return np.where(mortar[..., None], colours[0], colours[1] * (0.6 + 0.4 * tone[..., None]))


def clouds(rng: Generator, size: int) -> Array:
    noise = value_noise(rng, size, int(rng.choice([2, 4, 8])))[..., None]
    low, high = palette(rng, 2)
    t = np.clip((noise - 0.3) / 0.4, 0, 1)
    return low + (high - low) * t


def wood(rng: Generator, size: int) -> Array:
    x, y = _grid(size)
    warp = value_noise(rng, size, 2)
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (int(rng.integers(4, 12)) * x + 1.5 * warp))
    grain = value_noise(rng, size, 32, 2)
    tone = (0.7 * rings + 0.3 * grain)[..., None]
    dark = np.array([0.16, 0.07, 0.03]) * rng.uniform(0.6, 1.4)
    return dark + (np.array([0.62, 0.38, 0.18]) - dark) * tone + 0 * y[..., None]


def marble(rng: Generator, size: int) -> Array:
    x, y = _grid(size)
    a, b = rng.integers(1, 4, 2)
    vein = np.abs(np.sin(np.pi * (a * x + b * y + 2.5 * value_noise(rng, size, 4, 5))))
    colours = palette(rng, 2)
    return colours[0] + (colours[1] - colours[0]) * (vein**0.4)[..., None]


def glyphs(rng: Generator, size: int) -> Array:
    """Rows of random block letters: fine, sharp and irregular, like print."""
    columns = int(rng.choice([6, 9, 12]))
    letters = rng.random((columns, columns, 5, 3)) < 0.55
    page = np.zeros((columns, 8, columns, 5), dtype=bool)
    page[:, 1:6, :, 1:4] = letters.transpose(0, 2, 1, 3)
    sheet = page.reshape(columns * 8, columns * 5)
    rows = np.arange(size) * sheet.shape[0] // size
    cols = np.arange(size) * sheet.shape[1] // size
    return palette(rng, 2)[sheet[rows][:, cols].astype(int)]


def cells(rng: Generator, size: int) -> Array:
    """Voronoi cells on a torus."""
    count = int(rng.integers(12, 60))
    points = rng.random((count, 2))
    x, y = _grid(size)
    dx, dy = np.abs(x[..., None] - points[:, 0]), np.abs(y[..., None] - points[:, 1])
    distance = np.minimum(dx, 1 - dx) ** 2 + np.minimum(dy, 1 - dy) ** 2
    return palette(rng, count)[distance.argmin(axis=-1)]


# Held out: never drawn for a training scene.


def hexagons(rng: Generator, size: int) -> Array:
    n = int(rng.choice([4, 6, 10]))
    x, y = _grid(size)
    a, b = x * n, y * n
    first = np.hypot(a % 1 - 0.5, b % 1 - 0.5)
    second = np.hypot((a + 0.5) % 1 - 0.5, (b + 0.5) % 1 - 0.5)
    edge = np.abs(first - second) < 0.08
    ident = np.where(first < second, a.astype(int) + b.astype(int), 7 + (a + 0.5).astype(int)) % 4
    colours = palette(rng, 5)
    return np.where(edge[..., None], colours[4], colours[ident])


def truchet(rng: Generator, size: int) -> Array:
    """Quarter circles in randomly turned tiles."""
    n = int(rng.choice([6, 8, 12]))
    x, y = _grid(size)
    u, v = (x * n) % 1, (y * n) % 1
    flip = rng.random((n, n))[(y * n).astype(int), (x * n).astype(int)] < 0.5
    u = np.where(flip, 1 - u, u)
    near = np.minimum(np.abs(np.hypot(u, v) - 0.5), np.abs(np.hypot(1 - u, 1 - v) - 0.5))
    return palette(rng, 2)[(near < 0.12).astype(int)]


def spirals(rng: Generator, size: int) -> Array:
    n = int(rng.choice([2, 3, 4]))
    x, y = _grid(size)
    u, v = (x * n) % 1 - 0.5, (y * n) % 1 - 0.5
    turn = np.arctan2(v, u) / (2 * np.pi) + 4 * np.hypot(u, v)
    return palette(rng, 3)[((turn % 1.0) * 3).astype(int)]


def weave(rng: Generator, size: int) -> Array:
    n = int(rng.choice([6, 10, 16]))
    x, y = _grid(size)
    over = ((x * n).astype(int) + (y * n).astype(int)) % 2 == 0
    strand = np.where(over, np.sin(np.pi * ((y * n) % 1)), np.sin(np.pi * ((x * n) % 1)))
    colours = palette(rng, 2)[over.astype(int)]
    return colours * (0.25 + 0.75 * strand[..., None])


Family = Callable[[Generator, int], Array]

TRAINING: dict[str, Family] = {
    f.__name__: f for f in (checker, stripes, dots, bricks, clouds, wood, marble, glyphs, cells)
}
HELD_OUT: dict[str, Family] = {f.__name__: f for f in (hexagons, truchet, spirals, weave)}


def srgb8(colours: Array) -> NDArray[np.uint8]:
    """Linear 0..1 as 8-bit sRGB."""
    linear = np.clip(colours, 0.0, 1.0)
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return (curve * 255 + 0.5).astype(np.uint8)
