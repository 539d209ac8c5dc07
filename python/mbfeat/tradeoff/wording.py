"""Numbers as text."""

from __future__ import annotations

import os
from collections.abc import Sequence

MOST_NAMES = 5


def number(value: float) -> str:
    """Three digits, and all of those before the point of a number that has up to six."""
    return f"{value:.0f}" if 1000 <= abs(value) < 1e6 else f"{value:.3g}"


def counted(count: int, what: str) -> str:
    """A number of things, as in "2 threads"."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def samples(spp: int) -> str:
    """A number of samples in words."""
    return f"{counted(spp, 'sample')} a pixel"


def duration(seconds: float) -> str:
    """Seconds, minutes or hours, in two digits or so."""
    if seconds < 90:
        return f"about {seconds:.0f} s"
    return f"about {seconds / 60:.0f} min" if seconds < 5400 else f"about {seconds / 3600:.1f} h"


def not_found(files: Sequence[str]) -> list[str]:
    """A sentence where a stage names files that are not there; else nothing."""
    if not files:
        return []
    names = ", ".join(os.path.relpath(file) for file in files[:MOST_NAMES])
    more = f" and {len(files) - MOST_NAMES} more" if len(files) > MOST_NAMES else ""
    return [
        f"Files that the stage names and that were not found: {names}{more}. All images, that of "
        "the reference too, are without them."
    ]
