"""Scene classes of mirrors and metals."""

from __future__ import annotations

from training import stagekit as kit
from training.scenes import shapes
from training.scenes.builder import Builder


def _outdoors_or_room(b: Builder, depth: float, spread: float) -> None:
    """Ground under sky and sun, or a room of that depth with lamps near its middle."""
    if b.chance(0.4):
        b.ground()
        b.daylight()
    else:
        b.room(6, 3, depth)
        b.ceiling_lights(3, spread)


def plane_mirror(b: Builder) -> None:
    """A flat mirror that faces textured things, some of which the camera does not see itself."""
    b.room(6, 3, 7)
    b.ceiling_lights(3, 1.8)
    mirror = b.box((-1.6, 0.2, -0.03), (1.6, 2.5, 0.0), b.mirror())
    kit.place(mirror, translate=(0, 0, -1.6), rotate=(b.uniform(-6, 2), b.uniform(-30, 30), 0))
    b.things(4, (-2.2, 0, -0.8), (2.2, 0, 1.0), (0.5, 1.0))
    b.things(3, (-2.6, 0, 2.4), (2.6, 0, 3.2), (0.8, 1.4))
    b.camera((b.uniform(-1, 1), 1.4, 2.2), (b.uniform(-0.3, 0.3), 1.1, -1.6), b.uniform(26, 42))


def curved_mirror(b: Builder) -> None:
    """Chrome balls, blobs and bent sheets before patterns."""
    _outdoors_or_room(b, 7, 1.8)
    for i in range(2):
        b.thing((1.3 * (2 * i - 1), 0, b.uniform(-0.5, 0.5)), b.uniform(1.1, 1.5), b.mirror())
    angle = b.uniform(0.5, 2.2) * (1 if b.chance(0.6) else -1)
    sheet = shapes.bent(b.stage, f"/World/{b.name('Sheet')}", 2.4, 2.0, angle)
    b.put(kit.place(sheet, translate=(0, 0.05, -1.8)), b.mirror())
    b.things(5, (-2.3, 0, -1.2), (2.3, 0, 1.6), (0.35, 0.7))
    b.camera((b.uniform(-1, 1), b.uniform(0.9, 1.7), 3.1), (0, 0.7, -0.3), b.uniform(26, 42))


def mirror_in_mirror(b: Builder) -> None:
    """Two mirrors that face each other at a small angle, with things between them."""
    b.room(6, 3, 7)
    b.ceiling_lights(3, 1.2)
    for z, facing in ((-2.0, 0.0), (3.2, 180.0)):
        mirror = b.box((-2.0, 0.1, -0.03), (2.0, 2.7, 0.0), b.mirror())
        kit.place(mirror, translate=(0, 0, z), rotate=(0, facing + b.uniform(-12, 12), 0))
    b.things(5, (-1.8, 0, -1.4), (1.8, 0, 1.0), (0.5, 1.0))
    b.camera((b.uniform(-1.2, 1.2), 1.5, 2.4), (b.uniform(-0.5, 0.5), 1.1, -2), b.uniform(24, 40))


def metal_ladder(b: Builder) -> None:
    """Metals whose roughness grows from thing to thing, on a patterned floor."""
    _outdoors_or_room(b, 6, 2)
    low, high = b.uniform(0.02, 0.06), b.uniform(0.3, 0.5)
    for i in range(5):
        roughness = low * (high / low) ** (i / 4)
        b.thing((0.95 * (i - 2), 0, b.uniform(-0.4, 0.4)), b.uniform(0.8, 1.0), b.metal(roughness))
    panel = b.box((-2.2, 0.0, -0.03), (2.2, 2.2, 0.0), b.metal(b.uniform(0.04, 0.2)))
    kit.place(panel, translate=(0, 0, -1.7))
    b.things(3, (-2.2, 0, 0.9), (2.2, 0, 1.5), (0.3, 0.6))
    b.camera((b.uniform(-1, 1), b.uniform(0.9, 1.7), 2.95), (0, 0.5, -0.4), b.uniform(24, 34))


def glossy_floor(b: Builder) -> None:
    """A polished plastic or metal floor that mirrors patterned walls and things."""
    w = 3.0
    floor = (
        b.diffuse(textured=True, roughness=b.uniform(0.02, 0.15))
        if b.chance(0.6)
        else b.metal(b.uniform(0.02, 0.2))
    )
    b.quad((-w, 0, w), (2 * w, 0, 0), (0, 0, -2 * w), floor, 3)
    for turn in (0, 90, 270):
        wall = b.quad((-w, 0, -w), (2 * w, 0, 0), (0, 3, 0), b.diffuse(textured=True), 2)
        kit.place(wall, rotate=(0, turn, 0))
    if b.chance(0.4):
        glow = b.emitter(b.uniform(1, 4), textured=True)
        sign = b.quad((-1, 1.2, -2.9), (2, 0, 0), (0, 1, 0), glow)
        kit.place(sign, translate=(b.uniform(-1, 1), 0, 0))
    b.sky(sun=False, intensity=0.5)
    b.rect_light((b.uniform(-2, 2), 3.5, 1), (0, 0, 0), 1.0, b.uniform(10, 25))
    b.things(5, (-2.2, 0, -2.2), (2.2, 0, 1.0), (0.6, 1.2))
    b.camera((b.uniform(-1, 1), b.uniform(0.5, 1.2), 3.6), (0, 0.5, -0.5), b.uniform(26, 42))
