"""Weights to begin training with: those of a checkpoint, or of an exported network.

Exported networks are what is kept for good (checkpoints are large, and lie with the data), so that
training can go on from one on another machine, on other data.
"""

from __future__ import annotations

import base64
import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from training.checkpoints import CheckpointError, load_model
from training.export import PREFIX, example, open_session
from training.model.sksn import Sksn

EXPORTED = ".onnx"
INSIDE = "model."  # before the names of parameters in an exported graph


@dataclass(frozen=True)
class Initial:
    """Weights by parameter, and where they come from: the file's name, digest and history."""

    weights: dict[str, Tensor]
    origin: dict[str, Any]


def read(path: Path) -> Initial:
    """Raises CheckpointError."""
    if path.suffix != EXPORTED:
        trained = load_model(path)
        weights, history = dict(trained.model.state_dict()), trained.history
    else:
        weights, history = _exported(path)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return Initial(weights, {"file": path.name, "sha256": digest, "history": history})


def with_guides(weights: dict[str, Tensor], model: Sksn) -> dict[str, Tensor]:
    """Weights of a network with fewer guides as those of `model`, which it then is but for scales.

    The new guides' scales are those of `model`, and its other layers do not look at them yet. Other
    weights are given back as they are.
    """
    groups = model.config.guide_groups
    had = len(weights["scales.bias"]) if "scales.bias" in weights else len(groups)
    first = "regressor.0.weight"
    if had >= len(groups) or first not in weights:
        return weights
    own = model.state_dict()
    widened = dict(weights)
    for name in ("scales.weight", "scales.bias"):
        widened[name] = torch.cat([weights[name], own[name][had:]])
    # Guides are followed by the share of straight paths alone.
    before, after = weights[first][:, :-1], weights[first][:, -1:]
    unused = torch.zeros_like(after).expand(-1, sum(groups[had:]), -1, -1)
    widened[first] = torch.cat([before, unused, after], dim=1)
    return widened


def _exported(path: Path) -> tuple[dict[str, Tensor], dict[str, Any]]:
    import onnx

    try:
        graph = onnx.load(str(path))
        entries = {entry.key: entry.value for entry in graph.metadata_props}
        samples = entries.get(f"{PREFIX}samples")
        parts = [graph.graph]
        if samples is not None:
            parts.append(onnx.load_from_string(base64.b64decode(samples)).graph)
        weights: dict[str, Tensor] = {}
        for part in parts:
            for tensor in part.initializer:
                name = tensor.name.removesuffix(".half")
                if name.startswith(INSIDE):
                    values = onnx.numpy_helper.to_array(tensor).astype("float32")
                    weights[name.removeprefix(INSIDE)] = torch.from_numpy(values)
        # Outputs that do not depend on inputs, whose names the export does not keep.
        weights |= _constants(path, entries, samples)
        return weights, json.loads(entries.get(f"{PREFIX}training", "{}"))
    except FileNotFoundError as error:
        raise CheckpointError(f"there is no network {path}") from error
    except Exception as error:  # what protocol buffers and the runtime raise is not documented
        raise CheckpointError(
            f"{path} is no exported network with its parts apart ({error}); name a file that "
            "training.export wrote without --whole, or a checkpoint"
        ) from error


def _constants(path: Path, entries: dict[str, str], samples: str | None) -> dict[str, Tensor]:
    side = 2 * int(entries[f"{PREFIX}unit"])
    x = example(entries[f"{PREFIX}features"], 1, side, side).numpy()
    given = {"samples": x, "share": torch.ones(1, 1, side, side).numpy()}
    if samples is not None:
        classes = open_session(base64.b64decode(samples)).run(["classes"], given)[0]
        given = {"classes": classes}
    session = open_session(str(path))
    names = [output.name for output in session.get_outputs()]
    found = {n: torch.from_numpy(a) for n, a in zip(names, session.run(None, given), strict=True)}
    weights = {"kernels.weight": found["weight"][:, :, None, None], "kernels.bias": found["bias"]}
    if "table" in found:
        weights["atrous.spatial"] = found["table"][:, :-1]
        weights["atrous.sharpness"] = found["table"][:, -1:]
    return weights
