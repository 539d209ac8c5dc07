"""The windows that are compared on: the held-out set and the three hand-made stages.

Their references are kept in `references/`; their samples are rendered from seeds where missing.
"""

from __future__ import annotations

import dataclasses
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from training.dataset.plan import Plan
from training.dataset.reader import Dataset, Item
from training.dataset.references import References
from training.dataset.shards import ShardFiles, read_item

# Seeds apart from those of any training set.
PLANS = {
    "test": Plan(
        split="test", seed=9001, scenes=20, windows=1, size=128, spp=8, reference_spp=1024
    ),
    "stages": Plan(
        split="stages", seed=9001, scenes=3, windows=2, size=128, spp=8, reference_spp=2048
    ),
}


def references_file(name: str) -> Path:
    """Where the references of a data set are kept; `training.dataset.references` writes it."""
    return Path(__file__).resolve().parent / "references" / f"{name}.npz"


class DataError(Exception):
    """The data could not be rendered; the message says what happened."""


def dataset(folder: Path, name: str, *, threads: int = 0) -> Dataset:
    """The data set of that name in `folder`, made or completed if need be; raises DataError."""
    place = folder / name
    if not (place / "dataset.json").exists():
        PLANS[name].write(place)
    plan = Plan.read(place)
    if plan != PLANS[name]:
        raise DataError(
            f"{place} holds another data set than the one that is compared on; delete it, or name "
            "another folder with --data"
        )
    if not all((place / f"shard-{n:05d}.json").exists() for n in range(plan.shards)):
        references = references_file(name)
        kept = ["--references", str(references)] if _is_of(references, plan) else []
        _generate([str(place), "--threads", str(threads), *kept])
    return Dataset(place)


def _is_of(references: Path, plan: Plan) -> bool:
    """Whether there are references of that plan; without them they are rendered."""
    return references.exists() and References.read(references).fits(plan)


def _generate(arguments: list[str]) -> None:
    """In a process of its own: one that has rendered cannot end in order, see generate.command."""
    command = [sys.executable, "-m", "training.generate", *arguments]
    root = Path(__file__).resolve().parents[2]
    if subprocess.run(command, cwd=root, check=False).returncode != 0:
        raise DataError(
            f"{' '.join(command[1:])} failed, see above; rendering needs ./run, as in "
            "./run training python -m training.evaluate"
        )


def with_samples(dataset: Dataset, index: int, samples: int, *, threads: int = 0) -> Item:
    """The same window with another number of samples, of random numbers of their own."""
    about = dataset.about(index)
    with tempfile.TemporaryDirectory(prefix="mbfeat-extra-") as scratch:
        folder = Path(scratch)
        dataclasses.replace(dataset.plan, spp=samples).write(folder)
        numbers = [about["scene"], about["window"], threads, *about["resolution"], *about["at"]]
        command = [sys.executable, "-m", "training.dataset.again", scratch, *map(str, numbers)]
        root = Path(__file__).resolve().parents[2]
        if subprocess.run(command, cwd=root, check=False).returncode != 0:
            raise DataError(f"window {index} of {dataset.folder} could not be rendered again")
        files = ShardFiles(folder, 0)
        mapped = read_item(files.data, files.entries()[0])
        half, as_bytes = (np.array(mapped[name]) for name in ("half", "bytes"))
    original = dataset[index]
    return Item(about, half, as_bytes, original.reference, original.halves)
