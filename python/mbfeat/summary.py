"""The summary that ``usdrecord`` prints of a render."""

from __future__ import annotations

import os

from mbfeat import _core


def summary(report: _core.RenderReport, what: str, written: list[str]) -> str:
    """What was rendered and where it went, time by phase, effects, and what to look at again.

    `what` names stage, frame and camera; `written` lists files beyond those of the report.
    """
    lines = [
        f"rendered {what}, {report.samples_per_pixel} samples per pixel",
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


def _phases(report: _core.RenderReport) -> str:
    parts = [f"{name} {seconds:.2f} s" for name, seconds in report.seconds]
    return f"{report.total_seconds:.2f} s ({', '.join(parts)})"


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def _shown(path: str) -> str:
    relative = os.path.relpath(path)
    return path if relative.startswith("..") else relative
