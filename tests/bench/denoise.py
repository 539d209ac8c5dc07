"""What denoising costs, phase by phase.

    ./run python tests/bench/denoise.py [STAGE] [--width 1280] [--samples 8] [--rounds 3]

Renders a stage without and with each network that MBFeat comes with, in turn, a process each, and
prints medians and ranges of the seconds that the renderer tells of its phases, as a table for the
docs. Seconds are of the wall clock, on all cores: the machine should do nothing else. Recording
features happens in the sampling of all but the first, and what that takes longer counts too.
"""

from __future__ import annotations

import argparse
import os
import re
import statistics
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

from mbfeat import _core
from mbfeat.machine import cpu_name

STAGE = Path(__file__).resolve().parents[1] / "scenes" / "interior.usda"
PHASES = ("feature recording", "inference", "splat", "tiles")
SAMPLING = "sampling"


def seconds_of(stage: Path, width: int, samples: int, network: str | None) -> dict[str, float]:
    """Phases of one render by their names."""
    # Paths that are recorded do not split: neither do those that they are compared with.
    settings = [f"mbfeat:samplesPerPixel={samples}", "mbfeat:splitting=1"]
    if network:
        settings += ["mbfeat:denoise:enabled=true", f"mbfeat:denoise:model={network}"]
    with tempfile.TemporaryDirectory(prefix="mbfeat-bench-") as scratch:
        command = [sys.executable, "-m", "mbfeat.usdrecord", "--renderer", "MBFeat"]
        command += ["--imageWidth", str(width)]
        command += [part for setting in settings for part in ("--set", setting)]
        command += [str(stage), str(Path(scratch) / "image.exr")]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    line = re.search(r"time: .*\((.*)\)", done.stdout + done.stderr)
    if done.returncode or not line:
        sys.exit(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")
    found = re.findall(r"([a-z ]+) ([\d.]+) s", line.group(1))
    return {name.strip(): float(value) for name, value in found}


def shown(values: list[float]) -> str:
    return f"{statistics.median(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("stage", type=Path, nargs="?", default=STAGE)
    parser.add_argument("--width", type=int, default=1280)
    parser.add_argument("--samples", type=int, default=8)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    networks = [None, *(name for name, _ in _core.installed_models())]
    found: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for _ in range(options.rounds):
        sampling = 0.0
        for network in networks:
            phases = seconds_of(options.stage, options.width, options.samples, network)
            if network is None:
                sampling = phases[SAMPLING]
                continue
            row = found[network]
            for phase in PHASES:
                row[phase].append(phases.get(phase, 0.0))
            row[SAMPLING].append(phases[SAMPLING] - sampling)
            row["all"].append(sum(row[phase][-1] for phase in (SAMPLING, *PHASES)))
    print(f"{cpu_name()}, {os.cpu_count()} threads, {options.stage.name}, width {options.width},")
    print(f"{options.samples} samples a pixel, {options.rounds} rounds: medians and ranges, s\n")
    columns = ("all", SAMPLING, *PHASES)
    print("| network | " + " | ".join(("all", "sampling longer", *PHASES)) + " |")
    print("|---" * (len(columns) + 1) + "|")
    for network, row in found.items():
        print(f"| {network} | " + " | ".join(shown(row[name]) for name in columns) + " |")


if __name__ == "__main__":
    main()
