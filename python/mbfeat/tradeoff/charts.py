"""The picture of a measurement: error against seconds, where the seconds go, and crops.

The only module that imports matplotlib.
"""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import ticker
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpecFromSubplotSpec
from matplotlib.image import imsave
from numpy.typing import NDArray

from mbfeat.tradeoff.analysis import Rung
from mbfeat.tradeoff.crops import Crop
from mbfeat.tradeoff.renders import PHASES
from mbfeat.tradeoff.wording import counted, number

# Okabe and Ito's colours, which colour-blind people can tell apart; markers differ besides.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C6D31")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
PHASE_COLOURS = {
    "load": "#BBBBBB",
    "build": "#777777",
    "sampling": "#0072B2",
    "recording": "#56B4E9",
    "inference": "#D55E00",
    "splat": "#E69F00",
    "write": "#009E73",
    "other": "#CC79A7",
}
INK, FAINT = "#222222", "#DDDDDD"
MOST_BARS = 15


def png(result: Mapping[str, Any], crops: Sequence[Crop], *, dpi: int = 110) -> bytes:
    """The whole picture of a result (see command.result) as a PNG file."""
    rows: list[Rung] = result["rungs"]
    figure = Figure(figsize=(14.0, 9.4), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    columns = 2 if len(crops) > 3 else 1
    grid = figure.add_gridspec(2, 2, width_ratios=(2.5, 0.62 * columns + 0.3), height_ratios=(3, 2))
    _errors(figure.add_subplot(grid[0, 0]), result)
    _breakdown(figure.add_subplot(grid[1, 0]), _bars(rows))
    places = GridSpecFromSubplotSpec(
        math.ceil(len(crops) / columns), columns, subplot_spec=grid[:, 1]
    )
    for i, crop in enumerate(crops):
        _crop(figure.add_subplot(places[i // columns, i % columns]), crop)
    figure.suptitle(
        f"{result['scene']}, {result['width']} x {result['height']} pixels, "
        f"{counted(result['threads'], 'thread')} of {result['machine']['cpu']}",
        fontsize=12,
        color=INK,
    )
    sink = io.BytesIO()
    figure.savefig(sink, format="png", dpi=dpi)
    return sink.getvalue()


def crops_png(rows: Sequence[Sequence[Crop]], *, dpi: int = 110) -> bytes:
    """Crops in rows as a PNG file."""
    columns = max(len(row) for row in rows)
    size = (2.6 * columns, 2.9 * len(rows))
    figure = Figure(figsize=size, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    for i, row in enumerate(rows):
        for j, crop in enumerate(row):
            _crop(figure.add_subplot(len(rows), columns, i * columns + j + 1), crop)
    sink = io.BytesIO()
    figure.savefig(sink, format="png", dpi=dpi)
    return sink.getvalue()


def colours(rows: Sequence[Rung]) -> dict[str, str]:
    """One for each variant."""
    names = list(dict.fromkeys(row["variant"] for row in rows))
    return {name: COLOURS[i % len(COLOURS)] for i, name in enumerate(names)}


def _errors(axes: Axes, result: Mapping[str, Any]) -> None:
    """Error against seconds on logarithmic axes, a band from the least to the most of the seeds."""
    rows: list[Rung] = result["rungs"]
    metric = result["metric"]
    palette = colours(rows)
    axes.set_xscale("log")
    axes.set_yscale("log")
    for i, (name, colour) in enumerate(palette.items()):
        mine = [row for row in rows if row["variant"] == name]
        seconds = [row["total_seconds"]["median"] for row in mine]
        middle, low, high = (
            [max(row["errors"][metric][key], 1e-12) for row in mine]
            for key in ("median", "low", "high")
        )
        marker = MARKERS[i % len(MARKERS)]
        axes.fill_between(seconds, low, high, color=colour, alpha=0.18, linewidth=0)
        axes.plot(seconds, middle, color=colour, marker=marker, markersize=5, label=name, zorder=3)
        for row, x, y in zip(mine, seconds, middle, strict=True):
            spread = [[x - row["total_seconds"]["low"]], [row["total_seconds"]["high"] - x]]
            axes.errorbar(x, y, xerr=spread, color=colour, linewidth=0.8, alpha=0.7)
            axes.annotate(
                str(row["samples_per_pixel"]),
                (x, y),
                xytext=(4, 4),
                textcoords="offset points",
                fontsize=7,
                color=colour,
            )
    _front(axes, rows, metric)
    _guide(axes, rows, metric)
    floor = (result["reference"]["noise"] or {}).get(metric)
    if floor:
        axes.axhline(floor, color=INK, linewidth=0.8, linestyle=":")
        axes.annotate(
            "the reference's own noise",
            (0.995, floor),
            xycoords=("axes fraction", "data"),
            xytext=(0, 3),
            textcoords="offset points",
            fontsize=7,
            ha="right",
            color=INK,
        )
    epsilon = result["epsilons"].get(metric)
    axes.set_ylabel(metric + (f" (epsilon {epsilon:g})" if epsilon else ""))
    axes.set_xlabel("seconds from the start of the program to the written image")
    times = [row["total_seconds"][key] for row in rows for key in ("low", "high")]
    axes.set_xlim(0.8 * min(times), 1.25 * max(times))
    axes.xaxis.set_major_formatter(ticker.FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_formatter(ticker.FuncFormatter(_sparse))
    axes.tick_params(which="both", labelsize=8)
    axes.grid(which="major", color=FAINT, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.legend(fontsize=8, loc="upper right", framealpha=0.9)
    axes.set_title(
        f"Error against time, {counted(result['seeds'], 'seed')}: median, least and most; samples "
        "a pixel beside the marks",
        loc="left",
        fontsize=11,
    )


def _sparse(value: float, _: object) -> str:
    """Labels of the minor ticks 2 and 5 alone."""
    digit = round(value / 10 ** math.floor(math.log10(value))) if value > 0 else 0
    return f"{value:g}" if digit in (2, 5) else ""


def _front(axes: Axes, rows: Sequence[Rung], metric: str) -> None:
    """The steps below which nothing was measured."""
    best = sorted(
        (row["total_seconds"]["median"], max(row["errors"][metric]["median"], 1e-12))
        for row in rows
        if row["on_front"]
    )
    if not best:
        return
    axes.step(
        [x for x, _ in best],
        [y for _, y in best],
        where="post",
        color=INK,
        linewidth=1.1,
        linestyle="--",
        label="Pareto front",
        zorder=2,
    )
    axes.plot(*zip(*best, strict=True), "o", mfc="none", mec=INK, markersize=10, zorder=4)


def _guide(axes: Axes, rows: Sequence[Rung], metric: str) -> None:
    """What independent samples do: a tenth of the squared error in ten times the time."""
    raw = [row for row in rows if row["variant"] == rows[0]["variant"]]
    last = max(raw, key=lambda row: row["samples_per_pixel"])
    x, y = last["total_seconds"]["median"], last["errors"][metric]["median"]
    left = max(min(row["total_seconds"]["median"] for row in raw), x / 30)
    if y <= 0 or left >= x:
        return
    slope = -1.0 if metric in ("relMSE", "tonemappedRelMSE", "MSE") else -0.5
    ends = np.array([left, x])
    axes.plot(
        ends,
        y * (ends / x) ** slope,
        color="#999999",
        linewidth=0.9,
        linestyle=(0, (6, 3)),
        label=f"slope {slope:g}",
        zorder=1,
    )


def _bars(rows: Sequence[Rung]) -> list[Rung]:
    """The rungs whose seconds are shown: all, or of each variant the last ones."""
    names = list(dict.fromkeys(row["variant"] for row in rows))
    each = max(MOST_BARS // max(len(names), 1), 1)
    found = []
    for name in names:
        found += [row for row in rows if row["variant"] == name][-each:]
    return found


def _breakdown(axes: Axes, rows: Sequence[Rung]) -> None:
    """Where the seconds go, as shares, with the seconds beside: bars of all lengths are legible."""
    labels = [f"{row['variant']}, {row['samples_per_pixel']}" for row in rows]
    places = np.arange(len(rows))
    left = np.zeros(len(rows))
    totals = np.array([max(sum(row["seconds"].values()), 1e-9) for row in rows])
    for phase in PHASES:
        seconds = np.array([row["seconds"][phase] for row in rows])
        if not seconds.any():
            continue
        share = 100.0 * seconds / totals
        axes.barh(places, share, left=left, color=PHASE_COLOURS[phase], label=phase, height=0.75)
        for place, start, part, value in zip(places, left, share, seconds, strict=True):
            if part > 7:
                axes.text(
                    start + part / 2,
                    float(place),
                    f"{number(value)} s",
                    ha="center",
                    va="center",
                    fontsize=6.5,
                    color="white" if phase in ("build", "sampling", "inference") else INK,
                )
        left += share
    for line, row in enumerate(rows):
        total = f"{number(row['total_seconds']['median'])} s"
        axes.text(101, line, total, va="center", fontsize=7, color=INK)
    axes.set_yticks(places, labels, fontsize=7)
    axes.invert_yaxis()
    axes.set_xlim(0, 109)
    axes.set_xticks([0, 25, 50, 75, 100])
    axes.set_xlabel(
        "% of the seconds of the render of the median total; samples a pixel beside the names"
    )
    axes.legend(fontsize=7, ncols=8, loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False)
    axes.set_title("Where every second goes", loc="left")
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _crop(axes: Axes, crop: Crop) -> None:
    axes.imshow(crop.pixels, interpolation="nearest")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title(crop.title, fontsize=8.5, pad=3, color=INK)
    axes.set_xlabel(crop.note, fontsize=7.5, color=INK)


def image_png(pixels: NDArray[np.float64], scale: int = 1) -> bytes:
    """A display image [height, width, 3] in 0..1 as a PNG file, each pixel `scale` wide."""
    sink = io.BytesIO()
    imsave(sink, np.clip(pixels.repeat(scale, 0).repeat(scale, 1), 0.0, 1.0), format="png")
    return sink.getvalue()
