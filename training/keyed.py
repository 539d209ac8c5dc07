"""Random numbers keyed on what they are for, so that no order of work changes any of them."""

from __future__ import annotations

import hashlib

import numpy as np


def key_of(*names: str | int) -> int:
    """128 bits from a path of names and numbers."""
    text = "/".join(f"{type(name).__name__}:{name}" for name in names)
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:16], "little")


def generator(*names: str | int) -> np.random.Generator:
    """A generator of its own for this path of names, the same on every machine."""
    return np.random.Generator(np.random.PCG64(key_of(*names)))


def render_seed(*names: str | int) -> int:
    """A value for mbfeat:seed, 0..2^52: different names have independent noise."""
    return key_of("render", *names) % (1 << 52)
