"""What memory this process has, as Linux tells it."""

from __future__ import annotations

import os
from pathlib import Path


def resident() -> int:
    """Resident memory of this process, bytes."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def peak_resident() -> int:
    """Peak resident memory since forget_peak(), bytes."""
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmHWM"):
            return int(line.split()[1]) * 1024
    raise RuntimeError("the system does not tell the peak memory of a process")


def forget_peak() -> None:
    """Makes the peak what is resident now."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
