"""Scene classes of glass and water: things seen through, and at once reflected, by one surface."""

from __future__ import annotations

from training import stagekit as kit
from training.scenes import shapes
from training.scenes.builder import Builder


def pane(b: Builder) -> None:
    """A pane seen at a grazing angle: it shows what is behind it and what is beside the camera."""
    b.room(6, 3, 7)
    b.ceiling_lights(3, 1.8)
    turn = b.uniform(50, 82) * (1 if b.chance(0.5) else -1)
    sheet = b.box((-1.7, 0.1, -0.02), (1.7, 2.2, 0.02), b.glass(ior=b.uniform(1.4, 1.6)))
    kit.place(sheet, rotate=(0, turn, 0))
    b.things(5, (-2.5, 0, -3), (2.5, 0, 1.2), (0.6, 1.2))
    b.camera((b.uniform(-0.6, 0.6), 1.3, 3.1), (0, b.uniform(0.7, 1.1), 0), b.uniform(26, 45))


def solid_glass(b: Builder) -> None:
    """Solid glass things before textured ones."""
    b.room(5, 3, 6)
    b.ceiling_lights(3, 1.5)
    for i in range(3):
        b.thing((1.1 * (i - 1) + b.uniform(-0.2, 0.2), 0, 0.8), b.uniform(0.8, 1.2), b.glass())
    b.things(4, (-1.8, 0, -2.2), (1.8, 0, -0.4), (0.7, 1.3))
    b.camera((b.uniform(-1, 1), b.uniform(0.7, 1.6), 2.9), (0, 0.4, 0.4), b.uniform(30, 48))


def thin_shell(b: Builder) -> None:
    """Hollow glass: two surfaces a few hundredths apart, with something inside."""
    b.ground()
    b.sky(sun=False)
    b.rect_light((3, 4, 3), (0, 0, 0), 1.5, b.uniform(8, 20))
    for i in range(2):
        x, radius = 1.2 * (2 * i - 1) + b.uniform(-0.15, 0.15), b.uniform(0.7, 0.95)
        glass = b.glass(ior=b.uniform(1.4, 1.55))
        for r, inward in ((radius, False), (radius * b.uniform(0.94, 0.98), True)):
            shell = kit.sphere_mesh(b.stage, f"/World/{b.name('Shell')}", r, 64, inward=inward)
            kit.place(shell, translate=(x, radius, 0))
            b.put(shell, glass)
        b.thing((x, radius * 0.55, 0), radius * 0.75)
    b.things(4, (-3, 0, -3), (3, 0, -1.3), (0.7, 1.2))
    b.camera((b.uniform(-1, 1), b.uniform(0.8, 1.8), 4.0), (0, 0.7, 0), b.uniform(32, 50))


def frosted(b: Builder) -> None:
    """Panes of frosted glass, rougher from pane to pane, before bright things."""
    b.room(6, 3, 6)
    b.ceiling_lights(3, 2)
    base = b.uniform(0.04, 0.15)
    for i in range(4):
        sheet = b.box((-0.55, 0.0, -0.02), (0.55, 2.0, 0.02), b.glass(base * 1.7**i, 1.5))
        kit.place(sheet, translate=(1.2 * (i - 1.5), 0, 0.6), rotate=(0, b.uniform(-20, 20), 0))
    b.things(6, (-2.4, 0, -2), (2.4, 0, -0.1), (0.7, 1.4))
    if b.chance(0.6):
        b.thing((b.uniform(-1.5, 1.5), 0, -0.4), 0.6, b.emitter(b.uniform(1, 5), textured=True))
    b.camera((b.uniform(-0.5, 0.5), 1.2, 2.9), (0, 0.9, 0), b.uniform(26, 38))


def water(b: Builder) -> None:
    """A rippled surface over a textured floor with things below and above it."""
    b.quad((-4, -0.9, 4), (8, 0, 0), (0, 0, -8), b.diffuse(textured=True), 4)
    for turn in (0, 90, 180, 270):
        wall = b.quad((-4, -0.9, -4), (8, 0, 0), (0, 1.1, 0), b.diffuse(), 3)
        kit.place(wall, rotate=(0, turn, 0))
    name = f"/World/{b.name('Water')}"
    surface = shapes.wavy(b.stage, name, b.rng, 4.0, b.uniform(0.01, 0.08))
    b.put(surface, b.glass(ior=1.33))
    b.things(5, (-2, -0.9, -2), (2, -0.6, 2), (0.5, 1.0))
    b.things(3, (-2.5, 0.0, -2.5), (2.5, 0.3, 0.5), (0.5, 1.0))
    if b.chance(0.5):
        b.daylight()
    else:
        b.sky(sun=False, intensity=0.4)
        b.rect_light((2, 3.5, 1), (0, 0, 0), 1.0, b.uniform(15, 35))
    b.camera((b.uniform(-1.5, 1.5), b.uniform(0.7, 2.2), 3.6), (0, -0.4, 0), b.uniform(26, 42))


def both(b: Builder) -> None:
    """A glass front: the same thing is seen reflected in it and another one through it."""
    b.room(6, 3, 8)
    b.box((-2.4, 0, -0.3), (2.4, 2.5, -0.26), b.glass(ior=b.uniform(1.5, 1.9)))
    for z, power in ((1.8, b.uniform(14, 30)), (-2.0, b.uniform(10, 30))):
        b.rect_light((b.uniform(-1, 1), 2.9, z), (0, 0, z), 0.8, power / 0.64)
    b.things(4, (-1.8, 0, -3), (1.8, 0, -0.9), (0.7, 1.3))
    b.things(3, (-2.6, 0, 0.6), (2.6, 0, 2.2), (0.5, 0.9))
    side = 1 if b.chance(0.5) else -1
    b.camera((side * b.uniform(1.2, 2.4), 1.4, 3.2), (-side * 0.6, 0.9, -0.3), b.uniform(24, 38))
