"""What is said where torch is missing."""

from __future__ import annotations

import importlib.util
import sys


def require(program: str) -> None:
    """Ends the program, saying how to get torch, if it cannot be imported."""
    if importlib.util.find_spec("torch") is None:
        sys.stderr.write(
            f"{program}: this needs torch, which rendering never does; start it with "
            f"./run training python -m {program}, which installs it once (190 MB)\n"
        )
        sys.exit(1)
