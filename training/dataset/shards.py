"""Shards: files of arrays that can be made in pieces, resumed, verified and mapped into memory.

A shard is ``shard-00000.bin``, arrays one after the other, each at a multiple of 64 bytes, and
``shard-00000.json``, which says for every item where its arrays lie, and their SHA-256. The index
is written last, so a shard that has one is complete. While it is being made there is instead
``shard-00000.journal``, one line an item, appended after the item's data has reached the disk: a
run that was killed anywhere goes on after the last whole item.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from mbfeat.devtools.layout import write_whole

ALIGNMENT = 64


class ShardError(Exception):
    """A shard is damaged or in use; the message names the file and says what to do."""


@dataclass(frozen=True)
class ShardFiles:
    """The files of shard `number` in a folder."""

    folder: Path
    number: int

    @property
    def name(self) -> str:
        return f"shard-{self.number:05d}"

    @property
    def data(self) -> Path:
        return self.folder / f"{self.name}.bin"

    @property
    def index(self) -> Path:
        return self.folder / f"{self.name}.json"

    @property
    def journal(self) -> Path:
        return self.folder / f"{self.name}.journal"

    @property
    def lock(self) -> Path:
        return self.folder / f"{self.name}.lock"

    def is_complete(self) -> bool:
        return self.index.exists()

    def entries(self) -> list[dict[str, Any]]:
        """The items of a complete shard, as `read_item` takes them."""
        try:
            content = json.loads(self.index.read_text(encoding="utf-8"))
            entries: list[dict[str, Any]] = content["items"]
            size = int(content["bytes"])
        except (OSError, ValueError, KeyError) as error:
            raise ShardError(
                f"{self.index} cannot be read ({error}); delete it and generate the shard again"
            ) from error
        found = self.data.stat().st_size if self.data.exists() else 0
        if found != size:
            raise ShardError(
                f"{self.data} has {found} bytes instead of {size}; delete {self.name}.* and "
                "generate the shard again"
            )
        return entries


class ShardWriter:
    """Appends items to a shard; a context manager that holds the shard's lock.

    Raises ShardError when another process makes the same shard.
    """

    def __init__(self, files: ShardFiles) -> None:
        self._files = files
        files.folder.mkdir(parents=True, exist_ok=True)
        self._lock: IO[str] = files.lock.open("w", encoding="utf-8")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            self._lock.close()
            raise ShardError(f"{files.name} is being made by another process") from error
        self.entries: list[dict[str, Any]] = []
        end = 0
        for entry in _journal(files.journal):
            if not _is_whole(files.data, entry):
                break
            self.entries.append(entry)
            end = entry["end"]
        # What lies behind the last whole item is the rest of a killed run.
        self._data: IO[bytes] = files.data.open("r+b" if files.data.exists() else "w+b")
        self._data.truncate(end)
        self._data.seek(end)
        lines = "".join(json.dumps(entry) + "\n" for entry in self.entries)
        write_whole(files.journal, lines)

    def append(self, about: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Adds an item; when this returns, it survives a kill."""
        digest = hashlib.sha256()
        places = {}
        for name, array in arrays.items():
            self._data.write(bytes(-self._data.tell() % ALIGNMENT))
            content = np.ascontiguousarray(array)
            places[name] = {
                "offset": self._data.tell(),
                "dtype": content.dtype.str,
                "shape": list(content.shape),
            }
            raw = content.data.cast("B") if content.size else memoryview(b"")
            digest.update(raw)
            self._data.write(raw)
        self._data.flush()
        os.fsync(self._data.fileno())
        entry = {
            "about": dict(about),
            "arrays": places,
            "sha256": digest.hexdigest(),
            "end": self._data.tell(),
        }
        with self._files.journal.open("a", encoding="utf-8") as journal:
            journal.write(json.dumps(entry) + "\n")
            journal.flush()
            os.fsync(journal.fileno())
        self.entries.append(entry)

    def finish(self) -> None:
        """Declares the shard complete."""
        content = {"bytes": self._data.tell(), "items": self.entries}
        write_whole(self._files.index, json.dumps(content, indent=1) + "\n")
        self._files.journal.unlink(missing_ok=True)

    def close(self) -> None:
        self._data.close()
        self._files.lock.unlink(missing_ok=True)
        self._lock.close()

    def __enter__(self) -> ShardWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def read_item(data: Path, entry: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """The arrays of an item, mapped from the file and read only where they are looked at."""
    return {
        name: np.memmap(
            data,
            dtype=np.dtype(place["dtype"]),
            mode="r",
            offset=place["offset"],
            shape=tuple(place["shape"]),
        )
        for name, place in entry["arrays"].items()
    }


def checksum(data: Path, entry: Mapping[str, Any]) -> str:
    """SHA-256 of an item's arrays as they lie in the file."""
    digest = hashlib.sha256()
    with data.open("rb") as file:
        for place in entry["arrays"].values():
            file.seek(place["offset"])
            left = int(np.dtype(place["dtype"]).itemsize * np.prod(place["shape"], dtype=np.int64))
            while left:
                block = file.read(min(left, 1 << 22))
                if not block:
                    return ""
                digest.update(block)
                left -= len(block)
    return digest.hexdigest()


def _is_whole(data: Path, entry: Mapping[str, Any]) -> bool:
    try:
        return data.stat().st_size >= entry["end"] and checksum(data, entry) == entry["sha256"]
    except (OSError, KeyError, TypeError):
        return False


def _journal(file: Path) -> list[dict[str, Any]]:
    """The lines that were written whole."""
    entries: list[dict[str, Any]] = []
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except OSError:
        return entries
    for line in lines:
        try:
            entries.append(json.loads(line))
        except ValueError:
            break
    return entries
