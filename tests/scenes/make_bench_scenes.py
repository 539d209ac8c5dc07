"""Writes the stages of the benchmark against other renderers (``./run mbfeat bench``).

Run ``./run python tests/scenes/make_bench_scenes.py``. The small ones are committed in bench/; with
``--large --out FOLDER`` it writes those of a million triangles, which the benchmark does itself.

They hold only what the renderers model alike: meshes, instances, rect, sphere and dome lights,
Lambert surfaces (a UsdPreviewSurface of ior 1), metals of one GGX lobe (metallic 1), white glass.
Behind every rect light is a black card and in the dome's lamp a black ball, since renderers differ
in what the back of a light is, and in whether a path that meets its front ends there or goes on.
No rect or sphere light is in sight of the camera, except through glass: to Cycles' it is invisible.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import stagekit as kit
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, Vt

HERE = Path(__file__).resolve().parent
CHECKER = "../textures/checker.png"
RESOLUTION = (320, 180)
MATERIALS = "/World/Materials"


def diffuse(stage: Usd.Stage, name: str, colour: kit.Vector) -> UsdShade.Material:
    """A Lambert surface."""
    return kit.preview_material(
        stage, f"{MATERIALS}/{name}", diffuseColor=colour, roughness=1.0, ior=1.0
    )


def textured(stage: Usd.Stage, name: str, file: str) -> UsdShade.Material:
    """A Lambert surface with a texture."""
    colour = kit.texture(stage, f"{MATERIALS}/{name}/Colour", file)
    return kit.preview_material(
        stage, f"{MATERIALS}/{name}", diffuseColor=colour, roughness=1.0, ior=1.0
    )


def metal(stage: Usd.Stage, name: str, colour: kit.Vector, roughness: float) -> UsdShade.Material:
    """A metal; of roughness 0 a perfect mirror."""
    return kit.preview_material(
        stage, f"{MATERIALS}/{name}", diffuseColor=colour, metallic=1.0, roughness=roughness
    )


def glass(stage: Usd.Stage, name: str, roughness: float) -> UsdShade.Material:
    """White glass of index 1.5."""
    return kit.preview_material(
        stage,
        f"{MATERIALS}/{name}",
        diffuseColor=(1, 1, 1),
        opacity=0.0,
        ior=1.5,
        roughness=roughness,
    )


def rect_light(
    stage: Usd.Stage,
    name: str,
    position: kit.Vector,
    target: kit.Vector,
    size: tuple[float, float],
    radiance: float,
    colour: kit.Vector = (1, 1, 1),
) -> None:
    """A rect light with its card."""
    light = kit.rect_light(stage, f"/World/Lights/{name}", position, target, size, radiance, colour)
    card(stage, name, light, size)


def card(stage: Usd.Stage, name: str, light: UsdLux.RectLight, size: tuple[float, float]) -> None:
    """A black card a centimetre behind a light of that size, which shines along its -z."""
    width, height = size
    origin = (-width / 2, -height / 2, 0.01)
    quad = kit.quad(stage, f"/World/Cards/{name}", origin, (width, 0, 0), (0, height, 0))
    quad.AddTransformOp().Set(light.GetLocalTransformation())
    kit.bind(quad, diffuse(stage, f"{name}Card", (0, 0, 0)))


def tiled(mesh: UsdGeom.Mesh, across: float, along: float) -> UsdGeom.Mesh:
    """A quad whose texture repeats; returns it."""
    corners = [Gf.Vec2f(u, v) for u, v in [(0, 0), (across, 0), (across, along), (0, along)]]
    UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").Set(corners)
    return mesh


def finish(stage: Usd.Stage, position: kit.Vector, target: kit.Vector, focal: float) -> Usd.Stage:
    """Adds the camera and the render settings; returns the stage."""
    kit.camera(stage, "/World/Camera", position, target, focal_length=focal)
    settings: dict[str, object] = {"mbfeat:maxBounces": 12, "mbfeat:pixelFilter": "box"}
    kit.render_settings(stage, "/World/Camera", RESOLUTION, settings=settings)
    return stage


def mirrors(folder: Path) -> Usd.Stage:
    """Flat mirrors, mirror balls and a ball of brushed gold between walls of a fine pattern."""
    stage = kit.new_stage()
    pattern = textured(stage, "Pattern", CHECKER)
    plain = diffuse(stage, "Plain", (0.55, 0.5, 0.45))
    silver = metal(stage, "Silver", (0.95, 0.95, 0.95), 0.0)
    gold = metal(stage, "Gold", (0.9, 0.7, 0.35), 0.3)
    ground = kit.quad(stage, "/World/Ground", (-7, 0, 9), (14, 0, 0), (0, 0, -14))
    kit.bind(tiled(ground, 7, 7), pattern)
    back = kit.quad(stage, "/World/Back", (-7, 0, -5), (14, 0, 0), (0, 4.5, 0))
    kit.bind(tiled(back, 28, 9), pattern)
    front = kit.quad(stage, "/World/Front", (7, 0, 9), (-14, 0, 0), (0, 4.5, 0))
    kit.bind(tiled(front, 28, 9), pattern)
    for name, x, turn in (("Left", -3.2, 52.0), ("Right", 3.2, -52.0)):
        pane = kit.quad(stage, f"/World/{name}Mirror", (-1.6, 0, 0.011), (3.2, 0, 0), (0, 3, 0))
        board = kit.box(stage, f"/World/{name}Board", (-1.7, 0, -0.09), (1.7, 3.1, 0.01))
        for prim, material in ((pane, silver), (board, plain)):
            kit.bind(kit.place(prim, translate=(x, 0, -0.8), rotate=(0, turn, 0)), material)
    for i, (x, z, size) in enumerate([(-0.9, 0.2, 0.75), (0.75, 1.0, 0.55), (0.5, -1.6, 1.0)]):
        ball = kit.sphere_mesh(stage, f"/World/Ball{i}", 1.0, 32)
        kit.place(ball, translate=(x, size, z), scale=(size, size, size))
        kit.bind(ball, gold if i == 1 else silver)
    rect_light(stage, "Key", (0, 6, 1), (0, 0, 1), (5, 5), 2.5, (1, 0.95, 0.88))
    sky = UsdLux.DomeLight.Define(stage, "/World/Lights/Sky")
    sky.CreateColorAttr(Gf.Vec3f(0.35, 0.42, 0.55))
    return finish(stage, (0.2, 1.7, 6.2), (0, 1.05, 0), 27.0)


def room(folder: Path) -> Usd.Stage:
    """The closed diffuse room of interior.usda.

    A layer over that stage: only what differs is said here.
    """
    below, stage = overlay("interior")
    card(stage, "Light", UsdLux.RectLight.Get(below, "/World/Light"), (1.2, 1.2))
    return stage


def dome(folder: Path) -> Usd.Stage:
    """The cockpit of cockpit.usda in its shell of rough glass, without coats, tints and emission.

    A layer over that stage: only what differs is said here.
    """
    below, stage = overlay("cockpit")
    materials = Sdf.Path(MATERIALS)
    for name in ["Floor", "Dark", "Leather", "Screen", *(f"Paint{i}" for i in range(4))]:
        over(stage, materials.AppendPath(f"{name}/Surface"), ior=1.0, roughness=1.0)
    over(stage, materials.AppendPath("Dark/Surface"), diffuseColor=(0.16, 0.17, 0.19))
    screen = materials.AppendPath("Screen/Surface")
    prim = over(stage, screen, diffuseColor=(0.1, 0.5, 0.2), emissiveColor=(0, 0, 0))
    prim.GetAttribute("inputs:emissiveColor").SetConnections([])
    over(stage, materials.AppendPath("Glass/Surface"), diffuseColor=(1, 1, 1), ior=1.5)
    over(stage, Sdf.Path("/World/Lights/Key"), intensity=4.0, width=4.5, height=4.5)
    card(stage, "Key", UsdLux.RectLight.Get(below, "/World/Lights/Key"), (4.5, 4.5))
    over(stage, Sdf.Path("/World/Lights/Lamp"), intensity=12.0, radius=0.09)
    core = kit.sphere_mesh(stage, "/World/Cards/Lamp", 0.085, 32)
    kit.place(core, translate=(0.0, 0.62, 0.1))
    kit.bind(core, diffuse(stage, "LampCore", (0, 0, 0)))
    stage.OverridePrim("/World/Cockpit/Knob").SetActive(False)
    return stage


def overlay(name: str) -> tuple[Usd.Stage, Usd.Stage]:
    """The stage of that name, and an empty one to lie over it, with the settings of all."""
    stage = Usd.Stage.CreateInMemory()
    settings = stage.OverridePrim("/Render/Settings")
    for attribute, kind, value in (
        ("resolution", Sdf.ValueTypeNames.Int2, Gf.Vec2i(*RESOLUTION)),
        ("mbfeat:maxBounces", Sdf.ValueTypeNames.Int, 12),
        ("mbfeat:pixelFilter", Sdf.ValueTypeNames.Token, "box"),
    ):
        custom = attribute.startswith("mbfeat:")
        settings.CreateAttribute(attribute, kind, custom=custom).Set(value)
    stage.SetMetadata("renderSettingsPrimPath", "/Render/Settings")
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.GetRootLayer().defaultPrim = "World"
    return Usd.Stage.Open(str(HERE / f"{name}.usda")), stage


def over(stage: Usd.Stage, path: Sdf.Path, **inputs: object) -> Usd.Prim:
    """An over of a shader or light with these inputs; returns it."""
    prim = stage.OverridePrim(path)
    for name, value in inputs.items():
        colour = isinstance(value, tuple)
        kind = Sdf.ValueTypeNames.Color3f if colour else Sdf.ValueTypeNames.Float
        attribute = prim.CreateAttribute(f"inputs:{name}", kind, custom=False)
        attribute.Set(Gf.Vec3f(*value) if isinstance(value, tuple) else value)
    return prim


def stairs(folder: Path) -> Usd.Stage:
    """Stairs behind two panes of glass with thickness, one clear and one slightly rough."""
    stage = kit.new_stage()
    pattern = textured(stage, "Pattern", CHECKER)
    step = diffuse(stage, "Step", (0.6, 0.55, 0.48))
    edge = diffuse(stage, "Edge", (0.7, 0.2, 0.1))
    wall = diffuse(stage, "Wall", (0.5, 0.52, 0.55))
    panes = [glass(stage, "Clear", 0.0), glass(stage, "Rough", 0.15)]
    kit.bind(
        tiled(kit.quad(stage, "/World/Ground", (-4, 0, 5), (8, 0, 0), (0, 0, -10)), 8, 10), pattern
    )
    kit.bind(kit.quad(stage, "/World/Back", (-4, 0, -4.6), (8, 0, 0), (0, 4.5, 0)), wall)
    for i in range(8):
        low, high = (-2.4, 0.0, -0.5 - 0.5 * i), (2.4, 0.25 * (i + 1), 0.0 - 0.5 * i)
        kit.bind(kit.box(stage, f"/World/Step{i}", low, high), step)
        low = (-2.4, high[1], high[2] - 0.06)
        kit.bind(kit.box(stage, f"/World/Edge{i}", low, (2.4, high[1] + 0.02, high[2])), edge)
    for i, x in enumerate((-2.29, 0.06)):
        pane = kit.box(stage, f"/World/Pane{i}", (x, 0.05, 0.9), (x + 2.23, 2.7, 0.94))
        kit.bind(pane, panes[i])
    for i, x in enumerate((-2.35, 0.0, 2.35)):
        post = kit.box(stage, f"/World/Post{i}", (x - 0.05, 0, 0.87), (x + 0.05, 2.75, 0.97))
        kit.bind(post, edge)
    rect_light(stage, "Key", (0, 4.8, -1.5), (0, 0, -2), (4, 3), 3.5)
    sky = UsdLux.DomeLight.Define(stage, "/World/Lights/Sky")
    sky.CreateColorAttr(Gf.Vec3f(0.4, 0.48, 0.6))
    return finish(stage, (0.5, 1.7, 4.8), (0, 1.25, 0), 28.0)


def lamps(folder: Path) -> Usd.Stage:
    """A hall with columns, lit by a hundred small spheres of many colours and powers."""
    stage = kit.new_stage()
    stone = diffuse(stage, "Stone", (0.6, 0.58, 0.55))
    brick = diffuse(stage, "Brick", (0.5, 0.25, 0.18))
    floor = textured(stage, "Floor", CHECKER)
    steel = metal(stage, "Steel", (0.7, 0.72, 0.75), 0.35)
    room: list[tuple[str, UsdShade.Material, kit.Vector, kit.Vector, kit.Vector]] = [
        ("Floor", floor, (-6, 0, 6), (12, 0, 0), (0, 0, -12)),
        ("Ceiling", stone, (-6, 3.5, -6), (12, 0, 0), (0, 0, 12)),
        ("Back", brick, (-6, 0, -6), (12, 0, 0), (0, 3.5, 0)),
        ("Front", stone, (6, 0, 6), (-12, 0, 0), (0, 3.5, 0)),
        ("Left", stone, (-6, 0, 6), (0, 0, -12), (0, 3.5, 0)),
        ("Right", brick, (6, 0, -6), (0, 0, 12), (0, 3.5, 0)),
    ]
    for name, material, origin, u, v in room:
        kit.bind(tiled(kit.quad(stage, f"/World/Room/{name}", origin, u, v), 6, 6), material)
    for i in range(8):
        x, z = (-3.0 if i % 2 == 0 else 3.0), 3.0 - 2.5 * (i // 2)
        column = kit.revolve(stage, f"/World/Column{i}", [(0.35, 0.0), (0.35, 3.5)], 24)
        kit.bind(kit.place(column, translate=(x, 0, z)), stone)
    for i, (x, z) in enumerate([(-1.2, 0.5), (1.0, -1.0), (0.2, -3.2)]):
        crate = kit.box(stage, f"/World/Crate{i}", (-0.45, 0, -0.45), (0.45, 0.8 + 0.2 * i, 0.45))
        kit.bind(kit.place(crate, translate=(x, 0, z), rotate=(0, 25 * i, 0)), steel)
    for i in range(100):
        light = UsdLux.SphereLight.Define(stage, f"/World/Lights/Lamp{i:02d}")
        # A grid, shifted by multiples of irrational numbers, so that no two lamps touch.
        shift = [(i * step) % 1.0 for step in (0.618034, 0.414214, 0.732051, 0.236068)]
        x = -5.4 + 1.2 * (i % 10) + 0.6 * (shift[0] - 0.5)
        z = -5.4 + 1.2 * (i // 10) + 0.6 * (shift[1] - 0.5)
        kit.place(light, translate=(round(x, 4), round(2.5 + 0.8 * shift[2], 4), round(z, 4)))
        light.CreateRadiusAttr(0.04)
        light.CreateIntensityAttr(round(20.0 * 8.0 ** shift[3], 3))
        warmth = shift[2]
        colour = (1.0, round(0.6 + 0.3 * warmth, 4), round(0.3 + 0.6 * shift[0], 4))
        light.CreateColorAttr(Gf.Vec3f(*colour))
    return finish(stage, (0.3, 1.4, 5.6), (0, 0, 0), 30.0)


def rock(rng: np.random.Generator) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """A ball with bumps and hollows: points [3922, 3] and triangles [7840, 3], outside outwards."""
    rings, segments = 50, 80
    latitude = np.linspace(-math.pi / 2, math.pi / 2, rings + 1)[1:-1, None]
    longitude = np.linspace(0.0, 2.0 * math.pi, segments, endpoint=False)[None, :]
    x, z = np.cos(latitude) * np.cos(longitude), -np.cos(latitude) * np.sin(longitude)
    y = np.broadcast_to(np.sin(latitude), x.shape)
    sphere = np.concatenate(
        [np.stack([x, y, z], axis=-1).reshape(-1, 3), [(0, -1, 0)], [(0, 1, 0)]]
    )
    south, north = len(sphere) - 2, len(sphere) - 1
    here = np.arange(segments)
    there = (here + 1) % segments
    faces = [np.stack([np.full(segments, south), there, here], axis=-1)]
    for row in range(rings - 2):
        low, high = row * segments, (row + 1) * segments
        faces.append(np.stack([low + here, low + there, high + there], axis=-1))
        faces.append(np.stack([low + here, high + there, high + here], axis=-1))
    last = (rings - 2) * segments
    faces.append(np.stack([last + here, last + there, np.full(segments, north)], axis=-1))
    centres = rng.normal(size=(24, 3))
    centres /= np.linalg.norm(centres, axis=1, keepdims=True)
    heights, spread = rng.uniform(-0.3, 0.3, 24), rng.uniform(4.0, 16.0, 24)
    radius = 1.0 + (heights * np.exp(spread * (sphere @ centres.T - 1.0))).sum(axis=1)
    points = sphere * radius[:, None] * np.array([1.0, 0.7, 1.0])
    return points.astype(np.float32), np.concatenate(faces).astype(np.int32)


def write_sky(path: Path) -> None:
    """A latitude-longitude image, 1024 x 512: blue above, brown below, and a sun of 1.2 degrees."""
    import OpenEXR

    height, width = 512, 1024
    latitude = math.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    longitude = math.pi * (1.0 - 2.0 * (np.arange(width) + 0.5) / width)[None, :]
    direction = np.stack(
        [
            np.sin(longitude) * np.cos(latitude),
            np.broadcast_to(np.sin(latitude), (height, width)),
            np.cos(longitude) * np.cos(latitude),
        ],
        axis=-1,
    )
    up = direction[..., 1:2]
    horizon, zenith, earth = (np.array(c) for c in ((0.8, 0.85, 0.9), (0.2, 0.4, 0.9), (0.2,) * 3))
    sky = np.where(up > 0, horizon + (zenith - horizon) * np.sqrt(np.maximum(up, 0)), earth)
    sun = np.array([0.55, 0.6, 0.58]) / np.linalg.norm([0.55, 0.6, 0.58])
    angle = np.degrees(np.arccos(np.clip(direction @ sun, -1.0, 1.0)))[..., None]
    edge = np.clip((1.4 - angle) / 0.4, 0.0, 1.0)
    image = sky + 2200.0 * np.array([1.0, 0.9, 0.75]) * edge * edge * (3.0 - 2.0 * edge)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": image.astype(np.float32)}).write(str(path))


def field(folder: Path) -> Usd.Stage:
    """A million triangles in instances of four rocks, under a sky with a sun."""
    rng = np.random.default_rng(20)
    write_sky(folder / "sky.exr")
    stage = kit.new_stage()
    materials = [
        diffuse(stage, "Grey", (0.45, 0.43, 0.4)),
        diffuse(stage, "Red", (0.5, 0.25, 0.16)),
        diffuse(stage, "Moss", (0.25, 0.35, 0.12)),
        metal(stage, "Ore", (0.8, 0.65, 0.4), 0.5),
    ]
    ground = kit.quad(stage, "/World/Ground", (-40, 0, 40), (80, 0, 0), (0, 0, -80))
    kit.bind(ground, diffuse(stage, "Sand", (0.5, 0.42, 0.3)))
    instancer = UsdGeom.PointInstancer.Define(stage, "/World/Rocks")
    triangles = 0
    for i, material in enumerate(materials):
        points, faces = rock(rng)
        triangles = len(faces)
        mesh = UsdGeom.Mesh.Define(stage, f"/World/Rocks/Prototypes/Rock{i}")
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
        mesh.CreateFaceVertexCountsAttr([3] * len(faces))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.reshape(-1)))
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(mesh.GetPointsAttr().Get()))
        kit.bind(mesh, material)
        instancer.CreatePrototypesRel().AddTarget(mesh.GetPath())
    count = -(-1_000_000 // triangles)
    turn = 2.399963 * np.arange(count)  # the golden angle
    radius = 1.0 * np.sqrt(np.arange(count) + 0.5)
    size = rng.uniform(0.4, 1.1, count)
    half = rng.uniform(0.0, math.pi, count)
    positions = np.stack([radius * np.cos(turn), 0.4 * size, radius * np.sin(turn)], axis=-1)
    instancer.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(positions.astype(np.float32)))
    instancer.CreateOrientationsAttr(
        [Gf.Quath(math.cos(a), 0.0, math.sin(a), 0.0) for a in half.tolist()]
    )
    instancer.CreateScalesAttr([Gf.Vec3f(s) for s in size.tolist()])
    instancer.CreateProtoIndicesAttr(Vt.IntArray.FromNumpy(rng.integers(0, 4, count, np.int32)))
    sky = UsdLux.DomeLight.Define(stage, "/World/Lights/Sky")
    sky.CreateTextureFileAttr(Sdf.AssetPath("./sky.exr"))
    sky.CreateTextureFormatAttr(UsdLux.Tokens.latlong)
    return finish(stage, (0.0, 3.4, 13.0), (0.0, 0.2, 0.0), 30.0)


SMALL: dict[str, Callable[[Path], Usd.Stage]] = {
    "room": room,
    "mirrors": mirrors,
    "dome": dome,
    "stairs": stairs,
    "lamps": lamps,
}
BELOW = {
    "room": ["../interior.usda"],
    "dome": ["../cockpit.usda"],
}  # sublayers, which a stage in memory would not find
LARGE: dict[str, Callable[[Path], Usd.Stage]] = {"field": field}


def write(stages: dict[str, Callable[[Path], Usd.Stage]], folder: Path, extension: str) -> None:
    """Writes stages with their own images."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, make in stages.items():
        stage = make(folder)
        layer = Sdf.Layer.CreateAnonymous()
        layer.TransferContent(stage.GetRootLayer())
        layer.documentation = (make.__doc__ or "").strip()
        layer.subLayerPaths = BELOW.get(name, [])
        layer.Export(str(folder / f"{name}.{extension}"))
        print(f"wrote {folder / name}.{extension}")


def main() -> None:
    """Writes the small stages, or the large ones."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--large", action="store_true", help="the large ones, as .usdc")
    parser.add_argument("--out", type=Path, default=HERE / "bench", help="folder to write into")
    options = parser.parse_args()
    write(LARGE if options.large else SMALL, options.out, "usdc" if options.large else "usda")


if __name__ == "__main__":
    main()
