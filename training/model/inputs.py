"""Feature sets: the channels of a path sample that a network is given, in this order.

This is the contract of the exported network: the renderer fills these channels and nothing else.
Radiance and distances are as rendered; normals are turned into camera space (-z is forward), so
that a view can be flipped and features do not depend on where north is; bits are 0 or 1.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray

from training.dataset import layout
from training.dataset.layout import VERTICES

COMMON = ("R", "G", "B", "subpixel.X", "subpixel.Y", "Z")
PER_VERTEX = 9  # albedo, normal, direct
VALID = tuple(f"valid:{k}" for k in VERTICES)
EVENT_BITS = {
    "specular": layout.SPECULAR,
    "reflect": layout.REFLECT,
    "transmit": layout.TRANSMIT,
    "diffuse": layout.DIFFUSE,
}
EVENTS = tuple(f"{name}:{k}" for k in VERTICES for name in EVENT_BITS)

CHANNELS: dict[str, tuple[str, ...]] = {
    "gbuffer": (*COMMON, *layout.FEATURES[:PER_VERTEX]),
    "paths": (*COMMON, *layout.FEATURES),
    "extended": (*COMMON, *layout.FEATURES, *VALID, *layout.EXTENDED, *EVENTS),
}


def network_input(
    half: NDArray[np.float16],
    as_bytes: NDArray[np.uint8],
    world_to_camera: NDArray[np.float32],
    features: str,
) -> torch.Tensor:
    """The channels of a feature set, float32 [samples, channels, h, w].

    `half` [samples, HALF, h, w] and `as_bytes` [samples, BYTES, h, w] are a data set's arrays.
    What is not finite becomes 0.
    """
    names = [name for name in CHANNELS[features] if name in layout.HALF_INDEX]
    chosen = np.asarray(half[:, [layout.HALF_INDEX[name] for name in names]], dtype=np.float32)
    stored = torch.nan_to_num(torch.from_numpy(chosen), nan=0.0, posinf=0.0, neginf=0.0)
    turn = torch.from_numpy(world_to_camera)
    for first, name in enumerate(names):
        if ":normal:" in name and name.endswith(".X"):
            world = stored[:, first : first + 3]
            stored[:, first : first + 3] = torch.einsum("ij,sjhw->sihw", turn, world)
    if features != "extended":
        return stored
    integers = torch.from_numpy(np.array(as_bytes))
    valid = torch.stack([(integers[:, 0] >> k) & 1 for k in VERTICES], dim=1)
    bits = [(integers[:, 1 + k] & bit).bool() for k in VERTICES for bit in EVENT_BITS.values()]
    flat = len(COMMON) + len(layout.FEATURES)
    return torch.cat(
        [
            stored[:, :flat],
            valid.float(),
            stored[:, flat:],
            torch.stack(bits, dim=1).float(),
        ],
        dim=1,
    )


def first_hit_channels(features: str) -> list[int]:
    """All but the events and what is behind the first hit.

    Radiance, place in the pixel, depth, and of the first hit albedo, normal, direct light, whether
    there is one, roughness and distance; its throughput is 1.
    """
    return [
        i
        for i, name in enumerate(CHANNELS[features])
        if (":" not in name or ":0" in name) and name.partition(":")[0] not in EVENT_BITS
    ]


def normal_channels(features: str) -> list[int]:
    """Where the x of each normal is."""
    names = CHANNELS[features]
    return [i for i, name in enumerate(names) if ":normal:" in name and name.endswith(".X")]


def colour_channels(features: str) -> list[int]:
    """Where the red of each colour is: radiance, albedos, direct light, throughputs."""
    return [i for i, name in enumerate(CHANNELS[features]) if name.rpartition(".")[2] == "R"]


def radiance_channels(features: str) -> list[int]:
    """Channels in units of radiance, which a change of exposure scales."""
    names = CHANNELS[features]
    return [i for i, n in enumerate(names) if n in ("R", "G", "B") or ":direct:" in n]
