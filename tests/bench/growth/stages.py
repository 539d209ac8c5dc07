"""The procedural stages: one thing grows, and what the camera sees stays much the same.

Every function writes one stage, the same for the same size. Sizes scale what there is, not how
much of the image it covers or how bright it is: the terrain is cut finer, instances and lights get
smaller as they get more, and textures get more texels on the same tiles.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from growth.axes import SEED

TILES = 8  # meshes of the terrain, textures on the wall
INSTANCE_TRIANGLES = 1000
SIDE = 10.0  # of everything, scene units


def write(kind: str, size: int, path: Path) -> None:
    """Writes the stage `path` (.usdc) and the files that it refers to into its folder."""
    from pxr import Sdf, Usd, UsdGeom

    layer = Sdf.Layer.CreateNew(str(path))
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    MAKERS[kind](stage, size, path.parent)
    _add_view(stage)
    stage.GetRootLayer().Save()


def _add_view(stage: Any) -> None:
    """A camera that looks down at the middle, and render settings with one product."""
    from pxr import Gf, Sdf, UsdGeom, UsdRender

    camera = UsdGeom.Camera.Define(stage, "/World/Camera")
    camera.CreateFocalLengthAttr(22.0)
    camera.CreateHorizontalApertureAttr(20.0)
    camera.CreateVerticalApertureAttr(11.25)
    camera.CreateClippingRangeAttr(Gf.Vec2f(0.1, 1000.0))
    look = Gf.Matrix4d().SetLookAt(
        Gf.Vec3d(0.0, 6.0, 8.0), Gf.Vec3d(0.0, 0.0, 0.3), Gf.Vec3d(0.0, 1.0, 0.0)
    )
    UsdGeom.Xformable(camera).AddTransformOp().Set(look.GetInverse())
    settings = UsdRender.Settings.Define(stage, "/Render/Settings")
    settings.CreateCameraRel().SetTargets([camera.GetPath()])
    product = UsdRender.Product.Define(stage, "/Render/Product")
    settings.CreateProductsRel().SetTargets([product.GetPath()])
    kind = Sdf.ValueTypeNames.Token
    product.GetPrim().CreateAttribute("driver:parameters:OpenEXR:compression", kind).Set("none")


def _add_sky(stage: Any, intensity: float) -> None:
    from pxr import UsdLux

    UsdLux.DomeLight.Define(stage, "/World/Sky").CreateIntensityAttr(intensity)


def _add_mesh(
    stage: Any,
    path: str,
    points: NDArray[np.float32],
    faces: NDArray[np.int32],
    uv: NDArray[np.float32] | None = None,
) -> Any:
    """A mesh of points [n, 3] and faces [m, corners], with texture coordinates [n, 2] or none."""
    from pxr import Gf, Sdf, UsdGeom, Vt

    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, np.float32)))
    counts = np.full(len(faces), faces.shape[1], np.int32)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(counts))
    indices = np.ascontiguousarray(faces.reshape(-1), np.int32)
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(indices))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    low, high = points.min(axis=0), points.max(axis=0)
    mesh.CreateExtentAttr([Gf.Vec3f(*map(float, low)), Gf.Vec3f(*map(float, high))])
    if uv is not None:
        st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
            "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex
        )
        st.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(uv, np.float32)))
    return mesh


def _grid(cells_u: int, cells_v: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Points [n, 2] in the unit square and the triangles [2 cells_u cells_v, 3] between them."""
    u, v = np.meshgrid(
        np.linspace(0, 1, cells_u + 1, dtype=np.float32),
        np.linspace(0, 1, cells_v + 1, dtype=np.float32),
    )
    corner = (np.arange(cells_v)[:, None] * (cells_u + 1) + np.arange(cells_u)[None, :]).ravel()
    a, b, c, d = corner, corner + cells_u + 1, corner + cells_u + 2, corner + 1
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=1)
    return np.stack([u.ravel(), v.ravel()], -1), faces.reshape(-1, 3).astype(np.int32)


def _height(x: NDArray[Any], z: NDArray[Any]) -> NDArray[np.float32]:
    """Hills with folds, the same however finely they are cut."""
    hills = 0.5 * np.sin(0.9 * x + 0.4) * np.cos(1.1 * z) + 0.2 * np.sin(2.3 * x - 1.7 * z)
    return np.asarray(hills + 0.06 * np.sin(7.1 * x + 5.3 * z) * np.cos(6.1 * z), np.float32)


def _points(x: NDArray[Any], y: NDArray[Any], z: NDArray[Any]) -> NDArray[np.float32]:
    columns: list[NDArray[Any]] = [x, y, z]
    return np.stack(columns, axis=-1).astype(np.float32)


def _triangles(stage: Any, size: int, folder: Path) -> None:
    """A terrain of about `size` triangles in eight meshes, under a sky and a lamp."""
    from pxr import Gf, UsdGeom, UsdLux

    cells = max(round(math.sqrt(size / (2 * TILES))), 1)
    unit, faces = _grid(cells, cells)
    for i in range(TILES):
        x = ((i % 4 + unit[:, 0]) / 4 - 0.5) * SIDE
        z = ((i // 4 + unit[:, 1]) / 2 - 0.5) * SIDE
        _add_mesh(stage, f"/World/Tile{i}", _points(x, _height(x, z), z), faces)
    _add_sky(stage, 0.6)
    lamp = UsdLux.SphereLight.Define(stage, "/World/Lamp")
    lamp.CreateRadiusAttr(0.5)
    lamp.CreateIntensityAttr(40.0)
    UsdGeom.Xformable(lamp).AddTranslateOp().Set(Gf.Vec3d(-2.0, 4.0, 0.0))


def _spots(count: int, rng: np.random.Generator) -> tuple[NDArray[np.float64], float]:
    """Jittered places [count, 2] over the square, and the side of the cell that each has."""
    cells = math.ceil(math.sqrt(count))
    index = rng.permutation(cells * cells)[:count] if count < cells * cells else np.arange(count)
    jitter = rng.uniform(0.3, 0.7, (count, 2))
    place = np.stack([index % cells, index // cells], -1) + jitter
    return (place / cells - 0.5) * SIDE, SIDE / cells


def _add_ground(stage: Any, y: float) -> None:
    corners = np.array([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]], np.float32)
    points = SIDE * corners + np.array([0, y, 0], np.float32)
    _add_mesh(stage, "/World/Ground", points, np.array([[0, 1, 2, 3]], np.int32))


def _instances(stage: Any, size: int, folder: Path) -> None:
    """`size` instances of one dented ball of a thousand triangles, on a ground under a sky."""
    from pxr import Sdf, UsdGeom, Vt

    rng = np.random.default_rng(SEED)
    spots, cell = _spots(size, rng)
    instancer = UsdGeom.PointInstancer.Define(stage, "/World/Field")
    unit, faces = _grid(25, INSTANCE_TRIANGLES // 50)
    around, down = 2 * math.pi * unit[:, 0], math.pi * unit[:, 1]
    radius = 1.0 + 0.15 * np.sin(5 * around) * np.sin(down) ** 2
    ball = np.stack([np.cos(around) * np.sin(down), np.cos(down), np.sin(around) * np.sin(down)])
    prototype = "/World/Field/Prototypes/Ball"
    _add_mesh(stage, prototype, (radius * ball).T.astype(np.float32), faces[:, ::-1])
    instancer.CreatePrototypesRel().SetTargets([Sdf.Path(prototype)])
    scale = 0.4 * cell
    places = np.stack([spots[:, 0], np.full(size, scale), spots[:, 1]], -1).astype(np.float32)
    instancer.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(places))
    instancer.CreateScalesAttr(Vt.Vec3fArray.FromNumpy(np.full((size, 3), scale, np.float32)))
    instancer.CreateProtoIndicesAttr(Vt.IntArray.FromNumpy(np.zeros(size, np.int32)))
    _add_ground(stage, 0.0)
    _add_sky(stage, 1.0)


def _lights(stage: Any, size: int, folder: Path) -> None:
    """`size` sphere lights of the same power together, over hills."""
    from pxr import Gf, Sdf, UsdGeom, UsdLux

    rng = np.random.default_rng(SEED)
    spots, cell = _spots(size, rng)
    unit, faces = _grid(100, 100)
    x, z = (unit[:, 0] - 0.5) * 1.2 * SIDE, (unit[:, 1] - 0.5) * 1.2 * SIDE
    _add_mesh(stage, "/World/Hills", _points(x, _height(x, z), z), faces)
    heights = rng.uniform(1.2, 2.5, size)
    stage.DefinePrim("/World/Lights", "Scope")
    with Sdf.ChangeBlock():
        layer = stage.GetRootLayer()
        for i in range(size):
            prim = Sdf.CreatePrimInLayer(layer, f"/World/Lights/L{i}")
            prim.specifier, prim.typeName = Sdf.SpecifierDef, "SphereLight"
            # Power goes with the area: the cell's.
            _set(prim, "inputs:radius", Sdf.ValueTypeNames.Float, 0.02 * cell)
            _set(prim, "inputs:intensity", Sdf.ValueTypeNames.Float, 600.0)
            place = Gf.Vec3d(float(spots[i, 0]), float(heights[i]), float(spots[i, 1]))
            _set(prim, "xformOp:translate", Sdf.ValueTypeNames.Double3, place)
            order = ["xformOp:translate"]
            _set(prim, "xformOpOrder", Sdf.ValueTypeNames.TokenArray, order, uniform=True)
    assert UsdLux.SphereLight(stage.GetPrimAtPath("/World/Lights/L0"))
    assert UsdGeom.Xformable(stage.GetPrimAtPath("/World/Lights/L0")).GetOrderedXformOps()


def _set(prim: Any, name: str, kind: Any, value: object, uniform: bool = False) -> None:
    from pxr import Sdf

    variability = Sdf.VariabilityUniform if uniform else Sdf.VariabilityVarying
    Sdf.AttributeSpec(prim, name, kind, variability).default = value


def _textures(stage: Any, size: int, folder: Path) -> None:
    """Eight tiles with an image of noise each, of `size` MB decoded together, under a sky."""
    from pxr import Sdf, UsdShade

    rng = np.random.default_rng(SEED)
    side = max(int(math.sqrt(size * 1e6 / TILES / 3)), 1)  # three bytes a texel
    unit, faces = _grid(1, 1)
    for i in range(TILES):
        write_tga(folder / f"noise{i}.tga", rng.integers(0, 256, (side, side, 3), dtype=np.uint8))
        x = ((i % 4 + unit[:, 0]) / 4 - 0.5) * SIDE
        z = ((i // 4 + unit[:, 1]) / 2 - 0.5) * SIDE
        points = _points(x, np.zeros_like(x), z)
        mesh = _add_mesh(stage, f"/World/Tile{i}", points, faces, unit)
        material = UsdShade.Material.Define(stage, f"/World/Look{i}")
        surface = UsdShade.Shader.Define(stage, f"/World/Look{i}/Surface")
        surface.CreateIdAttr("UsdPreviewSurface")
        reader = UsdShade.Shader.Define(stage, f"/World/Look{i}/Reader")
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
        result = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        texture = UsdShade.Shader.Define(stage, f"/World/Look{i}/Texture")
        texture.CreateIdAttr("UsdUVTexture")
        texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(f"./noise{i}.tga")
        texture.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(result)
        colour = texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
        surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(colour)
        surface_output = surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
        material.CreateSurfaceOutput().ConnectToSource(surface_output)
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    _add_sky(stage, 1.0)


def write_tga(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Writes [height, width, 3] uncompressed: a gigabyte of PNG would take minutes."""
    height, width = pixels.shape[:2]
    header = bytearray(18)
    header[2] = 2  # true colour
    header[12:16] = width.to_bytes(2, "little") + height.to_bytes(2, "little")
    header[16] = 24  # bits a pixel
    with path.open("wb") as file:
        file.write(bytes(header))
        file.write(pixels.tobytes())


MAKERS = {
    "triangles": _triangles,
    "instances": _instances,
    "lights": _lights,
    "textures": _textures,
}
