"""Small stages, OpenUSD's engine and its frame recorder, for tests that go through Hydra."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pxr import CameraUtil, Gf, Sdf, Usd, UsdAppUtils, UsdGeom, UsdImagingGL, UsdRender, UsdShade

from mbfeat import _core

PLUGIN = "HdMBFeatRendererPlugin"
QUAD = [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)]


def make_stage(light: float = 1.0) -> Usd.Stage:
    """A Y-up stage with a camera at z = 8 that looks at the origin, and a uniform dome."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    camera = UsdGeom.Camera.Define(stage, "/World/camera")
    camera.CreateClippingRangeAttr(Gf.Vec2f(0.1, 1000.0))
    camera.CreateHorizontalApertureAttr(20.0)
    camera.CreateVerticalApertureAttr(10.0)
    camera.CreateFocalLengthAttr(40.0)
    UsdGeom.Xformable(camera).AddTranslateOp().Set(Gf.Vec3d(0.0, 0.0, 8.0))
    if light > 0.0:
        dome = stage.DefinePrim("/World/dome", "DomeLight")
        dome.CreateAttribute("inputs:intensity", Sdf.ValueTypeNames.Float).Set(light)
    return stage


def add_quad(stage: Usd.Stage, path: str = "/World/quad") -> UsdGeom.Mesh:
    """A square of side 2 in the plane z = 0, facing the camera."""
    return add_mesh(stage, path, QUAD, [4], [0, 1, 2, 3])


def add_mesh(
    stage: Usd.Stage, path: str, points: Any, counts: list[int], indices: list[int]
) -> UsdGeom.Mesh:
    """A polygon mesh of these points and faces."""
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(points)
    mesh.CreateFaceVertexCountsAttr(counts)
    mesh.CreateFaceVertexIndicesAttr(indices)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    return mesh


def add_material(stage: Usd.Stage, path: str, color: tuple[float, float, float]) -> UsdShade.Shader:
    """A UsdPreviewSurface of that diffuse colour; the shader is returned."""
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*color))
    output = shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput().ConnectToSource(output)
    return shader


def bind(prim: Usd.Prim, material_path: str) -> None:
    """Binds a material to a prim."""
    material = UsdShade.Material(prim.GetStage().GetPrimAtPath(material_path))
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)


def add_settings(
    stage: Usd.Stage, resolution: tuple[int, int] = (32, 16), **settings: Any
) -> UsdRender.Settings:
    """/Render/settings with the stage's camera; keywords are mbfeat:* settings."""
    prim = UsdRender.Settings.Define(stage, "/Render/settings")
    prim.CreateResolutionAttr(Gf.Vec2i(*resolution))
    prim.CreateCameraRel().SetTargets(["/World/camera"])
    types = {int: Sdf.ValueTypeNames.Int, float: Sdf.ValueTypeNames.Float}
    for name, value in {"samplesPerPixel": 4, **settings}.items():
        kind = types.get(type(value), Sdf.ValueTypeNames.Token)
        prim.GetPrim().CreateAttribute(f"mbfeat:{name}", kind).Set(value)
    return prim


def add_var(
    stage: Usd.Stage,
    name: str,
    source: str,
    source_type: str = "raw",
    *,
    layer: str = "",
    stored_as: str = "",
) -> Sdf.Path:
    """A RenderVar; `layer` and `stored_as` are driver:parameters:aov:name and :format."""
    var = UsdRender.Var.Define(stage, f"/Render/{name}")
    var.CreateSourceNameAttr(source)
    var.CreateSourceTypeAttr(source_type)
    for key, value in (("name", layer), ("format", stored_as)):
        if value:
            attribute = f"driver:parameters:aov:{key}"
            var.GetPrim().CreateAttribute(attribute, Sdf.ValueTypeNames.String).Set(value)
    return var.GetPath()


def add_product(
    stage: Usd.Stage, name: str, file: Path | str, variables: Iterable[Sdf.Path]
) -> UsdRender.Product:
    """A RenderProduct of /Render/settings."""
    product = UsdRender.Product.Define(stage, f"/Render/{name}")
    product.CreateProductNameAttr(str(file))
    product.CreateOrderedVarsRel().SetTargets(list(variables))
    UsdRender.Settings(stage.GetPrimAtPath("/Render/settings")).CreateProductsRel().AddTarget(
        product.GetPath()
    )
    return product


def record(stage: Usd.Stage, file: Path | str, width: int = 32) -> bool:
    """One frame through a frame recorder of its own, without GPU and camera light."""
    recorder = UsdAppUtils.FrameRecorder(PLUGIN, False)
    recorder.SetImageWidth(width)
    recorder.SetColorCorrectionMode("disabled")
    recorder.SetCameraLightEnabled(False)
    recorder.SetDomeLightVisibility(True)
    if stage.GetPrimAtPath("/Render/settings"):
        recorder.SetActiveRenderSettingsPrimPath("/Render/settings")
    _core.Host.drop_last_frame()
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/World/camera"))
    return bool(recorder.Record(stage, camera, Usd.TimeCode(1), str(file)))


def last_frame() -> _core.FinishedFrame:
    """The last finished render of this process; there must be one."""
    frame = _core.Host.last_frame()
    assert frame is not None
    return frame


def last_film(index: int = 0) -> _core.Film:
    """A film of the last finished render of this process."""
    return last_frame().images[index][0]


class EngineHost:
    """A UsdImagingGL engine without GPU on a stage, as an interactive application drives it."""

    def __init__(self, stage: Usd.Stage, width: int = 32, height: int = 16) -> None:
        self.stage = stage
        parameters = UsdImagingGL.Engine.Parameters()
        parameters.rendererPluginId = PLUGIN
        parameters.gpuEnabled = False
        self.engine = UsdImagingGL.Engine(parameters)
        self.resize(width, height)
        self.engine.SetCameraPath("/World/camera")
        self.engine.SetRendererAov("color")
        self.parameters = UsdImagingGL.RenderParams()
        self.parameters.frame = Usd.TimeCode(1)

    def resize(self, width: int, height: int) -> None:
        """Gives the viewport another size."""
        self.engine.SetRenderBufferSize(Gf.Vec2i(width, height))
        window = Gf.Range2f(Gf.Vec2f(0.0, 0.0), Gf.Vec2f(width, height))
        data = Gf.Rect2i(Gf.Vec2i(0, 0), width, height)
        self.engine.SetFraming(CameraUtil.Framing(window, data, 1.0))

    def set(self, **settings: Any) -> None:
        """Sets mbfeat:* settings as a host does."""
        for name, value in settings.items():
            self.engine.SetRendererSetting(f"mbfeat:{name}", value)

    def render_once(self) -> None:
        """One execution, as a viewer makes for each of its frames."""
        self.engine.Render(self.stage.GetPseudoRoot(), self.parameters)

    def converge(self, timeout: float = 120.0) -> _core.Film:
        """Renders until the engine says that the image is finished; its film."""
        end = time.monotonic() + timeout
        self.render_once()
        while not self.engine.IsConverged():
            if time.monotonic() > end:
                raise TimeoutError(f"not converged: {dict(self.engine.GetRenderStats())}")
            time.sleep(0.002)
            self.render_once()
        return last_film()

    def stats(self) -> dict[str, Any]:
        """The render statistics."""
        return dict(self.engine.GetRenderStats())

    def dump(self, file: Path | str) -> str:
        """The translated scene as text; converge() first."""
        if not self.engine.InvokeRendererCommand("dumpScene", {"file": str(file)}):
            raise RuntimeError("the scene could not be dumped")
        return Path(file).read_text(encoding="utf-8")


def run_scenario(
    name: str, scene_index: bool, folder: Path, script: str = "engine_scenarios.py"
) -> dict[str, Any]:
    """Runs a function of the script in a process of its own, in one of Hydra's modes.

    The mode is an environment variable that OpenUSD reads once a process. Returns what the
    function returned.
    """
    environment = {**os.environ, "USDIMAGINGGL_ENGINE_ENABLE_SCENE_INDEX": str(int(scene_index))}
    finished = subprocess.run(
        [sys.executable, str(Path(__file__).with_name(script)), name, str(folder)],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    if finished.returncode != 0:
        raise AssertionError(f"{name} ended with {finished.returncode}:\n{finished.stderr}")
    return dict(json.loads(finished.stdout.strip().splitlines()[-1]))
