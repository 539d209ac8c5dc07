"""Scenarios of interactive hosts: what UsdImagingGL's engine does with MBFeat, one a process.

Called as ``engine_scenarios.py NAME FOLDER``; prints the function's result as one line of JSON.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

import hydrakit
from mbfeat import _core

PREVIEW = "UsdPreviewSurface"


def mean_color(film: _core.Film) -> list[float]:
    return [float(v) for v in film.resolve("color")[..., :3].mean(axis=(0, 1))]


def geometry_of(dump: str, path: str) -> list[str]:
    """The lines of one geometry of a scene dump."""
    lines = dump.splitlines()
    start = next(i for i, line in enumerate(lines) if line == f"geometry {path}")
    body = []
    for line in lines[start + 1 :]:
        if not line.startswith(" "):
            break
        body.append(line.strip())
    return body


def edits(folder: Path) -> dict[str, Any]:
    """Edits of a stage between renders: colour, place, visibility, removal, a new prim, camera."""
    stage = hydrakit.make_stage()
    quad = hydrakit.add_quad(stage)
    shader = hydrakit.add_material(stage, "/World/red", (0.5, 0.0, 0.0))
    hydrakit.bind(quad.GetPrim(), "/World/red")
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=4)
    host.engine.SetRendererAov("primId")
    result: dict[str, Any] = {}

    def look(name: str) -> None:
        film = host.converge()
        albedo = film.resolve("color")[8, 16, :3]
        hit = film.resolve("primId")[..., 0] >= 0
        columns = np.flatnonzero(hit.any(axis=0))
        result[name] = {
            "center": [float(v) for v in albedo],
            "pixels": int(hit.sum()),
            "columns": [int(columns[0]), int(columns[-1])] if columns.size else [],
        }

    look("first")
    look("again")
    shader.GetInput("diffuseColor").Set(Gf.Vec3f(0.0, 0.5, 0.0))
    look("green")
    UsdGeom.Xformable(quad).AddTranslateOp().Set(Gf.Vec3d(1.0, 0.0, 0.0))
    look("moved")
    UsdGeom.Imageable(quad).MakeInvisible()
    look("hidden")
    UsdGeom.Imageable(quad).MakeVisible()
    look("shown")
    hydrakit.add_quad(stage, "/World/second")
    look("added")
    stage.RemovePrim("/World/quad")
    look("removed")
    UsdGeom.Xformable(stage.GetPrimAtPath("/World/camera")).GetOrderedXformOps()[0].Set(
        Gf.Vec3d(0.0, 0.0, 4.0)
    )
    look("nearer")
    host.resize(64, 32)
    result["resized"] = list(host.converge().resolution)
    points = UsdGeom.Mesh(stage.GetPrimAtPath("/World/second")).GetPointsAttr()
    points.Set([Gf.Vec3f(p) * 0.5 for p in points.Get()])
    result["shrunk"] = geometry_of(host_dump(host, folder), "/World/second")
    return result


def host_dump(host: hydrakit.EngineHost, folder: Path) -> str:
    host.converge()
    return host.dump(folder / "scene.txt")


def view_aov(folder: Path) -> dict[str, Any]:
    """Every AOV of the table, bound by name and shown in place of color."""
    stage = hydrakit.make_stage()
    hydrakit.add_quad(stage)
    host = hydrakit.EngineHost(stage, 8, 4)
    host.set(samplesPerPixel=1)
    names = [aov.name for aov in _core.aov_table()]
    settings = {s.key: s.name for s in host.engine.GetRendererSettingsList()}
    missing = [s.name for s in _core.setting_table() if s.name not in settings]
    unnamed = [n for n in names if n not in settings["mbfeat:viewAov"]]
    not_bound, not_shown = [], []
    for name in names:
        host.engine.SetRendererAov(name)
        if name not in [aov.name for aov in host.converge().aovs]:
            not_bound.append(name)
        # Hosts that need identifiers write underscores for colons.
        host.engine.SetRendererAov(name.replace(":", "_"))
        if name not in [aov.name for aov in host.converge().aovs]:
            not_bound.append(name.replace(":", "_"))
    host.engine.SetRendererAov("color")
    for name in names:
        host.set(viewAov=name)
        if name not in [aov.name for aov in host.converge().aovs]:
            not_shown.append(name)
    host.set(viewAov="mbfeat:albedoo:0")
    return {
        "missing": missing,
        "unnamed": unnamed,
        "not_bound": not_bound,
        "not_shown": not_shown,
        "with_wrong_name": next(aov.name for aov in host.converge().aovs),
    }


def restart(folder: Path) -> dict[str, Any]:
    """Seconds that an execution takes which must stop a long render and start the next."""
    stage = hydrakit.make_stage()
    quad = hydrakit.add_quad(stage)
    shader = hydrakit.add_material(stage, "/World/red", (0.5, 0.0, 0.0))
    hydrakit.bind(quad.GetPrim(), "/World/red")
    host = hydrakit.EngineHost(stage, 256, 128)
    host.set(samplesPerPixel=65536)
    place = UsdGeom.Xformable(stage.GetPrimAtPath("/World/camera")).GetOrderedXformOps()[0]
    host.render_once()
    seconds: dict[str, list[float]] = {"camera": [], "prim": []}
    fractions = []
    for i in range(8):
        time.sleep(0.1)
        edit = "camera" if i % 2 else "prim"
        begin = time.monotonic()
        if edit == "camera":
            place.Set(Gf.Vec3d(0.0, 0.0, 8.0 + i))
        else:
            shader.GetInput("diffuseColor").Set(Gf.Vec3f(0.1 * i))
        host.render_once()
        seconds[edit].append(time.monotonic() - begin)
        fractions.append(host.stats()["fractionDone"])
    return {"seconds": seconds, "fractions": fractions, "converged": host.engine.IsConverged()}


def impatient(folder: Path) -> dict[str, Any]:
    """Executions a second of a host that asks without a pause whether the image is finished."""
    stage = hydrakit.make_stage()
    hydrakit.add_quad(stage)
    host = hydrakit.EngineHost(stage, 64, 64)
    host.set(samplesPerPixel=65536)
    host.render_once()
    executions = 0
    begin = time.monotonic()
    while time.monotonic() - begin < 0.3:
        host.render_once()
        executions += 1
    seconds = time.monotonic() - begin
    return {"rate": executions / seconds, "converged": host.engine.IsConverged()}


def pause_stop(folder: Path) -> dict[str, Any]:
    """Pausing holds the progress, stopping ends it, restarting begins anew."""
    stage = hydrakit.make_stage()
    hydrakit.add_quad(stage)
    host = hydrakit.EngineHost(stage, 128, 64)
    host.set(samplesPerPixel=65536)
    host.render_once()
    time.sleep(0.2)
    host.engine.PauseRenderer()
    time.sleep(0.3)
    first = host.stats()["fractionDone"]
    time.sleep(0.3)
    second = host.stats()["fractionDone"]
    stage_name = host.stats()["rendererStage"]
    host.engine.ResumeRenderer()
    time.sleep(0.4)
    third = host.stats()["fractionDone"]
    host.engine.StopRenderer()
    host.render_once()
    stopped = {"converged": host.engine.IsConverged(), "stage": host.stats()["rendererStage"]}
    host.engine.RestartRenderer()
    host.set(samplesPerPixel=2)
    film = host.converge()
    return {
        "fractions": [first, second, third],
        "paused": stage_name,
        "stopped": stopped,
        "samples": int(film.sample_counts.min()),
    }


def two_delegates(folder: Path) -> dict[str, Any]:
    """A delegate that dies in mid-render does not disturb another one."""
    stage = hydrakit.make_stage()
    hydrakit.add_quad(stage)
    alone = hydrakit.EngineHost(stage)
    alone.set(samplesPerPixel=16)
    expected = alone.converge().resolve("color")
    doomed = hydrakit.EngineHost(stage, 256, 128)
    doomed.set(samplesPerPixel=65536)
    doomed.render_once()
    other = hydrakit.EngineHost(stage)
    other.set(samplesPerPixel=16)
    other.render_once()
    del doomed.engine
    film = other.converge()
    return {"equal": bool((film.resolve("color") == expected).all())}


def instances(folder: Path) -> dict[str, Any]:
    """A point instancer in a point instancer, and native instances."""
    stage = hydrakit.make_stage()
    outer = UsdGeom.PointInstancer.Define(stage, "/World/outer")
    outer.CreatePositionsAttr([Gf.Vec3f(0, 0, 0), Gf.Vec3f(0, 10, 0)])
    outer.CreateProtoIndicesAttr([0, 0])
    UsdGeom.Xformable(outer).AddTranslateOp().Set(Gf.Vec3d(0.0, 0.0, 100.0))
    inner = UsdGeom.PointInstancer.Define(stage, "/World/outer/inner")
    inner.CreatePositionsAttr([Gf.Vec3f(1, 0, 0), Gf.Vec3f(2, 0, 0), Gf.Vec3f(3, 0, 0)])
    inner.CreateProtoIndicesAttr([0, 0, 0])
    inner.CreateScalesAttr([Gf.Vec3f(1), Gf.Vec3f(2), Gf.Vec3f(1)])
    inner.CreateOrientationsAttr([Gf.Quath(1, 0, 0, 0)] * 2 + [Gf.Quath(0, 0, 0, 1)])
    prototype = hydrakit.add_quad(stage, "/World/outer/inner/quad")
    UsdGeom.Xformable(prototype).AddTranslateOp().Set(Gf.Vec3d(0.5, 0.0, 0.0))
    inner.CreatePrototypesRel().SetTargets([prototype.GetPath()])
    outer.CreatePrototypesRel().SetTargets([inner.GetPath()])
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=1)
    lines = [line.strip() for line in host_dump(host, folder).splitlines()]
    return {"transforms": [line for line in lines if line.startswith("transform")]}


def shapes(folder: Path) -> dict[str, Any]:
    """The implicit surfaces arrive as meshes of the right size."""
    stage = hydrakit.make_stage()
    UsdGeom.Sphere.Define(stage, "/World/sphere").CreateRadiusAttr(2.0)
    UsdGeom.Cube.Define(stage, "/World/cube").CreateSizeAttr(4.0)
    UsdGeom.Cone.Define(stage, "/World/cone").CreateHeightAttr(4.0)
    UsdGeom.Cylinder.Define(stage, "/World/cylinder").CreateHeightAttr(4.0)
    UsdGeom.Capsule.Define(stage, "/World/capsule").CreateHeightAttr(4.0)
    UsdGeom.Plane.Define(stage, "/World/plane").CreateWidthAttr(4.0)
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=1)
    dump = host_dump(host, folder)
    result = {}
    for name in ("sphere", "cube", "cone", "cylinder", "capsule", "plane"):
        lines = geometry_of(dump, f"/World/{name}")
        bounds = next(line for line in lines if line.startswith("bounds"))
        numbers = bounds.removeprefix("bounds ").replace(",", "").split()
        result[name] = [round(float(n), 3) for n in numbers]
    return result


def subsets(folder: Path) -> dict[str, Any]:
    """Subsets take their own materials, the rest the mesh's."""
    stage = hydrakit.make_stage()
    points = [(x, y, 0.0) for y in range(2) for x in range(5)]
    faces = [i for x in range(4) for i in (x, x + 1, x + 6, x + 5)]
    mesh = hydrakit.add_mesh(stage, "/World/strip", points, [4] * 4, faces)
    for name in ("mesh", "a", "b"):
        hydrakit.add_material(stage, f"/World/{name}", (0.5, 0.5, 0.5))
    hydrakit.bind(mesh.GetPrim(), "/World/mesh")
    for name, indices in (("a", [1]), ("b", [2, 3])):
        subset = UsdGeom.Subset.CreateGeomSubset(mesh, name, "face", indices, "materialBind")
        hydrakit.bind(subset.GetPrim(), f"/World/{name}")
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=1)
    lines = geometry_of(host_dump(host, folder), "/World/strip")
    return {"slots": [line.split("'")[1] for line in lines if line.startswith("material slot")]}


def primvars_on_demand(folder: Path) -> dict[str, Any]:
    """Meshes keep the primvars that materials read, also of a material that is edited later."""
    stage = hydrakit.make_stage()
    quad = hydrakit.add_quad(stage)
    api = UsdGeom.PrimvarsAPI(quad)
    for name in ("tint", "unused"):
        primvar = api.CreatePrimvar(name, Sdf.ValueTypeNames.Color3fArray, "vertex")
        primvar.Set([Gf.Vec3f(0.1 * i) for i in range(4)])
    shader = hydrakit.add_material(stage, "/World/look", (0.5, 0.5, 0.5))
    hydrakit.bind(quad.GetPrim(), "/World/look")
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=1)
    before = geometry_of(host_dump(host, folder), "/World/quad")
    reader = UsdShade.Shader.Define(stage, "/World/look/reader")
    reader.CreateIdAttr("UsdPrimvarReader_float3")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("tint")
    output = reader.CreateOutput("result", Sdf.ValueTypeNames.Float3)
    shader.GetInput("diffuseColor").ConnectToSource(output)
    after = geometry_of(host_dump(host, folder), "/World/quad")

    def primvars(lines: list[str]) -> list[str]:
        return [line.split("'")[1] for line in lines if line.startswith("primvar")]

    return {"before": primvars(before), "after": primvars(after)}


def materialx(folder: Path) -> dict[str, Any]:
    """MaterialX surfaces become the nearest UsdPreviewSurface inputs."""
    stage = hydrakit.make_stage()
    color, number = Sdf.ValueTypeNames.Color3f, Sdf.ValueTypeNames.Float
    surfaces: dict[str, tuple[str, dict[str, Any]]] = {
        "gold": ("open_pbr_surface", {"base_color": (0.9, 0.8, 0.4), "base_metalness": 1.0}),
        "glass": (
            "standard_surface",
            {"base": 0.0, "transmission": 1.0, "transmission_color": (0.5, 1.0, 0.5)},
        ),
        "lamp": ("standard_surface", {"emission": 3.0, "emission_color": (1.0, 0.5, 0.25)}),
        "leaf": ("gltf_pbr", {"alpha_mode": 1.0, "alpha": 0.25, "metallic": 0.0}),
    }
    for index, (name, (model, inputs)) in enumerate(surfaces.items()):
        quad = hydrakit.add_quad(stage, f"/World/quad{index}")
        material = UsdShade.Material.Define(stage, f"/World/{name}")
        shader = UsdShade.Shader.Define(stage, f"/World/{name}/surface")
        shader.CreateIdAttr(f"ND_{model}_surfaceshader")
        for key, value in inputs.items():
            kind = color if isinstance(value, tuple) else number
            shader.CreateInput(key, kind).Set(value)
        output = shader.CreateOutput("out", Sdf.ValueTypeNames.Token)
        material.CreateSurfaceOutput("mtlx").ConnectToSource(output)
        hydrakit.bind(quad.GetPrim(), f"/World/{name}")
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=1)
    dump = host_dump(host, folder).splitlines()
    result = {}
    for name in surfaces:
        start = next(i for i, line in enumerate(dump) if line.endswith(f"/World/{name}"))
        lines = [line.strip().split(" ", 1) for line in dump[start + 1 : start + 14]]
        result[name] = {line[0]: line[-1] for line in lines}
    return result


def purposes(folder: Path) -> dict[str, Any]:
    """Whether a quad is seen while its purpose and the purposes that are shown change."""
    stage = hydrakit.make_stage()
    quad = hydrakit.add_quad(stage)
    purpose = quad.CreatePurposeAttr()
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=1)
    host.engine.SetRendererAov("primId")
    result: dict[str, Any] = {}

    def look(name: str) -> None:
        result[name] = bool((host.converge().resolve("primId") >= 0).any())

    look("default")
    purpose.Set(UsdGeom.Tokens.guide)
    look("guide")
    host.parameters.showGuides = True
    look("guides shown")
    host.parameters.showGuides = False
    look("guides hidden")
    purpose.Set(UsdGeom.Tokens.default_)
    look("default again")
    purpose.Set(UsdGeom.Tokens.guide)
    look("guide again")
    return result


def placements(host: hydrakit.EngineHost, folder: Path) -> list[str]:
    """The transforms of everything in the scene that is rendered."""
    dump = host_dump(host, folder)
    paths = [line.split()[1] for line in dump.splitlines() if line.startswith("geometry ")]
    lines = [line for path in paths for line in geometry_of(dump, path)]
    return [line.removeprefix("transform ") for line in lines if line.startswith("transform ")]


def instance_attributes(folder: Path) -> dict[str, Any]:
    """Transforms of an instance whose attributes are blocked one after the other."""
    stage = hydrakit.make_stage()
    instancer = UsdGeom.PointInstancer.Define(stage, "/World/instancer")
    instancer.CreatePositionsAttr([Gf.Vec3f(5, 0, 0)])
    instancer.CreateProtoIndicesAttr([0])
    scales = instancer.CreateScalesAttr([Gf.Vec3f(2)])
    orientations = instancer.CreateOrientationsAttr([Gf.Quath(0, 0, 0, 1)])
    prototype = hydrakit.add_quad(stage, "/World/instancer/quad")
    instancer.CreatePrototypesRel().SetTargets([prototype.GetPath()])
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=1)
    result = {"all": placements(host, folder)}
    scales.Block()
    result["no scales"] = placements(host, folder)
    orientations.Block()
    result["no orientations"] = placements(host, folder)
    scales.Set([Gf.Vec3f(3)])
    result["scales again"] = placements(host, folder)
    return result


def instancer_visibility(folder: Path) -> dict[str, Any]:
    """Number of placements while a point instancer, the one around it and its parent are hidden."""
    stage = hydrakit.make_stage()
    parent = UsdGeom.Xform.Define(stage, "/World/parent")
    outer = UsdGeom.PointInstancer.Define(stage, "/World/parent/outer")
    # With scene indices OpenUSD makes the roots of prototypes visible whatever is authored.
    prototype = UsdGeom.Xform.Define(stage, "/World/parent/outer/prototype")
    inner = UsdGeom.PointInstancer.Define(stage, "/World/parent/outer/prototype/inner")
    for instancer in (outer, inner):
        instancer.CreatePositionsAttr([Gf.Vec3f(0, 0, 0), Gf.Vec3f(0, 10, 0)])
        instancer.CreateProtoIndicesAttr([0, 0])
    quad = hydrakit.add_quad(stage, "/World/parent/outer/prototype/inner/quad")
    inner.CreatePrototypesRel().SetTargets([quad.GetPath()])
    outer.CreatePrototypesRel().SetTargets([prototype.GetPath()])
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=1)
    result = {"visible": len(placements(host, folder))}
    for name, prim in (("inner", inner), ("outer", outer), ("parent", parent)):
        UsdGeom.Imageable(prim).MakeInvisible()
        result[f"{name} hidden"] = len(placements(host, folder))
        UsdGeom.Imageable(prim).MakeVisible()
        result[f"{name} shown"] = len(placements(host, folder))
    return result


def native_instance_visibility(folder: Path) -> dict[str, Any]:
    """Number of placements while native instances of one prototype are hidden."""
    stage = hydrakit.make_stage()
    stage.CreateClassPrim("/Source")
    hydrakit.add_quad(stage, "/Source/quad")
    instances = []
    for name in ("first", "second"):
        instance = UsdGeom.Xform.Define(stage, f"/World/{name}")
        instance.GetPrim().GetReferences().AddInternalReference("/Source")
        instance.GetPrim().SetInstanceable(True)
        instances.append(UsdGeom.Imageable(instance))
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=1)
    result = {"both": len(placements(host, folder))}
    instances[0].MakeInvisible()
    result["second"] = len(placements(host, folder))
    instances[1].MakeInvisible()
    result["none"] = len(placements(host, folder))
    instances[0].MakeVisible()
    result["first"] = len(placements(host, folder))
    return result


def repairs(folder: Path) -> dict[str, Any]:
    """Warnings and whether an abort holds the image back, as data turns bad and is repaired."""
    stage = hydrakit.make_stage()
    quad = hydrakit.add_quad(stage)
    shader = hydrakit.add_material(stage, "/World/look", (0.5, 0.5, 0.5))
    hydrakit.bind(quad.GetPrim(), "/World/look")
    lamp = UsdLux.SphereLight.Define(stage, "/World/lamp")
    UsdGeom.Xformable(lamp).AddTranslateOp().Set(Gf.Vec3d(0.0, 0.0, 50.0))
    radius = lamp.CreateRadiusAttr(0.5)
    focal = stage.GetPrimAtPath("/World/camera").GetAttribute("focalLength")
    scale = UsdGeom.Xformable(quad).AddScaleOp()
    scale.Set(Gf.Vec3f(1.0))
    points = quad.GetPointsAttr()
    good = points.Get()
    bad = [Gf.Vec3f(math.nan), *good[1:]]
    texture = UsdShade.Shader.Define(stage, "/World/look/texture")
    texture.CreateIdAttr("UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(str(folder / "missing.png"))
    texture.CreateInput("st", Sdf.ValueTypeNames.Float2).Set(Gf.Vec2f(0.5, 0.5))
    texture_output = texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
    color = shader.GetInput("diffuseColor")
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=1, onError="abort")
    result: dict[str, Any] = {}

    def look(name: str) -> None:
        host.converge()
        report = hydrakit.last_frame().report
        result[name] = [report.warnings, len(report.errors)]

    look("good")
    changes: list[tuple[str, Callable[[], Any], Callable[[], Any]]] = [
        ("points", lambda: points.Set(bad), lambda: points.Set(good)),
        ("scale", lambda: scale.Set(Gf.Vec3f(0.0)), lambda: scale.Set(Gf.Vec3f(1.0))),
        ("radius", lambda: radius.Set(math.nan), lambda: radius.Set(0.5)),
        ("focalLength", lambda: focal.Set(0.0), lambda: focal.Set(40.0)),
        ("shader", lambda: shader.CreateIdAttr("None"), lambda: shader.CreateIdAttr(PREVIEW)),
        ("texture", lambda: color.ConnectToSource(texture_output), color.DisconnectSource),
        ("setting", lambda: host.set(maxBounces=-3), lambda: host.set(maxBounces=3)),
        ("viewAov", lambda: host.set(viewAov="nothing"), lambda: host.set(viewAov="")),
    ]
    for name, spoil, repair in changes:
        spoil()
        look(f"{name} spoilt")
        repair()
        look(f"{name} repaired")
    points.Set(good, 1.0)
    points.Set(bad, 2.0)
    points.Set(good, 3.0)
    for frame in (1.0, 2.0, 3.0):
        host.parameters.frame = Usd.TimeCode(frame)
        look(f"frame {frame:.0f}")
    return result


def shadows(folder: Path) -> dict[str, Any]:
    """Brightness of a quad whose sun stands behind a wall, as its shadows go off and on."""
    stage = hydrakit.make_stage(0.0)
    hydrakit.add_quad(stage)
    wall = UsdGeom.Xformable(hydrakit.add_quad(stage, "/World/wall"))  # behind the camera
    wall.AddTranslateOp().Set(Gf.Vec3d(0.0, 0.0, 20.0))
    wall.AddScaleOp().Set(Gf.Vec3f(9.0))
    sun = UsdLux.DistantLight.Define(stage, "/World/sun")
    enabled = UsdLux.ShadowAPI.Apply(sun.GetPrim()).CreateShadowEnableAttr()
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=4)
    result: dict[str, Any] = {}
    for name, value in (("on", True), ("off", False), ("on again", True)):
        enabled.Set(value)
        result[name] = float(host.converge().resolve("color")[8, 16, 0])
    return result


SCENARIOS: dict[str, Callable[[Path], dict[str, Any]]] = {
    function.__name__: function
    for function in (
        edits,
        view_aov,
        restart,
        impatient,
        pause_stop,
        two_delegates,
        instances,
        shapes,
        subsets,
        primvars_on_demand,
        materialx,
        purposes,
        instance_attributes,
        instancer_visibility,
        native_instance_visibility,
        repairs,
        shadows,
    )
}

if __name__ == "__main__":
    print(json.dumps(SCENARIOS[sys.argv[1]](Path(sys.argv[2]))))
