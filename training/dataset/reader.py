"""A data set's complete shards as one sequence of items."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training.dataset.plan import Plan
from training.dataset.shards import ShardError, ShardFiles, checksum, read_item


@dataclass(frozen=True)
class Item:
    """One window: `about` as `items` made it, arrays mapped from the shard."""

    about: dict[str, Any]
    half: NDArray[np.float16]
    bytes: NDArray[np.uint8]
    reference: NDArray[np.float32]
    halves: NDArray[np.float32]

    @property
    def world_to_camera(self) -> NDArray[np.float32]:
        return np.array(self.about["world_to_camera"], dtype=np.float32).reshape(3, 3)


class Dataset(Sequence[Item]):
    """The items of every complete shard, in order; raises PlanError or ShardError."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.plan = Plan.read(folder)
        self._entries: list[tuple[Path, dict[str, Any]]] = []
        self.missing: list[int] = []
        for number in range(self.plan.shards):
            files = ShardFiles(folder, number)
            if files.is_complete():
                self._entries += [(files.data, entry) for entry in files.entries()]
            else:
                self.missing.append(number)
        if not self._entries:
            raise ShardError(
                f"{folder} has no complete shard yet; run python -m training.generate first"
            )

    def __len__(self) -> int:
        return len(self._entries)

    def __getitem__(self, index: int) -> Item:  # type: ignore[override]
        data, entry = self._entries[index]
        return Item(about=entry["about"], **read_item(data, entry))

    def about(self, index: int) -> dict[str, Any]:
        """What the item is, without touching its data."""
        return dict(self._entries[index][1]["about"])

    def damaged(self, index: int) -> bool:
        """Whether the item's checksum is wrong; reads all of it."""
        data, entry = self._entries[index]
        return checksum(data, entry) != entry["sha256"]

    def location(self, index: int) -> str:
        return self._entries[index][0].name
