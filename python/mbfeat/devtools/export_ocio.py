"""Writes OpenColorIO's built-in ACES configs as files, for libraries that have none built in.

Usage: python export_ocio.py DIRECTORY, which is replaced. Needs the PyPI package opencolorio.
The configs are of profile version 2.1, the newest that OpenColorIO 2.1 (Debian 12) reads.
"""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

CONFIGS = (
    "cg-config-v1.0.0_aces-v1.3_ocio-v2.1",
    "studio-config-v1.0.0_aces-v1.3_ocio-v2.1",
)


def main() -> int:
    import PyOpenColorIO

    directory = Path(sys.argv[1])
    partial = directory.with_name(f"{directory.name}.{os.getpid()}.partial")
    partial.mkdir(parents=True)
    for name in CONFIGS:
        config = PyOpenColorIO.Config.CreateFromBuiltinConfig(name)
        # They list colour spaces as inactive that they don't have, of which OpenColorIO warns.
        listed = (space.strip() for space in config.getInactiveColorSpaces().split(","))
        present = [space for space in dict.fromkeys(listed) if config.getColorSpace(space)]
        config.setInactiveColorSpaces(", ".join(present))
        (partial / f"{name}.ocio").write_text(config.serialize(), encoding="utf-8")
    shutil.rmtree(directory, ignore_errors=True)
    partial.rename(directory)
    return 0


if __name__ == "__main__":
    sys.exit(main())
