"""The process that renders: a renderer with one scene, which renders whenever it is told to.

    python -m peers.worker RENDERER SCENE WIDTH HEIGHT BOUNCES THREADS

RENDERER is ``mbfeat`` with a stage as SCENE, or a peer with a folder of peers.scene. Each line on
standard input is a JSON object with `spp`, `seed` and `image`, the file to write the image to as
.npy; each is answered by a line on standard output. The first line comes unasked, when the scene
is loaded. What the renderers print themselves goes to standard error.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from peers.rendering import Job, Renderer


def load(name: str, source: Path, job: Job) -> Renderer:
    """The renderer of that name with its scene; imports what only its environment has."""
    if name == "mitsuba":
        from peers.mitsuba_scene import MitsubaRenderer

        return MitsubaRenderer(source, job)
    if name == "cycles":
        from peers.cycles_scene import CyclesRenderer

        return CyclesRenderer(source, job)
    if name == "mbfeat":
        from peers.own import OwnRenderer

        return OwnRenderer(source, job)
    raise ValueError(f"there is no renderer {name!r}")


def main(arguments: list[str]) -> None:
    """Serves until standard input ends."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8", buffering=1)
    os.dup2(2, 1)

    def answer(content: dict[str, Any]) -> None:
        answers.write(json.dumps(content) + "\n")

    name, source, *numbers = arguments
    renderer = load(name, Path(source), Job(*map(int, numbers)))
    answer({"version": renderer.version})
    for line in sys.stdin:
        order = json.loads(line)
        rendered = renderer.render(order["spp"], order["seed"])
        np.save(order["image"], rendered.image)
        answer({"seconds": rendered.seconds, "cpu": rendered.cpu})
    sys.stderr.flush()
    # The renderers' own ends take long, and one of them may crash in it; nothing is left to do.
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1:])
