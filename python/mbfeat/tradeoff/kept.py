"""Finished renders in the output folder: an interrupted measurement goes on from them.

Each is two files named by all that the image depends on, so that what is of another build, size,
setting or edit of the stage is left alone. The image is kept too: its error can be measured again
against another reference.
"""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbfeat.files import write_whole
from mbfeat.tradeoff.renders import Shot, Subject


def digest(content: Any) -> str:
    """A short hash of plain values."""
    text = json.dumps(content, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:20]


def build_key() -> str:
    """Changes when the renderer is built anew, which its version does not."""
    from mbfeat import _core

    folders = [Path(str(_core.__file__)).parent]
    if "MBFEAT_BUILD_DIR" in os.environ:
        folders.append(Path(os.environ["MBFEAT_BUILD_DIR"]))
    files = sorted({file for folder in folders for file in folder.rglob("*.so")})
    files = [file for file in files if "mbfeat" in str(file).lower()]
    return digest([(file.name, file.stat().st_size, file.stat().st_mtime_ns) for file in files])


def subject_key(subject: Subject) -> str:
    """All that an image depends on and no variant, sample count or seed changes."""
    facts = subject.facts
    where = [str(subject.stage.resolve()), facts.settings, facts.camera, facts.files]
    size = [subject.width, subject.height, subject.threads]
    return digest([where, size, subject.settings, build_key()])


class Keep:
    """A folder of finished renders."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def load(self, key: str) -> Shot | None:
        """The render of that key, if it is there whole."""
        about = self.about(key)
        if about is None:
            return None
        try:
            image = np.load(self._folder / f"{key}.npy")
        except (OSError, ValueError):
            return None
        return Shot(image, about["seconds"])

    def about(self, key: str) -> dict[str, Any] | None:
        """What is written of a render without its image."""
        try:
            return dict(json.loads((self._folder / f"{key}.json").read_text(encoding="utf-8")))
        except (OSError, ValueError):
            return None

    def save(self, key: str, shot: Shot, about: Mapping[str, Any]) -> None:
        """Keeps a render; the description comes last, and only with it the render counts."""
        self._folder.mkdir(parents=True, exist_ok=True)
        partial = self._folder / f"{key}.{os.getpid()}.partial.npy"
        np.save(partial, shot.image)
        partial.replace(self._folder / f"{key}.npy")
        self.describe(key, {**about, "seconds": dict(shot.seconds)})

    def describe(self, key: str, about: Mapping[str, Any]) -> None:
        """Keeps plain values."""
        write_whole(self._folder / f"{key}.json", json.dumps(dict(about)) + "\n")

    def load_arrays(self, name: str) -> dict[str, NDArray[Any]] | None:
        """What save_arrays() kept under that name, if it is there whole."""
        try:
            with np.load(self._folder / f"{name}.npz") as archive:
                return dict(archive)
        except (OSError, ValueError, zipfile.BadZipFile):
            return None

    def save_arrays(self, name: str, **arrays: NDArray[Any]) -> None:
        """Keeps arrays together, whole or not at all."""
        self._folder.mkdir(parents=True, exist_ok=True)
        partial = self._folder / f"{name}.{os.getpid()}.partial.npz"
        np.savez(partial, **arrays)  # type: ignore[arg-type]
        partial.replace(self._folder / f"{name}.npz")
