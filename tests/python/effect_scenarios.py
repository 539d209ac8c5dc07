"""Edits that bring effects and take them away, in an interactive host, one scenario a process.

Called as ``effect_scenarios.py NAME FOLDER``; prints the function's result as one line of JSON.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pxr import Gf, Sdf, UsdGeom, UsdLux, UsdShade

import hydrakit

FLOAT = Sdf.ValueTypeNames.Float


class Watcher:
    """Renders after each edit and keeps what the report says of it."""

    def __init__(self, host: hydrakit.EngineHost) -> None:
        self.host = host
        self.seen: dict[str, Any] = {}
        self.images: dict[str, Any] = {}

    def look(self, name: str) -> None:
        film = self.host.converge()
        report: Any = hydrakit.last_frame().report.to_dict()
        self.images[name] = film.resolve("color")
        self.seen[name] = {
            "present": report["effects"]["present"],
            "askedBy": report["effects"]["askedBy"],
            "prebuilt": report["kernel"]["prebuilt"],
            "handled": report["kernel"]["handled"],
            "builds": report["builds"],
            "memory": report["memory"],
        }


def diffuse_stage() -> tuple[Any, UsdShade.Shader]:
    """A Lambert quad under a dome, and the quad's shader."""
    stage = hydrakit.make_stage()
    quad = hydrakit.add_quad(stage)
    shader = hydrakit.add_material(stage, "/World/look", (0.5, 0.4, 0.3))
    shader.CreateInput("ior", FLOAT).Set(1.0)
    hydrakit.bind(quad.GetPrim(), "/World/look")
    return stage, shader


def on_the_fly(folder: Path) -> dict[str, Any]:
    """Effects come and go, one after the other."""
    stage, shader = diffuse_stage()
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=4)
    watcher = Watcher(host)
    look = watcher.look
    look("first")

    opacity = shader.CreateInput("opacity", FLOAT)
    opacity.Set(0.3)
    look("glass")
    opacity.Set(1.0)
    look("no glass")

    dome = UsdLux.DomeLight(stage.GetPrimAtPath("/World/dome"))
    texture = Path(__file__).resolve().parents[1] / "scenes" / "textures" / "checker.png"
    dome.CreateTextureFileAttr().Set(Sdf.AssetPath(str(texture)))
    look("textured dome")
    dome.GetTextureFileAttr().Set(Sdf.AssetPath(""))
    look("plain dome")

    camera = UsdGeom.Camera(stage.GetPrimAtPath("/World/camera"))
    camera.CreateFStopAttr(1.0)
    camera.CreateFocusDistanceAttr(4.0)
    look("lens")
    host.set(blur=False)
    look("no blur")
    host.set(blur=True)
    camera.GetFStopAttr().Set(0.0)
    look("pinhole")

    host.engine.SetRendererAov("mbfeat:albedo:1")
    look("features")
    host.engine.SetRendererAov("color")
    look("no features")

    shader.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(1.0))
    look("glows")
    shader.GetInput("emissiveColor").Set(Gf.Vec3f(0.0))
    look("glows no more")
    same = [
        bool((watcher.images[name] == watcher.images["first"]).all())
        for name in ("no glass", "plain dome", "no blur", "pinhole", "no features", "glows no more")
    ]
    return {"seen": watcher.seen, "same": same}


def requests(folder: Path) -> dict[str, Any]:
    """The setting mbfeat:effects: the full kernel, an effect more, an effect less."""
    stage, shader = diffuse_stage()
    shader.CreateInput("clearcoat", FLOAT).Set(1.0)
    shader.GetInput("ior").Set(1.5)
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=4)
    watcher = Watcher(host)
    watcher.look("auto")
    host.set(effects="full")
    watcher.look("full")
    host.set(effects="auto, +transmission")
    watcher.look("more")
    host.set(effects="-clearcoat")
    watcher.look("less")
    host.set(effects="auto")
    watcher.look("auto again")
    shader.GetInput("clearcoat").Set(0.0)
    watcher.look("none")
    images = watcher.images
    return {
        "seen": watcher.seen,
        "same": [bool((images[n] == images["auto"]).all()) for n in ("full", "more", "auto again")],
        "less is none": bool((images["less"] == images["none"]).all()),
        "less is auto": bool((images["less"] == images["auto"]).all()),
    }


def many_lights(folder: Path) -> dict[str, Any]:
    """Lights that are met one by one are not in the acceleration structure, more of them are."""
    stage, _ = diffuse_stage()
    host = hydrakit.EngineHost(stage)
    host.set(samplesPerPixel=1)
    watcher = Watcher(host)
    watcher.look("none")
    lamps = []
    for i in range(9):
        lamp = UsdLux.SphereLight.Define(stage, f"/World/lamp{i}")
        lamp.CreateRadiusAttr(0.1)
        UsdGeom.Xformable(lamp).AddTranslateOp().Set(Gf.Vec3d(0.3 * i, 2.0, 1.0))
        lamps.append(lamp)
        if i == 3:
            watcher.look("four")
    watcher.look("nine")
    lamps[0].CreateIntensityAttr(3.0)
    watcher.look("brighter")
    for lamp in lamps[4:]:
        stage.RemovePrim(lamp.GetPath())
    watcher.look("four again")
    lamps[0].GetIntensityAttr().Set(5.0)
    watcher.look("four, brighter")
    return {"seen": watcher.seen}


SCENARIOS: dict[str, Callable[[Path], dict[str, Any]]] = {
    function.__name__: function for function in (on_the_fly, requests, many_lights)
}

if __name__ == "__main__":
    print(json.dumps(SCENARIOS[sys.argv[1]](Path(sys.argv[2]))))
