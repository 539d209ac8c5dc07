"""Instructions that absent effects cost: the kernel as it is by one compiled without the effect.

    ./run python tests/bench/effects/instructions.py --json instructions.json

Builds the AVX2 kernel once as it is and once without each effect, lets each trace the same paths
of five small scenes (one for each prebuilt set of parts of the closure) under valgrind's callgrind,
and divides the instructions: Embree's are among them. A sixth scene calls for every effect: there
the full kernel is compared with one that was compiled for that, and asks for nothing. Needs
valgrind (Debian package of that name).
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

SCENES = ("diffuse", "opaque", "glass", "coated", "full")
LIMIT = 1.01
FULL_LIMIT = 1.1  # of the full kernel by one that takes all effects for granted


def build(folder: Path) -> None:
    """Builds the bench and all kernels; some minutes."""
    command = ["cmake", "--build", str(folder), "--target", "effectKernels"]
    subprocess.run(command, check=True, stdout=sys.stderr)


def trace(folder: Path, module: str, scene: str) -> tuple[int, list[str]]:
    """Instructions of the traced paths, and what the bench says of its work."""
    command = ["valgrind", "--tool=callgrind", "--toggle-collect=benchTrace"]
    command += ["--callgrind-out-file=/dev/null", str(folder / "bin" / "effectBench")]
    command += [str(folder / "bench" / f"{module}.so"), scene]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    counted = re.search(r"Collected : (\d+)", answer.stderr)
    if answer.returncode != 0 or counted is None:
        raise SystemExit(f"{module} on {scene} failed:\n{answer.stderr}")
    return int(counted[1]), answer.stdout.strip().split("|")


def module_of(effect: str, folder: Path) -> str:
    """The module without the effect; its name is that of the enumeration, e.g. kRoughGlass."""
    wanted = "without_k" + "".join(c for c in effect.lower() if c.isalpha())
    aliases = {
        "without_klightswithoutshadows": "without_kshadowlesslights",
        "without_kfirstnondelta": "without_kfirstnondelta",
    }
    wanted = aliases.get(wanted, wanted)
    for file in (folder / "bench").glob("kernel_*.so"):
        if file.stem.removeprefix("kernel_").lower() == wanted:
            return file.stem
    raise SystemExit(f"there is no kernel without {effect}")


def measure(folder: Path) -> list[dict[str, Any]]:
    """A row for each scene and each effect that it does not call for."""
    from mbfeat import _core

    names = [row.name for row in _core.effect_table()]
    rows = []
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        for scene in SCENES:
            whole, (prebuilt, radiance, *present) = trace(folder, "kernel_whole", scene)
            absent = [name for name in names if name not in present]
            modules = [module_of(name, folder) for name in absent]
            answers = pool.map(trace, [folder] * len(absent), modules, [scene] * len(absent))
            for name, (count, (_, other, *_)) in zip(absent, answers, strict=True):
                if other != radiance:
                    raise SystemExit(f"without {name} the {scene} scene is another one")
                rows.append(
                    {
                        "scene": scene,
                        "prebuilt": prebuilt,
                        "effect": name,
                        "instructions": whole,
                        "without": count,
                        "ratio": whole / count,
                    }
                )
    return rows


def measure_full(folder: Path) -> dict[str, Any]:
    """The full kernel in a scene that calls for everything, by one compiled for such scenes."""
    from mbfeat import _core

    count, (prebuilt, radiance, *present) = trace(folder, "kernel_whole", "everything")
    absent = {row.name for row in _core.effect_table()} - set(present)
    if prebuilt != "full" or absent:
        raise SystemExit(f"the scene gets the {prebuilt} kernel and does not call for {absent}")
    best, (_, other, *_) = trace(folder, "kernel_everything", "everything")
    if other != radiance:
        raise SystemExit("the kernel for everything makes another image")
    return {"instructions": count, "best": best, "ratio": count / best}


def table(rows: list[dict[str, Any]]) -> list[str]:
    """Markdown: effects down, scenes across."""
    lines = [f"| absent effect | {' | '.join(SCENES)} |", "|---" * (len(SCENES) + 1) + "|"]
    ratios = {(row["effect"], row["scene"]): row["ratio"] for row in rows}
    for effect in dict.fromkeys(row["effect"] for row in rows):
        cells = [
            f"{ratios[effect, scene]:.4f}" if (effect, scene) in ratios else "present"
            for scene in SCENES
        ]
        lines.append(f"| {effect} | {' | '.join(cells)} |")
    return lines


def main() -> int:
    """Measures and prints; 1 when an absent effect costs more than the limit."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what was counted there")
    parser.add_argument("--skip-build", action="store_true", help="the kernels are built already")
    options = parser.parse_args()
    if shutil.which("valgrind") is None:
        raise SystemExit("valgrind is missing: apt-get install valgrind")
    folder = Path(os.environ["MBFEAT_BUILD_DIR"])
    if not options.skip_build:
        build(folder)
    rows = measure(folder)
    print("\n".join(table(rows)))
    worst = max(rows, key=lambda row: row["ratio"])
    print(f"\nworst: {worst['ratio']:.4f}, {worst['effect']} absent from {worst['scene']}")
    full = measure_full(folder)
    print(f"full kernel where all is called for, by one compiled for that: {full['ratio']:.4f}")
    if options.json:
        result = {
            "date": datetime.now(UTC).date().isoformat(),
            "limit": LIMIT,
            "rows": rows,
            "full": full,
        }
        options.json.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    return 0 if worst["ratio"] <= LIMIT and full["ratio"] <= FULL_LIMIT else 1


if __name__ == "__main__":
    sys.exit(main())
