"""MBFeat itself, through OpenUSD's frame recorder, as usdrecord renders.

Runs in the project's environment. It reads the stage, not the arrays of peers.scene.
"""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

import numpy as np

from mbfeat.devtools.layout import digest
from peers.rendering import BUILD, Job, Rendered


class OwnRenderer:
    """The delegate on one stage; see peers.rendering.Renderer."""

    def __init__(self, stage: Path, job: Job) -> None:
        from mbfeat.runtime import use_runtime

        use_runtime()
        from pxr import Gf, Usd, UsdGeom, UsdRender

        import mbfeat
        from mbfeat import _core

        self.version = f"MBFeat {mbfeat.__version__}{BUILD}{_build_digest()}"
        self._job = job
        self._stage = Usd.Stage.Open(str(stage))
        self._stage.SetEditTarget(self._stage.GetSessionLayer())
        path = self._stage.GetMetadata("renderSettingsPrimPath") or "/Render/Settings"
        self._settings = UsdRender.Settings.Get(self._stage, path)
        self._settings.GetResolutionAttr().Set(Gf.Vec2i(job.width, job.height))
        camera = self._settings.GetCameraRel().GetTargets()[0]
        self._camera = UsdGeom.Camera(self._stage.GetPrimAtPath(camera))
        _core.Host.set_progress_style(_core.ProgressStyle.NONE)

    def render(self, spp: int, seed: int) -> Rendered:
        from pxr import Usd, UsdAppUtils

        from mbfeat import _core

        settings = {
            "samplesPerPixel": spp,
            "seed": seed,
            "maxBounces": self._job.bounces,
            "threads": self._job.threads,
            "pixelFilter": "box",
            "clampDirect": 0,
            "clampIndirect": 0,
        }
        _core.Host.set_overrides([(f"mbfeat:{name}", str(v)) for name, v in settings.items()])
        _core.Host.drop_last_frame()
        recorder = UsdAppUtils.FrameRecorder("HdMBFeatRendererPlugin", False, False)
        recorder.SetActiveRenderSettingsPrimPath(self._settings.GetPath())
        recorder.SetPrimaryCameraPrimPath(self._camera.GetPath())
        recorder.SetImageWidth(self._job.width)
        recorder.SetColorCorrectionMode("disabled")
        recorder.SetDomeLightVisibility(True)
        used = time.process_time()
        with tempfile.TemporaryDirectory(prefix="mbfeat-bench-") as folder:
            file = str(Path(folder) / "image.exr")
            recorder.Record(self._stage, self._camera, Usd.TimeCode.Default(), file)
        used = time.process_time() - used
        frame = _core.Host.last_frame()
        if frame is None or frame.report.errors or frame.report.interrupted:
            errors = frame.report.errors if frame is not None else ["it left no image"]
            raise RuntimeError("; ".join(errors) or "the render was interrupted")
        film = frame.images[0][0]
        image = np.array(film.resolve("color"), dtype=np.float32)[..., :3]
        return Rendered(image, dict(frame.report.seconds)["sampling"], used)


def _build_digest() -> str:
    """A hash of the renderer's libraries, since its version does not change with every edit."""
    build = Path(os.environ["MBFEAT_BUILD_DIR"])
    libraries = sorted(p for p in build.rglob("*.so") if "mbfeat" in p.name.lower())
    return digest(*(path.read_bytes() for path in libraries))[:12]
