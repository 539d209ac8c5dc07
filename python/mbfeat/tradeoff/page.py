"""The documentation's page 'What accuracy costs', from the folders of measurements."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mbfeat.files import write_whole
from mbfeat.tradeoff import limits
from mbfeat.tradeoff.outcome import LIMITS_PICTURE
from mbfeat.tradeoff.renders import PHASES
from mbfeat.tradeoff.web import about
from mbfeat.tradeoff.wording import number

DOCS = Path(__file__).resolve().parents[1] / "docs"
WIDTH = 100
COLUMNS = ("relMSE", "tonemappedRelMSE", "MSE", "relL1", "L1", "FLIP")
INTRODUCTION = """\
# What accuracy costs

Error against the seconds that a person waits, from the start of the program to the written image,
raw and through every denoiser that is installed. Two questions are answered: with so many seconds,
what is the best that I get, and how? To reach an error, how long does it take, and how?

    ./run mbfeat tradeoff STAGE --out DIR
    ./run mbfeat tradeoff STAGE --out DIR --seconds 10 --error 0.01
    ./run mbfeat tradeoff STAGE --out DIR --reference FILE.exr
    ./run mbfeat tradeoff STAGE --out DIR --variant 'few bounces:mbfeat:maxBounces=2'
    ./run mbfeat tradeoff STAGE --out DIR --limits
    ./run mbfeat tradeoff --peers --out DIR
    ./run mbfeat tradeoff --page DIR DIR DIR

measure any stage with a camera, answer other questions than the middle ones, measure against a
given image, beside other settings, with caps on the bounces of each kind and without caustics or
blur, or beside Mitsuba 3 and Cycles, and write this page. `DIR` holds
`tradeoff.json` (`points`, every measurement; `pareto`, those that no other beats; `rungs`, medians
and ranges; `answers`), `tradeoff.csv`, `tradeoff.html` and `tradeoff.png`, and in `kept/` every
render: an interrupted run goes on where it was, and a run against another reference renders
nothing again. Every render is a process of its own; variants take turns, with the same random
numbers at the same number of samples. Paths whose features are recorded do not split; the variant
`whole paths` does not either. Recording is what the sampling of a render with features takes longer
than that of whole paths, or what the renderer tells of it where that is more. Open Image Denoise
counts its device and its filter, not the start of its process. A peer's process is started once for
all of its images; its start, the loading of the translated stage and what its first render takes
longer count with each of them.

Every render takes the samples of its rung, whatever targets, denoiser, AOV to look at and data
window the stage's settings have; `--set` changes other settings of all of them. Files that the
stage names and that are not there are listed. An answer holds between the medians of what was
measured: seconds that fall with more samples are taken for noise of the machine.

Without `--reference` the truth is a render of many more samples, from other random numbers. It
costs the most of the run, and what MBFeat gets wrong in every render does not show against it. Its
own noise is told from two halves; an error near it is marked in the answers. Peers are measured
against references of their own.
"""


def write(folders: Sequence[Path]) -> Path:
    """Writes the page and its pictures; returns the page. Raises OSError for missing results."""
    results = []
    for folder in folders:
        if not (folder / "tradeoff.json").is_file():
            raise FileNotFoundError(
                f"--page: {folder} has no tradeoff.json; measure first: mbfeat tradeoff STAGE "
                f"--out {folder}"
            )
        made = json.loads((folder / "tradeoff.json").read_text(encoding="utf-8"))
        write_whole(DOCS / "images" / picture(made), (folder / "tradeoff.png").read_bytes())
        if made.get("limits"):
            write_whole(
                DOCS / "images" / limits_picture(made), (folder / LIMITS_PICTURE).read_bytes()
            )
        results.append(made)
    target = DOCS / "accuracy.md"
    write_whole(target, page(results))
    return target


def picture(made: Mapping[str, Any]) -> str:
    """The file name of a result's picture."""
    return f"accuracy-{made['scene']}{'-with-limits' if made.get('limits') else ''}.png"


def limits_picture(made: Mapping[str, Any]) -> str:
    """The file name of the crops that show what limits lose."""
    return f"limits-{made['scene']}.png"


def page(results: Sequence[Mapping[str, Any]]) -> str:
    """The page as Markdown."""
    lines = [INTRODUCTION.rstrip()]
    for made in results:
        lines += ["", *_section(made)]
    return "\n".join(lines).rstrip() + "\n"


def _section(made: Mapping[str, Any]) -> list[str]:
    scene = made["scene"]
    found = made.get("limits", ())
    lines = [f"## {scene}{', with limits' if found else ''}", "", f"    {made['command']}", ""]
    for paragraph in about(made):
        lines += [textwrap.fill(paragraph, WIDTH), ""]
    lines += [f"![Error against seconds of {scene}](images/{picture(made)})", ""]
    for answer in made["answers"]:
        lines.append(textwrap.fill(f"- {answer['text']}", WIDTH, subsequent_indent="  "))
    if found:
        lines += ["", *_limits(made)]
    lines += ["", "Medians; on the front, no other has less error in less time.", ""]
    lines += _table(made)
    lines += [
        "",
        "Seconds, of the render whose total is the median of the seeds:",
        "",
        *_seconds(made),
    ]
    for name, reason in made["left_out"].items():
        lines += ["", textwrap.fill(f"Left out: {name}: {reason}", WIDTH)]
    return lines


def _limits(made: Mapping[str, Any]) -> list[str]:
    head, rows = limits.cells(made["limits"])
    lines = [textwrap.fill(limits.meaning(made["limits"]), WIDTH), ""]
    lines += [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)]
    shown = f"images/{limits_picture(made)}"
    return [*lines, "", f"![Full, limited, and the difference, of {made['scene']}]({shown})"]


def _table(made: Mapping[str, Any]) -> list[str]:
    head = ["variant", "samples", "seconds", *COLUMNS, "bias", "squared bias", "front"]
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for row in made["rungs"]:
        squared = row["squared_bias"]
        cells = [
            row["variant"],
            str(row["samples_per_pixel"]),
            number(row["total_seconds"]["median"]),
            *(number(row["errors"][name]["median"]) for name in COLUMNS),
            f"{100 * row['bias']['median']:.2f} %",
            "" if squared is None else number(squared),
            "yes" if row["on_front"] else "",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _seconds(made: Mapping[str, Any]) -> list[str]:
    rows = made["rungs"]
    used = [phase for phase in PHASES if any(row["seconds"][phase] for row in rows)]
    head = ["variant", "samples", *used]
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for row in rows:
        values = [number(row["seconds"][phase]) if row["seconds"][phase] else "" for phase in used]
        cells = [row["variant"], str(row["samples_per_pixel"]), *values]
        lines.append(f"| {' | '.join(cells)} |")
    return lines
