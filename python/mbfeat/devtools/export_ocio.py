"""Writes OpenColorIO's built-in ACES configs as files, for libraries that have none built in.

Usage: python export_ocio.py DIRECTORY. Needs the PyPI package opencolorio. The configs are of
profile version 2.1, the newest that OpenColorIO 2.1 (Debian 12) reads.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

CONFIGS = (
    "cg-config-v1.0.0_aces-v1.3_ocio-v2.1",
    "studio-config-v1.0.0_aces-v1.3_ocio-v2.1",
)


def main() -> int:
    import PyOpenColorIO

    directory = Path(sys.argv[1])
    directory.mkdir(parents=True, exist_ok=True)
    for name in CONFIGS:
        text = PyOpenColorIO.Config.CreateFromBuiltinConfig(name).serialize()
        partial = directory / f"{name}.partial"
        partial.write_text(text, encoding="utf-8")
        os.replace(partial, directory / f"{name}.ocio")
    return 0


if __name__ == "__main__":
    sys.exit(main())
