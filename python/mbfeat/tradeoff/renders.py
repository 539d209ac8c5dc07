"""Renders of a stage by usdrecord, each in a process of its own, as a person would start them."""

from __future__ import annotations

import ctypes
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mbfeat.tradeoff.child import clock
from mbfeat.tradeoff.exr import read_layers
from mbfeat.tradeoff.inspection import StageFacts
from mbfeat.tradeoff.variants import Variant

Image = NDArray[np.float32]  # [3, height, width], linear

# Where a second can go, in the order in which they pass.
PHASES = ("load", "build", "sampling", "recording", "inference", "splat", "write", "other")
MEANING = {
    "load": "start of the program, reading the stage, its translation",
    "build": "textures, acceleration structures, light tables",
    "sampling": "tracing and shading",
    "recording": "what features add to the sampling",
    "inference": "the network or filter",
    "splat": "applying the network's kernels, and what else a reconstruction does",
    "write": "the files",
    "other": "what the renderer reports beyond these",
}
# Phases of the renderer's statistics by ours.
REPORTED = {
    "commit": "build",
    "build": "build",
    "sampling": "sampling",
    "feature recording": "recording",
    "inference": "inference",
    "splat": "splat",
    "tiles": "splat",  # the rest of a reconstruction: sums, borders, the film
    "write": "write",
}
SCOPE = "MBFeatTradeoff"  # of the prims that the session layer adds
MESSAGE = "usdrecord: "  # begins a message of the child's
PR_SET_PDEATHSIG = 1


class RenderError(Exception):
    """A render failed; the message says how."""


@dataclass(frozen=True)
class Shot:
    """An image and where its seconds went; `seconds` has keys of PHASES and sums to the total."""

    image: Image
    seconds: Mapping[str, float]

    @property
    def total(self) -> float:
        """Seconds from the start of the program to the written image."""
        return sum(self.seconds.values())


class Renderer(Protocol):
    """What makes images of one scene at one size."""

    def render(self, variant: Variant, spp: int, seed: int) -> Shot:
        """One image; equal seeds have equal noise. Raises RenderError."""
        ...


Filter = Callable[[str, Image, Mapping[str, Image]], tuple[Image, Mapping[str, float]]]


@dataclass(frozen=True)
class Subject:
    """What all renders of a measurement share."""

    stage: Path
    facts: StageFacts
    width: int
    height: int
    settings: tuple[tuple[str, str], ...]  # of the command line
    threads: int
    cores: tuple[int, ...]

    @property
    def settings_path(self) -> str:
        """Of the stage's RenderSettings, or of those that the session layer adds."""
        return self.facts.settings or f"/{SCOPE}/Settings"


class StageRenderer:
    """Renders a subject; `apply` is what filters an image (see variants.Variant.filter).

    `tell` gets every message of usdrecord's about the stage once, however many renders have it.
    """

    def __init__(
        self,
        subject: Subject,
        apply: Filter | None = None,
        tell: Callable[[str], None] | None = None,
    ) -> None:
        self._subject = subject
        self._apply = apply
        self._tell = tell
        self._told: set[str] = set()

    def render(self, variant: Variant, spp: int, seed: int) -> Shot:
        """See Renderer."""
        with tempfile.TemporaryDirectory(prefix="mbfeat-tradeoff-") as scratch:
            shot, features = self._rendered(variant, spp, seed, Path(scratch))
        if not variant.filter:
            return shot
        if self._apply is None:
            raise RenderError(f"{variant.name}: there is nothing to filter the image with")
        image, more = self._apply(variant.filter, shot.image, features)
        seconds = {p: shot.seconds.get(p, 0.0) + more.get(p, 0.0) for p in PHASES}
        return Shot(image, seconds)

    def _rendered(
        self, variant: Variant, spp: int, seed: int, scratch: Path
    ) -> tuple[Shot, Mapping[str, Image]]:
        subject = self._subject
        image, product = scratch / "image.exr", scratch / "product.exr"
        session, statistics = scratch / "session.usda", scratch / "statistics.json"
        session.write_text(session_layer(subject, product, variant.features), encoding="utf-8")
        settings = dict(subject.settings) | dict(variant.settings)
        settings |= {
            "mbfeat:samplesPerPixel": str(spp),
            "mbfeat:seed": str(seed),
            "mbfeat:threads": str(subject.threads),
        }
        command = [sys.executable, "-m", "mbfeat.tradeoff.child", str(statistics)]
        command += ["--renderer", "MBFeat", "--quiet", "--sessionLayer", str(session)]
        command += ["--renderSettingsPrimPath", subject.settings_path]
        command += ["--camera", subject.facts.camera, "--imageWidth", str(subject.width)]
        command += [part for n, v in settings.items() for part in ("--set", f"{n}={v}")]
        started = clock()
        done = run_bound([*command, str(subject.stage), str(image)], subject.cores)
        if done.returncode != 0 or not statistics.exists():
            raise RenderError(f"{variant.name}, {spp} samples: {_last_words(done)}")
        self._pass_on(done.stderr)
        about = json.loads(statistics.read_text(encoding="utf-8"))
        seconds = phases(
            about["statistics"]["seconds"], about["image"], about["finished"] - started
        )
        layers = read_layers(image)
        features = read_layers(product) if variant.features else {}
        color = layers["color"]
        if color.shape[1:] != (subject.height, subject.width):
            raise RenderError(
                f"{variant.name}: the image is {color.shape[2]} x {color.shape[1]} pixels, not "
                f"{subject.width} x {subject.height}"
            )
        return Shot(color, seconds), features

    def _pass_on(self, said: str) -> None:
        """Tells the messages that were not told before."""
        for line in said.splitlines():
            # The name of the stage in memory differs from render to render.
            key = re.sub(r"<0x[0-9a-f]+>", "", line)
            if line.startswith(MESSAGE) and key not in self._told and self._tell is not None:
                self._tell(line)
            self._told.add(key)


def phases(
    reported: Sequence[Mapping[str, object]], image: float, total: float
) -> dict[str, float]:
    """Seconds by PHASES, of what the statistics report; what they do not is loading."""
    seconds = dict.fromkeys(PHASES, 0.0)
    seconds["write"] = image
    for row in reported:
        value = row["seconds"]
        assert isinstance(value, int | float)
        seconds[REPORTED.get(str(row["phase"]), "other")] += float(value)
    seconds["load"] = max(total - sum(seconds.values()), 0.0)
    return seconds


def session_layer(subject: Subject, product: Path, features: Sequence[str]) -> str:
    """USD text over the stage: one product of the measured size instead of the stage's own."""
    names = ["color", *features]
    variables = "".join(
        f"""
    def RenderVar "Var{i}"
    {{
        uniform token dataType = "{"color4f" if name == "color" else "color3f"}"
        uniform string sourceName = "{name}"
        custom string driver:parameters:aov:name = "{name}"
    }}
"""
        for i, name in enumerate(names)
    )
    targets = ", ".join(f"</{SCOPE}/Var{i}>" for i in range(len(names)))
    # The whole image, whatever window the stage's settings have.
    whole = "uniform float4 dataWindowNDC = (0, 0, 1, 1)"
    settings = f"rel products = </{SCOPE}/Product>\n        {whole}"
    camera = f"rel camera = <{subject.facts.camera}>"
    own = ""
    if not subject.facts.settings:
        own = f"""
    def RenderSettings "Settings"
    {{
        {settings}
        {camera}
    }}
"""
    text = f"""#usda 1.0

def Scope "{SCOPE}"
{{{own}
    def RenderProduct "Product"
    {{
        {camera}
        uniform int2 resolution = ({subject.width}, {subject.height})
        uniform token productName = "{_quoted(product)}"
        uniform token productType = "raster"
        rel orderedVars = [{targets}]
    }}
{variables}}}
"""
    if subject.facts.settings:
        text += _over(subject.facts.settings.strip("/").split("/"), settings, "")
    return text


def _over(path: Sequence[str], content: str, indent: str) -> str:
    inner = f"{indent}    {content}\n"
    if len(path) > 1:
        inner = _over(path[1:], content, indent + "    ")
    return f'{indent}over "{path[0]}"\n{indent}{{\n{inner}{indent}}}\n'


def _quoted(path: Path) -> str:
    return str(path).replace("\\", "\\\\").replace('"', '\\"')


def run_bound(command: Sequence[str], cores: Sequence[int]) -> subprocess.CompletedProcess[str]:
    """Runs a command on these cores; it ends with this process, and not by a Ctrl-C of its own."""

    def prepare() -> None:
        os.sched_setaffinity(0, cores)
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)

    return subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        process_group=0,
        preexec_fn=prepare,
    )


def _last_words(done: subprocess.CompletedProcess[str]) -> str:
    lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    how = f"signal {-done.returncode}" if done.returncode < 0 else f"status {done.returncode}"
    # A message of ours is the last line that names the program; a crash leaves anything.
    said = [line for line in lines if line.startswith(MESSAGE)] or lines
    return said[-1].removeprefix(MESSAGE) if said else f"the render ended with {how}"
