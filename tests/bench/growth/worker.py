"""The process that renders one value, and says what that took as a line of JSON.

    python -P -m growth.worker WARM-STAGE STAGE SHOT

SHOT is a JSON object of growth.axes.Shot. The renderer and its kernels are loaded by rendering a
tiny stage before anything is measured. Then the stage is opened and rendered through OpenUSD's
frame recorder, as usdrecord does.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from growth.axes import Shot
from process_memory import forget_peak, peak_resident, resident

FEATURES = ("mbfeat:albedo:", "mbfeat:normal:", "mbfeat:direct:")


class Stopwatch:
    """Wall and CPU seconds of this process since it was made."""

    def __init__(self) -> None:
        self._wall, self._cpu = time.perf_counter(), time.process_time()

    def read(self) -> tuple[float, float]:
        """Wall, CPU."""
        return time.perf_counter() - self._wall, time.process_time() - self._cpu


def _ask_for(stage: Any, aovs: int, file: Path) -> None:
    """Makes the product hold color and the first `aovs` feature AOVs."""
    from pxr import UsdRender

    from mbfeat import _core

    table = [(aov.name, len(aov.channels)) for aov in _core.aov_table()]
    chosen = [table[0], *[row for row in table if row[0].startswith(FEATURES)][:aovs]]
    product = UsdRender.Product.Get(stage, "/Render/Product")
    product.CreateProductNameAttr(str(file))
    for i, (name, channels) in enumerate(chosen):
        var = UsdRender.Var.Define(stage, f"/Render/Vars/v{i}")
        var.CreateSourceNameAttr(name)
        var.CreateDataTypeAttr("float" if channels == 1 else f"color{channels}f")
        product.CreateOrderedVarsRel().AddTarget(var.GetPath())


def render(path: Path, shot: Shot, folder: Path) -> tuple[dict[str, Any], Any]:
    """Opens and renders the stage; what it took, and what keeps the scene alive."""
    from pxr import Gf, Usd, UsdAppUtils, UsdGeom, UsdRender

    from mbfeat import _core

    # Whether paths split is a matter of each scene, and of whether features are recorded.
    settings = {"samplesPerPixel": shot.samples, "threads": shot.threads, "splitting": 1}
    _core.Host.set_overrides([(f"mbfeat:{name}", str(v)) for name, v in settings.items()])
    _core.Host.drop_last_frame()
    watch = Stopwatch()
    stage = Usd.Stage.Open(str(path))
    opened = watch.read()
    stage.SetEditTarget(stage.GetSessionLayer())
    render_settings = UsdRender.Settings.Get(stage, "/Render/Settings")
    render_settings.CreateResolutionAttr(Gf.Vec2i(shot.width, shot.height))
    _ask_for(stage, shot.aovs, folder / "product.exr")
    camera = UsdGeom.Camera.Get(stage, "/World/Camera")
    recorder = UsdAppUtils.FrameRecorder("HdMBFeatRendererPlugin", False, False)
    recorder.SetActiveRenderSettingsPrimPath(render_settings.GetPath())
    recorder.SetPrimaryCameraPrimPath(camera.GetPath())
    recorder.SetImageWidth(shot.width)
    recorder.SetColorCorrectionMode("disabled")
    recorder.SetDomeLightVisibility(True)
    watch = Stopwatch()
    recorder.Record(stage, camera, Usd.TimeCode.Default(), str(folder / "image.exr"))
    wall, cpu = watch.read()
    frame = _core.Host.last_frame()
    if frame is None or frame.report.errors or frame.report.interrupted:
        errors = frame.report.errors if frame is not None else ["it left no image"]
        raise SystemExit(f"{path.name} was not rendered: {'; '.join(errors)}")
    report: dict[str, Any] = frame.report.to_dict()
    seconds = dict(frame.report.seconds)
    phases = {
        "open": opened[0],
        "translate": wall - sum(seconds.values()),
        "build": seconds["commit"],
        "sampling": seconds["sampling"],
        "write": sum(s for name, s in seconds.items() if name not in ("commit", "sampling")),
    }
    answer: dict[str, Any] = {
        "seconds": phases,
        "wall": wall + opened[0],
        "cpu": cpu + opened[1],
        "sampling_cpu": report["samplingCpuSeconds"],
        "rays": report["trace"]["rays"],
        "paths": report["trace"]["paths"],
        "scene": report["scene"],
        "memory": report["memory"],
    }
    return answer, (stage, recorder, frame)


def main() -> None:
    """Renders, prints."""
    from mbfeat.runtime import use_runtime

    use_runtime()
    from mbfeat import _core

    warm, path, shot = Path(sys.argv[1]), Path(sys.argv[2]), Shot(**json.loads(sys.argv[3]))
    _core.Host.set_progress_style(_core.ProgressStyle.NONE)
    with tempfile.TemporaryDirectory(prefix="mbfeat-growth-") as folder:
        small = Shot("triangles", 100, 16, 1, shot.aovs, shot.threads)
        _, kept = render(warm, small, Path(folder))
        del kept
        before = resident()
        forget_peak()
        answer, kept = render(path, shot, Path(folder))
        assert kept  # the scene is alive: its memory counts
        answer["resident_bytes"] = resident() - before
        answer["peak_bytes"] = peak_resident() - before
    print(json.dumps(answer), flush=True)
    os._exit(0)  # OpenUSD frees the stage on threads that outlive the interpreter


if __name__ == "__main__":
    main()
