"""Other renderers on a translation of the stage; works in a checkout, whose tests/bench has them.

A peer's process stays alive, but each of its images counts what a person who makes one has to wait
for: the start, the loading, what the first render takes longer than a second one, and the render.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from mbfeat.tradeoff.child import clock
from mbfeat.tradeoff.renders import RenderError, Shot
from mbfeat.tradeoff.variants import Variant

WARM_UP_SEED = 90_000
BOUNCES = 12
# What the translations of the stage render, and MBFeat beside them.
SETTINGS = {
    "mbfeat:pixelFilter": "box",
    "mbfeat:maxBounces": str(BOUNCES),
    "mbfeat:clampDirect": "0",
    "mbfeat:clampIndirect": "0",
}
# What they are, and the package that has their version.
TITLES = {
    "mitsuba": ("the path integrator of Mitsuba 3", "mitsuba"),
    "cycles": ("the path tracer of Cycles", "bpy"),
}


class PeersError(Exception):
    """No other renderer can take part; the message says why."""


def checkout() -> Path:
    """The folder of the translations. Raises PeersError where this is no checkout."""
    folder = Path(__file__).resolve().parents[3] / "tests" / "bench"
    if not (folder / "peers").is_dir():
        raise PeersError(
            "--peers: this is no checkout, and the other renderers' translations are not "
            "installed; run ./run mbfeat tradeoff --peers in a checkout"
        )
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
    return folder


def default_stage() -> Path:
    """The stage that is measured where none is named."""
    return checkout().parent / "scenes" / "bench" / "room.usda"


def set_up(names: Sequence[str]) -> None:
    """Installs these renderers and Open Image Denoise. Raises PeersError."""
    checkout()
    from mbfeat.devtools import peer_steps, setup
    from mbfeat.devtools.console import SetupError
    from mbfeat.devtools.layout import this_layout

    for name in names:
        if name not in peer_steps.PEERS:
            known = ", ".join(peer_steps.PEERS)
            raise PeersError(f"--peers: there is no peer {name!r}; there are {known}")
    try:
        setup.set_up(this_layout(), [*peer_steps.steps_for(list(names)), peer_steps.Oidn])
    except SetupError as error:
        raise PeersError(f"--peers: {error}") from error


def variants(names: Sequence[str]) -> list[Variant]:
    """One for each peer."""
    from mbfeat.devtools.layout import this_layout

    found = []
    for name in names:
        title, package = TITLES[name]
        pinned = this_layout().devtools / f"requirements-{name}.txt"
        lines = pinned.read_text(encoding="utf-8").splitlines()
        version = next(line for line in lines if line.startswith(f"{package}=="))
        found.append(Variant(name, f"{title} ({version})", renderer=name, version=version))
    return found


class PeerStage:
    """The translation of a stage to arrays. Raises PeersError where it has none."""

    def __init__(self, stage: Path) -> None:
        checkout()
        from mbfeat.devtools.layout import this_layout
        from peers import stages

        self.layout = this_layout()
        try:
            self.files = stages.read(stage.stem, stage, self.layout)
        except stages.StageError as error:
            raise PeersError(
                f"--peers: {error}; only MBFeat is measured on this stage. The stages of "
                "tests/scenes/bench can be translated"
            ) from error


class PeerRenderer:
    """One peer on one stage; its process starts with the first render. See renders.Renderer."""

    def __init__(
        self,
        name: str,
        stage: PeerStage,
        size: tuple[int, int],
        threads: int,
        cores: Sequence[int],
        stack: ExitStack,
    ) -> None:
        from peers.process import installation
        from peers.rendering import Job

        self._installation = installation(name, stage.layout)
        self._source = stage.files.arrays
        self._log = stage.layout.log(f"tradeoff-{name}")
        self._job = Job(*size, BOUNCES, threads)
        self._cores = cores
        self._stack = stack
        self._process: Any = None
        self._load = self._first = 0.0

    def render(self, variant: Variant, spp: int, seed: int) -> Shot:
        """See renders.Renderer; the number of samples has to be a power of 4 for some."""
        from peers.process import RendererError

        try:
            if self._process is None:
                self._start()
            started = clock()
            rendered = self._process.render(spp, seed)
            taken = clock() - started
        except RendererError as error:
            self._process = None
            raise RenderError(str(error)) from error
        image = np.ascontiguousarray(rendered.image.transpose(2, 0, 1))
        seconds = {"load": self._load, "build": self._first, "sampling": taken}
        return Shot(np.nan_to_num(image, nan=0.0, posinf=0.0, neginf=0.0), seconds)

    def _start(self) -> None:
        from peers.process import RendererProcess

        started = clock()
        process = RendererProcess(
            self._installation, self._source, self._job, self._cores, self._log
        )
        self._process = self._stack.enter_context(process)
        self._load = clock() - started
        took = []
        for _ in range(2):
            started = clock()
            process.render(1, WARM_UP_SEED)
            took.append(clock() - started)
        self._first = max(took[0] - took[1], 0.0)
