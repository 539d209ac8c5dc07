"""Throughput of the renderer, and what recording path features costs.

    ./run python tests/bench/throughput.py --json out.json

Every scene is rendered through Hydra (OpenUSD's frame recorder, as usdrecord does) with three sets
of AOVs: color alone, the paper's 54 values, and those with the extended set and the contributions.
One process per scene and set stays alive and records one frame after the other, as usdrecord does
with a sequence (the first frame, which touches the film's memory for the first time and loads the
plug-in, is not measured); they take turns, so that whatever else the machine does
meets all of them alike, and each is pinned to the same cores. Median and range of the runs are
printed. The cost of a set is the median over the rounds of its time by that of color alone in the
same round: that of the sampling, which is what recording costs, and that of the whole render with
the writing of a product of so many more channels.

The sampling is timed by the wall clock, so the machine should do nothing else. The whole is in CPU
seconds of the process: translation of the stage, sampling, and writing the product, uncompressed.
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
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mbfeat.machine import cpu_name

SCENES = Path(__file__).resolve().parents[1] / "scenes"
SCENE_NAMES = ("interior", "cockpit", "garden")
PAPER = ("mbfeat:albedo:", "mbfeat:normal:", "mbfeat:direct:")
SETS = ("off", "paper", "extended")


def aovs_of(name: str) -> list[tuple[str, int]]:
    """AOVs of a set with their channel counts, `color` first, in table order."""
    from mbfeat import _core

    table = [(aov.name, len(aov.channels)) for aov in _core.aov_table()]
    if name == "off":
        return table[:1]
    if name == "paper":
        return [table[0], *(a for a in table if a[0].startswith(PAPER))]
    return [table[0], *(a for a in table if a[0].startswith("mbfeat:"))]


# ---- the process that renders


def add_product(stage: Any, aovs: list[tuple[str, int]], image: str) -> None:
    """Authors a product with the AOVs, uncompressed floats, on the stage's settings."""
    from pxr import Sdf, UsdRender

    def set_on(prim: Any, name: str, kind: Any, value: object) -> None:
        prim.CreateAttribute(name, kind, custom=True).Set(value)

    product = UsdRender.Product.Define(stage, "/Render/BenchProduct")
    product.CreateProductNameAttr(image)
    exr = "driver:parameters:OpenEXR:compression"
    set_on(product.GetPrim(), exr, Sdf.ValueTypeNames.Token, "none")
    for aov, channels in aovs:
        var = UsdRender.Var.Define(stage, f"/Render/BenchVars/{aov.replace(':', '_')}")
        var.CreateSourceNameAttr(aov)
        var.CreateDataTypeAttr("float" if channels == 1 else f"color{channels}f")
        set_on(var.GetPrim(), "driver:parameters:aov:name", Sdf.ValueTypeNames.String, aov)
        product.GetOrderedVarsRel().AddTarget(var.GetPath())
    settings = UsdRender.Settings(stage.GetPrimAtPath("/Render/Settings"))
    settings.GetProductsRel().SetTargets([product.GetPath()])


def work(options: argparse.Namespace) -> None:
    """Renders once for each line on stdin and answers with a line of JSON."""
    scene, set_name = options.worker
    from mbfeat.runtime import use_runtime

    use_runtime()
    from pxr import Gf, Usd, UsdAppUtils, UsdGeom, UsdRender

    from mbfeat import _core

    _core.Host.set_progress_style(_core.ProgressStyle.NONE)
    _core.Host.set_overrides(
        [
            ("mbfeat:samplesPerPixel", str(options.samples)),
            ("mbfeat:threads", str(options.threads)),
            # Paths that are recorded do not split: neither do those that they are compared with.
            ("mbfeat:splitting", "1"),
        ]
    )
    stage = Usd.Stage.Open(str(SCENES / f"{scene}.usda"))
    settings = UsdRender.Settings(stage.GetPrimAtPath("/Render/Settings"))
    settings.GetResolutionAttr().Set(Gf.Vec2i(options.width, options.width * 9 // 16))
    camera = UsdGeom.Camera(stage.GetPrimAtPath(settings.GetCameraRel().GetTargets()[0]))
    aovs = aovs_of(set_name)
    with tempfile.TemporaryDirectory(prefix="mbfeat-bench-") as folder:
        image = str(Path(folder) / "product.exr")
        add_product(stage, aovs, image)
        recorder = UsdAppUtils.FrameRecorder("HdMBFeatRendererPlugin", False, False)
        recorder.SetActiveRenderSettingsPrimPath(settings.GetPath())
        recorder.SetPrimaryCameraPrimPath(camera.GetPath())
        recorder.SetImageWidth(options.width)
        recorder.SetColorCorrectionMode("disabled")
        for _ in sys.stdin:
            _core.Host.drop_last_frame()
            cpu = time.process_time()
            recorder.Record(stage, camera, Usd.TimeCode.Default(), str(Path(folder) / "image.exr"))
            cpu = time.process_time() - cpu
            frame = _core.Host.last_frame()
            if frame is None or frame.report.errors or not Path(image).is_file():
                raise SystemExit(f"{scene} with {set_name} was not rendered")
            report = frame.report.to_dict()
            answer = {
                "values": sum(channels for _, channels in aovs[1:]),
                "cpu": cpu,
                "wall": dict(frame.report.seconds)["sampling"],
                "trace": report["trace"],
            }
            print(json.dumps(answer), flush=True)


# ---- the process that measures


@dataclass
class Case:
    """A scene with a set of AOVs and what its runs took."""

    scene: str
    set_name: str
    process: subprocess.Popen[str]
    sampling: list[float] = field(default_factory=list)
    whole: list[float] = field(default_factory=list)
    values: int = 0
    paths: int = 0
    rays: int = 0

    def run(self) -> tuple[float, float]:
        """Renders once; the seconds of the sampling and of the whole."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write("render\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit(f"{self.scene} with {self.set_name}: the renderer's process ended")
        answer = json.loads(line)
        self.values = answer["values"]
        self.paths = answer["trace"]["paths"]
        self.rays = answer["trace"]["rays"] + answer["trace"]["shadowRays"]
        return float(answer["wall"]), float(answer["cpu"])


def start(scene: str, set_name: str, options: argparse.Namespace, cores: list[int]) -> Case:
    """Starts the process of a case on its cores."""
    command = [sys.executable, "-P", __file__, "--worker", scene, set_name]
    for name in ("width", "samples", "threads"):
        command += [f"--{name}", str(getattr(options, name))]
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        preexec_fn=lambda: os.sched_setaffinity(0, cores),
    )
    return Case(scene, set_name, process)


def spread(values: list[float]) -> dict[str, float]:
    """Median and range."""
    return {"median": statistics.median(values), "low": min(values), "high": max(values)}


def measure(scene: str, options: argparse.Namespace, cores: list[int]) -> list[dict[str, Any]]:
    """Runs the cases of one scene in turns; returns a row for each set."""
    cases = [start(scene, set_name, options, cores) for set_name in SETS]
    try:
        for case in cases:
            case.run()  # loads the plug-in and warms the caches
        for turn in range(options.runs):
            first = turn % len(cases)
            for case in cases[first:] + cases[:first]:
                sampling, whole = case.run()
                case.sampling.append(sampling)
                case.whole.append(whole)
    finally:
        for case in cases:
            case.process.kill()
            case.process.wait()

    def cost(seconds: list[float], off: list[float]) -> dict[str, float]:
        return spread([s / base - 1.0 for s, base in zip(seconds, off, strict=True)])

    rows = []
    for case in cases:
        rows.append(
            {
                "scene": scene,
                "set": case.set_name,
                "values": case.values,
                "paths": case.paths,
                "raysPerPath": case.rays / case.paths,
                "seconds": spread(case.sampling),
                "samplesPerSecond": spread([case.paths / s for s in case.sampling]),
                "secondsPerMillionRays": spread([1e6 * s / case.rays for s in case.sampling]),
                "cost": cost(case.sampling, cases[0].sampling),
                "costWithWriting": cost(case.whole, cases[0].whole),
            }
        )
    return rows


def report(rows: list[dict[str, Any]]) -> str:
    """The table, as Markdown."""

    def ranged(value: dict[str, float], scale: float, digits: int) -> str:
        m, low, high = (f"{value[k] * scale:.{digits}f}" for k in ("median", "low", "high"))
        return f"{m} ({low} .. {high})"

    lines = [
        "| scene | AOVs | values | rays a path | thousand samples/s | s per million rays "
        "| cost, % | cost with writing, % |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        lines.append(
            f"| {row['scene']} | {row['set']} | {row['values']} | {row['raysPerPath']:.2f} "
            f"| {ranged(row['samplesPerSecond'], 1e-3, 1)} "
            f"| {ranged(row['secondsPerMillionRays'], 1.0, 3)} "
            f"| {ranged(row['cost'], 100.0, 1) if row['set'] != 'off' else '-'} "
            f"| {ranged(row['costWithWriting'], 100.0, 1) if row['set'] != 'off' else '-'} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Measures, prints the table and, with --json, writes everything that was measured."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", nargs="+", default=list(SCENE_NAMES), metavar="NAME")
    parser.add_argument("--runs", type=int, default=7, help="renders of each case")
    parser.add_argument("--width", type=int, default=320, help="of the image, pixels")
    parser.add_argument("--samples", type=int, default=16, help="per pixel")
    parser.add_argument("--threads", type=int, default=1, help="render threads, a core for each")
    parser.add_argument("--json", type=Path, help="file to write the measurements to")
    parser.add_argument("--worker", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        work(options)
        return
    cores = sorted(os.sched_getaffinity(0))[-options.threads :]
    about = {
        "date": datetime.now(UTC).date().isoformat(),
        "cpu": cpu_name(),
        "threads": options.threads,
        "runs": options.runs,
        "width": options.width,
        "samplesPerPixel": options.samples,
        "loadAverage": os.getloadavg()[0],
    }
    print(", ".join(f"{name} {value}" for name, value in about.items()), flush=True)
    rows = [row for scene in options.scenes for row in measure(scene, options, cores)]
    print(report(rows))
    if options.json:
        options.json.write_text(json.dumps(about | {"rows": rows}, indent=2) + "\n", "utf-8")


if __name__ == "__main__":
    main()
