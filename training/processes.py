"""Several processes that train one network, as torchrun starts them; or one alone."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import torch
from torch import distributed


@dataclass(frozen=True)
class Processes:
    """How many there are, and which is this one."""

    count: int = 1
    rank: int = 0

    @property
    def is_first(self) -> bool:
        """Whether this one writes files and talks."""
        return self.rank == 0

    def from_first(self, value: float) -> float:
        """The first process's number, in all of them."""
        if self.count == 1:
            return value
        box = torch.tensor([value], dtype=torch.float64)
        distributed.broadcast(box, 0)
        return float(box[0])

    def wait(self) -> None:
        """Until all have come here."""
        if self.count > 1:
            distributed.barrier()


def keep_freed_memory() -> None:
    """Lets the C library keep what is freed, where it can: every step needs the same again.

    Otherwise large tensors are mapped and cleared anew each time, a tenth of a step and more.
    """
    threshold, trim = -3, -1  # M_MMAP_THRESHOLD, M_TRIM_THRESHOLD of malloc.h
    try:
        library = ctypes.CDLL(None)
        library.mallopt(threshold, 1 << 30)
        library.mallopt(trim, (1 << 31) - 1)
    except (OSError, AttributeError):
        return  # not glibc


@contextmanager
def joined() -> Iterator[Processes]:
    """Joins the group that torchrun's variables describe, on gloo."""
    count = int(os.environ.get("WORLD_SIZE", "1"))
    if count == 1:
        yield Processes()
        return
    distributed.init_process_group("gloo")
    try:
        yield Processes(distributed.get_world_size(), distributed.get_rank())
    finally:
        distributed.destroy_process_group()
