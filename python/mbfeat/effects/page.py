"""The page 'effects on demand' of the documentation, from the JSON of runs."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mbfeat.effects.command import askers, cost_text

PAGE = Path(__file__).resolve().parents[1] / "docs" / "effects.md"
COUNTED = "rows"  # a key that only counts of instructions have

HEAD = """# Effects on demand

A scene is traced by a kernel for what it calls for. `./run mbfeat effects STAGE` shows which
effects those are, which prims or AOVs ask for them, what is left out, and with `--measure` what
each costs.

    ./run mbfeat effects STAGE                       # what the stage calls for
    ./run mbfeat effects STAGE --json                # the same as JSON
    ./run mbfeat effects STAGE --measure --chart costs.png
    ./run mbfeat effects --page FILE.json FILE.json  # writes this page again

How it works:

- When a scene is committed, a census looks at every material on every mesh and at every light; the
  camera and the AOVs are looked at for each image. Edits bring effects and take them away; nothing
  else is rebuilt for it (`tests/python/test_effects_edits.py`).
- The SIMD kernels are built for five sets of parts of the closure: *diffuse* (nothing reflects),
  *opaque* (an interface that reflects), *glass* (and transmission), *coated* (instead of that,
  clearcoat and the specular workflow) and *full* (all of it). The first that has what the scene
  needs is taken. Recording of path features is compiled in or out too: that makes ten kernels for
  each instruction set.
- Everything else is a stage or a branch of a whole group of paths that does not run where the
  census did not find the effect: cut-outs, textures, normal maps, emission, environments, light
  shapes, multipliers, lights without shadows, the choice among several lights.
- The image is that of the full kernel to the last bit (`tests/cpp/integrate/kernels.cpp`,
  `tests/python/test_effects.py`): random numbers are reserved for each vertex, used or not.
- Films hold the AOVs that are bound, meshes the primvars that a material or an AOV reads, the
  texture cache the images that an input reads, a thread's path records the parts that an AOV reads
  (a cache line a path for `color` alone, eleven for everything). More than eight light shapes have
  an acceleration structure of their own, so that editing them builds no surface again; up to eight
  have none. The counters are in the JSON of `mbfeat effects` and of the render report (`memory`,
  `builds`).

`mbfeat:effects` steers this: `auto`, `full` (the kernel with everything, as if the scene called for
it), `+NAME` handles an effect although nothing calls for it, `-NAME` takes one away from the scene.
What users may do without has settings of its own: `mbfeat:maxDiffuseBounces`,
`mbfeat:maxReflectionBounces`, `mbfeat:maxTransmissionBounces`, `mbfeat:caustics` and `mbfeat:blur`;
all of them lose light or sharpen what should be blurred, see [settings](settings.md). There are no
volumes and no motion blur to switch off.

| effect | a scene calls for it when | `-NAME` puts in its place |
|---|---|---|"""

MEASURED = """
## Measured

Seconds of sampling for a million samples, as median (lowest .. highest). What a stage calls for is
taken away and measured against the stage as it is; what it does not call for is forced on, or its
AOVs are added. Each render has one of the stage as it is right before or after it; renders of all
kinds take turns. Taking an effect away may change what paths meet and how long they get: that is
part of its cost, and why some are below zero. Paths do not split (`mbfeat:splitting=1`), since
recorded ones never do."""


def write_page(files: Sequence[Path]) -> int:
    """Writes the page from results of --measure and of instructions.py."""
    try:
        results = [json.loads(file.read_text(encoding="utf-8")) for file in files]
    except (OSError, ValueError) as error:
        sys.stderr.write(f"mbfeat: effects: {error}\n")
        return 1
    PAGE.write_text(page(results), encoding="utf-8")
    print(f"wrote {PAGE}")
    return 0


def page(results: Sequence[Mapping[str, Any]]) -> str:
    """The page as Markdown."""
    from mbfeat import _core

    lines = [HEAD]
    lines += [f"| {row.name} | {row.doc} | {row.without or '-'} |" for row in _core.effect_table()]
    stages = [result for result in results if COUNTED not in result]
    if stages:
        lines += [MEASURED, "", *_ratios(stages)]
    for result in stages:
        lines += ["", *_stage(result)]
    for result in results:
        if COUNTED in result:
            lines += ["", *_instructions(result)]
    return "\n".join(lines) + "\n"


def _ratios(stages: Sequence[Mapping[str, Any]]) -> list[str]:
    lines = [
        "| stage | kernel | s per million samples | full kernel | specialised over full |",
        "|---|---|---|---|---|",
    ]
    for result in stages:
        low, high = result["specialised_over_full_range"]
        seconds = result["seconds_per_million"]
        lines.append(
            f"| {_name(result)} | {result['kernel']['instructions']}, "
            f"{result['kernel']['prebuilt']} | {_spread(seconds['specialised'])} "
            f"| {_spread(seconds['full'])} "
            f"| {result['specialised_over_full']:.3f} ({low:.3f} .. {high:.3f}) |"
        )
    return lines


def _stage(result: Mapping[str, Any]) -> list[str]:
    lines = [
        f"### {_name(result)}",
        "",
        f"    ./run mbfeat effects {result['stage']} --measure --rounds {result['rounds']}",
        "",
        f"{result['date']}, {result['processor']}, {result['threads']} thread(s) on as many cores, "
        f"{result['clock']} seconds, load average {result['load_average']:.1f}, {result['width']} "
        f"pixels wide, {result['samples_per_pixel']} samples per pixel, {result['rounds']} rounds.",
        "",
        "| effect | asked for by | s per million samples |",
        "|---|---|---|",
    ]
    cost = result["cost"]
    for effect in result["effects"]:
        name = effect["name"]
        text = cost_text(cost[name]) if name in cost else "-"
        lines.append(f"| {name} | {askers(effect)} | {text} |")
    lines += [
        f"| {name} | - | {cost_text(cost[name]) if name in cost else '-'} |"
        for name in result["absent"]
    ]
    return lines


def _instructions(result: Mapping[str, Any]) -> list[str]:
    scenes = list(dict.fromkeys(row["scene"] for row in result["rows"]))
    ratios = {(row["effect"], row["scene"]): row["ratio"] for row in result["rows"]}
    lines = [
        "## Absent effects, in instructions",
        "",
        "    ./run python tests/bench/effects/instructions.py --json instructions.json",
        "",
        f"{result['date']}, AVX2 kernel, callgrind: instructions for the same paths by those of a",
        "kernel that was compiled without the effect, in scenes that do not call for it. The limit",
        f"is {result['limit']}.",
        "",
        f"| absent effect | {' | '.join(scenes)} |",
        "|---" * (len(scenes) + 1) + "|",
    ]
    for effect in dict.fromkeys(row["effect"] for row in result["rows"]):
        cells = [
            f"{ratios[effect, scene]:.4f}" if (effect, scene) in ratios else "present"
            for scene in scenes
        ]
        lines.append(f"| {effect} | {' | '.join(cells)} |")
    full = result.get("full")
    if full is not None:
        lines += [
            "",
            "Where a scene calls for everything (as `tests/scenes/everything.usda` does), the full",
            "kernel is the one that the project has. It takes",
            f"{full['ratio']:.4f} times the instructions of a kernel that was compiled for just",
            "that scene and takes all effects for granted; the limit is 1.1.",
        ]
    return lines


def _name(result: Mapping[str, Any]) -> str:
    return Path(result["stage"]).stem


def _spread(value: Mapping[str, float]) -> str:
    return f"{value['median']:.3f} ({value['low']:.3f} .. {value['high']:.3f})"
