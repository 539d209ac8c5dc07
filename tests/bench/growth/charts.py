"""The plots of a result. The only module of the package that imports matplotlib."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

# Okabe and Ito's colours, which colour-blind people can tell apart; markers differ besides.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00")
MARKERS = ("o", "s", "^", "D", "v")
FAINT = "#DDDDDD"
SECONDS = {
    "translate_s": "translate",
    "build_s": "build",
    "sampling_s": "sampling",
    "write_s": "write",
    "wall_s": "all",
}
LEAST_SECONDS = 1e-4  # what is shorter is not told from the clock's noise


def png(axis: Mapping[str, Any], about: str, *, dpi: int = 110) -> bytes:
    """Seconds by phase, time of a sample, and memory against the values of an axis."""
    figure = Figure(figsize=(13.0, 4.0), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    seconds, sample, memory = figure.subplots(1, 3)
    points = axis["points"]
    _lines(seconds, points, SECONDS, LEAST_SECONDS)
    seconds.set_yscale("log")
    seconds.set_title("wall seconds", loc="left", fontsize=10)
    _lines(sample, points, {"sample_ns": "sampling"}, 0.0)
    sample.set_ylim(bottom=0)
    sample.set_title("ns of CPU time a sample", loc="left", fontsize=10)
    _lines(memory, points, {"peak_mb": "peak", "film_mb": "film", "image_mb": "texels"}, 0.01)
    memory.set_yscale("log")
    memory.set_title("MB", loc="left", fontsize=10)
    for axes in (seconds, sample, memory):
        if points[0]["value"] > 0:
            axes.set_xscale("log")
        axes.set_xlabel(axis["unit"], fontsize=9)
        axes.tick_params(which="both", labelsize=8)
        axes.grid(which="major", color=FAINT, linewidth=0.7)
        axes.set_axisbelow(True)
        if len(axes.get_lines()) > 1:
            axes.legend(fontsize=8)
    figure.suptitle(about, fontsize=9, x=0.01, ha="left")
    sink = io.BytesIO()
    figure.savefig(sink, format="png", dpi=dpi)
    return sink.getvalue()


def _lines(
    axes: Axes, points: Sequence[Mapping[str, Any]], metrics: Mapping[str, str], least: float
) -> None:
    """A line through the medians of each metric that is above `least`, in a band of its range."""
    for i, (metric, label) in enumerate(metrics.items()):
        mine = [point for point in points if point[metric]["median"] > least]
        values = [point["value"] for point in mine]
        middle, low, high = (
            [max(point[metric][key], least) for point in mine] for key in ("median", "low", "high")
        )
        if mine:
            axes.fill_between(values, low, high, color=COLOURS[i], alpha=0.18, linewidth=0)
            axes.plot(
                values, middle, color=COLOURS[i], marker=MARKERS[i], markersize=5, label=label
            )
