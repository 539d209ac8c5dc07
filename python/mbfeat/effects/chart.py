"""The bar chart of what effects cost. The only module of the package that imports matplotlib."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

PRESENT, ABSENT = "#2b6ca3", "#b9bec4"


def write_chart(file: Path, result: Mapping[str, Any]) -> None:
    """Draws the costs, the dearest first, into a .png or .svg; bars show medians, lines ranges."""
    present = {effect["name"] for effect in result["effects"]}
    rows = sorted(
        result["cost"].items(),
        key=lambda row: row[1]["seconds_per_million"]["median"],
        reverse=True,
    )
    spreads = [row["seconds_per_million"] for _, row in rows]
    medians = [s["median"] for s in spreads]
    ranges = [
        [s["median"] - s["low"] for s in spreads],
        [s["high"] - s["median"] for s in spreads],
    ]
    figure = Figure(figsize=(8.0, 1.6 + 0.24 * len(rows)), layout="constrained")
    canvas = FigureCanvasSVG if file.suffix.lower() == ".svg" else FigureCanvasAgg
    canvas(figure)
    axes = figure.add_subplot()
    axes.barh(
        range(len(rows)),
        medians,
        xerr=ranges,
        color=[PRESENT if name in present else ABSENT for name, _ in rows],
        error_kw={"elinewidth": 0.8, "ecolor": "#444444"},
    )
    axes.set_yticks(range(len(rows)), [f"{name} ({row['how']})" for name, row in rows], fontsize=8)
    axes.invert_yaxis()
    axes.axvline(0.0, color="#444444", linewidth=0.8)
    axes.grid(axis="x", linewidth=0.3)
    axes.set_axisbelow(True)
    axes.set_xlabel("seconds that a million samples take longer with the effect")
    whole = result["seconds_per_million"]["specialised"]["median"]
    axes.set_title(
        f"{Path(result['stage']).name}: {whole:.3f} s per million samples, "
        f"{result['specialised_over_full']:.2f} of the full kernel's\n"
        f"{result['processor']}, {result['threads']} thread(s), {result['date']}; "
        "blue: the stage calls for it, grey: it does not",
        fontsize=9,
        loc="left",
    )
    figure.savefig(file, dpi=150)
