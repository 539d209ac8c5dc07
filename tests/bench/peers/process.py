"""The measuring side's end of a process that renders (peers.worker)."""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from mbfeat.devtools import peer_steps
from mbfeat.devtools.layout import Layout
from peers.rendering import Job, Rendered

PR_SET_PDEATHSIG = 1
BENCH = Path(__file__).resolve().parents[1]


class RendererError(Exception):
    """A renderer's process ended; the message says where its output is."""


@dataclass(frozen=True)
class Installation:
    """How to start a renderer: its Python and what it needs to find."""

    name: str  # as peers.worker knows it
    python: Path
    environment: Mapping[str, str]


def own_installation() -> Installation:
    """MBFeat as ./run has set it up for this process."""
    paths = [str(BENCH), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    return Installation("mbfeat", Path(sys.executable), environment)


def peer_installation(name: str, python: Path, **variables: str) -> Installation:
    """A peer in a virtual environment of its own, without anything of ours but this package."""
    ours = ("PYTHON", "PXR_", "MBFEAT_", "VIRTUAL_ENV")
    environment = {k: v for k, v in os.environ.items() if not k.startswith(ours)}
    environment.update(PYTHONPATH=str(BENCH), PYTHONNOUSERSITE="1", **variables)
    return Installation(name, python, environment)


def installation(name: str, layout: Layout) -> Installation:
    """A peer where ./run has set it up."""
    variables = {}
    if name == "mitsuba" and "DRJIT_LIBLLVM_PATH" not in os.environ:
        variables["DRJIT_LIBLLVM_PATH"] = peer_steps.LLVM
    return peer_installation(name, layout.peers / name / "bin" / "python", **variables)


class RendererProcess:
    """A running renderer with a scene; a context manager that ends the process."""

    def __init__(
        self, installation: Installation, source: Path, job: Job, cores: Sequence[int], log: Path
    ) -> None:
        self.name = installation.name
        self._log = log
        self._image = log.with_name(f"{log.stem}.{os.getpid()}.npy")
        log.parent.mkdir(parents=True, exist_ok=True)

        def prepare() -> None:
            """On the same cores as the others, and gone when this process is."""
            os.sched_setaffinity(0, cores)
            ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)

        numbers = [job.width, job.height, job.bounces, job.threads]
        command = [str(installation.python), "-P", "-m", "peers.worker", installation.name]
        with log.open("w", encoding="utf-8") as sink:
            self._process = subprocess.Popen(
                [*command, str(source), *map(str, numbers)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=sink,
                text=True,
                env=dict(installation.environment),
                process_group=0,
                preexec_fn=prepare,
            )
        try:
            self.version = str(self._answer()["version"])
        except BaseException:
            self.close()
            raise

    def render(self, spp: int, seed: int) -> Rendered:
        """Renders and waits for it. Raises RendererError."""
        assert self._process.stdin is not None
        order = {"spp": spp, "seed": seed, "image": str(self._image)}
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps(order) + "\n")
            self._process.stdin.flush()
        answer = self._answer()
        return Rendered(np.load(self._image), answer["seconds"], answer["cpu"])

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if line:
            return dict(json.loads(line))
        status = self._process.wait()
        how = f"signal {-status}" if status < 0 else f"status {status}"
        lines = self._log.read_text(encoding="utf-8", errors="replace").split("\n")
        last = next((text.strip() for text in reversed(lines) if text.strip()), "it said nothing")
        raise RendererError(f"{self.name} ended with {how}: {last} (all output: {self._log})")

    def close(self) -> None:
        """Ends the process, whatever it does."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                with contextlib.suppress(OSError):
                    pipe.close()
        self._image.unlink(missing_ok=True)

    def __enter__(self) -> RendererProcess:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
