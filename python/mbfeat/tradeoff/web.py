"""The result as one HTML file that needs no other, and as CSV."""

from __future__ import annotations

import base64
import csv
import html
import io
from collections.abc import Mapping, Sequence
from typing import Any

from mbfeat.metrics import NAMES
from mbfeat.tradeoff import limits
from mbfeat.tradeoff.analysis import Rung
from mbfeat.tradeoff.charts import colours, image_png
from mbfeat.tradeoff.crops import Crop
from mbfeat.tradeoff.renders import MEANING, PHASES
from mbfeat.tradeoff.variants import OWN, RAW
from mbfeat.tradeoff.wording import counted, not_found, number

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; margin: 2rem auto; max-width: 1240px;
       padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
img.chart { width: 100%; height: auto; }
.answers p { background: #f3f6f9; border-left: 4px solid #0072B2; padding: .6rem .9rem;
             margin: .5rem 0; }
.crops { display: flex; flex-wrap: wrap; gap: 1rem; }
.crops figure { margin: 0; } .crops img { image-rendering: pixelated; width: 190px; }
figcaption { font-size: .8rem; white-space: pre-line; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .82rem; font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .55rem; text-align: right; border-bottom: 1px solid #ddd;
         white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
th { position: sticky; top: 0; background: #fff; }
tr.front td:first-child::after { content: " \\25cf"; color: #222; }
td small { color: #777; }
.dot { display: inline-block; width: .7em; height: .7em; border-radius: 50%; margin-right: .4em; }
code { background: #f3f3f3; padding: .1rem .3rem; }
"""


def csv_text(points: Sequence[Mapping[str, Any]]) -> str:
    """One line for each measurement."""
    sink = io.StringIO()
    writer = csv.writer(sink, lineterminator="\n")
    head = ["variant", "renderer", "samples_per_pixel", "seed", "total_seconds"]
    writer.writerow([*head, *(f"{phase}_seconds" for phase in PHASES), *NAMES, "bias"])
    for point in points:
        writer.writerow(
            [
                *(point[name] for name in head),
                *(point["seconds"].get(phase, 0.0) for phase in PHASES),
                *(point["errors"][name] for name in NAMES),
                point["bias"],
            ]
        )
    return sink.getvalue()


def page(
    result: Mapping[str, Any],
    chart: bytes,
    crops: Sequence[Crop],
    limited: Sequence[Sequence[Crop]] = (),
) -> str:
    """The HTML file."""
    rows: list[Rung] = result["rungs"]
    scene = html.escape(result["scene"])
    parts = [
        '<!doctype html><html lang="en"><meta charset="utf-8">',
        f"<title>What accuracy costs: {scene}</title><style>{STYLE}</style>",
        f"<h1>What accuracy costs: {scene}</h1>",
        *(f"<p>{html.escape(line)}</p>" for line in about(result)),
        '<h2>Answers</h2><div class="answers">',
        *(f"<p>{html.escape(answer['text'])}{_how(answer)}</p>" for answer in result["answers"]),
        "</div>",
        f'<h2>Error against time</h2><img class="chart" alt="error against seconds" '
        f'src="{_data(chart)}">',
        f"<h2>Crops</h2><p>{html.escape(result['crops']['text'])}</p><div class='crops'>",
        *(_figure(crop) for crop in crops),
        f"</div>{_limits(result['limits'], limited)}",
        "<h2>Numbers</h2><p>Medians of the seeds; below them least and most. A dot marks what is "
        "on the Pareto front.</p>",
        f'<div class="scroll">{_table(rows)}</div>',
        "<h2>Seconds</h2><p>Of the render whose total is the median of the seeds. "
        + " ".join(f"<b>{phase}</b>: {html.escape(MEANING[phase])}." for phase in PHASES)
        + "</p>",
        f'<div class="scroll">{_seconds(rows)}</div>',
    ]
    if result["left_out"]:
        left = (f"<li>{html.escape(n)}: {html.escape(t)}" for n, t in result["left_out"].items())
        parts.append(f"<h2>Left out</h2><ul>{''.join(left)}</ul>")
    parts.append(f"<h2>Again</h2><p><code>{html.escape(result['command'])}</code></p></html>")
    return "\n".join(parts) + "\n"


def about(result: Mapping[str, Any]) -> list[str]:
    """What was measured where against what, in sentences."""
    machine = result["machine"]
    load = machine["load_average"]
    lines = [
        f"{result['date']}; {machine['cpu']}, {counted(result['threads'], 'thread')}; "
        f"{result['width']} x {result['height']} pixels; {counted(result['seeds'], 'seed')}.",
        *not_found(result.get("missing", ())),
        result["reference"]["text"],
        *(f"{name}: {made['text']}" for name, made in result["references"].items() if name != OWN),
        *(f"{name}: {made['title']}." for name, made in result["variants"].items() if name != RAW),
        "Errors are of linear radiance: relMSE, tonemappedRelMSE and relL1 with an epsilon of "
        f"{result['epsilons']['relMSE']:g}, added to the square or magnitude of the reference; "
        "DSSIM and FLIP are of the sRGB image. Bias is the difference of mean brightness, by that "
        "of the reference; squared bias is the part of the relMSE that averaging more seeds would "
        "leave, less the noise of the reference where that is known.",
    ]
    if max(load) > result["threads"] + 0.5:
        lines.append(
            f"The machine was busy with other work (load average {load[0]:.1f} at the start, "
            f"{load[1]:.1f} at the end): the seconds are too many, and noisy. "
            "On a quiet machine the same command gives better ones."
        )
    return lines


def _limits(found: Sequence[Mapping[str, Any]], shown: Sequence[Sequence[Crop]]) -> str:
    """What limits save and lose; nothing where none were measured."""
    if not found:
        return ""
    head, lines = limits.cells(found)
    table = "".join(f"<th>{html.escape(cell)}</th>" for cell in head)
    for line in lines:
        table += f"</tr><tr>{''.join(f'<td>{html.escape(cell)}</td>' for cell in line)}"
    crops = "".join(f"<div class='crops'>{''.join(map(_figure, row))}</div>" for row in shown)
    return (
        f"<h2>What limits save and lose</h2><p>{html.escape(limits.meaning(found))}</p>"
        f'<div class="scroll"><table><tr>{table}</tr></table></div>{crops}'
    )


def _how(answer: Mapping[str, Any]) -> str:
    command = answer.get("command")
    return f"<br><code>{html.escape(command)}</code>" if command else ""


def _data(png: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")


def _figure(crop: Crop) -> str:
    caption = html.escape(f"{crop.title}\n{crop.note}".strip())
    source = _data(image_png(crop.pixels))
    title = html.escape(crop.title)
    image = f'<img alt="{title}" src="{source}">'
    return f"<figure>{image}<figcaption>{caption}</figcaption></figure>"


def _table(rows: Sequence[Rung]) -> str:
    palette = colours(rows)
    head = ["variant", "samples", "seconds", *NAMES, "bias", "squared bias"]
    lines = [f"<table><tr>{''.join(f'<th>{html.escape(name)}</th>' for name in head)}</tr>"]
    for row in rows:
        squared = row["squared_bias"]
        cells = [
            _name(row, palette),
            str(row["samples_per_pixel"]),
            _spread(row["total_seconds"]),
            *(_spread(row["errors"][name]) for name in NAMES),
            _spread({key: 100.0 * value for key, value in row["bias"].items()}, " %"),
            "" if squared is None else number(squared),
        ]
        marked = ' class="front"' if row["on_front"] else ""
        lines.append(f"<tr{marked}>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>")
    return "".join([*lines, "</table>"])


def _seconds(rows: Sequence[Rung]) -> str:
    palette = colours(rows)
    head = "".join(f"<th>{name}</th>" for name in ("variant", "samples", *PHASES, "total"))
    lines = [f"<table><tr>{head}</tr>"]
    for row in rows:
        values = [row["seconds"][phase] for phase in PHASES]
        values.append(row["total_seconds"]["median"])
        cells = "".join(f"<td>{number(value) if value else ''}</td>" for value in values)
        lines.append(
            f"<tr><td>{_name(row, palette)}</td><td>{row['samples_per_pixel']}</td>{cells}</tr>"
        )
    return "".join([*lines, "</table>"])


def _name(row: Rung, palette: Mapping[str, str]) -> str:
    dot = f'<span class="dot" style="background:{palette[row["variant"]]}"></span>'
    return dot + html.escape(row["variant"])


def _spread(value: Mapping[str, float], unit: str = "") -> str:
    low, high = number(value["low"]), number(value["high"])
    return f"{number(value['median'])}{unit}<br><small>{low} .. {high}</small>"
