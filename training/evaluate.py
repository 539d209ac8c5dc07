"""Compares reconstructions on held-out scenes and on the three stages, at 4 and 8 samples a pixel.

    python -m training.evaluate [--model NAME=FILE ...] [--json FILE] [--sheet FILE.png]
        [--equal-time]
    python -m training.evaluate --page RESULT.json      # writes the documentation's page

Prints the metrics of each class, then the ratios paths/gbuffer, best/first_hit and best/oidn over
all images at the larger number of samples. Without --model the networks that come with MBFeat are
compared: those of the first two ratios, and those that it renders with. Files are exported networks
(.onnx), run as the renderer runs them, or checkpoints (.pt), which need torch. Windows are rendered
from their seeds first, where they are missing; their references come along. Open Image Denoise
takes part where the package pyoidn is installed.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mbfeat import metrics
from mbfeat.devtools.layout import this_layout
from mbfeat.files import write_whole
from mbfeat.machine import cpu_name
from training.dataset.plan import PlanError
from training.dataset.reader import Dataset, Item
from training.dataset.references import ReferencesError
from training.dataset.shards import ShardError
from training.evaluation import methods, networks, page, report, statistics
from training.evaluation.data import PLANS, DataError, dataset, with_samples
from training.evaluation.methods import BEST, OIDN_BEST
from training.evaluation.statistics import Row

PAIRS = (("paths", "gbuffer"), (BEST, "first_hit"), (BEST, OIDN_BEST))
HARD = ("reflection", "refraction")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m training.evaluate",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--model", action="append", default=[], metavar="NAME=FILE")
    parser.add_argument("--data", type=Path, help="folder of the data sets test and stages")
    parser.add_argument("--samples", type=int, nargs="+", default=[4, 8])
    parser.add_argument("--threads", type=int, default=0, help="of everything (default: all cores)")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--sheet", type=Path, help="a PNG of crops side by side")
    parser.add_argument(
        "--equal-time",
        action="store_true",
        help="also give the faster of best and oidn the difference as extra samples",
    )
    parser.add_argument("--page", type=Path, metavar="RESULT", help="a JSON file of a comparison")
    options = parser.parse_args(arguments)
    try:
        if options.page:
            print(f"wrote {page.write(_result(options.page), options.page)}")
            return 0
        comparison = Comparison(options)
        comparison.run()
    except (
        networks.NetworkError,
        DataError,
        PlanError,
        ReferencesError,
        ShardError,
        ValueError,
    ) as error:
        sys.stderr.write(f"training.evaluate: {error}\n")
        return 1
    ratios = comparison.ratios()
    print(report.table(comparison.rows, ratios))
    if options.json:
        content = report.as_json(comparison.rows, ratios, comparison.about())
        write_whole(options.json, json.dumps(content, indent=1) + "\n")
    if options.sheet:
        report.sheet(options.sheet, comparison.strips)
    return 0


def _result(file: Path) -> dict[str, Any]:
    try:
        content: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ValueError(f"--page {file}: it is no result of a comparison: {error}") from error
    return content


class Comparison:
    """Every method on every window."""

    def __init__(self, options: argparse.Namespace) -> None:
        self._options = options
        self._folder = options.data or this_layout().made / "training-data"
        self.methods = [methods.raw()]
        self._networks = _networks(options.model)
        for name, file in self._networks.items():
            self.methods.append(networks.network(name, file, options.threads))
        self.methods += methods.oidn_methods(options.threads)
        self.rows: list[Row] = []
        self.equal: list[Row] = []
        self.strips: list[tuple[str, dict[str, Any]]] = []
        self._floors: list[float] = []
        self._load = os.getloadavg()[0]  # before this one's own

    def run(self) -> None:
        number = 0
        for name in PLANS:
            windows = dataset(self._folder, name, threads=self._options.threads)
            shown: set[str] = set()
            for index in range(len(windows)):
                item = windows[index]
                self._floors.append(item.about["floor"])
                for samples in self._options.samples:
                    images = self._compare(item, number, samples)
                if item.about["class"] not in shown:
                    shown.add(item.about["class"])
                    images["reference"] = item.reference
                    self.strips.append((item.about["class"], images))
                if self._options.equal_time and item.about["light"] in (*HARD, "diffuse"):
                    self._compare_at_equal_time(windows, index, number)
                number += 1
                print(f"compared {number} windows", end="\r", file=sys.stderr, flush=True)

    def _compare(self, item: Item, number: int, samples: int) -> dict[str, Any]:
        if samples > item.half.shape[0]:
            raise ValueError(f"the data has {item.half.shape[0]} samples, not {samples}")
        images: dict[str, Any] = {}
        for method in self.methods:
            row, images[method.name] = methods.measured(method, item, number, samples)
            self.rows.append(row)
        return images

    def _compare_at_equal_time(self, windows: Dataset, index: int, number: int) -> None:
        """The faster method gets what the slower one takes longer as samples."""
        largest = max(self._options.samples)
        mine = {
            row.method: row
            for row in self.rows
            if row.image == number and row.samples == largest and row.method in (BEST, OIDN_BEST)
        }
        if len(mine) < 2:
            return
        about = windows.about(index)
        each = about["sample_seconds"]
        fast, slow = sorted(mine.values(), key=lambda row: row.seconds)
        extra = int((slow.seconds - fast.seconds) / max(each, 1e-9))
        self.equal.append(slow)
        if extra < 1:
            self.equal.append(fast)
            return
        item = with_samples(windows, index, largest + extra, threads=self._options.threads)
        method = next(m for m in self.methods if m.name == fast.method)
        row, _ = methods.measured(method, item, number, largest + extra)
        self.equal.append(row)

    def ratios(self) -> report.Ratios:
        """Of every pair that took part, over all images at the largest number of samples."""
        largest = max(self._options.samples)
        chosen = [row for row in self.rows if row.samples == largest]
        names = {method.name for method in self.methods}
        found: report.Ratios = {}
        for first, second in PAIRS:
            if {first, second} <= names:
                found[f"{first}/{second}"] = _ratios(chosen, first, second)
        for title, lights in (("reflection and refraction", HARD), ("diffuse", ("diffuse",))):
            part = [row for row in self.equal if row.light in lights]
            if part:
                name = f"{BEST}/{OIDN_BEST} at equal time, {title}"
                found[name] = _ratios(part, BEST, OIDN_BEST)
        return found

    def about(self) -> dict[str, Any]:
        """What the numbers are of."""
        floors = sorted(self._floors)
        return {
            "command": " ".join(["python -m training.evaluate", *map(_shown, sys.argv[1:])]),
            "windows": len(floors),
            "reference_floor": {
                "epsilon": 1e-2,
                "mean": sum(floors) / len(floors),
                "median": floors[len(floors) // 2],
            },
            "threads": self._options.threads or os.cpu_count(),
            "networks": {name: file.name for name, file in self._networks.items()},
            "load_average": self._load,
            "date": datetime.date.today().isoformat(),
            "processor": cpu_name(),
            "sheet": str(self._options.sheet) if self._options.sheet else None,
        }


def _networks(given: Sequence[str]) -> dict[str, Path]:
    """Names and files of --model, or the networks that come with MBFeat."""
    if not given:
        return networks.shipped()
    found = {}
    for text in given:
        name, separator, file = text.partition("=")
        if not separator:
            raise ValueError(f"--model {text}: write NAME=FILE")
        found[name] = Path(file)
    return found


def _ratios(rows: Sequence[Row], first: str, second: str) -> dict[str, statistics.Interval]:
    return {metric: statistics.ratio(rows, first, second, metric) for metric in metrics.NAMES}


def _shown(argument: str) -> str:
    """An argument without the folders of files, for a page that others read."""
    name, equals, file = argument.rpartition("=")
    return f"{name}{equals}{Path(file).name}"


if __name__ == "__main__":
    sys.exit(main())
