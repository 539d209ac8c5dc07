"""Writes the stages of this folder and their textures.

Run ``./run python tests/scenes/make_scenes.py``.

The stages are committed; run this after a change here and commit what it writes.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path

import effect_stages
import numpy as np
import paper_stages
import stagekit as kit
from PIL import Image
from pxr import Gf, Usd, UsdGeom, UsdLux

HERE = Path(__file__).resolve().parent


def write_textures(folder: Path) -> None:
    """8-bit images, sRGB but for the normals.

    checker.png (greys), panel.png (instrument markings), leaf.png (with alpha), and bumps.png
    (normals).
    """
    folder.mkdir(parents=True, exist_ok=True)
    cells = (np.indices((64, 64)) // 8).sum(axis=0) % 2
    checker = np.where(cells[..., None] == 1, [200, 198, 190], [95, 100, 112]).astype(np.uint8)
    Image.fromarray(checker).save(folder / "checker.png", optimize=True)

    size = 256
    y, x = np.mgrid[0:size, 0:size] / (size - 1)
    panel = np.zeros((size, size, 3))
    panel[...] = (0.02, 0.05, 0.04)
    grid = (np.abs((x * 8) % 1 - 0.5) > 0.47) | (np.abs((y * 8) % 1 - 0.5) > 0.47)
    panel[grid] = (0.05, 0.25, 0.18)
    trace = np.abs(y - (0.5 + 0.28 * np.sin(9.0 * x) * np.cos(4.0 * x))) < 0.016
    panel[trace] = (0.35, 1.0, 0.45)
    horizon = np.hypot(x - 0.5, y - 0.5)
    panel[np.abs(horizon - 0.38) < 0.012] = (1.0, 0.75, 0.2)
    rgb = (np.clip(panel, 0, 1) ** (1 / 2.2) * 255 + 0.5).astype(np.uint8)
    Image.fromarray(rgb).save(folder / "panel.png", optimize=True)

    y, x = np.mgrid[0:128, 0:64]
    along, across = (127 - y) / 127, np.abs(x - 31.5) / 31.5
    outline = 0.95 * np.sin(np.pi * np.clip(along, 0, 1) ** 0.8) + 0.03
    vein = (across < 0.06) | (np.abs((along * 7 - across * 2) % 1 - 0.5) > 0.46)
    leaf = np.where(vein[..., None], [120, 150, 70], [52, 104, 38])
    alpha = np.where(across < outline, 255, 0)[..., None]
    Image.fromarray(np.concatenate([leaf, alpha], axis=-1).astype(np.uint8)).save(
        folder / "leaf.png", optimize=True
    )

    slope = 0.35 * np.sin(np.mgrid[0:32, 0:32] * (2.0 * math.pi / 16))
    normals = np.stack([slope[1], slope[0], np.ones((32, 32))], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    Image.fromarray((127.5 * (normals + 1.0) + 0.5).astype(np.uint8)).save(
        folder / "bumps.png", optimize=True
    )


def cockpit() -> Usd.Stage:
    """A cockpit inside a closed shell of rough glass with thickness, on a floor under a sky.

    First-hit features see only the glass; what stands inside appears from vertex 2 on.
    """
    stage = kit.new_stage()
    materials = "/World/Materials"
    glass = kit.preview_material(
        stage,
        f"{materials}/Glass",
        diffuseColor=(0.97, 0.99, 1.0),
        opacity=0.0,
        ior=1.45,
        roughness=0.12,
    )
    floor = kit.preview_material(
        stage,
        f"{materials}/Floor",
        diffuseColor=kit.texture(stage, f"{materials}/Floor/Checker", "./textures/checker.png"),
        roughness=0.7,
    )
    dark = kit.preview_material(
        stage, f"{materials}/Dark", diffuseColor=(0.06, 0.065, 0.075), roughness=0.45
    )
    leather = kit.preview_material(
        stage, f"{materials}/Leather", diffuseColor=(0.55, 0.09, 0.05), roughness=0.5
    )
    metal = kit.preview_material(
        stage, f"{materials}/Metal", diffuseColor=(0.75, 0.72, 0.68), metallic=1.0, roughness=0.25
    )
    screen = kit.preview_material(
        stage,
        f"{materials}/Screen",
        diffuseColor=(0.02, 0.02, 0.02),
        emissiveColor=kit.texture(
            stage, f"{materials}/Screen/Panel", "./textures/panel.png", scale=(2.5, 2.5, 2.5, 1.0)
        ),
        roughness=0.2,
    )
    paints = [
        kit.preview_material(stage, f"{materials}/Paint{i}", diffuseColor=colour, roughness=0.4)
        for i, colour in enumerate(
            [(0.8, 0.1, 0.08), (0.9, 0.65, 0.08), (0.1, 0.55, 0.2), (0.1, 0.3, 0.8)]
        )
    ]

    ground = kit.quad(stage, "/World/Ground", (-8, -1.02, 8), (16, 0, 0), (0, 0, -16))
    UsdGeom.PrimvarsAPI(ground).GetPrimvar("st").Set(
        [Gf.Vec2f(u, v) for u, v in [(0, 0), (4, 0), (4, 4), (0, 4)]]
    )
    kit.bind(ground, floor)

    # The shell: outside and inside faces, so that light refracts twice.
    for name, radius, inward in (("Outside", 1.0, False), ("Inside", 0.96, True)):
        face = kit.sphere_mesh(stage, f"/World/Dome/{name}", radius, 96, inward=inward)
        kit.place(face, scale=(1.3, 1.0, 1.2))
        kit.bind(face, glass)

    deck = kit.revolve(
        stage,
        "/World/Cockpit/Deck",
        [(0.0, -0.62), (0.86, -0.62), (0.86, -0.56), (0.0, -0.56)],
        48,
        smooth=False,
    )
    kit.bind(deck, dark)
    dash = kit.box(stage, "/World/Cockpit/Dash", (-0.62, -0.17, -0.12), (0.62, 0.17, 0.12))
    kit.place(dash, translate=(0, -0.28, 0.32), rotate=(-28, 0, 0))
    kit.bind(dash, dark)
    for i, x in enumerate((-0.4, 0.0, 0.4)):
        panel = kit.quad(
            stage, f"/World/Cockpit/Screen{i}", (-0.16, -0.11, 0.125), (0.32, 0, 0), (0, 0.22, 0)
        )
        kit.place(panel, translate=(x, -0.28, 0.32), rotate=(-28, 0, 0))
        kit.bind(panel, screen)
    for i in range(12):
        button = kit.box(
            stage, f"/World/Cockpit/Button{i:02d}", (-0.018, -0.018, 0.12), (0.018, 0.018, 0.15)
        )
        kit.place(button, translate=(0.1 * (i - 5.5), -0.14, 0.255), rotate=(-28, 0, 0))
        kit.bind(button, paints[i % len(paints)])
    for side, x in (("Left", -0.34), ("Right", 0.34)):
        seat = kit.box(stage, f"/World/Cockpit/{side}Seat", (-0.2, 0.0, -0.2), (0.2, 0.12, 0.2))
        kit.place(seat, translate=(x, -0.56, -0.25))
        kit.bind(seat, leather)
        back = kit.box(stage, f"/World/Cockpit/{side}Back", (-0.2, 0.0, -0.05), (0.2, 0.62, 0.05))
        kit.place(back, translate=(x, -0.44, -0.46), rotate=(-10, 0, 0))
        kit.bind(back, leather)
        head = kit.box(stage, f"/World/Cockpit/{side}Head", (-0.1, 0.0, -0.04), (0.1, 0.14, 0.04))
        kit.place(head, translate=(x, 0.2, -0.57), rotate=(-10, 0, 0))
        kit.bind(head, leather)
    column = kit.revolve(stage, "/World/Cockpit/Column", [(0.03, 0.0), (0.03, 0.3), (0.0, 0.3)], 16)
    kit.place(column, translate=(0.0, -0.56, 0.02), rotate=(12, 0, 0))
    kit.bind(column, metal)
    knob = UsdGeom.Sphere.Define(stage, "/World/Cockpit/Knob")
    knob.CreateRadiusAttr(0.055)
    knob.CreateExtentAttr([Gf.Vec3f(-0.055), Gf.Vec3f(0.055)])
    kit.place(knob, translate=(0.0, -0.24, 0.09))
    kit.bind(knob, metal)

    dome = UsdLux.DomeLight.Define(stage, "/World/Lights/Sky")
    dome.CreateColorAttr(Gf.Vec3f(0.55, 0.7, 1.0))
    dome.CreateIntensityAttr(0.9)
    kit.rect_light(
        stage,
        "/World/Lights/Key",
        (3.5, 4.5, 3.0),
        (0, -0.2, 0),
        (3.0, 3.0),
        14.0,
        (1.0, 0.93, 0.82),
    )
    lamp = UsdLux.SphereLight.Define(stage, "/World/Lights/Lamp")
    lamp.CreateRadiusAttr(0.07)
    lamp.CreateIntensityAttr(22.0)
    lamp.CreateColorAttr(Gf.Vec3f(1.0, 0.85, 0.6))
    kit.place(lamp, translate=(0.0, 0.62, 0.1))

    kit.camera(stage, "/World/Camera", (0.0, 0.75, 4.3), (0.0, -0.12, 0.0), focal_length=46.0)
    kit.render_settings(stage, "/World/Camera", (640, 360), settings={"mbfeat:samplesPerPixel": 64})
    return stage


def interior() -> Usd.Stage:
    """A closed room of diffuse surfaces under one ceiling light."""
    stage = kit.new_stage()
    colours = {
        "White": (0.73, 0.73, 0.73),
        "Red": (0.65, 0.06, 0.05),
        "Green": (0.12, 0.45, 0.15),
        "Blue": (0.1, 0.2, 0.55),
        "Ochre": (0.7, 0.5, 0.2),
    }
    materials = {
        name: kit.preview_material(
            stage, f"/World/Materials/{name}", diffuseColor=colour, roughness=1.0, ior=1.0
        )
        for name, colour in colours.items()
    }
    walls: list[tuple[str, str, kit.Vector, kit.Vector, kit.Vector]] = [
        ("Floor", "White", (-2, 0, 3), (4, 0, 0), (0, 0, -5)),
        ("Ceiling", "White", (-2, 3, -2), (4, 0, 0), (0, 0, 5)),
        ("Back", "White", (-2, 0, -2), (4, 0, 0), (0, 3, 0)),
        ("Front", "Blue", (2, 0, 3), (-4, 0, 0), (0, 3, 0)),
        ("Left", "Red", (-2, 0, 3), (0, 0, -5), (0, 3, 0)),
        ("Right", "Green", (2, 0, -2), (0, 0, 5), (0, 3, 0)),
    ]
    for name, material, origin, u, v in walls:
        kit.bind(kit.quad(stage, f"/World/Room/{name}", origin, u, v), materials[material])
    tall = kit.box(stage, "/World/Tall", (-0.5, 0.0, -0.5), (0.5, 1.7, 0.5))
    kit.place(tall, translate=(-0.75, 0, -0.8), rotate=(0, 18, 0))
    kit.bind(tall, materials["White"])
    low = kit.box(stage, "/World/Low", (-0.45, 0.0, -0.45), (0.45, 0.7, 0.45))
    kit.place(low, translate=(0.8, 0, 0.3), rotate=(0, -20, 0))
    kit.bind(low, materials["Ochre"])
    ball = kit.sphere_mesh(stage, "/World/Ball", 0.4, 48)
    kit.place(ball, translate=(0.8, 1.1, 0.3))
    kit.bind(ball, materials["Blue"])
    kit.rect_light(stage, "/World/Light", (0, 2.98, 0.0), (0, 0, 0), (1.2, 1.2), 12.0)
    kit.camera(stage, "/World/Camera", (0.0, 1.5, 2.9), (0.0, 1.25, -1.0), focal_length=22.0)
    kit.render_settings(stage, "/World/Camera", (640, 360), settings={"mbfeat:samplesPerPixel": 64})
    return stage


def leaves(stage: Usd.Stage, path: str, count: int) -> UsdGeom.Mesh:
    """A tuft of `count` leaves, each two bent quads, with st for leaf.png; about 0.6 high."""
    points: list[kit.Vector] = []
    st: list[kit.Vector] = []
    faces: list[list[int]] = []
    for i in range(count):
        turn = 2.399963 * i  # the golden angle, so that no two leaves coincide
        lean = 0.25 + 0.9 * ((i * 0.618034) % 1.0)
        out = (math.cos(turn), math.sin(turn))
        first = len(points)
        for row, bend in ((0.0, 0.0), (0.5, 0.35), (1.0, 1.0)):
            reach, height = 0.5 * row * lean * (0.6 + bend), 0.6 * row * (1.15 - lean * bend * 0.7)
            for side in (-0.5, 0.5):
                width = 0.16 * side
                points.append(
                    (reach * out[0] - width * out[1], height, reach * out[1] + width * out[0])
                )
                st.append((side + 0.5, row))
        faces += [
            [first, first + 1, first + 3, first + 2],
            [first + 2, first + 3, first + 5, first + 4],
        ]
    return kit.mesh(stage, path, points, faces, st=st)


def garden() -> Usd.Stage:
    """Instanced plants with cut-out leaves, textured crates and metal balls under sun and sky."""
    stage = kit.new_stage()
    materials = "/World/Materials"
    leaf = f"{materials}/Leaf"
    checker = "./textures/checker.png"
    bound = {
        "Plant": kit.preview_material(
            stage,
            leaf,
            diffuseColor=kit.texture(stage, f"{leaf}/Colour", "./textures/leaf.png"),
            opacity=kit.texture(stage, f"{leaf}/Alpha", "./textures/leaf.png", output="a"),
            opacityThreshold=0.5,
            roughness=0.6,
        ),
        "Crate": kit.preview_material(
            stage,
            f"{materials}/Crate",
            diffuseColor=kit.texture(
                stage, f"{materials}/Crate/Map", checker, scale=(0.9, 0.55, 0.3, 1)
            ),
            roughness=0.8,
        ),
        "Ball": kit.preview_material(
            stage, f"{materials}/Ball", diffuseColor=(0.9, 0.72, 0.4), metallic=1.0, roughness=0.15
        ),
    }
    ground = kit.quad(stage, "/World/Ground", (-20, 0, 20), (40, 0, 0), (0, 0, -40))
    UsdGeom.PrimvarsAPI(ground).GetPrimvar("st").Set(
        [Gf.Vec2f(u, v) for u, v in [(0, 0), (12, 0), (12, 12), (0, 12)]]
    )
    earth = kit.texture(stage, f"{materials}/Earth/Map", checker, scale=(0.6, 0.45, 0.3, 1))
    kit.bind(
        ground, kit.preview_material(stage, f"{materials}/Earth", diffuseColor=earth, roughness=1.0)
    )

    instancer = UsdGeom.PointInstancer.Define(stage, "/World/Plants")
    prototypes = {
        "Plant": leaves(stage, "/World/Plants/Prototypes/Plant", 24),
        "Crate": kit.box(stage, "/World/Plants/Prototypes/Crate", (-0.2, 0, -0.2), (0.2, 0.4, 0.2)),
        "Ball": kit.sphere_mesh(stage, "/World/Plants/Prototypes/Ball", 0.25, 32),
    }
    for name, prototype in prototypes.items():
        kit.bind(prototype, bound[name])
        instancer.CreatePrototypesRel().AddTarget(prototype.GetPath())
    positions, orientations, scales, indices = [], [], [], []
    for i in range(600):
        kind = 1 if i % 17 == 8 else 2 if i % 29 == 14 else 0
        radius, turn = 0.42 * math.sqrt(i + 0.5), 2.399963 * i
        x, z = radius * math.cos(turn), radius * math.sin(turn)
        positions.append(Gf.Vec3f(round(x, 4), 0.25 if kind == 2 else 0.0, round(z, 4)))
        half = 0.5 * (i * 1.7 % 6.28)
        orientations.append(Gf.Quath(math.cos(half), 0.0, math.sin(half), 0.0))
        scales.append(Gf.Vec3f(1.0 if kind == 2 else round(0.7 + 0.8 * (i * 0.618034 % 1.0), 3)))
        indices.append(kind)
    instancer.CreatePositionsAttr(positions)
    instancer.CreateOrientationsAttr(orientations)
    instancer.CreateScalesAttr(scales)
    instancer.CreateProtoIndicesAttr(indices)

    UsdLux.DomeLight.Define(stage, "/World/Lights/Sky").CreateColorAttr(Gf.Vec3f(0.5, 0.65, 1.0))
    sun = UsdLux.DistantLight.Define(stage, "/World/Lights/Sun")
    sun.CreateAngleAttr(1.0)
    sun.CreateIntensityAttr(9000.0)
    sun.CreateColorAttr(Gf.Vec3f(1.0, 0.9, 0.75))
    kit.place(sun, rotate=(-50, 35, 0))
    kit.camera(stage, "/World/Camera", (0.0, 3.2, 9.0), (0.0, 0.2, 0.0), focal_length=32.0)
    kit.render_settings(stage, "/World/Camera", (640, 360), settings={"mbfeat:samplesPerPixel": 64})
    return stage


def furnace() -> Usd.Stage:
    """The inside of a closed sphere of albedo 0.5 and emission 0.5: every direction sees 1.

    Emission seen directly is 0.5 and contribution k is 0.5^(k+2).
    """
    stage = kit.new_stage()
    sphere = kit.sphere_mesh(stage, "/World/Sphere", 2.0, 64, inward=True)
    kit.bind(
        sphere,
        kit.preview_material(
            stage,
            "/World/Material",
            diffuseColor=(0.5, 0.5, 0.5),
            emissiveColor=(0.5, 0.5, 0.5),
            roughness=1.0,
            ior=1.0,
        ),
    )
    kit.camera(stage, "/World/Camera", (0, 0, 0.5), (0, 0, -1), aspect=1.0)
    kit.render_settings(
        stage,
        "/World/Camera",
        (32, 32),
        settings={"mbfeat:maxBounces": 64, "mbfeat:pixelFilter": "box"},
    )
    return stage


def white_sky() -> Usd.Stage:
    """A convex sphere of albedo 0.5 under a uniform sky of radiance 1: the sphere shows 0.5."""
    stage = kit.new_stage()
    sphere = kit.sphere_mesh(stage, "/World/Sphere", 1.0, 64)
    kit.bind(
        sphere,
        kit.preview_material(
            stage, "/World/Material", diffuseColor=(0.5, 0.5, 0.5), roughness=1.0, ior=1.0
        ),
    )
    UsdLux.DomeLight.Define(stage, "/World/Sky").CreateIntensityAttr(1.0)
    kit.camera(stage, "/World/Camera", (0, 0, 6), (0, 0, 0), focal_length=80.0, aspect=1.0)
    kit.render_settings(stage, "/World/Camera", (32, 32), settings={"mbfeat:pixelFilter": "box"})
    return stage


def mirror() -> Usd.Stage:
    """A perfect mirror at 45 degrees that shows a green card: vertex 1 has its features."""
    stage = kit.new_stage()
    silver = kit.preview_material(
        stage, "/World/Materials/Mirror", diffuseColor=(1, 1, 1), metallic=1.0, roughness=0.0
    )
    green = kit.preview_material(
        stage, "/World/Materials/Card", diffuseColor=(0.1, 0.6, 0.2), roughness=1.0, ior=1.0
    )
    s = math.sqrt(0.5)
    kit.bind(kit.quad(stage, "/World/Mirror", (-s, -1, -s), (2 * s, 0, 2 * s), (0, 2, 0)), silver)
    # The camera ray along -z turns to +x or -x; a card stands on either side.
    kit.bind(kit.quad(stage, "/World/CardLeft", (-3, -2, 2), (0, 0, -4), (0, 4, 0)), green)
    kit.bind(kit.quad(stage, "/World/CardRight", (3, -2, -2), (0, 0, 4), (0, 4, 0)), green)
    kit.rect_light(stage, "/World/Light", (0, 4, 2), (0, 0, 0), (2, 2), 5.0)
    kit.camera(stage, "/World/Camera", (0, 0, 4), (0, 0, 0), focal_length=90.0, aspect=1.0)
    kit.render_settings(stage, "/World/Camera", (32, 32), settings={"mbfeat:pixelFilter": "box"})
    return stage


def pane() -> Usd.Stage:
    """A pane of clear glass, 0.1 thick and of index 1.5, before a card of radiance 1.

    At normal incidence each face reflects 0.04, so with all reflections inside the pane the camera
    sees (1 - 0.04) / (1 + 0.04) of the card.
    """
    stage = kit.new_stage()
    glass = kit.preview_material(
        stage,
        "/World/Materials/Glass",
        diffuseColor=(1, 1, 1),
        opacity=0.0,
        roughness=0.0,
        ior=1.5,
    )
    card = kit.preview_material(
        stage,
        "/World/Materials/Card",
        diffuseColor=(0.6, 0.4, 0.2),
        emissiveColor=(1, 1, 1),
        roughness=1.0,
        ior=1.0,
    )
    kit.bind(kit.box(stage, "/World/Pane", (-4, -4, -0.1), (4, 4, 0)), glass)
    kit.bind(kit.quad(stage, "/World/Card", (-2, -2, -2), (4, 0, 0), (0, 4, 0)), card)
    kit.camera(stage, "/World/Camera", (0, 0, 4), (0, 0, 0), focal_length=180.0, aspect=1.0)
    kit.render_settings(
        stage,
        "/World/Camera",
        (32, 32),
        settings={"mbfeat:maxBounces": 64, "mbfeat:pixelFilter": "box"},
    )
    return stage


STAGES: dict[str, Callable[[], Usd.Stage]] = {
    "cockpit": cockpit,
    "livingroom": paper_stages.livingroom,
    "staircase": paper_stages.staircase,
    "interior": interior,
    "garden": garden,
    "furnace": furnace,
    "white_sky": white_sky,
    "mirror": mirror,
    "pane": pane,
    "everything": effect_stages.everything,
}


def main() -> None:
    """Writes every stage, or those named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", choices=[*STAGES, []], help="default: all")
    parser.add_argument("--out", type=Path, default=HERE, help="folder to write into")
    options = parser.parse_args()
    write_textures(options.out / "textures")
    for name in options.names or STAGES:
        path = options.out / f"{name}.usda"
        stage = STAGES[name]()
        stage.GetRootLayer().documentation = (STAGES[name].__doc__ or "").strip()
        stage.GetRootLayer().Export(str(path))
        print(f"wrote {path}")


if __name__ == "__main__":
    main()
