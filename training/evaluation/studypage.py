"""The documentation's page of studies, from the JSON of training.study."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mbfeat.files import write_whole

DOCS = Path(__file__).resolve().parents[2] / "python" / "mbfeat" / "docs"
STUDIES = Path(__file__).resolve().parents[1] / "studies"
WIDTH = 100
SECTION = "## "
# Of the paper's table, in its order, and what the eye sees.
METRICS = ("relMSE", "tonemappedRelMSE", "MSE", "relL1", "L1", "DSSIM", "FLIP")
HEAD = """\
# Networks trained alike

Networks that differ in one thing, trained by the same steps on the same patches of the same data
for as short a time as can be had for all of them, and compared on the windows of
[comparison.md](comparison.md), which are of classes of scenes that none was trained on, at 8
samples a pixel. [training.md](training.md) says what the switches do. A section is written anew by

    ./run training python -m training.study {studies} runs --data data --json study.json
    ./run training python -m training.study --page study.json ...
"""


def study_names() -> list[str]:
    """Those that come along."""
    return sorted(file.stem for file in STUDIES.glob("*.toml"))


def write(files: Sequence[Path]) -> Path:
    """Writes the page, of which sections of other studies stay as they are.

    Raises ValueError for a file that is no result of a study.
    """
    results = []
    for file in files:
        try:
            results.append(json.loads(file.read_text(encoding="utf-8")))
        except (OSError, ValueError) as error:
            raise ValueError(f"--page {file}: it is no result of a study: {error}") from error
    target = DOCS / "studies.md"
    sections = _sections(target.read_text(encoding="utf-8")) if target.exists() else {}
    for result, file in zip(results, files, strict=True):
        if [r["title"] for r in results].count(result["title"]) > 1:
            raise ValueError(f"--page {file}: another file is of {result['title']!r} too; name one")
        sections[result["title"]] = section(result)
    head = HEAD.format(studies="|".join(study_names()))
    write_whole(target, "\n".join([head, *sections.values()]))
    return target


def _sections(page: str) -> dict[str, str]:
    """Those of a page, by title."""
    parts = page.split(f"\n{SECTION}")[1:]
    return {part.partition("\n")[0]: f"{SECTION}{part.rstrip()}\n" for part in parts}


def section(result: Mapping[str, Any]) -> str:
    """A study as Markdown."""
    seeds, variants = result["seeds"], result["variants"]
    data = "; ".join(result["data"])
    lines = [
        f"{SECTION}{result['title']}",
        "",
        *textwrap.wrap(
            f"{result['date']}; {result['processor']}. {result['steps']} steps of the "
            f"configuration `{result['config']}` on one thread each; "
            f"seeds {', '.join(map(str, seeds))}; data: {data}. {result['windows']} windows. "
            "Minutes are of the wall clock, beside other runs.",
            WIDTH,
        ),
        "",
        "| " + " | ".join(("network", "parameters", "minutes", *METRICS)) + " |",
        "|---" * (3 + len(METRICS)) + "|",
    ]
    for name, about in variants.items():
        cells = [_means(about["means"][metric]) for metric in METRICS]
        cells = [name, f"{about['parameters'] / 1e6:.2f} M", f"{about['minutes']:.0f}", *cells]
        lines.append("| " + " | ".join(cells) + " |")
    lines += [
        "",
        *textwrap.wrap(
            "Ratios of the means over windows"
            + (" and seeds" if len(seeds) > 1 else "")
            + ", with 95 % intervals by resampling windows"
            + (", and those of each seed alone." if len(seeds) > 1 else "."),
            WIDTH,
        ),
        "",
        "| " + " | ".join(("ratio", *METRICS)) + " |",
        "|---" * (1 + len(METRICS)) + "|",
    ]
    for name, ratios in result["ratios"].items():
        cells = [_ratio(ratios[metric]) for metric in METRICS]
        lines.append("| " + " | ".join((name, *cells)) + " |")
    return "\n".join(lines) + "\n"


def _means(values: Sequence[float]) -> str:
    mean = sum(values) / len(values)
    if len(values) == 1:
        return f"{mean:.4g}"
    return f"{mean:.4g} ({min(values):.4g} .. {max(values):.4g})"


def _ratio(found: Mapping[str, Any]) -> str:
    text = f"{found['value']:.3f} ({found['low']:.3f} .. {found['high']:.3f})"
    seeds = found["seeds"]
    return text if len(seeds) == 1 else text + "; " + ", ".join(f"{v:.3f}" for v in seeds)
