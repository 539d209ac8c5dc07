"""A stage that calls for every effect. make_scenes.py writes it; nothing is random."""

from __future__ import annotations

import math

import stagekit as kit
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

MATERIALS = "/World/Materials"
LAMPS = 10  # more than are met one by one
FEATURES = [
    ("color", "color4f"),
    ("mbfeat:albedo:0", "color3f"),
    ("mbfeat:normal:1", "color3f"),
    ("mbfeat:direct:2", "color3f"),
    ("mbfeat:contribution:1", "color3f"),
    ("mbfeat:roughness:0", "float"),
    ("mbfeat:firstNonDelta:albedo", "color3f"),
    ("depth", "float"),
    ("primvars:displayColor", "color3f"),
]


def everything() -> Usd.Stage:
    """Every effect at once: what needs the full kernel, and what it is measured on."""
    stage = kit.new_stage()
    materials = _materials(stage)
    floor = kit.quad(stage, "/World/Floor", (-4, 0, 4), (8, 0, 0), (0, 0, -8))
    kit.bind(floor, materials["Floor"])
    kit.bind(kit.quad(stage, "/World/Wall", (-4, 0, -2), (8, 0, 0), (0, 4, 0)), materials["Wall"])
    leaf = kit.quad(stage, "/World/Leaf", (-1.9, 0.1, -0.6), (0.8, 0, 0.3), (0, 1.6, 0))
    kit.bind(leaf, materials["Leaf"])
    glow = kit.box(stage, "/World/Glow", (1.5, 0, -1.2), (1.7, 1.2, -1.0))
    kit.bind(glow, materials["Glow"])
    for i, name in enumerate(("Coated", "Lacquer", "Glass")):
        ball = kit.sphere_mesh(stage, f"/World/{name}", 0.4, 32)
        kit.place(ball, translate=(-0.95 + 0.95 * i, 0.4, 0.0))
        kit.bind(ball, materials[name])
    _balls(stage, materials["Painted"])
    _lights(stage)
    camera = kit.camera(stage, "/World/Camera", (0, 1.5, 4.2), (0, 0.6, 0), focal_length=40.0)
    camera.CreateFStopAttr(2.0)
    camera.CreateFocusDistanceAttr(4.2)
    kit.render_settings(stage, "/World/Camera", (320, 180), settings={"mbfeat:samplesPerPixel": 16})
    kit.render_product(stage, "Features", "everything.exr", FEATURES)
    kit.render_product(
        stage, "Paths", "everything_paths.exr", FEATURES[:1], product_type="deepRaster"
    )
    return stage


def _materials(stage: Usd.Stage) -> dict[str, UsdShade.Material]:
    def material(name: str, **inputs: object) -> UsdShade.Material:
        return kit.preview_material(stage, f"{MATERIALS}/{name}", **inputs)

    def map_of(name: str, file: str, **inputs: object) -> UsdShade.Output:
        return kit.texture(stage, f"{MATERIALS}/{name}", f"./textures/{file}.png", **inputs)  # type: ignore[arg-type]

    bumps = map_of(
        "Wall/Bumps", "bumps", color_space="raw", scale=(2, 2, 2, 2), bias=(-1, -1, -1, -1)
    )
    return {
        "Floor": material("Floor", diffuseColor=map_of("Floor/Map", "checker"), roughness=0.5),
        "Wall": material("Wall", diffuseColor=(0.6, 0.55, 0.5), roughness=0.7, normal=bumps),
        "Leaf": material(
            "Leaf",
            diffuseColor=map_of("Leaf/Colour", "leaf"),
            opacity=map_of("Leaf/Alpha", "leaf", output="a"),
            opacityThreshold=0.5,
            roughness=0.6,
        ),
        "Glow": material("Glow", diffuseColor=(0, 0, 0), emissiveColor=(4, 2, 1)),
        "Coated": material(
            "Coated",
            diffuseColor=(0.7, 0.2, 0.1),
            metallic=0.6,
            roughness=0.4,
            clearcoat=0.8,
            clearcoatRoughness=0.05,
        ),
        "Lacquer": material(
            "Lacquer",
            diffuseColor=(0.1, 0.3, 0.5),
            useSpecularWorkflow=1,
            specularColor=(0.2, 0.2, 0.25),
            roughness=0.2,
        ),
        "Glass": material(
            "Glass", diffuseColor=(0.9, 0.97, 0.95), opacity=0.0, roughness=0.15, ior=1.5
        ),
        "Painted": material("Painted", diffuseColor=_primvar(stage), roughness=0.6),
    }


def _primvar(stage: Usd.Stage) -> UsdShade.Output:
    reader = UsdShade.Shader.Define(stage, f"{MATERIALS}/Painted/Reader")
    reader.CreateIdAttr("UsdPrimvarReader_float3")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("displayColor")
    return reader.CreateOutput("result", Sdf.ValueTypeNames.Float3)


def _balls(stage: Usd.Stage, material: UsdShade.Material) -> None:
    """Instances of a painted ball along the wall."""
    instancer = UsdGeom.PointInstancer.Define(stage, "/World/Balls")
    ball = kit.sphere_mesh(stage, "/World/Balls/Prototypes/Ball", 0.18, 24)
    kit.bind(ball, material)
    ball.CreateDisplayColorPrimvar(UsdGeom.Tokens.constant).Set([Gf.Vec3f(0.8, 0.6, 0.1)])
    instancer.CreatePrototypesRel().AddTarget(ball.GetPath())
    instancer.CreatePositionsAttr([Gf.Vec3f(-1.5 + 0.6 * i, 0.18, -1.4) for i in range(6)])
    instancer.CreateProtoIndicesAttr([0] * 6)


def _lights(stage: Usd.Stage) -> None:
    """A sky with an image, and lamps of which one is shaped, one dims and one casts no shadows."""
    sky = UsdLux.DomeLight.Define(stage, "/World/Lights/Sky")
    sky.CreateTextureFileAttr("./textures/checker.png")
    sky.CreateIntensityAttr(0.3)
    for i in range(LAMPS):
        turn = 2.0 * math.pi * i / LAMPS
        place = (round(2.5 * math.cos(turn), 3), 2.6, round(2.0 * math.sin(turn), 3))
        path = f"/World/Lights/Lamp{i}"
        lamp = kit.rect_light(stage, path, place, (0, 0.4, 0), (0.3, 0.3), 6.0)
        if i == 0:
            UsdLux.ShapingAPI.Apply(lamp.GetPrim()).CreateShapingConeAngleAttr(35.0)
        elif i == 1:
            lamp.CreateDiffuseAttr(0.5)
        elif i == 2:
            UsdLux.ShadowAPI.Apply(lamp.GetPrim()).CreateShadowEnableAttr(False)
