"""Checkpoints: weights with the configuration and the history that made them.

Files hold tensors and plain values alone, so that loading one runs no code of its own.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from training.config import Config
from training.model.config import ConfigError
from training.model.sksn import Sksn

FORMAT = 1


class CheckpointError(Exception):
    """A file is no checkpoint, or none of this network; the message names it."""


def save(path: Path, content: dict[str, Any]) -> None:
    """Writes the file so that it is there whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f"{path.name}.{os.getpid()}.partial")
    with partial.open("wb") as file:
        torch.save({"format": FORMAT} | content, file)
        file.flush()
        os.fsync(file.fileno())
    partial.replace(path)


def load(path: Path) -> dict[str, Any]:
    """Raises CheckpointError."""
    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
    except FileNotFoundError as error:
        raise CheckpointError(f"there is no checkpoint {path}") from error
    except Exception as error:  # torch raises what its unpickler meets
        raise CheckpointError(f"{path} is no checkpoint: {error}") from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise CheckpointError(f"{path} is no checkpoint of format {FORMAT}")
    return content


@dataclass(frozen=True)
class Trained:
    """A network with averaged weights, its configuration, and how it came about."""

    model: Sksn
    config: Config
    history: dict[str, Any]


def load_model(path: Path) -> Trained:
    """The network of a checkpoint, ready to evaluate."""
    content = load(path)
    try:
        config = Config.from_dict(content["config"])
        model = Sksn(config.model)
        model.load_state_dict(content["average"] or content["model"])
    except (KeyError, ConfigError, RuntimeError) as error:
        raise CheckpointError(f"{path} does not fit this program: {error}") from error
    names = ("seed", "step", "total_steps", "seconds", "data", "origin", "processes", "torch")
    history = {name: content.get(name) for name in names}
    return Trained(model.eval(), config, history)
