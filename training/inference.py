"""Runs a trained network on an item of a data set."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray

from training.dataset.reader import Item
from training.model.inputs import network_input
from training.model.sksn import Sksn


def item_input(item: Item, features: str, samples: int) -> torch.Tensor:
    """The first `samples` samples as the network's input [1, samples, channels, h, w]."""
    half, as_bytes = item.half[:samples], item.bytes[:samples]
    return network_input(half, as_bytes, item.world_to_camera, features)[None]


def denoise(model: Sksn, item: Item, samples: int) -> NDArray[np.float32]:
    """Image [3, h, w] from the item's first samples."""
    with torch.inference_mode():
        image = model(item_input(item, model.config.features, samples))
    return np.asarray(image[0].numpy())
