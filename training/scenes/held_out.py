"""Scene classes that no training scene has; they also use the held-out meshes and textures."""

from __future__ import annotations

from training import stagekit as kit
from training.scenes import shapes
from training.scenes.builder import Builder


def vitrine(b: Builder) -> None:
    """A show-case of thick glass on a plinth, its goods lit from inside its lid."""
    b.room(6, 3, 7)
    b.ceiling_lights(3, 2)
    b.box((-1.1, 0, -0.7), (1.1, 0.7, 0.7), b.diffuse())
    glass = b.glass(ior=1.5)
    t = 0.04
    b.box((-1.1, 0.71, 0.66), (1.1, 1.9, 0.66 + t), glass)
    b.box((-1.1, 0.71, -0.66 - t), (1.1, 1.9, -0.66), glass)
    b.box((-1.1, 0.71, -0.65), (-1.1 + t, 1.9, 0.65), glass)
    b.box((1.1 - t, 0.71, -0.65), (1.1, 1.9, 0.65), glass)
    b.box((-1.1, 1.91, -0.7), (1.1, 1.95, 0.7), b.diffuse(textured=False))
    b.rect_light((0, 1.9, 0), (0, 0, 0), 0.5, b.uniform(8, 20))
    b.things(4, (-0.8, 0.7, -0.4), (0.8, 0.7, 0.4), (0.4, 0.8))
    b.things(4, (-2.5, 0, -3), (2.5, 0, -1.2), (0.8, 1.3))
    b.camera((b.uniform(-1.6, 1.6), b.uniform(1.2, 1.8), 3.1), (0, 1.15, 0), b.uniform(34, 52))


def periscope(b: Builder) -> None:
    """Two mirrors at 45 degrees show over a wall what stands behind it."""
    b.room(7, 4, 8)
    b.ceiling_lights(4, 2)
    s = 1.3
    for y, z, tilt in ((1.2, -0.6, -45.0), (3.0, -0.6, 135.0)):
        mirror = b.box((-1.6, -s / 2, -0.02), (1.6, s / 2, 0.0), b.mirror())
        kit.place(mirror, translate=(0, y, z), rotate=(tilt + b.uniform(-4, 4), 0, 0))
    b.box((-3.5, 0, -1.5), (3.5, 2.3, -1.4), b.diffuse(textured=True))
    b.things(5, (-2.5, 1.2, -3.6), (2.5, 1.8, -2.0), (0.8, 1.4))
    b.things(4, (-2.8, 0, -0.6), (2.8, 0, 1.0), (0.5, 0.9))
    b.camera((b.uniform(-0.7, 0.7), 1.4, 3.6), (0, 1.4, -0.6), b.uniform(28, 44))


def aquarium(b: Builder) -> None:
    """A tank of glass with water in it: media inside one another."""
    b.room(6, 3, 7)
    b.ceiling_lights(3, 2)
    b.box((-1.3, 0, -0.6), (1.3, 0.6, 0.6), b.diffuse())
    b.box((-1.25, 0.62, -0.55), (1.25, 1.75, 0.55), b.glass(ior=1.5))
    # The water's own surface against the glass has the relative index.
    water = kit.box(b.stage, f"/World/{b.name('Water')}", (-1.2, 0.66, -0.5), (1.2, 1.6, 0.5))
    b.put(water, b.material(diffuseColor=(0.95, 1, 1), opacity=0.0, ior=1.33 / 1.5, roughness=0.0))
    b.things(4, (-0.9, 0.67, -0.3), (0.9, 0.8, 0.3), (0.3, 0.6))
    b.things(4, (-2.5, 0, -3), (2.5, 0, -1.2), (0.9, 1.4))
    b.rect_light((0, 2.6, 0.2), (0, 0, 0), 0.8, b.uniform(12, 25))
    b.camera((b.uniform(-1.5, 1.5), b.uniform(1.0, 1.7), 3.0), (0, 1.05, 0), b.uniform(34, 50))


def bathroom(b: Builder) -> None:
    """A frosted screen beside a bent chrome column and a mirror that shows both."""
    b.room(5, 2.8, 6)
    b.ceiling_lights(2.8, 1.5)
    screen = b.box((-0.8, 0, -0.02), (0.8, 2.1, 0.02), b.glass(b.uniform(0.06, 0.3), 1.5))
    kit.place(screen, translate=(-1.0, 0, 0.2), rotate=(0, b.uniform(-25, 25), 0))
    mirror = b.box((-1.2, 0.8, -0.02), (1.2, 2.2, 0.0), b.mirror())
    kit.place(mirror, translate=(0.9, 0, -2.8), rotate=(0, b.uniform(-8, 8), 0))
    column = shapes.bent(b.stage, f"/World/{b.name('Column')}", 1.2, 2.4, 3.0)
    b.put(kit.place(column, translate=(1.1, 0, -0.4)), b.metal(b.uniform(0.02, 0.08)))
    b.things(6, (-2, 0, -2.4), (2, 0, -0.4), (0.6, 1.1))
    b.things(2, (-2, 0, 1.0), (2, 0, 2.0), (0.4, 0.7))
    b.camera((b.uniform(-0.8, 0.8), 1.4, 2.8), (0, 1.0, -0.5), b.uniform(24, 36))


def gallery(b: Builder) -> None:
    """A matt hall with plinths and pictures: diffuse light alone."""
    b.room(7, 3.5, 9)
    b.ceiling_lights(3.5, 2)
    for i in range(3):
        x = 2.0 * (i - 1)
        b.quad((x - 0.6, 1.0, -4.45), (1.2, 0, 0), (0, 1.3, 0), b.diffuse(textured=True))
        z = b.uniform(-2.5, 0.5)
        b.box((x - 0.3, 0, z - 0.3), (x + 0.3, 0.9, z + 0.3), b.diffuse(textured=False))
        b.thing((x, 0.9, z), b.uniform(0.6, 0.9), b.diffuse())
    b.camera((b.uniform(-1.5, 1.5), 1.5, 4.1), (0, 1.1, -1), b.uniform(22, 34))
