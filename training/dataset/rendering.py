"""Renders windows of a stage with MBFeat through Hydra, in this process."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training import stagekit as kit
from training.dataset import layout

PLUGIN = "HdMBFeatRendererPlugin"
SETTINGS = "/Render/Settings"
LARGEST_HALF = 65504.0


class RenderError(Exception):
    """The renderer left no image or reported an error; the message names the stage."""


@dataclass(frozen=True)
class Window:
    """Part of an image: `resolution` of the whole, `x`, `y` of the part's upper left, its size."""

    resolution: tuple[int, int]
    x: int
    y: int
    width: int
    height: int

    @property
    def ndc(self) -> tuple[float, float, float, float]:
        """dataWindowNDC: left, bottom, right, top, the origin at the lower left."""
        w, h = self.resolution
        return (
            self.x / w,
            1.0 - (self.y + self.height) / h,
            (self.x + self.width) / w,
            1.0 - self.y / h,
        )

    @staticmethod
    def whole(width: int, height: int) -> Window:
        return Window((width, height), 0, 0, width, height)


@dataclass
class Samples:
    """Kept paths: `half` [samples, HALF, h, w] float16, `bytes` [samples, BYTES, h, w] uint8.

    `clipped` counts values that a half float cannot hold, `seconds` is the time of sampling.
    """

    half: NDArray[np.float16]
    bytes: NDArray[np.uint8]
    clipped: int
    seconds: float


class StageRenderer:
    """A stage and its camera; renders any window with any seed, again and again."""

    def __init__(self, stage: Path, *, threads: int = 0, bounces: int = 12) -> None:
        from mbfeat.runtime import use_runtime

        use_runtime()
        from pxr import Sdf, Usd, UsdGeom

        from mbfeat import _core

        self._file = stage
        self._stage = Usd.Stage.Open(str(stage))
        self._stage.SetEditTarget(self._stage.GetSessionLayer())
        camera = "/World/Camera"
        existing = self._stage.GetPrimAtPath(SETTINGS)
        if existing:
            targets = existing.GetRelationship("camera").GetTargets()
            camera = str(targets[0]) if targets else camera
        self._camera = UsdGeom.Camera(self._stage.GetPrimAtPath(camera))
        if not self._camera:
            raise RenderError(f"{stage}: there is no camera <{camera}>")
        self._camera_path = Sdf.Path(camera)
        self._common = {
            "threads": threads,
            "maxBounces": bounces,
            "pixelFilter": "box",
            "clampDirect": 0,
            "clampIndirect": 0,
        }
        _core.Host.set_progress_style(_core.ProgressStyle.NONE)

    @property
    def world_to_camera(self) -> NDArray[np.float32]:
        """Rotation [3, 3] of world-space column vectors into the camera's axes (-z is forward)."""
        from pxr import Usd

        matrix = self._camera.ComputeLocalToWorldTransform(Usd.TimeCode.Default())
        rows = np.array(matrix, dtype=np.float64)[:3, :3]
        rows /= np.linalg.norm(rows, axis=1, keepdims=True)
        return rows.astype(np.float32)

    def samples(self, window: Window, spp: int, seed: int) -> Samples:
        """Every path of the window."""
        film, seconds = self._record(window, spp, seed, deep=True)
        paths = film.path_samples
        if paths is None:
            raise RenderError(f"{self._file}: no path samples were kept; see the messages above")
        names = [field.name for field in film.path_sample_layout]
        place = {name: index for index, name in enumerate(names)}
        half = np.empty((spp, len(layout.HALF), window.height, window.width), dtype=np.float16)
        clipped = 0
        for target, name in enumerate(layout.HALF):
            values = paths[..., place[name]]
            clipped += int(np.count_nonzero(np.abs(values) > LARGEST_HALF))
            bounded = np.clip(values, -LARGEST_HALF, LARGEST_HALF)
            half[:, target] = bounded.transpose(2, 0, 1)
        # Integer fields lie among the floats as numbers.
        integers = np.stack([paths[..., place[name]] for name in layout.BYTES])
        as_bytes = integers.astype(np.uint8).transpose(3, 0, 1, 2)
        return Samples(half, np.ascontiguousarray(as_bytes), clipped, seconds)

    def color(self, window: Window, spp: int, seed: int) -> tuple[NDArray[np.float32], float]:
        """Mean radiance [3, h, w], and the seconds of sampling."""
        film, seconds = self._record(window, spp, seed, deep=False)
        image = np.array(film.resolve("color"), dtype=np.float32)[..., :3]
        return np.ascontiguousarray(image.transpose(2, 0, 1)), seconds

    def _record(self, window: Window, spp: int, seed: int, *, deep: bool) -> tuple[Any, float]:
        from pxr import Gf, Sdf, Usd, UsdAppUtils

        from mbfeat import _core

        settings = self._common | {"samplesPerPixel": spp, "seed": seed}
        _core.Host.set_overrides([(f"mbfeat:{name}", str(v)) for name, v in settings.items()])
        _core.Host.drop_last_frame()
        with tempfile.TemporaryDirectory(prefix="mbfeat-data-") as scratch:
            self._stage.GetSessionLayer().Clear()
            kit.render_settings(self._stage, str(self._camera_path), window.resolution)
            sources = [("color", "color3f")]
            if deep:
                sources.append((layout.EXTENDED_AOV, "int"))
            product = kit.render_product(
                self._stage,
                "Window",
                str(Path(scratch) / "window.exr"),
                sources,
                product_type="deepRaster" if deep else "raster",
            )
            targets = self._stage.GetPrimAtPath(SETTINGS).GetRelationship("products")
            targets.SetTargets([product.GetPath()])
            product.CreateResolutionAttr(Gf.Vec2i(*window.resolution))
            product.CreateDataWindowNDCAttr(Gf.Vec4f(*window.ndc))
            # Nobody reads the file, so it is not compressed.
            product.GetPrim().CreateAttribute(
                "mbfeat:exr:compression", Sdf.ValueTypeNames.String, custom=True
            ).Set("none")
            recorder = UsdAppUtils.FrameRecorder(PLUGIN, False)
            recorder.SetColorCorrectionMode("disabled")
            recorder.SetDomeLightVisibility(True)
            recorder.SetActiveRenderSettingsPrimPath(Sdf.Path(SETTINGS))
            recorder.SetPrimaryCameraPrimPath(self._camera_path)
            recorder.SetImageWidth(16)
            time = Usd.TimeCode.Default()
            recorder.Record(self._stage, self._camera, time, str(Path(scratch) / "recorder.exr"))
            frame = _core.Host.last_frame()
            _core.Host.drop_last_frame()
        if frame is None:
            raise RenderError(f"{self._file}: the renderer left no image")
        if frame.report.errors or frame.report.interrupted:
            reasons = "; ".join(frame.report.errors) or "the render was interrupted"
            raise RenderError(f"{self._file}: {reasons}")
        film = frame.images[0][0]
        if film.data_window[2:] != (window.width, window.height):
            raise RenderError(
                f"{self._file}: asked for {window.width} x {window.height} pixels, "
                f"got {film.data_window[2:]}"
            )
        return film, dict(frame.report.seconds)["sampling"]
