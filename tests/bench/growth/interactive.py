"""The process that times a viewer: the first pixel of a large stage, and camera moves on it.

    python -P -m growth.interactive WARM-STAGE STAGE WIDTH MOVES THREADS

The viewer is UsdImagingGL.Engine without a GPU, whose Render() is called as an application does for
each of its frames: at once when the camera has moved, and then sixty times a second. Times are wall
and CPU seconds, pairs in this order,

- of the first pixels: from opening the stage until Render() came back with a whole pass of reduced
  resolution in the render buffer, the renderer's code being loaded and the file in the system's
  cache;
- of a camera move: from setting the camera until Render() came back with a whole pass of reduced
  resolution in the buffer, and until it came back with one sample of every pixel.

What is in the buffer is told from the renderer's count of samples before the call of Render().
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Any

from growth.worker import Stopwatch

COARSE = 8  # pixels between those of the pass of reduced resolution, in x and in y
SAMPLES = 4  # a pixel: a move comes before they are all there
FRAME = 1.0 / 60.0  # s between two frames of the viewer, at least
LONGEST = 600.0  # s to wait for anything


class Viewer:
    """An engine on a stage."""

    def __init__(self, stage: Any, width: int, height: int) -> None:
        from pxr import CameraUtil, Gf, UsdImagingGL

        self._stage = stage  # a prim does not keep its stage alive
        self._pixels = width * height
        self._shown = 0.0  # when the last frame was begun
        parameters = UsdImagingGL.Engine.Parameters()
        parameters.rendererPluginId = "HdMBFeatRendererPlugin"
        parameters.gpuEnabled = False
        self._engine = UsdImagingGL.Engine(parameters)
        self._engine.SetRenderBufferSize(Gf.Vec2i(width, height))
        window = Gf.Range2f(Gf.Vec2f(0, 0), Gf.Vec2f(width, height))
        data = Gf.Rect2i(Gf.Vec2i(0, 0), width, height)
        self._engine.SetFraming(CameraUtil.Framing(window, data))
        self._engine.SetRendererAov("color")
        self._how = UsdImagingGL.RenderParams()
        self._how.enableLighting = True

    def look_from(self, angle: float) -> None:
        """Turns the camera around the middle by `angle` degrees."""
        from pxr import Gf

        camera = Gf.Camera()
        camera.focalLength = 22.0
        camera.horizontalAperture, camera.verticalAperture = 20.0, 11.25
        eye = Gf.Rotation(Gf.Vec3d(0, 1, 0), angle).TransformDir(Gf.Vec3d(0.0, 6.0, 8.0))
        look = Gf.Matrix4d().SetLookAt(eye, Gf.Vec3d(0.0, 0.0, 0.3), Gf.Vec3d(0.0, 1.0, 0.0))
        camera.transform = look.GetInverse()
        frustum = camera.frustum
        self._engine.SetCameraState(frustum.ComputeViewMatrix(), frustum.ComputeProjectionMatrix())

    def show(self) -> None:
        """One frame of the application."""
        self._shown = time.perf_counter()
        self._engine.Render(self._stage.GetPseudoRoot(), self._how)

    def samples(self) -> float:
        """Samples of the running image."""
        return float(self._engine.GetRenderStats()["fractionDone"]) * SAMPLES * self._pixels

    def until(self, watch: Stopwatch, *counts: int) -> list[tuple[float, float]]:
        """Shows frames until each count of samples is in the buffer; wall and CPU seconds."""
        seconds = []
        for count in counts:
            while True:
                time.sleep(max(self._shown + FRAME - time.perf_counter(), 0.0))
                samples = self.samples()
                self.show()
                passed = watch.read()
                if samples > count - 0.5:
                    break
                if passed[0] > LONGEST:
                    raise SystemExit(f"{samples:g} of {count} samples came in {passed[0]:.0f} s")
            seconds.append(passed)
        return seconds


def measure(warm: Path, path: Path, width: int, moves: int) -> dict[str, Any]:
    """Times everything once; a camera move `moves` times."""
    from pxr import Usd

    height = width * 9 // 16
    whole = width * height
    coarse = -(-width // COARSE) * -(-height // COARSE)
    small = Viewer(Usd.Stage.Open(str(warm)), 64, 36)
    small.look_from(0.0)
    small.show()
    small.until(Stopwatch(), 64 * 36)

    watch = Stopwatch()
    stage = Usd.Stage.Open(str(path))
    answer: dict[str, Any] = {"open": watch.read()}
    viewer = Viewer(stage, width, height)
    viewer.look_from(0.0)
    viewer.show()
    answer["first_pixel"], answer["first_image"] = viewer.until(watch, coarse, whole)
    answer["coarse"], answer["full"] = [], []
    for move in range(moves):
        watch = Stopwatch()
        viewer.look_from(3.0 * (move + 1))
        viewer.show()
        in_coarse, in_full = viewer.until(watch, coarse, whole)
        answer["coarse"].append(in_coarse)
        answer["full"].append(in_full)
    return answer


def main() -> None:
    """Measures, prints."""
    from mbfeat.runtime import use_runtime

    use_runtime()
    from mbfeat import _core

    warm, path = Path(sys.argv[1]), Path(sys.argv[2])
    width, moves, threads = map(int, sys.argv[3:6])
    settings = {"samplesPerPixel": SAMPLES, "threads": threads}
    _core.Host.set_overrides([(f"mbfeat:{name}", str(v)) for name, v in settings.items()])
    _core.Host.set_progress_style(_core.ProgressStyle.NONE)
    print(json.dumps(measure(warm, path, width, moves)), flush=True)
    sys.stdout.flush()
    os._exit(0)  # OpenUSD frees the stage on threads that outlive the interpreter


if __name__ == "__main__":
    main()
