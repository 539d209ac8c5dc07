"""The process that renders for ``mbfeat effects``: a line of JSON in, a render, a line out.

A request says which AOVs and which settings; the stage stays open, and each render goes to one
product in a scratch folder, so that nothing of the stage's own is written.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import os
import signal
import sys
import tempfile
from pathlib import Path
from typing import Any

from mbfeat.effects.rendering import ANSWER
from mbfeat.runtime import RuntimeMissingError, use_runtime

PRODUCT = "/MBFeatEffects/Product"
CAMERA = "/MBFeatEffects/Camera"


class StageProblemError(Exception):
    """The stage cannot be rendered; the message is for the user."""


class Scratch:
    """The stage with one product of ours in place of its own, all in the session layer."""

    def __init__(self, stage: Any, settings: Any, width: int, folder: Path) -> None:
        from pxr import Gf, Sdf, UsdRender

        self.stage = stage
        self.own_aovs, self.deep = _asked_for(stage, settings)
        if not settings:
            settings = UsdRender.Settings.Define(stage, "/MBFeatEffects/Settings")
        self.settings = settings
        resolution = settings.GetResolutionAttr().Get() or Gf.Vec2i(960, 540)
        size = Gf.Vec2i(width, max(1, round(width * resolution[1] / max(resolution[0], 1))))
        settings.GetResolutionAttr().Set(size)
        self.product = UsdRender.Product.Define(stage, PRODUCT)
        self.product.CreateProductNameAttr(str(folder / "product.exr"))
        compression = "driver:parameters:OpenEXR:compression"
        self.product.GetPrim().CreateAttribute(compression, Sdf.ValueTypeNames.Token).Set("none")
        settings.GetProductsRel().SetTargets([self.product.GetPath()])

    def ask_for(self, aovs: list[str], deep: bool) -> None:
        """Makes the product hold these AOVs."""
        from pxr import UsdRender

        from mbfeat import _core

        channels = {aov.name: len(aov.channels) for aov in _core.aov_table()}
        paths = []
        for aov in aovs:
            var = UsdRender.Var.Define(self.stage, f"/MBFeatEffects/Vars/v{_identifier(aov)}")
            if not var.GetSourceNameAttr().HasAuthoredValue():
                var.CreateSourceNameAttr(aov)
                width = channels.get(aov, 3)
                var.CreateDataTypeAttr("float" if width == 1 else f"color{width}f")
            paths.append(var.GetPath())
        self.product.CreateOrderedVarsRel().SetTargets(paths)
        self.product.CreateProductTypeAttr("deepRaster" if deep else "raster")


def _other_camera(stage: Any) -> Any:
    """Where nothing says through which camera: the only one, else one that sees all of the stage.

    Which effects a stage calls for hardly depends on it; what they cost does. Raises
    StageProblemError where the stage has several.
    """
    from pxr import UsdGeom

    found = [UsdGeom.Camera(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera)]
    if len(found) > 1:
        names = ", ".join(str(camera.GetPath()) for camera in found[:8])
        raise StageProblemError(
            f"{stage.GetRootLayer().realPath}: neither its render settings nor its primary camera "
            f"say what to look through; name one with --camera: {names}"
        )
    return found[0] if found else _framing_camera(stage)


def _framing_camera(stage: Any) -> Any:
    """A camera in the session layer that has the bounds of the stage in view."""
    from pxr import Gf, Usd, UsdGeom

    purposes = [UsdGeom.Tokens.default_, UsdGeom.Tokens.render, UsdGeom.Tokens.proxy]
    bounds = UsdGeom.BBoxCache(Usd.TimeCode.EarliestTime(), purposes)
    box = bounds.ComputeWorldBound(stage.GetPseudoRoot()).ComputeAlignedRange()
    radius = 0.0 if box.IsEmpty() else 0.5 * box.GetSize().GetLength()
    centre = Gf.Vec3d(0.0) if box.IsEmpty() else box.GetMidpoint()
    radius = radius if math.isfinite(radius) and radius > 0.0 else 1.0
    camera = UsdGeom.Camera.Define(stage, CAMERA)
    half = 0.5 * camera.GetVerticalApertureAttr().Get() / camera.GetFocalLengthAttr().Get()
    distance = 1.1 * radius * math.hypot(1.0, half) / half
    camera.GetClippingRangeAttr().Set(
        Gf.Vec2f(max(distance - 1.1 * radius, 1e-3 * distance), distance + 1.1 * radius)
    )
    upright = UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y
    away = Gf.Vec3d(0.0, 0.0, 1.0) if upright else Gf.Vec3d(0.0, -1.0, 0.0)
    place = UsdGeom.XformCommonAPI(camera)
    place.SetTranslate(centre + away * distance)
    place.SetRotate(Gf.Vec3f(0.0 if upright else 90.0, 0.0, 0.0))
    sys.stderr.write(f"mbfeat: effects: the stage has no camera: {CAMERA} sees all of it\n")
    return camera


def _identifier(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name)


def _asked_for(stage: Any, settings: Any) -> tuple[list[str], bool]:
    """The AOVs of the stage's products, `color` first, and whether one is deep."""
    from pxr import UsdRender

    aovs, deep = ["color"], False
    targets = settings.GetProductsRel().GetForwardedTargets() if settings else []
    for target in targets:
        product = UsdRender.Product(stage.GetPrimAtPath(target))
        if not product:
            continue
        deep = deep or product.GetProductTypeAttr().Get() == "deepRaster"
        for path in product.GetOrderedVarsRel().GetForwardedTargets():
            var = UsdRender.Var(stage.GetPrimAtPath(path))
            source = var.GetSourceNameAttr().Get() if var else None
            if source and source not in aovs:
                aovs.append(source)
    return aovs, deep


def _serve(options: argparse.Namespace, folder: Path) -> None:
    from pxr import Usd, UsdAppUtils, UsdRender

    from mbfeat import _core
    from mbfeat.diagnostics import OpenUsdMessages
    from mbfeat.usdrecord import find_camera, find_settings, open_file

    messages = OpenUsdMessages()
    stage = open_file(options.stage)
    messages.flush()
    stage.SetEditTarget(stage.GetSessionLayer())
    path = find_settings(stage, None, options.settings or None)
    settings = UsdRender.Settings(stage.GetPrimAtPath(path)) if path else None
    camera = find_camera(stage, options.camera, path) or _other_camera(stage)
    scratch = Scratch(stage, settings, options.width, folder)
    scratch.settings.GetCameraRel().SetTargets([camera.GetPath()])
    _core.Host.print_messages("mbfeat")
    _core.Host.set_progress_style(_core.ProgressStyle.NONE)
    _core.Host.set_stage(options.stage)
    recorder = UsdAppUtils.FrameRecorder("HdMBFeatRendererPlugin", False)
    recorder.SetActiveRenderSettingsPrimPath(scratch.settings.GetPath())
    recorder.SetPrimaryCameraPrimPath(camera.GetPath())
    recorder.SetImageWidth(options.width)
    recorder.SetColorCorrectionMode("disabled")
    recorder.SetCameraLightEnabled(True)
    _answer({"aovs": scratch.own_aovs, "deep": scratch.deep, "camera": str(camera.GetPath())})
    for line in sys.stdin:
        request = json.loads(line)
        scratch.ask_for(request["aovs"], request["deep"])
        _core.Host.set_overrides(list(request["settings"].items()))
        _core.Host.drop_last_frame()
        image = str(folder / "image.exr")
        recorder.Record(stage, camera, Usd.TimeCode.EarliestTime(), image)
        frame = _core.Host.last_frame()
        messages.flush()
        if frame is None:
            raise StageProblemError(f"{options.stage} could not be rendered; see above")
        _answer({**frame.report.to_dict(), "digest": _digest(frame)})


def _digest(frame: Any) -> str:
    """A hash of all pixels of all AOVs, the same for images that are the same bit for bit."""
    state = hashlib.sha256()
    for film, _, _ in frame.images:
        for aov in film.aovs:
            state.update(film.resolve(aov.name).tobytes())
    return state.hexdigest()


def _answer(content: Any) -> None:
    print(f"{ANSWER}{json.dumps(content)}", flush=True)


def main() -> int:
    """Serves until stdin ends; 1 when the stage cannot be rendered."""
    parser = argparse.ArgumentParser()
    parser.add_argument("stage")
    parser.add_argument("--settings")
    parser.add_argument("--camera")
    parser.add_argument("--width", type=int, default=320)
    options = parser.parse_args()
    # Ended between renders, it takes its folder along.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    try:
        use_runtime()
        with tempfile.TemporaryDirectory(prefix="mbfeat-effects-") as folder:
            _serve(options, Path(folder))
    except BrokenPipeError:
        return 1  # who asked has ended
    except Exception as error:
        from mbfeat.usdrecord import StageError

        if not isinstance(error, StageProblemError | StageError | RuntimeMissingError):
            raise
        sys.stderr.write(f"mbfeat: effects: {error}\n")
        return 1
    return 0


if __name__ == "__main__":
    try:
        code = main()
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else 2
    sys.stdout.flush()
    os._exit(code)  # OpenUSD frees the stage on threads that outlive the interpreter
