"""Open Image Denoise, kept in a process of its own: it brings another TBB than the renderer's."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mbfeat.tradeoff.renders import Image, RenderError

RECIPES = ("plain", "best")
PACKAGE = Path(__file__).resolve().parents[2]  # the folder that holds the package mbfeat


def interpreter() -> str | None:
    """The Python that has pyoidn: this one, or that of the environment made for --peers."""
    if importlib.util.find_spec("pyoidn") is not None:
        return sys.executable
    with contextlib.suppress(ImportError):
        from mbfeat.devtools.layout import this_layout

        python = this_layout().peers / "oidn" / "bin" / "python"
        if python.exists():
            return str(python)
    return None


class OidnProcess:
    """Filters images; a context manager that ends the process, which starts with the first one."""

    def __init__(self, python: str, threads: int, cores: Sequence[int]) -> None:
        self._python = python
        self._threads = threads
        self._cores = cores
        self._process: subprocess.Popen[str] | None = None
        self._device_seconds = 0.0
        self._scratch = tempfile.TemporaryDirectory(prefix="mbfeat-oidn-")

    def __call__(
        self, recipe: str, color: Image, features: Mapping[str, Image]
    ) -> tuple[Image, Mapping[str, float]]:
        """The filtered image, and the seconds of the device and of the filter. See renders.Filter.

        The device is made once, and counted with every image, as a person who filters one has it.
        """
        if self._process is None:
            self._start()
        folder = Path(self._scratch.name)
        files = {}
        for i, (name, image) in enumerate({**features, "color": color}.items()):
            files[name] = str(folder / f"{i}.npy")
            np.save(files[name], image)
        output = folder / "output.npy"
        answer = self._ask({"recipe": recipe, "images": files, "output": str(output)})
        seconds = {"load": self._device_seconds, "inference": float(answer["seconds"])}
        return np.load(output), seconds

    def _start(self) -> None:
        variables = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
        variables.update(PYTHONPATH=str(PACKAGE), PYTHONNOUSERSITE="1")
        command = [self._python, "-m", "mbfeat.tradeoff.filter_worker", str(self._threads)]
        cores = self._cores
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=variables,
            process_group=0,
            preexec_fn=lambda: os.sched_setaffinity(0, cores),
        )
        self._device_seconds = float(self._answer()["seconds"])

    def _ask(self, order: Mapping[str, Any]) -> dict[str, Any]:
        assert self._process is not None
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps(order) + "\n")
            self._process.stdin.flush()
        return self._answer()

    def _answer(self) -> dict[str, Any]:
        assert self._process is not None
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            status = self._process.wait()
            raise RenderError(f"Open Image Denoise ended with status {status}, see above")
        answer = dict(json.loads(line))
        if "error" in answer:
            raise RenderError(f"Open Image Denoise: {answer['error']}")
        return answer

    def __enter__(self) -> OidnProcess:
        return self

    def __exit__(self, *error: object) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._scratch.cleanup()
