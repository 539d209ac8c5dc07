"""Reads a stage into the arrays of peers.scene, or says what in it the renderers model differently.

    python -m peers.reader STAGE FOLDER

A guess here would become a difference between renderers that looks like one of their own, so all
that is not understood exactly is an error.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade

from peers import scene
from peers.scene import Colour, Matrix


class UnsupportedError(ValueError):
    """A stage holds what cannot be compared; the message names the prim and what to change."""


def read(path: Path) -> scene.Scene:
    """The stage at its default time. Raises UnsupportedError."""
    stage = Usd.Stage.Open(str(path))
    if UsdGeom.GetStageUpAxis(stage) != UsdGeom.Tokens.y:
        raise UnsupportedError(f"{path}: the up axis is not y; author upAxis = Y")
    result = scene.Scene(camera=_camera(stage))
    materials = _Materials(result)
    for prim in _visible(stage.GetPseudoRoot()):
        if prim.IsA(UsdGeom.PointInstancer):
            result.meshes += _instances(prim, materials)
        elif prim.IsA(UsdGeom.Gprim):
            result.meshes.append(_mesh(prim, materials, _world(prim)[None]))
        elif prim.HasAPI(UsdLux.LightAPI):
            _light(prim, result, materials)
    return result


def _visible(root: Usd.Prim) -> Iterator[Usd.Prim]:
    """Prims that are rendered, in order, without what is below point instancers."""
    prims = iter(Usd.PrimRange(root, Usd.TraverseInstanceProxies()))
    for prim in prims:
        if prim.IsA(UsdGeom.Imageable):
            imageable = UsdGeom.Imageable(prim)
            purpose = imageable.ComputePurpose()
            hidden = imageable.ComputeVisibility() == UsdGeom.Tokens.invisible
            if hidden or purpose not in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render):
                prims.PruneChildren()
                continue
            if prim.IsA(UsdGeom.PointInstancer):
                prims.PruneChildren()
        yield prim


def _columns(matrix: Gf.Matrix4d) -> Matrix:
    """A matrix of OpenUSD, which acts on rows, as one that acts on columns."""
    return np.array(matrix, dtype=np.float64).T


def _world(prim: Usd.Prim) -> Matrix:
    return _columns(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default()))


def _camera(stage: Usd.Stage) -> scene.Camera:
    path = stage.GetMetadata("renderSettingsPrimPath") or "/Render/Settings"
    settings = UsdRender.Settings.Get(stage, path)
    targets = settings.GetCameraRel().GetTargets() if settings else []
    prim = stage.GetPrimAtPath(targets[0]) if targets else None
    if not prim or not prim.IsA(UsdGeom.Camera):
        raise UnsupportedError(f"{path}: it names no camera; author its relationship camera")
    camera = UsdGeom.Camera(prim).GetCamera(Usd.TimeCode.Default())
    plain = camera.projection == Gf.Camera.Perspective and camera.fStop == 0.0
    if not plain or camera.horizontalApertureOffset or camera.verticalApertureOffset:
        raise UnsupportedError(f"{prim.GetPath()}: it is no centred pinhole camera")
    return scene.Camera(_world(prim), camera.horizontalAperture / camera.focalLength)


# ---- meshes


def _mesh(prim: Usd.Prim, materials: _Materials, placements: Matrix) -> scene.Mesh:
    path = prim.GetPath()
    mesh = UsdGeom.Mesh(prim)
    if not mesh or mesh.GetSubdivisionSchemeAttr().Get() != UsdGeom.Tokens.none:
        raise UnsupportedError(f"{path}: only meshes of subdivisionScheme none are comparable")
    if UsdGeom.Subset.GetAllGeomSubsets(mesh) or mesh.GetHoleIndicesAttr().Get():
        raise UnsupportedError(f"{path}: subsets and holes are not read; author a mesh for each")
    points = np.array(mesh.GetPointsAttr().Get(), dtype=np.float32).reshape(-1, 3)
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get(), dtype=np.int64)
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get(), dtype=np.int64)
    normals = mesh.GetNormalsAttr().Get()
    st = UsdGeom.PrimvarsAPI(prim).GetPrimvar("st")
    uvs = st.ComputeFlattened() if st and st.HasValue() else None
    per_vertex: dict[str, NDArray[Any]] = {}
    per_corner: dict[str, NDArray[Any]] = {}
    for name, values, interpolation in (
        ("normals", normals, mesh.GetNormalsInterpolation()),
        ("uvs", uvs, st.GetInterpolation() if st else ""),
    ):
        if values is None:
            continue
        if interpolation in (UsdGeom.Tokens.vertex, UsdGeom.Tokens.varying):
            per_vertex[name] = np.array(values, dtype=np.float32)
        elif interpolation == UsdGeom.Tokens.faceVarying:
            per_corner[name] = np.array(values, dtype=np.float32)
        else:
            raise UnsupportedError(f"{path}: {name} of interpolation {interpolation} are not read")
    if per_corner:  # every corner becomes a point of its own
        points = points[corners]
        per_vertex = {name: values[corners] for name, values in per_vertex.items()} | per_corner
        corners = np.arange(len(corners))
    triangles = _fans(counts)
    if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
        triangles = triangles[:, ::-1]
    return scene.Mesh(
        name=str(path),
        material=materials.bound(prim),
        points=points,
        triangles=corners[triangles].astype(np.int32),
        normals=per_vertex.get("normals"),
        uvs=per_vertex.get("uvs"),
        placements=placements,
    )


def _fans(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Corners of the triangles of faces with these numbers of corners: fans, so convex faces."""
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    rows = []
    for step in range(1, int(counts.max(initial=2)) - 1):
        first = starts[counts > step + 1]
        rows.append(np.stack([first, first + step, first + step + 1], axis=-1))
    return np.concatenate(rows) if rows else np.zeros((0, 3), dtype=np.int64)


def _instances(prim: Usd.Prim, materials: _Materials) -> list[scene.Mesh]:
    """The meshes of a point instancer's prototypes with the places of their instances."""
    instancer = UsdGeom.PointInstancer(prim)
    time = Usd.TimeCode.Default()
    matrices = instancer.ComputeInstanceTransformsAtTime(time, time)
    indices = np.array(instancer.GetProtoIndicesAttr().Get())
    shown = np.array(instancer.ComputeMaskAtTime(time) or [True] * len(indices))[: len(indices)]
    indices = indices[shown] if len(matrices) != len(indices) else indices
    places = np.array([_columns(matrix) for matrix in matrices])
    result = []
    for i, target in enumerate(instancer.GetPrototypesRel().GetTargets()):
        root = prim.GetStage().GetPrimAtPath(target)
        into_root = np.linalg.inv(_world(root))
        for part in Usd.PrimRange(root):
            if part.IsA(UsdGeom.PointInstancer) or part.HasAPI(UsdLux.LightAPI):
                raise UnsupportedError(f"{part.GetPath()}: only meshes are read in prototypes")
            if part.IsA(UsdGeom.Gprim):
                within = into_root @ _world(part)
                placements = _world(prim) @ places[indices == i] @ within
                result.append(_mesh(part, materials, placements))
    return [mesh for mesh in result if len(mesh.placements)]


# ---- materials


class _Materials:
    """Translates each material and texture once."""

    def __init__(self, result: scene.Scene) -> None:
        self._scene = result
        self._materials: dict[str, int] = {}
        self._textures: dict[tuple[Any, ...], int] = {}

    def bound(self, prim: Usd.Prim) -> int:
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        if not material:
            raise UnsupportedError(f"{prim.GetPath()}: it has no material; bind one")
        path = str(material.GetPath())
        if path not in self._materials:
            self._materials[path] = len(self._scene.materials)
            self._scene.materials.append(self._read(material))
        return self._materials[path]

    def texture(self, key: tuple[Any, ...], image: scene.Floats) -> int:
        if key not in self._textures:
            self._textures[key] = len(self._scene.textures)
            self._scene.textures.append(image)
        return self._textures[key]

    def _read(self, material: UsdShade.Material) -> scene.Material:
        path = str(material.GetPath())
        shader = UsdShade.Shader(material.ComputeSurfaceSource()[0])
        if not shader or shader.GetIdAttr().Get() != "UsdPreviewSurface":
            raise UnsupportedError(f"{path}: only UsdPreviewSurface is comparable")

        def constant(name: str, fallback: Any) -> Any:
            source = shader.GetInput(name)
            if source and source.HasConnectedSource():
                raise UnsupportedError(f"{path}: a texture for {name} is not read")
            value = source.Get() if source else None
            return fallback if value is None else value

        def refuse(what: str) -> UnsupportedError:
            return UnsupportedError(f"{path}: {what} is modelled differently by the renderers")

        if any(constant("emissiveColor", (0, 0, 0))) or constant("clearcoat", 0.0):
            raise refuse("emissiveColor or clearcoat")
        if constant("useSpecularWorkflow", 0) or constant("opacityThreshold", 0.0):
            raise refuse("the specular workflow or opacityThreshold")
        if constant("displacement", 0.0) or shader.GetInput("normal"):
            raise refuse("displacement or normal")
        metallic, opacity = constant("metallic", 0.0), constant("opacity", 1.0)
        roughness, ior = float(constant("roughness", 0.5)), float(constant("ior", 1.5))
        if opacity == 0.0 and metallic == 0.0:
            if tuple(constant("diffuseColor", (0.18,) * 3)) != (1.0, 1.0, 1.0):
                raise refuse("glass whose diffuseColor is not white")
            return scene.Material(path, "glass", roughness=roughness, ior=ior)
        colour, texture = self._colour(path, shader)
        if opacity == 1.0 and metallic == 1.0:
            return scene.Material(path, "metal", colour, texture, roughness)
        if opacity == 1.0 and metallic == 0.0:
            if ior != 1.0:
                raise refuse(f"the coat of ior {ior:g} over a diffuse surface (1 has none)")
            return scene.Material(path, "diffuse", colour, texture)
        raise refuse("metallic or opacity between 0 and 1")

    def _colour(self, path: str, shader: UsdShade.Shader) -> tuple[Colour, int | None]:
        """diffuseColor: a constant or a texture."""
        source = shader.GetInput("diffuseColor")
        if not source or not source.HasConnectedSource():
            value = source.Get() if source else None
            return _colour3(value if value is not None else (0.18,) * 3), None
        node = UsdShade.Shader(source.GetConnectedSources()[0][0].source)
        if node.GetIdAttr().Get() != "UsdUVTexture":
            raise UnsupportedError(f"{path}: diffuseColor comes from no UsdUVTexture")
        for wrap in ("wrapS", "wrapT"):
            if node.GetInput(wrap).Get() != "repeat":
                raise UnsupportedError(f"{node.GetPath()}: only {wrap} = repeat is comparable")
        reader = node.GetInput("st")
        coordinates = UsdShade.Shader(reader.GetConnectedSources()[0][0].source)
        if coordinates.GetIdAttr().Get() != "UsdPrimvarReader_float2":
            raise UnsupportedError(f"{coordinates.GetPath()}: only a primvar reader is read")
        space = node.GetInput("sourceColorSpace")
        scale, bias = node.GetInput("scale"), node.GetInput("bias")
        key = (
            node.GetInput("file").Get().resolvedPath,
            space.Get() if space else "auto",
            tuple(scale.Get()) if scale else (1.0,) * 4,
            tuple(bias.Get()) if bias else (0.0,) * 4,
        )
        image = read_image(Path(key[0]), key[1])
        image = image * np.array(key[2][:3], np.float32) + np.array(key[3][:3], np.float32)
        return (1.0, 1.0, 1.0), self.texture(key, image)


def read_image(path: Path, colour_space: str = "auto") -> scene.Floats:
    """An image as linear float32 [height, width, 3]."""
    if path.suffix == ".exr":
        import OpenEXR

        with OpenEXR.File(str(path)) as file:
            channels = file.channels()
            return np.asarray(channels["RGB"].pixels, dtype=np.float32)
    from PIL import Image

    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB"), dtype=np.float32) / 255.0
    if colour_space == "raw":
        return pixels
    low, high = pixels / 12.92, ((pixels + 0.055) / 1.055) ** 2.4
    return np.where(pixels <= 0.04045, low, high).astype(np.float32)


# ---- lights


def _light(prim: Usd.Prim, result: scene.Scene, materials: _Materials) -> None:
    path = prim.GetPath()
    light = UsdLux.LightAPI(prim)
    if light.GetNormalizeAttr().Get() or light.GetEnableColorTemperatureAttr().Get():
        raise UnsupportedError(f"{path}: normalize and colour temperature are not read")
    if light.GetDiffuseAttr().Get() != 1.0 or light.GetSpecularAttr().Get() != 1.0:
        raise UnsupportedError(f"{path}: inputs:diffuse and inputs:specular have to be 1")
    if prim.HasAPI(UsdLux.ShapingAPI) and (
        UsdLux.ShapingAPI(prim).GetShapingConeAngleAttr().Get() != 90.0
        or UsdLux.ShapingAPI(prim).GetShapingFocusAttr().Get() != 0.0
    ):
        raise UnsupportedError(f"{path}: shaping is modelled differently by the renderers")
    strength = light.GetIntensityAttr().Get() * 2.0 ** light.GetExposureAttr().Get()
    red, green, blue = (float(c) * strength for c in light.GetColorAttr().Get())
    radiance = (red, green, blue)
    matrix = _world(prim)
    stretch = np.linalg.norm(matrix[:3, :3], axis=0)
    if prim.IsA(UsdLux.RectLight):
        rect = UsdLux.RectLight(prim)
        if rect.GetTextureFileAttr().Get():
            raise UnsupportedError(f"{path}: a texture on a rect light is not read")
        width, height = rect.GetWidthAttr().Get(), rect.GetHeightAttr().Get()
        result.rects.append(scene.RectLight(matrix, width, height, radiance))
    elif prim.IsA(UsdLux.SphereLight) and np.allclose(stretch, stretch[0], rtol=1e-5):
        radius = float(UsdLux.SphereLight(prim).GetRadiusAttr().Get() * stretch[0])
        x, y, z = matrix[:3, 3].tolist()
        result.spheres.append(scene.SphereLight((x, y, z), radius, radiance))
    elif prim.IsA(UsdLux.DomeLight):
        asset = UsdLux.DomeLight(prim).GetTextureFileAttr().Get()
        texture = None
        if asset and asset.path:
            image = read_image(Path(asset.resolvedPath))
            texture = materials.texture((asset.resolvedPath, "dome"), image)
        result.domes.append(scene.DomeLight(matrix, radiance, texture))
    else:
        kind = prim.GetTypeName()
        raise UnsupportedError(f"{path}: this {kind} is modelled differently by the renderers")


def _colour3(value: Any) -> Colour:
    red, green, blue = (float(c) for c in value)
    return red, green, blue


if __name__ == "__main__":
    try:
        scene.save(read(Path(sys.argv[1])), Path(sys.argv[2]))
    except UnsupportedError as error:
        sys.exit(f"{sys.argv[1]}: {error}")
