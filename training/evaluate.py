"""Compares reconstructions on held-out scenes and on the three stages, at 4 and 8 samples a pixel.

    python -m training.evaluate --model gbuffer=A.pt --model paths=B.pt --model best=C.pt \\
        [--json FILE] [--sheet FILE.png] [--equal-time]

Prints the metrics of each class, then the ratios paths/gbuffer and best/oidn over all images at the
larger number of samples. Windows are rendered from their seeds first, where they are missing. Open
Image Denoise takes part where the package pyoidn is installed.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from training.needs_torch import require

require("training.evaluate")

import torch  # noqa: E402

from mbfeat import metrics  # noqa: E402
from mbfeat.devtools.layout import this_layout, write_whole  # noqa: E402
from training.checkpoints import CheckpointError  # noqa: E402
from training.dataset.plan import PlanError  # noqa: E402
from training.dataset.reader import Dataset, Item  # noqa: E402
from training.dataset.shards import ShardError  # noqa: E402
from training.evaluation import methods, report, statistics  # noqa: E402
from training.evaluation.data import PLANS, DataError, dataset, with_samples  # noqa: E402
from training.evaluation.methods import BEST, OIDN_BEST, RAW, Method  # noqa: E402
from training.evaluation.statistics import Row  # noqa: E402

PAIRS = (("paths", "gbuffer"), (BEST, OIDN_BEST))
HARD = ("reflection", "refraction")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns its exit code."""
    parser = argparse.ArgumentParser(prog="python -m training.evaluate", description=__doc__)
    parser.add_argument("--model", action="append", default=[], metavar="NAME=FILE")
    parser.add_argument("--data", type=Path, help="folder of the data sets test and stages")
    parser.add_argument("--samples", type=int, nargs="+", default=[4, 8])
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--sheet", type=Path, help="a PNG of crops side by side")
    parser.add_argument(
        "--equal-time",
        action="store_true",
        help="also give the faster of best and oidn the difference as extra samples",
    )
    options = parser.parse_args(arguments)
    if options.threads:
        torch.set_num_threads(options.threads)
    try:
        comparison = Comparison(options)
        comparison.run()
    except (CheckpointError, DataError, PlanError, ShardError, ValueError) as error:
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


class Comparison:
    """Every method on every window."""

    def __init__(self, options: argparse.Namespace) -> None:
        self._options = options
        self._folder = options.data or this_layout().made / "training-data"
        self.methods = [Method(RAW, methods.raw_image)]
        for text in options.model:
            name, separator, file = text.partition("=")
            if not separator:
                raise ValueError(f"--model {text}: write NAME=FILE")
            self.methods.append(methods.network(name, Path(file)))
        self.methods += methods.oidn_methods(options.threads)
        self.rows: list[Row] = []
        self.equal: list[Row] = []
        self.strips: list[tuple[str, dict[str, Any]]] = []
        self._floors: list[float] = []

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
            row, images[method.name] = _run(method, item, number, samples)
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
        each = about["seconds"] / (about["spp"] + about["reference_spp"])
        fast, slow = sorted(mine.values(), key=lambda row: row.seconds)
        extra = int((slow.seconds - fast.seconds) / max(each, 1e-9))
        self.equal.append(slow)
        if extra < 1:
            self.equal.append(fast)
            return
        item = with_samples(windows, index, largest + extra, threads=self._options.threads)
        method = next(m for m in self.methods if m.name == fast.method)
        row, _ = _run(method, item, number, largest + extra)
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
            "command": " ".join(["python -m training.evaluate", *sys.argv[1:]]),
            "windows": len(floors),
            "reference_floor": {
                "epsilon": 1e-2,
                "mean": sum(floors) / len(floors),
                "median": floors[len(floors) // 2],
            },
            "threads": torch.get_num_threads(),
            "load_average": os.getloadavg()[0],
        }


def _run(method: Method, item: Item, number: int, samples: int) -> tuple[Row, Any]:
    started = time.perf_counter()
    image = method.image(item, samples)
    seconds = time.perf_counter() - started
    about = item.about
    found = metrics.all_metrics(image, item.reference)
    return Row(method.name, about["class"], about["light"], samples, number, found, seconds), image


def _ratios(rows: Sequence[Row], first: str, second: str) -> dict[str, statistics.Interval]:
    return {metric: statistics.ratio(rows, first, second, metric) for metric in metrics.NAMES}


if __name__ == "__main__":
    sys.exit(main())
