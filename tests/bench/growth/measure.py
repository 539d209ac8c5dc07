"""Rounds of processes that render, value after value; each answer is kept at once."""

from __future__ import annotations

import ctypes
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from growth import stages
from growth.axes import Axis, Shot
from mbfeat.files import write_whole
from mbfeat.tradeoff.kept import build_key, digest

PR_SET_PDEATHSIG = 1
BENCH = Path(__file__).resolve().parents[1]
WARM = Shot("triangles", 100)

Answer = dict[str, Any]


class GrowthError(Exception):
    """A value could not be measured; the message is for the user."""


@dataclass(frozen=True)
class Kept:
    """Answers in a folder, by all that they depend on."""

    folder: Path
    key: str  # of the build and of this package

    def file(self, what: Any, turn: int) -> Path:
        """Where the answer of that round is, or would be."""
        return self.folder / f"{digest([self.key, what, turn])}.json"

    def load(self, what: Any, turn: int) -> Answer | None:
        """The answer, if it is there."""
        try:
            return dict(json.loads(self.file(what, turn).read_text(encoding="utf-8")))
        except (OSError, ValueError):
            return None

    def save(self, what: Any, turn: int, answer: Answer) -> None:
        """Keeps an answer, whole or not at all."""
        write_whole(self.file(what, turn), json.dumps(answer) + "\n")


def kept_in(folder: Path) -> Kept:
    """The answers there that the renderer as it is built, and this package, would give again."""
    sources = [
        file.read_text(encoding="utf-8")
        for file in sorted(Path(__file__).parent.iterdir())
        if file.name in ("stages.py", "worker.py", "interactive.py")
    ]
    return Kept(folder, digest([build_key(), sources]))


def run_process(module: str, arguments: Sequence[str], cores: Sequence[int]) -> Answer:
    """Runs a module of this package in a process of its own on these cores; its answer.

    Raises GrowthError.
    """
    paths = [str(BENCH), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}

    def prepare() -> None:
        """On the given cores, and gone when this process is."""
        os.sched_setaffinity(0, cores)
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)

    done = subprocess.run(
        [sys.executable, "-P", "-m", f"growth.{module}", *arguments],
        capture_output=True,
        text=True,
        env=environment,
        check=False,
        preexec_fn=prepare,
    )
    lines = done.stdout.strip().splitlines()
    if done.returncode != 0 or not lines:
        said = " ".join(done.stderr.split())[-400:] or "it said nothing"
        raise GrowthError(f"{module} {' '.join(arguments)} ended with {done.returncode}: {said}")
    return dict(json.loads(lines[-1]))


class Stages:
    """Stages in a scratch folder, written when they are first needed."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def path(self, kind: str, size: int) -> Path:
        """The stage, written if it is not there."""
        path = self._folder / f"{kind}-{size}" / "stage.usdc"
        if not path.is_file():
            path.parent.mkdir(parents=True, exist_ok=True)
            stages.write(kind, size, path)
        return path


def measure_axis(
    axis: Axis, rounds: int, kept: Kept, cores: Sequence[int], tell: Callable[[str], None]
) -> list[list[Answer]]:
    """Answers [value][round]. The values take turns, so that what disturbs meets them alike."""
    answers: list[list[Answer]] = [[] for _ in axis.shots]
    with tempfile.TemporaryDirectory(prefix="mbfeat-growth-") as folder:
        there = Stages(Path(folder))
        for turn in range(rounds):
            for value, shot, found in zip(axis.values, axis.shots, answers, strict=True):
                tell(f"{axis.name} {value:,}, round {turn + 1} of {rounds}")
                answer = kept.load(asdict(shot), turn)
                if answer is None:
                    warm = there.path(WARM.kind, WARM.size)
                    stage = there.path(shot.kind, shot.size)
                    arguments = [str(warm), str(stage), json.dumps(asdict(shot))]
                    answer = run_process("worker", arguments, cores[: shot.threads])
                    kept.save(asdict(shot), turn, answer)
                found.append(answer)
    return answers
