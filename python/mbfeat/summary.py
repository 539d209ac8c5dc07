"""The summary that ``usdrecord`` prints of a render."""

from __future__ import annotations

import os

from mbfeat import _core

STOPPED = {
    "targetError": "stopped at the target error",
    "timeLimit": "stopped at the time limit",
    "interrupted": "interrupted",
}


def summary(report: _core.RenderReport, what: str, written: list[str]) -> str:
    """What was rendered and where it went, time by phase, effects, and what to look at again.

    `what` names stage, frame and camera; `written` lists files beyond those of the report.
    """
    lines = [
        f"rendered {what}, {_samples(report)}",
        *(f"wrote {_shown(path)}" for path in dict.fromkeys([*report.written, *written])),
        f"time: {_phases(report)}",
        f"scene: {_count(report.triangles, 'triangle')}, {_count(report.instances, 'instance')}, "
        f"{_count(report.lights, 'light')}; {report.paths:,} paths, {report.rays:,} rays",
        f"effects: {', '.join(report.effects) or 'none'}",
    ]
    chosen = [
        f"{name}={text} ({source.name.replace('_', ' ').lower()})"
        for name, text, source in report.settings
        if source != _core.SettingSource.DEFAULT
    ]
    if chosen:
        lines.append(f"settings: {', '.join(chosen)}")
    lines.append(f"warnings: {report.warnings}")
    if report.non_finite:
        lines.append(
            f"non-finite samples: {report.non_finite:,}, replaced by black; the AOV "
            "nonFinite shows where"
        )
    return "\n".join(f"  {line}" for line in lines)


def _samples(report: _core.RenderReport) -> str:
    taken = report.sampling
    if taken.fewest == taken.most:
        text = f"{taken.most} samples per pixel"
    else:
        text = f"{taken.fewest} to {taken.most} samples per pixel, {taken.mean:.1f} on average"
    split = sorted({count for count in report.branches if count})
    if split and split != [1]:
        text += f" of paths that split into {' or '.join(map(str, split))}"
    if taken.stopped != "samples":
        text += f"; {STOPPED[taken.stopped]}"
    if taken.error is not None and taken.error95 is not None:
        text += (
            f"; estimated error {taken.error:.2%}, of the 95th percentile of pixels "
            f"{taken.error95:.2%}"
        )
    return text


def _phases(report: _core.RenderReport) -> str:
    parts = [f"{name} {seconds:.2f} s" for name, seconds in report.seconds]
    return f"{report.total_seconds:.2f} s ({', '.join(parts)})"


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def _shown(path: str) -> str:
    relative = os.path.relpath(path)
    return path if relative.startswith("..") else relative
