"""The results as a table, and as the section of the benchmarks page.

    ./run python -m peers.report results.json

with PYTHONPATH naming tests/bench writes that section again from the JSON of a run.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

PEER_NAMES = {"mitsuba": "Mitsuba", "cycles": "Cycles", "mbfeat": "MBFeat"}
HEADING = "## Against Mitsuba and Cycles"
PAGE = Path(__file__).resolve().parents[3] / "python" / "mbfeat" / "docs" / "benchmarks.md"


def _number(value: float | None) -> str:
    """Three significant digits, without an exponent; JSON has null for what is not finite."""
    if value is None or not math.isfinite(value):
        return "-"
    digits = 0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2 if abs(value) >= 1 else 3
    return f"{value:.{digits}f}"


def _ranged(row: Mapping[str, Any], key: str) -> str:
    low, high = row[f"{key}_range"]
    return f"{_number(row[key])} ({_number(low)} .. {_number(high)})"


def absolute_table(result: Mapping[str, Any]) -> list[str]:
    """Rates, samples and seconds of every renderer, as Markdown."""
    lines = [
        "| scene | renderer | million samples/s | samples a pixel to 0.01 | seconds to 0.01 |",
        "|---|---|---|---|---|",
    ]
    for scene in result["scenes"]:
        rows = {"mbfeat": scene, **scene.get("peers", {})} if "peers" in scene else {}
        for name, row in rows.items():
            mark = "*" if row["spp_extrapolated"] else ""
            lines.append(
                f"| {scene['scene']} | {PEER_NAMES[name]} | {_ranged(row, 'msamples_per_s')} "
                f"| {_ranged(row, 'spp_to_relmse_0_01')}{mark} "
                f"| {_ranged(row, 'seconds_to_relmse_0_01')} |"
            )
        for name, text in scene.get("failures", {}).items():
            lines.append(f"| {scene['scene']} | {PEER_NAMES[name]} | failed: {text} | | |")
    return lines


def ratio_table(result: Mapping[str, Any]) -> list[str]:
    """MBFeat by each peer, as Markdown."""
    lines = [
        "| scene | MBFeat by | rate | samples to 0.01 | time to 0.01 | difference, % | noise, % |",
        "|---|---|---|---|---|---|---|",
    ]
    for scene in result["scenes"]:
        for name, row in scene.get("peers", {}).items():
            noise = (row["reference_noise"] ** 2 + scene["reference_noise"] ** 2) ** 0.5
            lines.append(
                f"| {scene['scene']} | {PEER_NAMES[name]} | {_ranged(row, 'rate_ratio')} "
                f"| {_ranged(row, 'spp_ratio')} | {_ranged(row, 'time_ratio')} "
                f"| {100.0 * row['mean_relative_difference']:.2f} | {100.0 * noise:.2f} |"
            )
    return lines


def summary(result: Mapping[str, Any]) -> str:
    """Both tables for a terminal."""
    parts = absolute_table(result)
    if any(scene.get("peers") for scene in result["scenes"]):
        parts += ["", *ratio_table(result)]
    if any(_extrapolated(scene) for scene in result["scenes"]):
        parts += ["", "* no rung of the ladder reached 0.01: extrapolated as error = c / samples"]
    return "\n".join(parts)


def _extrapolated(scene: Mapping[str, Any]) -> bool:
    rows = [scene, *scene.get("peers", {}).values()]
    return any(row.get("spp_extrapolated") for row in rows)


def section(result: Mapping[str, Any]) -> str:
    """The section of the page, from one run."""
    machine, settings = result["machine"], result["settings"]
    load = machine["load_average"]
    versions = {
        name: row["version"]
        for scene in result["scenes"]
        for name, row in {"mbfeat": scene, **scene.get("peers", {})}.items()
        if "version" in row
    }
    unit = "second" if settings["clock"] == "wall" else "CPU second, counted by threads"
    lines = [
        HEADING,
        "",
        f"    {result['command']}",
        "",
        f'Measured on {result["date"]} on {machine["cores"]} cores of an "{machine["cpu"]}", '
        f"{result['threads']} threads for each renderer. The load average was {load[0]:.1f} at "
        f"the start and {load[1]:.1f} at the end"
        + (
            "; other programs wanted the same cores all the time. "
            if max(load) > 1.5 * machine["cores"]
            else ". "
        )
        + f"{settings['width']} x {settings['height']} pixels, {settings['bounces']} bounces, box "
        "filter, no clamps, no denoiser, no adaptive sampling; "
        f"{'; '.join(versions[name] for name in PEER_NAMES if name in versions)}.",
        "",
        f"A rate is of sampling alone, in million samples (paths from the camera) a {unit}: the "
        "difference of a long and a short render, so that loading and compiling do not count; "
        f"median and range of {settings['rounds']} rounds in which the renderers take turns. "
        "The error is mean((x - r)^2 / (r^2 + 0.01)) against the renderer's own converged image, "
        f"the median of {settings['seeds']} seeds at each of 4, 16, 64, ... samples a pixel up "
        f"to {settings['most_spp']} or to an error below 0.01, fitted as c / samples at the three "
        "rungs next to 0.01. A median leaves out the rare seed with a very bright pixel, for all "
        "renderers alike. Ranges of samples are over the seeds, those of times hold both.",
        "",
        *absolute_table(result),
        "",
    ]
    if any(_extrapolated(scene) for scene in result["scenes"]):
        lines += ["\\* extrapolated: no rung reached 0.01.", ""]
    lines += [
        "The same as ratios; below 1, MBFeat traces fewer samples a second, needs fewer samples, "
        "or takes less time. The difference is that of the converged images, mean |a - b| / "
        "(b + 0.01) over blocks of 8 x 8 pixels, and beside it what the noise left in both "
        "would make.",
        "",
        *ratio_table(result),
        "",
    ]
    return "\n".join(lines)


def write_section(result: Mapping[str, Any], page: Path = PAGE) -> None:
    """Puts the section into the page, in place of an earlier one or at its end.

    Text that follows the tables below a line `<!-- written by hand -->` stays.
    """
    text = page.read_text(encoding="utf-8")
    before, found, rest = text.partition(HEADING + "\n")
    old, next_heading, after = rest.partition("\n## ")
    _, mark, by_hand = old.partition(MARK) if found else ("", "", "")
    parts = [before.rstrip() + "\n\n", section(result)]
    if mark:
        parts.append(f"\n{MARK}{by_hand}")
    if next_heading:
        parts.append(f"\n## {after}")
    page.write_text("".join(parts).rstrip() + "\n", encoding="utf-8")


MARK = "<!-- written by hand -->"


if __name__ == "__main__":
    write_section(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
