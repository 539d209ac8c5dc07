"""What the command line asks for, checked before anything is rendered."""

from __future__ import annotations

import argparse
import importlib.util
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mbfeat.machine import usable_cores
from mbfeat.metrics import NAMES
from mbfeat.tradeoff import peers, reference
from mbfeat.tradeoff.inspection import StageFacts, inspect
from mbfeat.tradeoff.renders import Subject
from mbfeat.tradeoff.variants import RAW, Variant

RUNGS = (1, 4, 16, 64, 256)
REFERENCE_FACTOR = 16  # samples of a rendered reference by those of the last rung
WIDTH = 320
# A ladder of samples is one only where nothing else ends a render.
FIXED = {"mbfeat:targetError": "0", "mbfeat:timeLimit": "0"}
NEEDED = ("matplotlib", "OpenEXR")


class UsageError(Exception):
    """The arguments do not fit; the message says what to change."""


@dataclass(frozen=True)
class Scale:
    """How thoroughly is measured."""

    rungs: tuple[int, ...]
    seeds: int
    reference_spp: int
    metric: str


def check_packages() -> None:
    """Raises UsageError where a package is missing that only this command needs."""
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        raise UsageError(
            f"this needs {' and '.join(missing)}; install mbfeat[charts], or "
            f"pip install {' '.join(missing)}"
        )


def peer_names(text: str | None) -> list[str]:
    """The names of --peers."""
    return list(dict.fromkeys(n.strip() for n in (text or "").split(",") if n.strip()))


def stage(options: argparse.Namespace) -> Path:
    """The stage that is named, or the one that peers are compared on."""
    if options.stage is None and options.peers is None:
        raise UsageError("name a stage: mbfeat tradeoff STAGE --out DIR")
    file = Path(options.stage) if options.stage is not None else peers.default_stage()
    if not file.is_file():
        raise UsageError(f"{file}: there is no such file; name a USD stage")
    return file


def folder(options: argparse.Namespace) -> Path:
    """The output folder, made where there is none."""
    if options.out is None:
        raise UsageError("name a folder for the results: --out DIR")
    out = Path(options.out)
    if out.exists() and not out.is_dir():
        raise UsageError(f"--out {out}: it is a file; name a folder")
    out.mkdir(parents=True, exist_ok=True)
    return out


def scale(options: argparse.Namespace) -> Scale:
    """How thoroughly to measure."""
    rungs: tuple[int, ...] = RUNGS
    if options.spp:
        try:
            rungs = tuple(sorted({int(part) for part in options.spp.split(",") if part.strip()}))
        except ValueError as error:
            raise UsageError(f"--spp {options.spp}: write numbers, as in 4,16,64") from error
    if not rungs or rungs[0] < 1:
        raise UsageError(f"--spp {options.spp}: a pixel has at least one sample")
    if options.seeds < 1:
        raise UsageError(f"--seeds {options.seeds}: at least one is measured")
    if options.metric not in NAMES:
        raise UsageError(f"--metric {options.metric}: there are {', '.join(NAMES)}")
    for name in ("seconds", "error"):
        if any(not (value > 0 and math.isfinite(value)) for value in getattr(options, name)):
            raise UsageError(f"--{name}: give a number above zero")
    spp = options.reference_spp or REFERENCE_FACTOR * rungs[-1]
    return Scale(rungs, options.seeds, max(spp, 2), options.metric)


def subject(options: argparse.Namespace, file: Path) -> Subject:
    """What is rendered; looks at the stage. Raises InspectionError."""
    facts = inspect(file, options.camera or "")
    if options.reference:
        image = reference.given(options.reference).image
        height, width = image.shape[1:]
        if options.width and options.width != width:
            raise UsageError(
                f"--width {options.width}: the reference is {width} pixels wide; leave one out"
            )
    else:
        width = options.width or min(facts.width or WIDTH, WIDTH)
        height = height_of(facts, width)
    cores = usable_cores()
    threads = options.threads or len(cores)
    if threads > len(cores):
        raise UsageError(f"--threads {threads} needs as many cores; there are {len(cores)}")
    bound = tuple(cores[-threads:])
    return Subject(file, facts, width, height, _settings(options), threads, bound)


def _settings(options: argparse.Namespace) -> tuple[tuple[str, str], ...]:
    from mbfeat import _core
    from mbfeat.options import check_overrides

    given, problems = check_overrides(options.overrides)
    if problems:
        raise UsageError("; ".join(problems))
    known = {setting.name for setting in _core.setting_table()}
    alike = {name: value for name, value in FIXED.items() if name in known}
    alike |= peers.SETTINGS if options.peers is not None else {}
    return tuple((alike | dict(given)).items())


def height_of(facts: StageFacts, width: int) -> int:
    """The height that fits the stage's resolution, else what its camera sees."""
    aspect = facts.width / facts.height if facts.width and facts.height else facts.aspect
    return max(round(width / aspect), 1)


def chosen(found: Sequence[Variant], only: str | None) -> list[Variant]:
    """Those that are named, and raw, to which all others are compared."""
    if not only:
        return list(found)
    wanted = [name.strip() for name in only.split(",") if name.strip()]
    known = [variant.name for variant in found]
    for name in wanted:
        if name not in known:
            raise UsageError(f"--only {name}: there is no such variant; there are {known}")
    return [variant for variant in found if variant.name in (RAW, *wanted)]
