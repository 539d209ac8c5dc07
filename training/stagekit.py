"""The building blocks of tests/scenes/stagekit.py, importable from here."""

from __future__ import annotations

import sys
from pathlib import Path

_SCENES = str(Path(__file__).resolve().parents[1] / "tests" / "scenes")
if _SCENES not in sys.path:
    sys.path.insert(0, _SCENES)

from stagekit import *  # noqa: E402, F403
