"""Renders the samples of one window again, as many as the folder's plan says, without a reference.

python -m training.dataset.again FOLDER SCENE WINDOW THREADS WIDTH HEIGHT X Y
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from training.dataset.items import samples_of
from training.dataset.plan import Plan
from training.dataset.rendering import Window
from training.dataset.shards import ShardFiles, ShardWriter
from training.generate import quiet_openusd


def main(arguments: list[str]) -> None:
    """Writes shard 0 of the folder with the one item."""
    folder = Path(arguments[0])
    scene, window, threads, width, height, x, y = map(int, arguments[1:])
    plan = Plan.read(folder)
    place = Window((width, height), x, y, min(plan.size, width), min(plan.size, height))
    quiet_openusd()
    about, arrays = samples_of(plan, scene, window, place, threads=threads)
    with ShardWriter(ShardFiles(folder, 0)) as writer:
        writer.append(about, arrays)
        writer.finish()


if __name__ == "__main__":
    main(sys.argv[1:])
    sys.stdout.flush()
    os._exit(0)
