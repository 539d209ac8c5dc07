"""Bad scene data costs that datum or prim, with one clear message, never the image."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, UsdVol, Vt

import hydrakit

NAN = math.nan
COLOR = Sdf.ValueTypeNames.Color3f
Case = Callable[[Usd.Stage, Path], None]


def _mesh(points: list[tuple[float, float, float]], counts: list[int], indices: list[int]) -> Case:
    def build(stage: Usd.Stage, _: Path) -> None:
        hydrakit.add_mesh(stage, "/World/bad", points, counts, indices)

    return build


def _transform(apply: Callable[[UsdGeom.Xformable], None]) -> Case:
    def build(stage: Usd.Stage, _: Path) -> None:
        apply(UsdGeom.Xformable(hydrakit.add_quad(stage, "/World/bad")))

    return build


def _primvar(interpolation: str, values: list[float], indices: list[int] | None = None) -> Case:
    """A quad whose material reads a primvar with these values."""

    def build(stage: Usd.Stage, _: Path) -> None:
        quad = hydrakit.add_quad(stage, "/World/bad")
        shader = hydrakit.add_material(stage, "/World/look", (0.5, 0.5, 0.5))
        hydrakit.bind(quad.GetPrim(), "/World/look")
        reader = UsdShade.Shader.Define(stage, "/World/look/reader")
        reader.CreateIdAttr("UsdPrimvarReader_float")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("gloss")
        output = reader.CreateOutput("result", Sdf.ValueTypeNames.Float)
        shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).ConnectToSource(output)
        primvar = UsdGeom.PrimvarsAPI(quad).CreatePrimvar(
            "gloss", Sdf.ValueTypeNames.FloatArray, interpolation
        )
        primvar.Set(Vt.FloatArray(values))
        if indices is not None:
            primvar.SetIndices(Vt.IntArray(indices))

    return build


def _texture(file: str, content: bytes | None = None) -> Case:
    """A quad with a texture of that name and content."""

    def build(stage: Usd.Stage, folder: Path) -> None:
        if content is not None:
            (folder / file).write_bytes(content)
        quad = hydrakit.add_quad(stage, "/World/bad")
        shader = hydrakit.add_material(stage, "/World/look", (0.5, 0.5, 0.5))
        hydrakit.bind(quad.GetPrim(), "/World/look")
        texture = UsdShade.Shader.Define(stage, "/World/look/texture")
        texture.CreateIdAttr("UsdUVTexture")
        name = str(folder / file) if file else ""
        texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(name)
        output = texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
        shader.GetInput("diffuseColor").ConnectToSource(output)

    return build


def _subset(stage: Usd.Stage, _: Path) -> None:
    quad = hydrakit.add_quad(stage, "/World/bad")
    hydrakit.add_material(stage, "/World/look", (0.5, 0.5, 0.5))
    for name, faces in (("a", [0]), ("b", [0, 7, -1])):
        subset = UsdGeom.Subset.CreateGeomSubset(quad, name, "face", faces, "materialBind")
        hydrakit.bind(subset.GetPrim(), "/World/look")


def _unknown_surface(stage: Usd.Stage, _: Path) -> None:
    quad = hydrakit.add_quad(stage, "/World/bad")
    hydrakit.add_material(stage, "/World/look", (0.5, 0.5, 0.5))
    shader = UsdShade.Shader(stage.GetPrimAtPath("/World/look/surface"))
    shader.CreateIdAttr("NobodysSurface")
    hydrakit.bind(quad.GetPrim(), "/World/look")


def _material(**values: float | tuple[float, float, float]) -> Case:
    """A quad whose material has these inputs."""

    def build(stage: Usd.Stage, _: Path) -> None:
        quad = hydrakit.add_quad(stage, "/World/bad")
        shader = hydrakit.add_material(stage, "/World/look", (0.5, 0.5, 0.5))
        hydrakit.bind(quad.GetPrim(), "/World/look")
        for name, value in values.items():
            kind = Sdf.ValueTypeNames.Float if isinstance(value, float) else COLOR
            shader.CreateInput(name, kind).Set(value)

    return build


def _corrupt_dome(stage: Usd.Stage, folder: Path) -> None:
    (folder / "dome.exr").write_bytes(b"\x76\x2f\x31\x01" + bytes(range(200)))
    dome = UsdLux.DomeLight.Define(stage, "/World/second")
    dome.CreateTextureFileAttr(str(folder / "dome.exr"))


def _light(attribute: str, value: float) -> Case:
    def build(stage: Usd.Stage, _: Path) -> None:
        light = UsdLux.SphereLight.Define(stage, "/World/lamp")
        UsdGeom.Xformable(light).AddTranslateOp().Set(Gf.Vec3d(0.0, 0.0, 50.0))
        light.GetPrim().GetAttribute(f"inputs:{attribute}").Set(value)

    return build


def _camera(**values: float | Gf.Vec2f) -> Case:
    def build(stage: Usd.Stage, _: Path) -> None:
        camera = stage.GetPrimAtPath("/World/camera")
        for name, value in values.items():
            camera.GetAttribute(name).Set(value)

    return build


def _curves(stage: Usd.Stage, _: Path) -> None:
    curves = UsdGeom.BasisCurves.Define(stage, "/World/hair")
    curves.CreatePointsAttr([(0, 0, 0), (0, 1, 0), (0, 2, 0), (0, 3, 0)])
    curves.CreateCurveVertexCountsAttr([4])


def _points(stage: Usd.Stage, _: Path) -> None:
    UsdGeom.Points.Define(stage, "/World/dust").CreatePointsAttr([(0, 0, 0)])


def _volume(stage: Usd.Stage, _: Path) -> None:
    UsdVol.Volume.Define(stage, "/World/smoke")


def _portal(stage: Usd.Stage, _: Path) -> None:
    UsdLux.PortalLight.Define(stage, "/World/portal")


def _mesh_light(stage: Usd.Stage, _: Path) -> None:
    UsdLux.MeshLightAPI.Apply(hydrakit.add_quad(stage, "/World/bad").GetPrim())


def _linked(collection: str) -> Case:
    """A light of which a collection leaves out the good quad."""

    def build(stage: Usd.Stage, _: Path) -> None:
        light = UsdLux.LightAPI(UsdLux.SphereLight.Define(stage, "/World/lamp"))
        api = getattr(light, f"Get{collection}LinkCollectionAPI")()
        api.CreateExcludesRel().SetTargets([Sdf.Path("/World/good")])

    return build


def _filtered(stage: Usd.Stage, _: Path) -> None:
    light = UsdLux.LightAPI(UsdLux.SphereLight.Define(stage, "/World/lamp"))
    gobo = UsdLux.LightFilter.Define(stage, "/World/gobo")
    light.CreateFiltersRel().SetTargets([gobo.GetPath()])


def _profiled(stage: Usd.Stage, _: Path) -> None:
    light = UsdLux.SphereLight.Define(stage, "/World/lamp")
    UsdLux.ShapingAPI.Apply(light.GetPrim()).CreateShapingIesFileAttr("lamp.ies")


def _clipped(stage: Usd.Stage, _: Path) -> None:
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/World/camera"))
    camera.CreateClippingPlanesAttr([Gf.Vec4f(1, 0, 0, 5)])


def _displaced(stage: Usd.Stage, _: Path) -> None:
    quad = hydrakit.add_quad(stage, "/World/bad")
    shader = hydrakit.add_material(stage, "/World/look", (0.5, 0.5, 0.5))
    hydrakit.bind(quad.GetPrim(), "/World/look")
    shader.CreateInput("displacement", Sdf.ValueTypeNames.Float).Set(0.5)
    material = UsdShade.Material(stage.GetPrimAtPath("/World/look"))
    output = shader.CreateOutput("displacement", Sdf.ValueTypeNames.Token)
    material.CreateDisplacementOutput().ConnectToSource(output)


QUAD = hydrakit.QUAD
CASES: dict[str, tuple[Case, str]] = {
    "no points": (_mesh([], [4], [0, 1, 2, 3]), "/World/bad: "),
    "NaN point": (_mesh([(NAN, 0.0, 0.0), *QUAD[1:]], [4], [0, 1, 2, 3]), "not finite"),
    "index out of range": (_mesh(QUAD, [4, 3], [0, 1, 2, 9, 0, -1, 2]), "out of range"),
    "counts too large": (_mesh(QUAD, [4, 4], [0, 1, 2, 3]), "faceVertexCounts"),
    "faces of one and two": (_mesh(QUAD, [1, 2], [0, 0, 1]), "fewer than three"),
    "singular transform": (
        _transform(lambda x: x.AddScaleOp().Set(Gf.Vec3f(0.0, 1.0, 1.0))),
        "singular",
    ),
    "NaN transform": (
        _transform(lambda x: x.AddTranslateOp().Set(Gf.Vec3d(NAN, 0.0, 0.0))),
        "not finite",
    ),
    "primvar too short": (_primvar("vertex", [0.1, 0.2]), "gloss"),
    "empty primvar": (_primvar("faceVarying", []), "gloss"),
    "primvar indices out of range": (_primvar("vertex", [0.1], [0, 0, 5, -1]), "gloss"),
    "overlapping subsets": (_subset, "/World/bad/b"),
    "missing texture": (_texture("nothing.png"), "nothing.png"),
    "texture without a file": (_texture(""), "names no file"),
    "texture that is no image": (_texture("text.png", b"not an image"), "text.png"),
    "unknown surface": (_unknown_surface, "/World/look"),
    "roughness that is no number": (
        _material(roughness=NAN),
        "/World/look: its input roughness is nan; 0.5 is used",
    ),
    "colour that is no number": (
        _material(diffuseColor=(NAN, 0.25, 0.5)),
        "/World/look: its input diffuseColor is (nan, 0.25, 0.5); (0.18, 0.25, 0.5) is used",
    ),
    "infinite emission": (
        _material(emissiveColor=(math.inf, math.inf, math.inf)),
        "/World/look: its input emissiveColor is inf; 0 is used",
    ),
    "curves": (_curves, "/World/hair: prims of the type basisCurves are not supported"),
    "points": (_points, "/World/dust: prims of the type points are not supported"),
    "volume": (_volume, "/World/smoke: prims of the type volume are not supported"),
    "portal light": (_portal, "/World/portal: its type of light"),
    "mesh light": (_mesh_light, "/World/bad: mesh lights are not supported"),
    "light linking": (_linked("Light"), "/World/lamp: light linking is not supported"),
    "shadow linking": (_linked("Shadow"), "/World/lamp: shadow linking is not supported"),
    "light filter": (_filtered, "/World/lamp: light filters are not supported"),
    "IES profile": (_profiled, "/World/lamp: IES profiles are not supported"),
    "clipping planes": (_clipped, "/World/camera: clippingPlanes are not supported"),
    "displacement": (_displaced, "/World/look: its displacement is not supported"),
    "tile set": (_texture("tiles.<UDIM>.png"), "UDIM"),
    "corrupt dome": (_corrupt_dome, "dome.exr"),
    "light of radius NaN": (_light("radius", NAN), "radius"),
    "light of radius 0": (_light("radius", 0.0), "/World/lamp"),
    "camera without aperture": (
        _camera(horizontalAperture=0.0, verticalAperture=0.0),
        "aperture",
    ),
    "camera without focal length": (_camera(focalLength=0.0), "focalLength"),
    "camera with its near end behind": (
        _camera(clippingRange=Gf.Vec2f(100.0, 1.0)),
        "/World/camera: the near end of clippingRange",
    ),
    "camera out of focus": (_camera(fStop=2.8, focusDistance=0.0), "focusDistance"),
}


@pytest.mark.parametrize("name", CASES)
def test_bad_data_is_named_and_the_rest_is_rendered(
    name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    build, expected = CASES[name]
    stage = hydrakit.make_stage()
    good = hydrakit.add_quad(stage, "/World/good")
    UsdGeom.Xformable(good).AddTranslateOp().Set(Gf.Vec3d(0.0, 0.0, 1.0))
    hydrakit.add_settings(stage)
    build(stage, tmp_path)

    assert hydrakit.record(stage, tmp_path / "image.exr")

    assert expected in capfd.readouterr().err
    film = hydrakit.last_film()
    assert np.isfinite(film.resolve("color")).all()
    assert int(film.sample_counts.min()) == 4
    assert film.resolve("color")[8, 16, 3] == pytest.approx(1.0, abs=1e-5)  # the good quad
    assert hydrakit.last_frame().report.warnings > 0


def test_textures_read_at_one_point_need_no_coordinates(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    stage = hydrakit.make_stage()
    hydrakit.add_settings(stage)
    header = bytes([0, 0, 2, *[0] * 9, 2, 0, 2, 0, 24, 0])  # 2 x 2 pixels of blue, green, red
    _texture("flat.tga", header + b"\xc0\x80\x40" * 4)(stage, tmp_path)
    texture = UsdShade.Shader(stage.GetPrimAtPath("/World/look/texture"))
    texture.CreateInput("st", Sdf.ValueTypeNames.Float2).Set(Gf.Vec2f(0.5, 0.5))

    assert hydrakit.record(stage, tmp_path / "image.exr")

    assert hydrakit.last_frame().report.warnings == 0, capfd.readouterr().err
    red, green, blue = hydrakit.last_film().resolve("color")[8, 16, :3]
    assert 0.0 < red < green < blue


def test_mirrored_transforms_look_like_their_originals(tmp_path: Path) -> None:
    def image(scale: float) -> np.ndarray:
        stage = hydrakit.make_stage(0.0)
        light = UsdLux.DistantLight.Define(stage, "/World/sun")
        light.CreateIntensityAttr(5.0)
        quad = hydrakit.add_quad(stage)
        UsdGeom.Xformable(quad).AddScaleOp().Set(Gf.Vec3f(scale, 1.0, 1.0))
        hydrakit.add_settings(stage)
        hydrakit.record(stage, tmp_path / "image.exr")
        return hydrakit.last_film().resolve("color")

    assert np.allclose(image(-1.0)[4:12, 10:22], image(1.0)[4:12, 10:22], rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(
    ("setting", "value", "expected"),
    [
        ("samplesPerPixl", 4, "samplesPerPixel"),
        ("pixelFilter", "bx", "box"),
        ("maxBounces", -3, "maxBounces"),
    ],
)
def test_wrong_settings_of_the_prim_name_the_right_ones(
    setting: str, value: int | str, expected: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    stage = hydrakit.make_stage()
    hydrakit.add_quad(stage)
    hydrakit.add_settings(stage, (32, 16), **{setting: value})
    assert hydrakit.record(stage, tmp_path / "image.exr")
    messages = [
        m for m in capfd.readouterr().err.splitlines() if f"/Render/settings: mbfeat:{setting}" in m
    ]
    assert len(messages) == 1 and expected in messages[0]


def test_unknown_vars_and_products_are_named_and_the_others_written(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    stage = hydrakit.make_stage()
    hydrakit.add_quad(stage)
    hydrakit.add_settings(stage)
    color = hydrakit.add_var(stage, "beauty", "color", layer="color")
    wrong = hydrakit.add_var(stage, "wrong", "mbfeat:albdo:1")
    paths = hydrakit.add_var(stage, "paths", "C<RD>L", "lpe")
    hydrakit.add_product(stage, "good", tmp_path / "good.exr", [color, wrong, paths])
    hydrakit.add_product(stage, "unwritable", tmp_path / "none" / "x.exr", [color])
    hydrakit.add_product(stage, "nameless", "", [color])
    odd = hydrakit.add_product(stage, "odd", tmp_path / "odd.exr", [color])
    odd.CreateProductTypeAttr("hologram")

    hydrakit.record(stage, tmp_path / "image.exr")

    assert (tmp_path / "good.exr").exists()
    report = hydrakit.last_frame().report
    assert report.written == [str(tmp_path / "good.exr")]
    messages = capfd.readouterr().err
    for prim, text in (
        ("/Render/wrong", "mbfeat:albedo:1"),
        ("/Render/paths", "mbfeat:contribution:0"),
        ("/Render/unwritable", str(tmp_path / "none")),
        ("/Render/nameless", "productName"),
        ("/Render/odd", "hologram"),
    ):
        assert any(prim in error and text in error for error in report.errors), report.errors
        assert prim in messages


def test_a_missing_prototype_costs_only_its_instances(tmp_path: Path) -> None:
    stage = hydrakit.make_stage()
    instancer = UsdGeom.PointInstancer.Define(stage, "/World/instancer")
    prototype = hydrakit.add_quad(stage, "/World/instancer/quad")
    instancer.CreatePrototypesRel().SetTargets([Sdf.Path("/World/nowhere"), prototype.GetPath()])
    instancer.CreateProtoIndicesAttr([0, 1, 1])
    instancer.CreatePositionsAttr([Gf.Vec3f(0, 0, 0)])
    hydrakit.add_settings(stage)
    assert hydrakit.record(stage, tmp_path / "image.exr")
    assert np.isfinite(hydrakit.last_film().resolve("color")).all()
