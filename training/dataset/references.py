"""References that were rendered before and are kept: a comparison need not render them again.

A file is a NumPy archive: `plan`, the data set's plan, and `items`, what each window is, as JSON;
and for each item `reference-N` and `halves-N` [3, h, w], float16 where its range suffices. Made by

    python -m training.dataset.references FOLDER OUT.npz

from the complete shards of a data set; taken by ``python -m training.generate --references``.
"""

from __future__ import annotations

import argparse
import dataclasses
import io
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbfeat.devtools.layout import write_whole
from training.dataset.plan import Plan, PlanError
from training.dataset.reader import Dataset
from training.dataset.rendering import LARGEST_HALF
from training.dataset.shards import ShardError

# Of an item, what the window is and what its reference took; the rest is of its samples.
KEPT = ("scene", "class", "light", "window", "resolution", "at", "reference_spp", "floor")


class ReferencesError(Exception):
    """A file of references cannot be used; the message names it and says what to do."""


@dataclass(frozen=True)
class Kept:
    """A window that has a reference: `about` as KEPT, arrays float32 [3, h, w]."""

    about: dict[str, Any]
    reference: NDArray[np.float32]
    halves: NDArray[np.float32]


class References:
    """The references of a data set, by scene and window."""

    def __init__(self, plan: Plan, kept: list[Kept]) -> None:
        self.plan = plan
        self._kept = {(k.about["scene"], k.about["window"]): k for k in kept}

    def __len__(self) -> int:
        return len(self._kept)

    @property
    def items(self) -> list[Kept]:
        return [self._kept[key] for key in sorted(self._kept)]

    def find(self, scene: int, window: int) -> Kept | None:
        return self._kept.get((scene, window))

    def fits(self, plan: Plan) -> bool:
        """Whether they are of that plan's windows; the number of samples may be another."""
        return dataclasses.replace(plan, spp=self.plan.spp) == self.plan

    @staticmethod
    def read(file: Path) -> References:
        """Raises ReferencesError."""
        try:
            with np.load(file, allow_pickle=False) as archive:
                plan = Plan(**json.loads(str(archive["plan"])))
                kept = [
                    Kept(
                        about,
                        archive[f"reference-{n}"].astype(np.float32),
                        archive[f"halves-{n}"].astype(np.float32),
                    )
                    for n, about in enumerate(json.loads(str(archive["items"])))
                ]
        except (OSError, ValueError, KeyError, TypeError, PlanError) as error:
            raise ReferencesError(
                f"{file} holds no references ({error}); make it with "
                "python -m training.dataset.references, or do without --references"
            ) from error
        return References(plan, kept)

    def write(self, file: Path) -> None:
        arrays: dict[str, Any] = {
            "plan": json.dumps(dataclasses.asdict(self.plan)),
            "items": json.dumps([kept.about for kept in self.items]),
        }
        for n, kept in enumerate(self.items):
            arrays[f"reference-{n}"] = _narrow(kept.reference)
            arrays[f"halves-{n}"] = _narrow(kept.halves)
        stream = io.BytesIO()
        np.savez_compressed(stream, **arrays)
        write_whole(file, stream.getvalue())


def _narrow(values: NDArray[np.float32]) -> NDArray[np.floating]:
    return values.astype(np.float16 if np.abs(values).max() <= LARGEST_HALF else np.float32)


def of_dataset(dataset: Dataset) -> References:
    """The references of a data set's complete shards."""
    kept = []
    for index in range(len(dataset)):
        item = dataset[index]
        about = {name: item.about[name] for name in KEPT}
        kept.append(Kept(about, np.array(item.reference), np.array(item.halves)))
    return References(dataset.plan, kept)


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m training.dataset.references", description=__doc__
    )
    parser.add_argument("folder", type=Path, help="of the data set")
    parser.add_argument("output", type=Path)
    options = parser.parse_args(arguments)
    try:
        references = of_dataset(Dataset(options.folder))
    except (PlanError, ShardError) as error:
        sys.stderr.write(f"training.dataset.references: {error}\n")
        return 1
    references.write(options.output)
    size = options.output.stat().st_size / 1e6
    print(f"{options.output}: {len(references)} references, {size:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
