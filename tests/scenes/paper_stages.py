"""Two interiors after the test scenes of the paper on multi-bounce features.

make_scenes.py writes them, beside the third, the cockpit. Nothing here is random.
"""

from __future__ import annotations

import math

import stagekit as kit
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade

MATERIALS = "/World/Materials"
CHECKER = "./textures/checker.png"
PANEL = "./textures/panel.png"


def _diffuse(stage: Usd.Stage, name: str, colour: kit.Vector) -> UsdShade.Material:
    return kit.preview_material(
        stage, f"{MATERIALS}/{name}", diffuseColor=colour, roughness=1.0, ior=1.0
    )


def _textured(
    stage: Usd.Stage, name: str, file: str, tint: kit.Vector, roughness: float = 1.0
) -> UsdShade.Material:
    colour = kit.texture(stage, f"{MATERIALS}/{name}/Map", file, scale=(*tint, 1.0))
    ior = 1.0 if roughness == 1.0 else 1.5
    return kit.preview_material(
        stage, f"{MATERIALS}/{name}", diffuseColor=colour, roughness=roughness, ior=ior
    )


def _tiled(prim: UsdGeom.Mesh, across: float, along: float) -> UsdGeom.Mesh:
    corners = [Gf.Vec2f(u, v) for u, v in [(0, 0), (across, 0), (across, along), (0, along)]]
    UsdGeom.PrimvarsAPI(prim).GetPrimvar("st").Set(corners)
    return prim


def _sculpture(stage: Usd.Stage, path: str) -> UsdGeom.Mesh:
    """A trefoil of a round tube, 0.7 high, standing on y = 0."""
    rings, sides, radius = 90, 12, 0.055
    points: list[kit.Vector] = []
    normals: list[kit.Vector] = []

    def at(t: float) -> Gf.Vec3d:
        r = 0.2 + 0.1 * math.cos(3 * t)
        return Gf.Vec3d(
            r * math.cos(2 * t), 0.35 + 1.05 * r * math.sin(2 * t), 0.11 * math.sin(3 * t)
        )

    for i in range(rings):
        t = 2 * math.pi * i / rings
        tangent = (at(t + 1e-3) - at(t - 1e-3)).GetNormalized()
        side = Gf.Cross(tangent, Gf.Vec3d(0, 0, 1)).GetNormalized()
        up = Gf.Cross(side, tangent)
        for j in range(sides):
            phi = 2 * math.pi * j / sides
            n = side * math.cos(phi) + up * math.sin(phi)
            points.append(tuple(at(t) + n * radius))
            normals.append(tuple(n))
    faces = [
        (
            i * sides + j,
            i * sides + (j + 1) % sides,
            (i + 1) % rings * sides + (j + 1) % sides,
            (i + 1) % rings * sides + j,
        )
        for i in range(rings)
        for j in range(sides)
    ]
    return kit.mesh(stage, path, points, faces, normals=normals)


def livingroom() -> Usd.Stage:
    """A living room whose wall mirror shows a sculpture that stands with its back to the camera.

    First-hit features see the mirror's frame and a flat surface; vertex 1 sees the room in it.
    """
    stage = kit.new_stage()
    wall = _diffuse(stage, "Wall", (0.68, 0.65, 0.58))
    ceiling = _diffuse(stage, "Ceiling", (0.78, 0.78, 0.76))
    accent = _textured(stage, "Accent", CHECKER, (0.8, 0.55, 0.45))
    floor = _textured(stage, "Floor", CHECKER, (0.75, 0.5, 0.32), 0.35)
    rug = _textured(stage, "Rug", PANEL, (0.9, 0.5, 0.5))
    wood = _diffuse(stage, "Wood", (0.3, 0.17, 0.09))
    cloth = _diffuse(stage, "Cloth", (0.14, 0.25, 0.36))
    cushion = _diffuse(stage, "Cushion", (0.75, 0.42, 0.1))
    bronze = kit.preview_material(
        stage, f"{MATERIALS}/Bronze", diffuseColor=(0.85, 0.55, 0.3), metallic=1.0, roughness=0.22
    )
    silver = kit.preview_material(
        stage, f"{MATERIALS}/Silver", diffuseColor=(0.93, 0.94, 0.95), metallic=1.0, roughness=0.0
    )
    shade = kit.preview_material(
        stage,
        f"{MATERIALS}/Shade",
        diffuseColor=(0.5, 0.4, 0.3),
        emissiveColor=(1.6, 1.1, 0.6),
        roughness=1.0,
    )

    ground = kit.quad(stage, "/World/Room/Floor", (-3, 0, 3), (6, 0, 0), (0, 0, -6))
    kit.bind(_tiled(ground, 6, 6), floor)
    walls: list[tuple[str, UsdShade.Material, kit.Vector, kit.Vector, kit.Vector]] = [
        ("Ceiling", ceiling, (-3, 2.8, -3), (6, 0, 0), (0, 0, 6)),
        ("Back", wall, (-3, 0, -3), (6, 0, 0), (0, 2.8, 0)),
        ("Left", wall, (-3, 0, 3), (0, 0, -6), (0, 2.8, 0)),
        ("Right", wall, (3, 0, -3), (0, 0, 6), (0, 2.8, 0)),
        ("Front", accent, (3, 0, 3), (-6, 0, 0), (0, 2.8, 0)),
    ]
    for name, material, origin, u, v in walls:
        prim = kit.quad(stage, f"/World/Room/{name}", origin, u, v)
        kit.bind(_tiled(prim, 4, 2) if name == "Front" else prim, material)
    carpet = kit.quad(stage, "/World/Rug", (-1.3, 0.012, 1.1), (2.6, 0, 0), (0, 0, -2.0))
    kit.bind(carpet, rug)

    kit.bind(kit.box(stage, "/World/Mirror/Frame", (-1.25, 0.75, -3.0), (1.25, 2.35, -2.94)), wood)
    glass = kit.quad(stage, "/World/Mirror/Glass", (-1.15, 0.85, -2.935), (2.3, 0, 0), (0, 1.4, 0))
    kit.bind(glass, silver)

    kit.bind(kit.box(stage, "/World/Table/Top", (-0.9, 0.66, -2.85), (0.9, 0.72, -2.2)), wood)
    for i, (x, z) in enumerate([(-0.85, -2.8), (0.8, -2.8), (-0.85, -2.3), (0.8, -2.3)]):
        leg = kit.box(stage, f"/World/Table/Leg{i}", (x, 0, z), (x + 0.06, 0.66, z + 0.06))
        kit.bind(leg, wood)
    sculpture = _sculpture(stage, "/World/Sculpture")
    kit.bind(kit.place(sculpture, translate=(-0.2, 0.72, -2.5), rotate=(0, 25, 0)), bronze)
    vase = kit.revolve(
        stage,
        "/World/Vase",
        [(0.0, 0.0), (0.07, 0.0), (0.13, 0.12), (0.1, 0.26), (0.045, 0.34), (0.07, 0.4)],
        32,
    )
    kit.bind(kit.place(vase, translate=(0.55, 0.72, -2.55)), cushion)

    kit.bind(kit.box(stage, "/World/Sofa/Seat", (-1.2, 0.15, 1.5), (1.2, 0.45, 2.4)), cloth)
    kit.bind(kit.box(stage, "/World/Sofa/Rest", (-1.2, 0.45, 2.2), (1.2, 0.95, 2.5)), cloth)
    for name, x in (("Left", -1.4), ("Right", 1.2)):
        kit.bind(kit.box(stage, f"/World/Sofa/{name}", (x, 0.1, 1.5), (x + 0.2, 0.65, 2.5)), cloth)
    for i, x in enumerate((-0.9, 0.5)):
        pillow = kit.box(stage, f"/World/Sofa/Pillow{i}", (0, 0, 0), (0.42, 0.4, 0.14))
        kit.bind(kit.place(pillow, translate=(x, 0.46, 2.02), rotate=(-16, 0, 0)), cushion)
    kit.bind(kit.box(stage, "/World/Lamp/Foot", (2.2, 0, 1.6), (2.26, 1.4, 1.66)), wood)
    hood = kit.revolve(stage, "/World/Lamp/Hood", [(0.26, 0.0), (0.16, 0.34)], 32)
    kit.bind(kit.place(hood, translate=(2.23, 1.35, 1.63)), shade)

    kit.rect_light(
        stage, "/World/Lights/Window", (2.97, 1.6, 0.2), (0, 1.2, 0), (1.8, 1.4), 7.0, (0.8, 0.9, 1)
    )
    kit.rect_light(
        stage, "/World/Lights/Ceiling", (0, 2.78, 0.3), (0, 0, 0.3), (1.0, 1.0), 5.0, (1, 0.9, 0.75)
    )
    kit.camera(stage, "/World/Camera", (-0.9, 1.45, 0.9), (0.1, 1.25, -2.9), focal_length=32.0)
    kit.render_settings(stage, "/World/Camera", (640, 360), settings={"mbfeat:samplesPerPixel": 64})
    return stage


def staircase() -> Usd.Stage:
    """Wooden steps behind a panel of clear glass, which also mirrors the hall before it.

    First-hit features see the panel; vertex 2 of a path that passes it sees the steps.
    """
    stage = kit.new_stage()
    wall = _diffuse(stage, "Wall", (0.7, 0.68, 0.64))
    blue = _diffuse(stage, "Blue", (0.16, 0.24, 0.42))
    floor = _textured(stage, "Floor", CHECKER, (0.7, 0.68, 0.66), 0.3)
    tread = _textured(stage, "Tread", CHECKER, (0.72, 0.44, 0.22), 0.45)
    riser = _diffuse(stage, "Riser", (0.75, 0.72, 0.66))
    picture = _textured(stage, "Picture", PANEL, (1.0, 1.0, 1.0))
    steel = kit.preview_material(
        stage, f"{MATERIALS}/Steel", diffuseColor=(0.62, 0.62, 0.64), metallic=1.0, roughness=0.18
    )
    glass = kit.preview_material(
        stage,
        f"{MATERIALS}/Glass",
        diffuseColor=(0.96, 0.99, 0.97),
        opacity=0.0,
        ior=1.52,
        roughness=0.0,
    )
    ground = kit.quad(stage, "/World/Hall/Floor", (-3, 0, 4), (6, 0, 0), (0, 0, -7))
    kit.bind(_tiled(ground, 6, 7), floor)
    walls: list[tuple[str, UsdShade.Material, kit.Vector, kit.Vector, kit.Vector]] = [
        ("Ceiling", wall, (-3, 3.6, -3), (6, 0, 0), (0, 0, 7)),
        ("Back", wall, (-3, 0, -3), (6, 0, 0), (0, 3.6, 0)),
        ("Left", wall, (-3, 0, 4), (0, 0, -7), (0, 3.6, 0)),
        ("Right", wall, (3, 0, -3), (0, 0, 7), (0, 3.6, 0)),
        ("Front", blue, (3, 0, 4), (-6, 0, 0), (0, 3.6, 0)),
    ]
    for name, material, origin, u, v in walls:
        kit.bind(kit.quad(stage, f"/World/Hall/{name}", origin, u, v), material)
    for i in range(11):
        x, y = -2.2 + 0.36 * i, 0.24 * i
        step = kit.box(
            stage, f"/World/Stairs/Tread{i:02d}", (x, y + 0.2, -2.2), (x + 0.4, y + 0.24, -0.9)
        )
        kit.bind(step, tread)
        front = kit.box(
            stage, f"/World/Stairs/Riser{i:02d}", (x, y, -2.2), (x + 0.03, y + 0.2, -0.9)
        )
        kit.bind(front, riser)
        post = kit.box(
            stage,
            f"/World/Stairs/Post{i:02d}",
            (x + 0.17, y + 0.24, -2.12),
            (x + 0.2, y + 1.1, -2.09),
        )
        kit.bind(post, steel)
    panel = kit.box(stage, "/World/Panel", (-2.4, 0.05, -0.62), (2.4, 2.7, -0.6))
    kit.bind(panel, glass)
    for i, x in enumerate((-2.46, 2.4)):
        kit.bind(kit.box(stage, f"/World/Post{i}", (x, 0, -0.64), (x + 0.06, 2.8, -0.58)), steel)
    frame = kit.quad(stage, "/World/Picture", (1.4, 1.1, 3.97), (-2.0, 0, 0), (0, 1.4, 0))
    kit.bind(frame, picture)
    ball = kit.sphere_mesh(stage, "/World/Ball", 0.28, 40)
    kit.bind(kit.place(ball, translate=(1.5, 0.28, 0.3)), blue)
    kit.bind(kit.box(stage, "/World/Bench", (-2.6, 0, 0.6), (-1.6, 0.42, 1.1)), tread)

    kit.rect_light(
        stage,
        "/World/Lights/Stairs",
        (0.5, 3.55, -1.5),
        (0.5, 0, -1.5),
        (1.6, 0.8),
        9.0,
        (1, 0.9, 0.75),
    )
    kit.rect_light(
        stage,
        "/World/Lights/Hall",
        (0.3, 3.55, 2.2),
        (0.3, 0, 2.2),
        (1.2, 1.2),
        5.0,
        (0.85, 0.92, 1),
    )
    lamp = UsdLux.SphereLight.Define(stage, "/World/Lights/Lamp")
    lamp.CreateRadiusAttr(0.08)
    lamp.CreateIntensityAttr(25.0)
    kit.place(lamp, translate=(-2.3, 2.2, -1.4))
    kit.camera(stage, "/World/Camera", (1.1, 1.5, 3.4), (-0.15, 1.2, -1.2), focal_length=30.0)
    kit.render_settings(stage, "/World/Camera", (640, 360), settings={"mbfeat:samplesPerPixel": 64})
    return stage
