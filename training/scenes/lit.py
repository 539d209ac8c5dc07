"""Scene classes of difficult lights, and plain diffuse rooms for generality."""

from __future__ import annotations

from training.scenes.builder import Builder


def small_lights(b: Builder) -> None:
    """Small bright lamps over glass and metal: fireflies and caustics."""
    b.room(5, 3, 6)
    for _ in range(int(b.rng.integers(2, 5))):
        position = (b.uniform(-1.8, 1.8), b.uniform(1.6, 2.7), b.uniform(-1.5, 1.5))
        b.lamp(position, 10 ** b.uniform(-2.2, -1.2), b.uniform(0.4, 1.5))
    b.thing((-0.7, 0, 0.3), 1.0, b.glass(), None)
    b.thing((0.7, 0, 0.2), 1.0, b.metal(b.uniform(0.02, 0.12)))
    b.things(4, (-1.9, 0, -2), (1.9, 0, -0.5), (0.7, 1.2))
    b.camera((b.uniform(-1, 1), b.uniform(0.8, 1.6), 2.9), (0, 0.6, 0), b.uniform(26, 42))


def sunlit(b: Builder) -> None:
    """Things of every kind under a sky with a sun."""
    b.ground()
    b.daylight()
    b.things(9, (-3, 0, -4), (3, 0, 1.4), (0.6, 1.5))
    b.thing((b.uniform(-1, 1), 0, 1.2), 0.9, b.glass() if b.chance(0.5) else b.mirror())
    b.camera((b.uniform(-2, 2), b.uniform(0.8, 2.4), 4.4), (0, 0.5, -0.5), b.uniform(28, 50))


def diffuse_room(b: Builder) -> None:
    """A closed room of matt surfaces: walls, furniture-like boxes and things."""
    w, h, d = b.uniform(4, 7), b.uniform(2.5, 3.5), b.uniform(5, 8)
    b.room(w, h, d)
    pick = b.rng.random()
    if pick < 0.6:
        b.ceiling_lights(h, 0.3 * w)
    elif pick < 0.8:
        for _ in range(2):
            b.lamp(
                (b.uniform(-1.5, 1.5), b.uniform(0.8, h - 0.3), b.uniform(-1.5, 1)),
                b.uniform(0.05, 0.2),
                b.uniform(0.5, 2.0),
            )
    else:
        wall = b.emitter(b.uniform(2, 6))
        b.quad((-0.49 * w, 0.6, 1), (0, 0, -2), (0, 1.4, 0), wall)
    for _ in range(int(b.rng.integers(1, 4))):
        x, z, s = b.uniform(-0.4 * w, 0.4 * w), b.uniform(-0.4 * d, 0.1 * d), b.uniform(0.2, 0.6)
        b.box((x - s, 0, z - s), (x + s, b.uniform(0.4, 1.6), z + s), b.diffuse())
    for _ in range(5):
        position = (b.uniform(-0.4 * w, 0.4 * w), 0.0, b.uniform(-0.4 * d, 0.2 * d))
        b.thing(position, b.uniform(0.5, 1.1), b.diffuse())
    b.camera(
        (b.uniform(-0.3, 0.3) * w, b.uniform(1.0, 1.8), 0.46 * d),
        (b.uniform(-0.5, 0.5), b.uniform(0.5, 1.2), 0),
        b.uniform(20, 36),
    )
