"""Networks as ways to make an image: exported ones as the renderer runs them, others by PyTorch."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np

from training.dataset import layout
from training.dataset.reader import Item
from training.evaluation.methods import Image, Method

ROOT = Path(__file__).resolve().parents[2]
PLACES = (Path(__file__).resolve().parent / "networks", ROOT / "python" / "mbfeat" / "models")
SHIPPED = ("gbuffer", "paths", "first_hit", "best", "fast")
EXPORTED = ".onnx"


class NetworkError(Exception):
    """A network cannot be run; the message names its file and says what to do."""


def shipped() -> dict[str, Path]:
    """The networks that come with MBFeat, by name."""
    found = {file.stem: file for place in PLACES for file in place.glob(f"*{EXPORTED}")}
    return {name: found[name] for name in SHIPPED if name in found}


def network(name: str, path: Path, threads: int = 0) -> Method:
    """The method of a network's file; raises NetworkError."""
    return _exported(name, path, threads) if path.suffix == EXPORTED else _trained(name, path)


def _exported(name: str, path: Path, threads: int) -> Method:
    from mbfeat import _core

    try:
        model = _core.DenoiseModel.open(str(path))
    except RuntimeError as error:
        raise NetworkError(str(error)) from error
    fields = [*layout.HALF, *layout.BYTES]

    def prepared(item: Item, samples: int) -> Any:
        return paths_of(item, samples), item.world_to_camera

    def image(given: Any) -> Image:
        paths, turn = given
        found, _ = _core.denoise_paths(model, paths, fields, turn, threads=threads)
        return np.asarray(found[0])

    return Method(name, prepared, image)


def paths_of(item: Item, samples: int) -> Image:
    """Paths [h, w, samples, HALF and BYTES], as the renderer keeps them."""
    parts = [item.half[:samples].astype(np.float32), item.bytes[:samples].astype(np.float32)]
    return np.ascontiguousarray(np.concatenate(parts, axis=1).transpose(2, 3, 0, 1))


def _trained(name: str, path: Path) -> Method:
    if importlib.util.find_spec("torch") is None:
        raise NetworkError(
            f"{path} needs torch, which rendering never does; export it with training.export, or "
            "start this with ./run training, which installs torch once (190 MB)"
        )
    from training.checkpoints import CheckpointError, load_model
    from training.inference import denoise

    try:
        model = load_model(path).model
    except CheckpointError as error:
        raise NetworkError(str(error)) from error

    def image(given: tuple[Item, int]) -> Image:
        return np.nan_to_num(denoise(model, *given), nan=0.0, posinf=0.0, neginf=0.0)

    return Method(name, lambda item, samples: (item, samples), image)
