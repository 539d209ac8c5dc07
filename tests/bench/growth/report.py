"""Tables of a result, in Markdown; the command prints them and the page holds them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

Result = Mapping[str, Any]

# Columns of an axis's table: heading, metric.
COMMON = [
    ("open + translate, s", ("open_s", "translate_s")),
    ("build, s", ("build_s",)),
    ("sampling, s", ("sampling_s",)),
    ("write, s", ("write_s",)),
    ("CPU of all, s", ("cpu_s",)),
    ("ns a sample", ("sample_ns",)),
    ("peak memory, MB", ("peak_mb",)),
]
EXTRA = {
    "textures": [("texels, MB", ("image_mb",))],
    "resolution": [("film, MB", ("film_mb",))],
    "aovs": [("film, MB", ("film_mb",))],
}
FIT_NAMES = {
    "prepare_cpu_s": "CPU seconds beside sampling",
    "sampling_cpu_s": "CPU seconds of sampling",
    "cpu_s": "CPU seconds of all",
    "peak_mb": "peak memory",
}


def number(value: float) -> str:
    """Three digits that count, and no more noise."""
    if abs(value) >= 1000:
        return f"{value:,.0f}"
    if abs(value) >= 100:
        return f"{value:.0f}"
    return f"{value:.3g}" if abs(value) >= 0.001 else "0"


def ranged(spread: Mapping[str, float]) -> str:
    """Median (low .. high)."""
    return f"{number(spread['median'])} ({number(spread['low'])} .. {number(spread['high'])})"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a Markdown table."""
    lines = [f"| {' | '.join(head)} |", f"|{'---|' * len(head)}"]
    return [*lines, *(f"| {' | '.join(row)} |" for row in rows)]


def _cell(point: Mapping[str, Any], metrics: Sequence[str]) -> str:
    """One metric, or the sum of some, whose ranges are added too."""
    keys = ("median", "low", "high")
    return ranged({key: sum(point[metric][key] for metric in metrics) for key in keys})


def axis_table(name: str, axis: Mapping[str, Any]) -> list[str]:
    """A row for each value."""
    columns = COMMON + EXTRA.get(name, [])
    rows = [
        [f"{point['value']:,}", *(_cell(point, metrics) for _, metrics in columns)]
        for point in axis["points"]
    ]
    return table([axis["unit"], *(head for head, _ in columns)], rows)


def slope_table(axes: Mapping[str, Any]) -> list[str]:
    """The slopes of every axis that has some."""
    rows = []
    for name, axis in axes.items():
        if axis["slopes"]:
            cells = []
            for metric in FIT_NAMES:
                fit = axis["slopes"][metric]
                cells.append(f"{_slope(fit)}, from {fit['from']:,}" if fit else "no growth")
            rows.append([name, *cells])
    return table(["what grows", *FIT_NAMES.values()], rows) if rows else []


def _slope(fit: Mapping[str, float]) -> str:
    return f"{fit['median']:.2f} ({fit['low']:.2f} .. {fit['high']:.2f})"


def decade_table(axes: Mapping[str, Any]) -> list[str]:
    """What a factor of ten adds to a sample, of the axes of which that is claimed."""
    rows = [
        [name, f"{step['from']:,} to {step['to']:,}", ranged(step["ns"])]
        for name, axis in axes.items()
        for step in axis.get("per_decade") or []
    ]
    return table(["what grows", "from", "ns a sample, per factor of ten"], rows) if rows else []


def is_busy(result: Result) -> bool:
    """Whether other programs took much of the cores."""
    machine = result["machine"]
    return bool(max(machine["load_average"]) > machine["cores"] + 0.5)


def aim_table(result: Result) -> list[str]:
    """Every aim that was measured."""
    missed = "not told: others had the cores" if is_busy(result) else "**no**"
    rows = [
        [aim["what"], aim["aim"], ranged(aim["measured"]), "yes" if aim["met"] else missed]
        for aim in result["aims"]
    ]
    return table(["", "aim", "measured", "met"], rows) if rows else []


def counted(number: int, one: str, more: str) -> str:
    """A number with its noun."""
    return f"{number} {one if number == 1 else more}"


def about(result: Result) -> str:
    """Date, machine, threads, rounds and load in a sentence."""
    machine = result["machine"]
    load = " to ".join(f"{load:.1f}" for load in machine["load_average"])
    size = "small sizes, which say little; " if result["quick"] else ""
    return (
        f"{result['date']}, {machine['cpu']}, {result['threads']} threads, "
        f"{counted(result['rounds'], 'round', 'rounds')}; {size}"
        f"load average {load} on {machine['cores']} cores."
    )


def summary(result: Result) -> str:
    """Everything, for the terminal."""
    lines = [about(result), ""]
    for name, axis in result["axes"].items():
        lines += [name, "", *axis_table(name, axis), ""]
    for part in (slope_table(result["axes"]), decade_table(result["axes"]), aim_table(result)):
        lines += [*part, ""] if part else []
    return "\n".join(lines).rstrip()
