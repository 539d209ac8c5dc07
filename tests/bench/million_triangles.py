"""Time and memory to take in a stage of a million triangles, none of them shared.

    ./run python tests/bench/million_triangles.py --json out.json

Makes a stage of displaced grids with normals and texture coordinates (the same for the same seed)
in a temporary folder. Each run is a process of its own that loads the renderer with a small stage,
opens the large one, and renders one sample a pixel through UsdImagingGL.Engine. Measured are

- translate and build: wall seconds from the first call of the engine until the image of 32 x 18
  pixels is there, less the seconds of sampling it: population of the Hydra index, translation of
  the prims, and the acceleration structure. CPU seconds of the process beside it;
- memory: peak resident memory of the process less what it was before the stage was opened, so that
  OpenUSD's own arrays count.

The aims are 2.5 s on two cores and 400 bytes a triangle. In a grid two triangles share a point;
with --unshared every face has points of its own, the worst case.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from process_memory import forget_peak, peak_resident, resident

SECONDS_AIM = 2.5
BYTES_AIM = 400.0
RESOLUTION = (32, 18)


# ---- the stage


@dataclass(frozen=True)
class Grid:
    """A displaced grid of cells x cells quads."""

    cells: int
    triangles: bool  # halve the quads
    unshared: bool  # give every face points of its own
    shift: float  # along x


def add_grid(stage: Any, path: str, grid: Grid, rng: Any) -> int:
    """Adds the grid as a mesh; returns its triangle count."""
    import numpy as np
    from pxr import Gf, Sdf, UsdGeom, Vt

    cells = grid.cells
    side = np.linspace(0.0, 1.0, cells + 1, dtype=np.float32)
    u, v = np.meshgrid(side, side, indexing="xy")
    rough = rng.random(u.shape, dtype=np.float32) / cells
    height = 0.05 * np.sin(9.0 * u) * np.cos(7.0 * v) + 0.4 * rough
    points = np.stack([u + grid.shift, height, v], axis=-1).reshape(-1, 3).astype(np.float32)
    across = np.gradient(height, 1.0 / cells, axis=1)
    along = np.gradient(height, 1.0 / cells, axis=0)
    normals = np.stack([-across, np.ones_like(across), -along], axis=-1).reshape(-1, 3)
    corner = np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)[None, :]
    a, b, c, d = corner, corner + cells + 1, corner + cells + 2, corner + 1
    faces = np.stack([a, b, c, a, c, d] if grid.triangles else [a, b, c, d], axis=-1).reshape(-1)
    corners = 3 if grid.triangles else 4
    uv = np.stack([u, v], axis=-1).reshape(-1, 2)
    if grid.unshared:
        points, normals, uv = points[faces], normals[faces], uv[faces]
        faces = np.arange(len(faces))
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr(
        Vt.IntArray.FromNumpy(np.full(len(faces) // corners, corners, np.int32))
    )
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.astype(np.int32)))
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(normals.astype(np.float32)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    low, high = points.min(axis=0), points.max(axis=0)
    mesh.CreateExtentAttr([Gf.Vec3f(*map(float, low)), Gf.Vec3f(*map(float, high))])
    st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex
    )
    st.Set(Vt.Vec2fArray.FromNumpy(uv.astype(np.float32)))
    return 2 * cells * cells


def add_textured_material(stage: Any) -> Any:
    """A material whose texture reads st, so that st is translated."""
    from pxr import Sdf, UsdShade

    material = UsdShade.Material.Define(stage, "/World/Material")
    surface = UsdShade.Shader.Define(stage, "/World/Material/Surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    reader = UsdShade.Shader.Define(stage, "/World/Material/Reader")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
    result = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    texture = UsdShade.Shader.Define(stage, "/World/Material/Texture")
    texture.CreateIdAttr("UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath("./texture.png"))
    texture.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(result)
    colour = texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
    surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(colour)
    material.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
    return material


def write_stage(path: Path, meshes: int, triangles: int, unshared: bool, seed: int) -> int:
    """Writes the stage and its texture; returns the triangles that it has, at least `triangles`."""
    import numpy as np
    from PIL import Image
    from pxr import Usd, UsdGeom, UsdLux, UsdShade

    rng = np.random.default_rng(seed)
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    material = add_textured_material(stage)
    Image.fromarray(rng.integers(0, 255, (64, 64, 3), dtype=np.uint8)).save(
        path.parent / "texture.png"
    )
    cells = int(np.ceil(np.sqrt(triangles / (2 * meshes))))
    total = 0
    for i in range(meshes):
        name = f"/World/Grid{i:02d}"
        grid = Grid(cells, i % 2 == 0, unshared, 1.1 * (i - meshes / 2))
        total += add_grid(stage, name, grid, rng)
        prim = stage.GetPrimAtPath(name)
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)
    UsdLux.DomeLight.Define(stage, "/World/Sky")
    stage.GetRootLayer().Save()
    return total


# ---- the process that renders


def render(stage: Any) -> tuple[Any, dict[str, float]]:
    """Renders the stage once; returns the engine, which holds the scene, and seconds by phase."""
    from pxr import CameraUtil, Gf, UsdImagingGL

    from mbfeat import _core

    _core.Host.drop_last_frame()
    wall, cpu = time.perf_counter(), time.process_time()
    parameters = UsdImagingGL.Engine.Parameters()
    parameters.gpuEnabled = False
    parameters.rendererPluginId = "HdMBFeatRendererPlugin"
    engine = UsdImagingGL.Engine(parameters)
    camera = Gf.Camera()
    camera.transform = (
        Gf.Matrix4d()
        .SetLookAt(Gf.Vec3d(0, 3, 4), Gf.Vec3d(0, 0, 0.5), Gf.Vec3d(0, 1, 0))
        .GetInverse()
    )
    frustum = camera.frustum
    engine.SetCameraState(frustum.ComputeViewMatrix(), frustum.ComputeProjectionMatrix())
    engine.SetRenderBufferSize(Gf.Vec2i(*RESOLUTION))
    window = Gf.Range2f(Gf.Vec2f(0, 0), Gf.Vec2f(*RESOLUTION))
    pixels = Gf.Rect2i(Gf.Vec2i(0, 0), *RESOLUTION)
    engine.SetFraming(CameraUtil.Framing(window, pixels))
    engine.SetRendererAov("color")
    how = UsdImagingGL.RenderParams()
    how.enableLighting = True
    engine.Render(stage.GetPseudoRoot(), how)
    while not engine.IsConverged():
        time.sleep(0.001)
        engine.Render(stage.GetPseudoRoot(), how)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    frame = _core.Host.last_frame()
    if frame is None:
        raise SystemExit("the renderer left no image")
    seconds = dict(frame.report.seconds)
    return engine, {
        "translateAndBuild": wall - seconds["sampling"],
        "build": seconds["commit"],
        "cpu": cpu,
        "triangles": frame.report.triangles,
    }


def work(folder: Path) -> None:
    """Measures in this process; prints JSON."""
    from mbfeat.runtime import use_runtime

    use_runtime()
    from pxr import Usd

    from mbfeat import _core

    _core.Host.set_progress_style(_core.ProgressStyle.NONE)
    _core.Host.set_overrides([("mbfeat:samplesPerPixel", "1")])
    render(Usd.Stage.Open(str(folder / "small.usdc")))
    before = resident()
    forget_peak()
    opening = time.perf_counter()
    stage = Usd.Stage.Open(str(folder / "large.usdc"))
    opening = time.perf_counter() - opening
    engine, answer = render(stage)
    answer["open"] = opening
    answer["residentBytes"] = resident() - before
    answer["peakBytes"] = peak_resident() - before
    del engine
    print(json.dumps(answer))


# ---- the process that measures


def main() -> None:
    """Measures, prints, and writes --json."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--triangles", type=int, default=1_000_000)
    parser.add_argument("--meshes", type=int, default=8)
    parser.add_argument("--unshared", action="store_true", help="no face shares a point")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", type=Path, help="file to write the measurements to")
    parser.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        work(options.worker)
        return

    with tempfile.TemporaryDirectory(prefix="mbfeat-bench-") as folder:
        large = Path(folder) / "large.usdc"
        triangles = write_stage(
            large, options.meshes, options.triangles, options.unshared, options.seed
        )
        write_stage(Path(folder) / "small.usdc", 1, 8, False, options.seed)
        command = [sys.executable, "-P", __file__, "--worker", folder]
        runs = []
        for _ in range(options.runs):
            done = subprocess.run(command, stdout=subprocess.PIPE, check=True, text=True)
            runs.append(json.loads(done.stdout.splitlines()[-1]))
    if any(run["triangles"] != triangles for run in runs):
        raise SystemExit(f"of {triangles} triangles, {runs[0]['triangles']} were rendered")

    result: dict[str, Any] = {
        "date": datetime.now(UTC).date().isoformat(),
        "cores": len(os.sched_getaffinity(0)),
        "loadAverage": os.getloadavg()[0],
        "triangles": triangles,
    }
    print(f"{triangles:,} triangles in {options.meshes} meshes, {result['cores']} cores")

    def show(name: str, key: str, unit: str, scale: float = 1.0, aim: float | None = None) -> None:
        values = [run[key] * scale for run in runs]
        median = statistics.median(values)
        result[key] = {"median": median, "low": min(values), "high": max(values)}
        verdict = "" if aim is None else f", aim {aim:g}: {'met' if median <= aim else 'MISSED'}"
        print(f"{name:36} {median:8.2f} {unit} ({min(values):.2f} .. {max(values):.2f}){verdict}")

    show("open the stage (OpenUSD)", "open", "s")
    show("translate and build", "translateAndBuild", "s", aim=SECONDS_AIM)
    show("  of it: build", "build", "s")
    show("  CPU time of all", "cpu", "s")
    show("memory, peak", "peakBytes", "bytes a triangle", 1.0 / triangles, BYTES_AIM)
    show("memory, afterwards", "residentBytes", "bytes a triangle", 1.0 / triangles)
    if options.json:
        options.json.write_text(json.dumps(result | {"runs": runs}, indent=2) + "\n", "utf-8")


if __name__ == "__main__":
    main()
