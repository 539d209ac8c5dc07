"""Where the time of sampling goes, stage by stage.

    ./run python tests/bench/profile_stages.py [STAGE ...] [--samples 1024] [--width 320]

Renders each stage under `perf record`, one thread pinned to one core, and prints what part of the
samples of the processor's clock fell into which kind of code, as a table for the docs; what was
inlined counts where it was inlined. Needs Linux's perf (Debian's package linux-perf) and the right
to count in user space. Without stages those of the benchmark against other renderers are taken;
that of a million instances is made by `./run mbfeat bench --scenes field --quick` first, and left
out where it is missing.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from mbfeat.devtools.layout import this_layout
from mbfeat.machine import cpu_name

BENCH = Path(__file__).resolve().parents[1] / "scenes" / "bench"
FREQUENCY = 997  # samples a second; no divisor of what happens at regular times
# The first whose pattern is found in the library or symbol.
KINDS = (
    ("Embree", r"libembree"),
    ("rays to and from Embree", r"TraceStage|RaySorter|intersectLight|AccelerationQuery|::Accel"),
    ("textures, primvars", r"sampleTexture|TexelLanes|MaterialLanes|evaluateMaterial"
     r"|evaluateAttribute|Image::|decodeTexel|decodeValue|lookUp|materialValues"),
    ("choice of lights", r"LightChoice|LightTree|LightSampler|InfiniteLights|LightWeights"
     r"|LightPair|oneOfPair|importanceAt"),
    ("lights", r"lightSamples|sampleOnLanes|Emitter|EnvironmentMap|EndStage|Shape<|LightShaping"
     r"|PreparedLight|PiecewiseConstant|AliasTable|LightShapeTree|lookAtEnvironment|shapeLanes"),
    ("surfaces, closures", r"ShadeStage|Bsdf|Microfacet|fresnel|Fresnel|surfacePoint|HitLanes"
     r"|fetchSurface|shadingNormal|ShadingNormal"),
    ("camera rays, random numbers", r"CameraStage|CameraRays|Sampler|sinCos|sobol|owen|spread"),
    ("states of paths", r"PathStream|PathKernel|LaneQuad|quads|ShadowQueue"),
    ("film", r"Film|PassRenderer|Refinement|PixelFilter"),
)  # fmt: skip
OTHER = "other"


def kind_of(library: str, symbol: str) -> str:
    """Of a sample."""
    text = f"{library} {symbol}"
    return next((kind for kind, pattern in KINDS if re.search(pattern, text)), OTHER)


def profile(stage: Path, width: int, samples: int) -> Counter[str]:
    """Samples of the clock by kind of code, of what the renderer's own libraries do."""
    settings = {"samplesPerPixel": samples, "maxBounces": 12, "threads": 1, "pixelFilter": "box"}
    with tempfile.TemporaryDirectory(prefix="mbfeat-bench-") as folder:
        data = Path(folder) / "perf.data"
        command = ["taskset", "-c", "0", "perf", "record", "-q", "-e", "cpu-clock:u"]
        command += ["-F", str(FREQUENCY), "-o", str(data)]
        command += [sys.executable, "-m", "mbfeat.usdrecord", "--renderer", "MBFeat", "--quiet"]
        command += ["--imageWidth", str(width)]
        for name, value in settings.items():
            command += ["--set", f"mbfeat:{name}={value}"]
        command += [str(stage), str(Path(folder) / "image.exr")]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")
        report = ["perf", "report", "-i", str(data), "--no-children", "--sort", "dso,symbol"]
        report += ["--field-separator", ";", "-F", "sample,dso,symbol"]
        told = subprocess.run(report, capture_output=True, text=True, check=True).stdout
    found: Counter[str] = Counter()
    for line in told.splitlines():
        fields = [part.strip() for part in line.split(";", 2)]
        if len(fields) == 3 and fields[0].isdigit() and re.match(r"lib(mbfeat|embree)", fields[1]):
            found[kind_of(fields[1], fields[2])] += int(fields[0])
    return found


def default_stages() -> list[Path]:
    """Those of the benchmark, as far as they are there."""
    made = this_layout().peers / "stages" / "field.usdc"
    return [*sorted(BENCH.glob("*.usda")), *([made] if made.exists() else [])]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("stages", type=Path, nargs="*")
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--width", type=int, default=320)
    options = parser.parse_args()
    if shutil.which("perf") is None:
        sys.exit("profile_stages: there is no perf; install Debian's package linux-perf")
    columns = {}
    for stage in options.stages or default_stages():
        columns[stage.stem] = profile(stage, options.width, options.samples)
        print(f"profiled {stage.stem}", file=sys.stderr, flush=True)
    print(f"{cpu_name()}, one thread; per cent of {FREQUENCY} samples a second\n")
    print("| | " + " | ".join(columns) + " |")
    print("|---" * (len(columns) + 1) + "|")
    for kind in [*(name for name, _ in KINDS), OTHER]:
        shares = [100.0 * found[kind] / max(found.total(), 1) for found in columns.values()]
        print(f"| {kind} | " + " | ".join(f"{share:.0f}" for share in shares) + " |")


if __name__ == "__main__":
    main()
