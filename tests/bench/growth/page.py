"""The page 'what grows with the work' of the documentation, from the JSON of a run."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from growth import report
from mbfeat.files import write_whole
from mbfeat.pages import FOLDER

PAGE = FOLDER / "growth.md"
IMAGES = FOLDER / "images"

HEAD = """# What grows with the work

    ./run mbfeat bench --growth --json growth.json   # measures; goes on where it was stopped
    ./run mbfeat bench --growth --page growth.json   # writes this page and its plots
    ./run mbfeat bench --growth --axes lights,triangles --rounds 5

Time and memory against one thing at a time: triangles, instances, lights, texture bytes, pixels,
samples and feature AOVs. The stages are procedural (`tests/bench/growth/stages.py`), and made so
that the camera sees much the same whatever their size. Each value is rendered by a process of its
own, which has loaded the renderer with a tiny stage before, as `usdrecord` renders: 320 x 180
pixels and 16 samples a pixel where nothing else is said, a product of uncompressed floats. The
values take turns. Numbers are medians over the rounds (lowest .. highest).

- *open + translate* is OpenUSD's reading of the stage, the Hydra index, and the delegate's
  translation: everything until the last image is there that the render report has no phase for.
- *build*, *sampling* and *write* are the report's phases. Textures are decoded in *build*.
- *ns a sample* is CPU time of all threads while sampling, by samples.
- *peak memory* is the growth of the process's resident memory over that before the stage was
  opened, at its highest, OpenUSD's part included.
- A *slope* is that of log cost over log value, of what is added to the first value's cost by what
  is added to the value: 1 is linear. It is fitted to the values that add more than 5 % and more
  than twice the range of the first one's cost.
"""

TITLES = {
    "triangles": "Triangles",
    "instances": "Instances",
    "lights": "Lights",
    "textures": "Texture bytes",
    "resolution": "Resolution",
    "samples": "Samples",
    "aovs": "Feature AOVs",
    "fixed": "Fixed cost",
    "threads": "Two threads",
}
NOTES = {
    "triangles": "A terrain in eight meshes under a sky and a lamp, cut finer and finer.",
    "instances": "Instances of one mesh of 1000 triangles, smaller as they get more.",
    "lights": "Sphere lights over hills, of the same power together.",
    "textures": "Eight images on tiles; they are held whole, without mip levels or a limit in "
    "memory.",
    "resolution": "Four samples a pixel of a terrain of 100,000 triangles, as in all that follows.",
    "samples": "160 x 90 pixels.",
    "aovs": "Of albedo, normal and direct at six path vertices, three values each, with `color`. "
    "Paths do not split in any of these renders (`mbfeat:splitting=1`), since recorded ones never "
    "do.",
    "fixed": "Shares of the whole, from opening the stage to the written image, at 16 samples a "
    "pixel: of the phases outside sampling, and of the intercept of the line through 1 and 16 "
    "samples. The intercept counts whatever makes the first sample of a pixel dearer than those "
    "that come with it in one batch.",
    "threads": "640 x 360 pixels. Wall seconds of sampling by one thread over those by two.",
}


def page(result: report.Result) -> str:
    """The page's text."""
    lines = [HEAD, report.about(result), ""]
    missing = [title for name, title in TITLES.items() if name not in result["axes"]]
    if missing:
        lines += [f"Not measured in this run: {', '.join(missing)}.", ""]
    if "note" in result:  # what somebody added to the file
        lines += [result["note"], ""]
    if report.is_busy(result):
        lines += [
            "Other programs wanted the cores meanwhile: wall seconds, and what is told from them, "
            "are too long,",
            "so that they do not tell whether an aim is missed, and CPU seconds carry the others'",
            "share of the caches.",
            "",
        ]
    lines += ["## Aims", "", *report.aim_table(result), ""] if result["aims"] else []
    slopes, decades = report.slope_table(result["axes"]), report.decade_table(result["axes"])
    lines += ["## Slopes", "", *slopes, ""] if slopes else []
    lines += ["## A sample, by factors of ten", "", *decades, ""] if decades else []
    for name, axis in result["axes"].items():
        lines += [f"## {TITLES[name]}", "", *filter(None, [NOTES[name]]), ""]
        if _has_plot(axis):
            lines += [f"![{TITLES[name]}: time and memory](images/growth-{name}.png)", ""]
        lines += [*report.axis_table(name, axis), ""]
        if name == "fixed":
            lines += _fixed(result) if "fixed_share" in result else []
    lines += _interactive(result) if "interactive" in result else []
    return "\n".join(lines).rstrip().replace("\n\n\n", "\n\n") + "\n"


def _has_plot(axis: dict[str, Any]) -> bool:
    return bool(axis["slopes"])


def _fixed(result: report.Result) -> list[str]:
    rows = [
        [clock, *(report.ranged(_percent(share[key])) for key in ("outside", "intercept"))]
        for clock, share in result["fixed_share"].items()
    ]
    return [*report.table(["clock", "outside sampling, %", "intercept, %"], rows), ""]


def _percent(spread: dict[str, float]) -> dict[str, float]:
    return {key: 100 * value for key, value in spread.items()}


INTERACTIVE = """## First pixel and camera moves

A viewer (`UsdImagingGL.Engine`) opens the terrain, the renderer being loaded already and the file
in the system's cache, and then moves the camera; it draws sixty frames a second. The first
pixels are those of the first pass of reduced resolution. The image comes in passes of reduced
resolution: every eighth pixel in both directions first, each standing for its block, then every
fourth, every second, and all. CPU time is the whole process's, the viewer's own part included;
after a move to reduced resolution that is also what was traced of the next passes before the viewer
drew again.

What a move to reduced resolution mostly waits for is the showing. On 2026-11-30 a draw of a partial
image took 46 to 62 ms of CPU time of the viewer's thread (nine draws at 1280 x 720, load average
7), starting an image 1 ms. In a profile of the build before, about half of the showing was the
resolving of pixels, which takes a lock a pixel and AOV, whether the pixel has samples or not. That
build showed the image in every draw, which was 30 % of all CPU time: a move took 2.06 to 2.37 CPU
seconds to one sample of all pixels (twelve moves on a million triangles, load average 4 to 8; wall
1.04 to 4.3 s), and 165 to 776 ms to reduced resolution. Now showing is due when a pass is whole,
and else takes a tenth of the time.
"""


def _interactive(result: report.Result) -> list[str]:
    found = result["interactive"]
    names = {
        "open": "open the stage (OpenUSD)",
        "first_pixel": "first pass of reduced resolution",
        "first_image": "first sample of all pixels",
        "coarse": "a move to the pass of reduced resolution",
        "full": "a move to one sample of all pixels",
    }
    rows = [
        [text, *(report.ranged(_milliseconds(found[name][clock])) for clock in ("wall", "cpu"))]
        for name, text in names.items()
    ]
    head = [f"{found['triangles']:,} triangles, {found['width']} x {found['width'] * 9 // 16}, "]
    head[0] += report.counted(found["processes"], "process", "processes")
    head[0] += f", {found['moves']} moves"
    return [INTERACTIVE, *report.table([*head, "wall ms", "CPU ms"], rows), ""]


def _milliseconds(spread: dict[str, float]) -> dict[str, float]:
    return {key: 1e3 * value for key, value in spread.items()}


def write_page(file: Path) -> int:
    """Writes the page and its plots; returns the exit code."""
    try:
        result = json.loads(file.read_text(encoding="utf-8"))
        text = page(result)
    except (OSError, ValueError, KeyError) as error:
        sys.stderr.write(
            f"mbfeat: bench: {file}: no result of bench --growth ({error!r}); measure one with "
            f"--growth --json {file}\n"
        )
        return 1
    from growth.charts import png

    for name, axis in result["axes"].items():
        if _has_plot(axis):
            write_whole(IMAGES / f"growth-{name}.png", png(axis, report.about(result)))
    write_whole(PAGE, text)
    print(f"wrote {PAGE}")
    return 0
