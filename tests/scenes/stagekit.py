"""Building blocks of the test stages: meshes, materials, lights and cameras as USD prims.

Lengths are metres (``metersPerUnit`` 1), +y is up. Nothing here is random: the stages are the same
on every run.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence

from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade

Vector = Sequence[float]


def new_stage(default_prim: str = "World") -> Usd.Stage:
    """An empty in-memory stage, +y up, in metres, with its default prim."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, f"/{default_prim}").GetPrim())
    return stage


def place(
    prim: UsdGeom.Xformable,
    translate: Vector = (0, 0, 0),
    rotate: Vector = (0, 0, 0),
    scale: Vector = (1, 1, 1),
) -> UsdGeom.Xformable:
    """Sets translation, rotation about x, y, z in degrees, and scale; returns the prim."""
    prim.ClearXformOpOrder()
    if tuple(translate) != (0, 0, 0):
        prim.AddTranslateOp().Set(Gf.Vec3d(*translate))
    if tuple(rotate) != (0, 0, 0):
        prim.AddRotateXYZOp().Set(Gf.Vec3f(*rotate))
    if tuple(scale) != (1, 1, 1):
        prim.AddScaleOp().Set(Gf.Vec3f(*scale))
    return prim


def _vector(v: Vector) -> Gf.Vec3f:
    """Rounded to a micrometre, so that the text of a stage stays short."""
    return Gf.Vec3f(*(round(c, 6) + 0.0 for c in v))


def mesh(
    stage: Usd.Stage,
    path: str,
    points: Iterable[Vector],
    faces: Sequence[Sequence[int]],
    *,
    normals: Iterable[Vector] | None = None,
    st: Iterable[Vector] | None = None,
    st_interpolation: str = UsdGeom.Tokens.vertex,
) -> UsdGeom.Mesh:
    """A polygon mesh without subdivision; normals are per point, st as said."""
    prim = UsdGeom.Mesh.Define(stage, path)
    points = [_vector(p) for p in points]
    prim.CreatePointsAttr(points)
    prim.CreateFaceVertexCountsAttr([len(face) for face in faces])
    prim.CreateFaceVertexIndicesAttr([i for face in faces for i in face])
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    prim.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    if normals is not None:
        prim.CreateNormalsAttr([_vector(n) for n in normals])
        prim.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    if st is not None:
        primvar = UsdGeom.PrimvarsAPI(prim).CreatePrimvar(
            "st", Sdf.ValueTypeNames.TexCoord2fArray, st_interpolation
        )
        primvar.Set([Gf.Vec2f(*uv) for uv in st])
    return prim


def quad(
    stage: Usd.Stage, path: str, origin: Vector, edge_u: Vector, edge_v: Vector
) -> UsdGeom.Mesh:
    """A rectangle; its normal is edge_u x edge_v and st runs 0..1 along the edges."""
    o, u, v = Gf.Vec3f(*origin), Gf.Vec3f(*edge_u), Gf.Vec3f(*edge_v)
    return mesh(
        stage,
        path,
        [o, o + u, o + u + v, o + v],
        [(0, 1, 2, 3)],
        st=[(0, 0), (1, 0), (1, 1), (0, 1)],
    )


def box(stage: Usd.Stage, path: str, low: Vector, high: Vector) -> UsdGeom.Mesh:
    """An axis-aligned box with normals outwards and st 0..1 on every face."""
    points = [
        (x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])
    ]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    st = [(0, 0), (1, 0), (1, 1), (0, 1)] * 6
    return mesh(stage, path, points, faces, st=st, st_interpolation=UsdGeom.Tokens.faceVarying)


def revolve(
    stage: Usd.Stage,
    path: str,
    profile: Sequence[tuple[float, float]],
    segments: int,
    *,
    smooth: bool = True,
) -> UsdGeom.Mesh:
    """The surface of a profile (radius, height) turned about +y.

    The outside is to the right of the profile's direction seen with the radius to the right and
    the height up: a profile that runs upwards faces outwards. A radius of 0 makes a pole.
    """
    points: list[Vector] = []
    normals: list[Vector] = []
    rings: list[list[int]] = []
    for i, (radius, height) in enumerate(profile):
        before, after = profile[max(i - 1, 0)], profile[min(i + 1, len(profile) - 1)]
        dr, dh = after[0] - before[0], after[1] - before[1]
        size = math.hypot(dr, dh) or 1.0
        nr, nh = dh / size, -dr / size
        if radius == 0.0:
            nr, nh = 0.0, math.copysign(1.0, nh)
        ring = []
        for s in range(1 if radius == 0.0 else segments):
            phi = 2.0 * math.pi * s / segments
            ring.append(len(points))
            points.append((radius * math.cos(phi), height, -radius * math.sin(phi)))
            normals.append((nr * math.cos(phi), nh, -nr * math.sin(phi)))
        rings.append(ring)
    faces: list[Sequence[int]] = []
    for low, high in itertools.pairwise(rings):
        for s in range(segments):
            t = (s + 1) % segments
            if len(low) == 1 and len(high) > 1:
                faces.append((low[0], high[t], high[s]))
            elif len(high) == 1 and len(low) > 1:
                faces.append((low[s], low[t], high[0]))
            elif len(low) > 1:
                faces.append((low[s], low[t], high[t], high[s]))
    return mesh(stage, path, points, faces, normals=normals if smooth else None)


def arc(radius: float, start: float, end: float, steps: int) -> list[tuple[float, float]]:
    """Profile points of a circle about the origin from latitude start to end, in degrees."""
    profile = []
    for i in range(steps + 1):
        angle = math.radians(start + (end - start) * i / steps)
        r = radius * math.cos(angle)
        profile.append((0.0 if abs(r) < 1e-6 * radius else r, radius * math.sin(angle)))
    return profile


def sphere_mesh(
    stage: Usd.Stage, path: str, radius: float, segments: int = 32, *, inward: bool = False
) -> UsdGeom.Mesh:
    """A sphere of quads with smooth normals; inward: the outside of the surface is its inside."""
    profile = arc(radius, -90.0, 90.0, segments // 2)
    return revolve(stage, path, profile[::-1] if inward else profile, segments)


def preview_material(stage: Usd.Stage, path: str, **inputs: object) -> UsdShade.Material:
    """A UsdPreviewSurface material. An input's value is a constant or a shader output to connect.

    Inputs are named as in the specification (diffuseColor, roughness, opacity, ior, ...).
    """
    material = UsdShade.Material.Define(stage, path)
    surface = UsdShade.Shader.Define(stage, f"{path}/Surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    colours = {"diffuseColor", "emissiveColor", "specularColor"}
    for name, value in inputs.items():
        if name in colours:
            kind = Sdf.ValueTypeNames.Color3f
        elif name == "normal":
            kind = Sdf.ValueTypeNames.Normal3f
        elif name == "useSpecularWorkflow":
            kind = Sdf.ValueTypeNames.Int
        elif name == "opacityMode":
            kind = Sdf.ValueTypeNames.Token
        else:
            kind = Sdf.ValueTypeNames.Float
        attribute = surface.CreateInput(name, kind)
        if isinstance(value, UsdShade.Output):
            attribute.ConnectToSource(value)
        elif name in colours or name == "normal":
            attribute.Set(Gf.Vec3f(*value))  # type: ignore[misc]
        else:
            attribute.Set(value)
    material.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
    return material


def texture(
    stage: Usd.Stage,
    path: str,
    file: str,
    *,
    output: str = "rgb",
    wrap: str = "repeat",
    color_space: str = "auto",
    **inputs: object,
) -> UsdShade.Output:
    """A UsdUVTexture that reads st; returns its output for preview_material()."""
    reader = UsdShade.Shader.Define(stage, f"{path}_st")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
    st = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    node = UsdShade.Shader.Define(stage, path)
    node.CreateIdAttr("UsdUVTexture")
    node.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(file))
    node.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(st)
    node.CreateInput("wrapS", Sdf.ValueTypeNames.Token).Set(wrap)
    node.CreateInput("wrapT", Sdf.ValueTypeNames.Token).Set(wrap)
    node.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set(color_space)
    for name, value in inputs.items():
        node.CreateInput(name, Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(*value))  # type: ignore[misc]
    kind = Sdf.ValueTypeNames.Float3 if output == "rgb" else Sdf.ValueTypeNames.Float
    return node.CreateOutput(output, kind)


def bind(prim: UsdGeom.Gprim, material: UsdShade.Material) -> UsdGeom.Gprim:
    """Binds the material and returns the prim."""
    UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(material)
    return prim


def camera(
    stage: Usd.Stage,
    path: str,
    position: Vector,
    target: Vector,
    *,
    focal_length: float = 35.0,
    aspect: float = 16.0 / 9.0,
) -> UsdGeom.Camera:
    """A pinhole camera at `position` that looks at `target`, 36 mm wide film back."""
    prim = UsdGeom.Camera.Define(stage, path)
    view = Gf.Matrix4d().SetLookAt(Gf.Vec3d(*position), Gf.Vec3d(*target), Gf.Vec3d(0, 1, 0))
    prim.AddTransformOp().Set(view.GetInverse())
    prim.CreateFocalLengthAttr(focal_length)
    prim.CreateHorizontalApertureAttr(36.0)
    prim.CreateVerticalApertureAttr(36.0 / aspect)
    prim.CreateClippingRangeAttr(Gf.Vec2f(0.01, 1000.0))
    return prim


def rect_light(
    stage: Usd.Stage,
    path: str,
    position: Vector,
    target: Vector,
    size: tuple[float, float],
    intensity: float,
    colour: Vector = (1, 1, 1),
) -> UsdLux.RectLight:
    """A rectangular light at `position` that shines towards `target`; radiance in `intensity`."""
    light = UsdLux.RectLight.Define(stage, path)
    up = Gf.Vec3d(0, 1, 0)
    direction = (Gf.Vec3d(*target) - Gf.Vec3d(*position)).GetNormalized()
    if abs(Gf.Dot(direction, up)) > 0.99:
        up = Gf.Vec3d(1, 0, 0)
    view = Gf.Matrix4d().SetLookAt(Gf.Vec3d(*position), Gf.Vec3d(*target), up)
    light.AddTransformOp().Set(view.GetInverse())
    light.CreateWidthAttr(size[0])
    light.CreateHeightAttr(size[1])
    light.CreateIntensityAttr(intensity)
    light.CreateColorAttr(Gf.Vec3f(*colour))
    return light


def render_settings(
    stage: Usd.Stage,
    camera_path: str,
    resolution: tuple[int, int],
    *,
    settings: dict[str, object] | None = None,
) -> UsdRender.Settings:
    """/Render/Settings with camera, resolution and mbfeat:* values; made the stage's default."""
    prim = UsdRender.Settings.Define(stage, "/Render/Settings")
    prim.CreateCameraRel().SetTargets([Sdf.Path(camera_path)])
    prim.CreateResolutionAttr(Gf.Vec2i(*resolution))
    kinds = {
        bool: Sdf.ValueTypeNames.Bool,
        int: Sdf.ValueTypeNames.Int,
        float: Sdf.ValueTypeNames.Float,
        str: Sdf.ValueTypeNames.Token,
    }
    for name, value in (settings or {}).items():
        prim.GetPrim().CreateAttribute(name, kinds[type(value)], custom=True).Set(value)
    stage.SetMetadata("renderSettingsPrimPath", str(prim.GetPath()))
    return prim


def render_product(
    stage: Usd.Stage,
    name: str,
    file: str,
    sources: Sequence[tuple[str, str]],
    *,
    product_type: str = "raster",
) -> UsdRender.Product:
    """Adds /Render/Products/<name> to the settings; sources are (AOV, dataType) pairs."""
    product = UsdRender.Product.Define(stage, f"/Render/Products/{name}")
    product.CreateProductNameAttr(file)
    product.CreateProductTypeAttr(product_type)
    targets = []
    for aov, data_type in sources:
        identifier = aov.replace(":", "_")
        var = UsdRender.Var.Define(stage, f"/Render/Vars/{identifier}")
        var.CreateSourceNameAttr(aov)
        var.CreateDataTypeAttr(data_type)
        var.GetPrim().CreateAttribute(
            "driver:parameters:aov:name", Sdf.ValueTypeNames.String, custom=True
        ).Set(aov)
        targets.append(var.GetPath())
    product.CreateOrderedVarsRel().SetTargets(targets)
    settings = UsdRender.Settings.Define(stage, "/Render/Settings")
    settings.CreateProductsRel().AddTarget(product.GetPath())
    return product
