"""The documentation's page 'What the features buy', from the JSON of a comparison."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mbfeat.files import write_whole
from mbfeat.metrics import NAMES

DOCS = Path(__file__).resolve().parents[2] / "python" / "mbfeat" / "docs"
WIDTH = 100
HEAD = """\
# What the features buy

Reconstructions of a few paths a pixel, on scenes of classes that no network was trained on and on
three stages that the paper's scenes are like, by

- `best`, the network that MBFeat denoises with by default, and `first_hit`, the same network
  trained by the same steps on the same patches, which sees what is recorded of the first hit
  (depth, albedo, normal, direct light, roughness) in place of six vertices and their events. What
  tells the two apart is what the features buy; where `first_hit` has less error they do harm.
- `gbuffer` and `paths`: the same comparison for the paper's network, the SKSN of 2019 at a reduced
  size, with the first hit's features and with the 54 of six vertices.
- `fast`, a smaller network, and Open Image Denoise, plain and at its best (albedo and normal of the
  first vertex that is neither mirror nor clear glass, each filtered before).

The page is made by

    {command}
    ./run training python -m training.evaluate --page {json}

How the networks were trained, for how short a time, and what was tried is on
[their card](../models/README.md).
"""
# What is aimed at, and what Cho, Huo and Yoon's network has: relMSE and so on of paths/gbuffer.
PAPER = {"relMSE": 0.523, "tonemappedRelMSE": 0.988, "MSE": 1.121, "relL1": 0.948, "L1": 1.130}
FEATURE_AIMS = {"relMSE": 0.45, "tonemappedRelMSE": 0.80, "MSE": 0.85, "relL1": 0.80, "L1": 0.88}
FEATURE_PAIRS = ("paths/gbuffer", "best/first_hit")
AIMS: dict[str, dict[str, float]] = {
    **dict.fromkeys(FEATURE_PAIRS, FEATURE_AIMS),
    "best/oidn at equal time, reflection and refraction": {"relMSE": 0.70},
    "best/oidn at equal time, diffuse": {"relMSE": 1.05},
}
Groups = Sequence[Mapping[str, Any]]


def write(result: Mapping[str, Any], source: Path) -> Path:
    """Writes the page, and its picture where the comparison made one; returns the page."""
    picture = None
    if result.get("sheet"):
        sheet = Path(result["sheet"])
        picture = f"comparison{sheet.suffix}"
        write_whole(DOCS / "images" / picture, sheet.read_bytes())
    target = DOCS / "comparison.md"
    write_whole(target, page(result, source, picture))
    return target


def page(result: Mapping[str, Any], source: Path, picture: str | None) -> str:
    """The page as Markdown."""
    floor = result["reference_floor"]
    lines = [
        HEAD.format(command=f"./run training {result['command']}", json=source.name).rstrip(),
        "",
        *textwrap.wrap(
            f"{result['date']}; {result['processor']}, {result['threads']} threads; "
            f"{result['windows']} windows of 128 x 128 pixels. The references' own relMSE (epsilon "
            f"1e-2) is {floor['median']:.2g} in the median and {floor['mean']:.2g} in the mean: "
            "what a perfect image would be found to have. Means over windows; relMSE, tonemapped "
            "relMSE and relL1 have an epsilon of 1e-4; DSSIM and FLIP are of the sRGB image. "
            "Seconds are those of all windows.",
            WIDTH,
        ),
    ]
    if result["load_average"] > 0.5 * result["threads"]:
        lines += [
            "",
            *textwrap.wrap(
                "The machine was busy with other work (load average "
                f"{result['load_average']:.1f}): the seconds are too many.",
                WIDTH,
            ),
        ]
    if picture:
        lines += ["", f"![Crops side by side](images/{picture})"]
    lines += ["", "## Ratios", "", *_ratios(result)]
    samples = sorted({group["samples"] for group in result["groups"]}, reverse=True)
    lines += ["", "## All windows"]
    for count in samples:
        chosen = [g for g in result["groups"] if g["samples"] == count and g["group"] == "all"]
        lines += ["", *_methods(chosen, count)]
    lines += ["", "## By class", "", f"relMSE at {samples[0]} samples a pixel.", ""]
    lines += _classes([g for g in result["groups"] if g["samples"] == samples[0]])
    return "\n".join(lines).rstrip() + "\n"


def _ratios(result: Mapping[str, Any]) -> list[str]:
    lines = [
        "Mean of one method over mean of the other at the larger number of samples, with 95 %",
        "intervals by resampling windows. At equal time the faster method gets the difference as",
        "extra samples.",
        "",
        "| ratio | metric | found | interval | aim | paper |",
        "|---|---|---|---|---|---|",
    ]
    for name, by_metric in result["ratios"].items():
        for metric, found in by_metric.items():
            low, high = result["intervals"][name][metric]
            aim = AIMS.get(name, {}).get(metric)
            paper = PAPER.get(metric) if name in FEATURE_PAIRS else None
            lines.append(
                f"| {name} | {metric} | {found:.3f} | {low:.3f} to {high:.3f} | "
                f"{_verdict(found, aim)} | {paper or ''} |"
            )
    return lines


def _verdict(found: float, aim: float | None) -> str:
    if aim is None:
        return ""
    return f"{aim:g}: reached" if found <= aim else f"{aim:g}: missed by {found - aim:.3f}"


def _methods(groups: Groups, samples: int) -> list[str]:
    head = " | ".join(NAMES)
    lines = [
        f"| {samples} samples a pixel | {head} | seconds |",
        "|---|" + "---|" * (len(NAMES) + 1),
    ]
    for group in groups:
        cells = " | ".join(f"{group['metrics'][name]:.4g}" for name in NAMES)
        lines.append(f"| {group['method']} | {cells} | {group['seconds']:.2f} |")
    return lines


def _classes(groups: Groups) -> list[str]:
    methods = list(dict.fromkeys(group["method"] for group in groups))
    lines = ["| class | windows | " + " | ".join(methods) + " |", "|---" * (len(methods) + 2) + "|"]
    for name in dict.fromkeys(group["group"] for group in groups):
        mine = {g["method"]: g for g in groups if g["group"] == name}
        cells = " | ".join(f"{mine[method]['metrics']['relMSE']:.4g}" for method in methods)
        lines.append(f"| {name} | {mine[methods[0]]['images']} | {cells} |")
    return lines
