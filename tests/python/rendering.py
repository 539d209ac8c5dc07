"""Renders stages in this process, through OpenUSD's frame recorder, and reads EXR files.

OpenUSD is imported late: this module is also imported where its imaging is missing.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from mbfeat import _core

SCENES = Path(__file__).resolve().parents[1] / "scenes"
SETTINGS = "/Render/Settings"
VERTICES = range(6)
PAPER = [f"mbfeat:{kind}:{k}" for k in VERTICES for kind in ("albedo", "normal", "direct")]
CONTRIBUTIONS = [
    "mbfeat:contribution:emission",
    *[f"mbfeat:contribution:{k}" for k in VERTICES],
    "mbfeat:contribution:tail",
]
FIRST_NON_DELTA = [f"mbfeat:firstNonDelta:{n}" for n in ("albedo", "normal", "depth", "tint")]
EXTENDED = [
    f"mbfeat:{kind}:{k}"
    for k in VERTICES
    for kind in ("roughness", "distance", "throughput", "event")
]
STANDARD = [
    "color",
    "alpha",
    "depth",
    "cameraDepth",
    "normal",
    "Neye",
    "primId",
    "instanceId",
    "elementId",
    "albedo",
    "mbfeat:raw",
    "variance",
    "sampleCount",
    "nonFinite",
]
EVERY_AOV = [*STANDARD, *PAPER, *CONTRIBUTIONS, *FIRST_NON_DELTA, *EXTENDED]

Image = NDArray[Any]


def kit() -> ModuleType:
    """tests/scenes/stagekit.py."""
    if str(SCENES) not in sys.path:
        sys.path.insert(0, str(SCENES))
    import stagekit

    return stagekit


def committed_stages() -> list[str]:
    """Names of the committed stages."""
    return sorted(path.stem for path in SCENES.glob("*.usda"))


def open_scene(name: str) -> Any:
    """A committed stage, with edits going to its session layer, which is not saved."""
    from pxr import Usd

    stage = Usd.Stage.Open(str(SCENES / f"{name}.usda"))
    stage.SetEditTarget(stage.GetSessionLayer())
    return stage


def add_product(
    stage: Any,
    file: Path,
    aovs: Iterable[str] = ("color",),
    *,
    resolution: tuple[int, int] | None = None,
    camera: str | None = None,
    deep: bool = False,
    half: bool = False,
    window: tuple[float, float, float, float] | None = None,
    attributes: Mapping[str, str] | None = None,
) -> Any:
    """Adds a render product that writes `file`, one layer an AOV and named by it.

    `window` is the dataWindowNDC: left, bottom, right, top. `attributes` are custom string ones.
    """
    from pxr import Gf, Sdf

    name = file.stem.replace("-", "_")
    sources = [(aov, "color3h" if half else "color3f") for aov in aovs]
    product = kit().render_product(
        stage, name, str(file), sources, product_type="deepRaster" if deep else "raster"
    )
    if resolution:
        product.CreateResolutionAttr(Gf.Vec2i(*resolution))
    if camera:
        product.CreateCameraRel().SetTargets([Sdf.Path(camera)])
    if window:
        product.CreateDataWindowNDCAttr(Gf.Vec4f(*window))
    for key, text in (attributes or {}).items():
        product.GetPrim().CreateAttribute(key, Sdf.ValueTypeNames.String, custom=True).Set(text)
    return product


def record(stage: Any, scratch: Path, **settings: object) -> _core.FinishedFrame:
    """Renders the stage with its render settings and products; returns what the renderer left.

    `settings` are mbfeat: settings by their names without the prefix, as the command line gives
    them. `scratch` is a folder for the recorder's own image.
    """
    from pxr import Sdf, Usd, UsdAppUtils, UsdGeom, UsdRender

    with ExitStack() as restored:
        restored.callback(_core.Host.set_overrides, _core.Host.overrides())
        restored.callback(_core.Host.set_progress_style, _core.Host.progress_style())
        texts = {n: str(v).lower() if isinstance(v, bool) else str(v) for n, v in settings.items()}
        _core.Host.set_overrides([(f"mbfeat:{name}", text) for name, text in texts.items()])
        _core.Host.set_progress_style(_core.ProgressStyle.NONE)
        _core.Host.drop_last_frame()
        recorder = UsdAppUtils.FrameRecorder("HdMBFeatRendererPlugin", False)
        recorder.SetColorCorrectionMode("disabled")
        recorder.SetDomeLightVisibility(True)
        recorder.SetActiveRenderSettingsPrimPath(Sdf.Path(SETTINGS))
        recorder.SetImageWidth(16)
        targets = UsdRender.Settings.Get(stage, SETTINGS).GetCameraRel().GetTargets()
        camera = UsdGeom.Camera(stage.GetPrimAtPath(targets[0])) if targets else UsdGeom.Camera()
        recorder.Record(stage, camera, Usd.TimeCode.Default(), str(scratch / "recorder.exr"))
        frame = _core.Host.last_frame()
        _core.Host.drop_last_frame()
    assert frame is not None, "the renderer left no image"
    return frame


def render(
    stage: Any,
    scratch: Path,
    aovs: Iterable[str],
    *,
    resolution: tuple[int, int] = (16, 16),
    **settings: object,
) -> dict[str, Image]:
    """Renders AOVs into an EXR file and reads them back: float32 [height, width, channels]."""
    wanted = list(aovs)
    file = scratch / "render.exr"
    add_product(stage, file, wanted, resolution=resolution)
    frame = record(stage, scratch, **settings)
    assert frame.report.errors == []
    layers = read_parts(file)[0].layers()
    return {aov: layers[aov] for aov in wanted}


@dataclass(frozen=True)
class Part:
    """One part of an EXR file."""

    name: str
    header: dict[str, Any]
    channels: dict[str, Image]  # [height, width]; in deep files arrays of arrays
    types: dict[str, str]  # "half", "float" or "uint"

    def layers(self) -> dict[str, Image]:
        """Arrays [height, width, channels], channels in the table's order; `color` is unnamed."""
        grouped: dict[str, list[str]] = {}
        for channel in self.channels:
            layer = channel.rpartition(".")[0] or "color"
            grouped.setdefault(layer, []).append(channel)
        order = "RGBXYZA"
        return {
            layer: np.stack(
                [self.channels[n] for n in sorted(names, key=lambda n: order.index(n[-1]))], axis=-1
            )
            for layer, names in grouped.items()
        }

    def window(self, name: str) -> tuple[int, int, int, int]:
        """x, y, width and height of dataWindow or displayWindow."""
        low, high = (np.asarray(corner).tolist() for corner in self.header[name])
        return low[0], low[1], high[0] - low[0] + 1, high[1] - low[1] + 1


def read_parts(path: Path) -> list[Part]:
    """All parts of an EXR file, by the OpenEXR package."""
    kinds = {OpenEXR.HALF: "half", OpenEXR.FLOAT: "float", OpenEXR.UINT: "uint"}
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return [
            Part(
                name=str(part.header.get("name", "")),
                header={key: value for key, value in part.header.items() if key != "channels"},
                channels={name: channel.pixels for name, channel in part.channels.items()},
                types={name: kinds[channel.type()] for name, channel in part.channels.items()},
            )
            for part in file.parts
        ]
