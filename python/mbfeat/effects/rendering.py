"""Starts the rendering process of ``mbfeat effects`` and talks to it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

ANSWER = "\x1e"  # begins the lines that are meant for us
RECORDED = {
    "path features": ("mbfeat:albedo:", "mbfeat:normal:", "mbfeat:direct:", "albedo"),
    "contributions": ("mbfeat:contribution:",),
    "extended features": (
        "mbfeat:roughness:",
        "mbfeat:distance:",
        "mbfeat:throughput:",
        "mbfeat:event:",
    ),
    "first non-delta": ("mbfeat:firstNonDelta:",),
    "first hit": ("primId", "instanceId", "elementId", "depth", "cameraDepth", "normal", "Neye"),
    "primvar AOVs": ("primvars:",),
}


class EffectsError(Exception):
    """The stage cannot be rendered; the message is for the user, or empty if it was printed."""


def aovs_of(effect: str) -> list[str]:
    """All AOVs that call for recording of that kind; none for other effects and for primvars."""
    from mbfeat import _core

    begins = RECORDED.get(effect, ())
    return [aov.name for aov in _core.aov_table() if aov.name.startswith(begins)] if begins else []


@dataclass(frozen=True)
class Variant:
    """What is rendered: mbfeat:effects, and AOVs."""

    effects: str
    aovs: tuple[str, ...]
    deep: bool = False


class Rendering:
    """The process that renders one stage; a context manager."""

    def __init__(
        self,
        stage: Path | str,
        *,
        settings: str = "",
        camera: str = "",
        width: int = 320,
        cores: list[int] | None = None,
    ) -> None:
        command = [sys.executable, "-P", "-m", "mbfeat.effects.worker", str(stage)]
        command += ["--width", str(width)]
        for name, value in (("settings", settings), ("camera", camera)):
            command += [f"--{name}", value] if value else []
        pin: Callable[[], None] | None = None
        if cores is not None:
            chosen = cores

            def pin() -> None:
                os.sched_setaffinity(0, chosen)

        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, preexec_fn=pin
        )
        about = self._answer()
        self.own = Variant("auto", tuple(about["aovs"]), bool(about["deep"]))
        self.camera = str(about["camera"])

    def __enter__(self) -> Rendering:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._process.stdin is not None:
            self._process.stdin.close()
        try:
            self._process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            self._process.terminate()
            try:
                self._process.wait(timeout=5)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()

    def render(self, variant: Variant, **settings: str) -> dict[str, Any]:
        """Renders; the report. Keywords are mbfeat:* settings."""
        request = {
            "aovs": list(variant.aovs),
            "deep": variant.deep,
            "settings": {
                "mbfeat:effects": variant.effects,
                **{f"mbfeat:{name}": value for name, value in settings.items()},
            },
        }
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError as error:
            raise EffectsError("") from error
        return self._answer()

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith(ANSWER):
                return dict(json.loads(line[1:]))
        raise EffectsError("")  # the process has said why
