"""Checks a data set: every shard there, every checksum right, every value finite; and its floor.

    python -m training.verify FOLDER [--quick]

Ends with 1 when something is missing or damaged.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np

from training.dataset.plan import PlanError
from training.dataset.reader import Dataset
from training.dataset.shards import ShardError

DENOISED_SHARE = 0.05  # of the denoised error that a reference's own may be


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns its exit code."""
    parser = argparse.ArgumentParser(prog="python -m training.verify", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--quick", action="store_true", help="read the indices alone")
    options = parser.parse_args(arguments)
    try:
        dataset = Dataset(options.folder)
    except (PlanError, ShardError) as error:
        sys.stderr.write(f"training.verify: {error}\n")
        return 1
    problems = [f"shard {number} is not complete" for number in dataset.missing]
    if not options.quick:
        for index in range(len(dataset)):
            problems += _problems(dataset, index)
    print(report(dataset))
    for problem in problems:
        print(f"problem: {problem}")
    print(f"{len(dataset)} items, {len(problems)} problems")
    return 1 if problems else 0


def _problems(dataset: Dataset, index: int) -> list[str]:
    where = f"{dataset.location(index)}, item {index}"
    if dataset.damaged(index):
        return [f"{where}: the checksum is wrong; delete the shard and generate it again"]
    item = dataset[index]
    found = []
    for name in ("half", "reference", "halves"):
        bad = int(np.count_nonzero(~np.isfinite(getattr(item, name))))
        if bad:
            found.append(f"{where}: {bad} values of {name} are not finite")
    return found


def report(dataset: Dataset) -> str:
    """A table by class: items, raw error, the references' own error, share of specular paths."""
    groups: dict[str, list[dict[str, float]]] = defaultdict(list)
    for index in range(len(dataset)):
        about = dataset.about(index)
        groups[about["class"]].append(about)
        groups["all"].append(about)
    head = f"{'class':20} {'items':>5} {'ref spp':>8} {'raw relMSE':>11} {'floor':>9} "
    lines = [head + f"{'median':>9} {'chains':>7} {'clipped':>7}"]
    for name in [*sorted(set(groups) - {"all"}), "all"]:
        rows = groups[name]

        def mean(key: str, rows: list[dict[str, float]] = rows) -> float:
            return float(np.mean([row[key] for row in rows]))

        lines.append(
            f"{name:20} {len(rows):5d} {mean('reference_spp'):8.0f} {mean('raw'):11.4f} "
            f"{mean('floor'):9.2g} {np.median([row['floor'] for row in rows]):9.2g} "
            f"{mean('chains'):7.2f} {sum(row['clipped'] for row in rows):7.0f}"
        )
    lines.append("relMSE with epsilon 1e-2; floor is the references' own")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
