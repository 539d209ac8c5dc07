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
from mbfeat.tradeoff import peers, reference, variants
from mbfeat.tradeoff.inspection import StageFacts, inspect
from mbfeat.tradeoff.measure import MOST_SEEDS
from mbfeat.tradeoff.renders import Subject
from mbfeat.tradeoff.variants import RAW, WHOLE, Variant

RUNGS = (1, 4, 16, 64, 256)
REFERENCE_FACTOR = 16  # samples of a rendered reference by those of the last rung
WIDTH = 320
MOST_SPP = 1 << 20  # of mbfeat:samplesPerPixel
# Whatever the stage says: a ladder of samples is one only where nothing else ends a render, and the
# raw image is the mean of the samples.
FIXED = {
    "mbfeat:targetError": "0",
    "mbfeat:timeLimit": "0",
    "mbfeat:denoise:enabled": "false",
    "mbfeat:viewAov": "",
}
# Settings that the measurement makes itself, and what to write instead.
RESERVED = {
    "mbfeat:samplesPerPixel": "--spp says how many samples are measured",
    "mbfeat:seed": "--seeds says how many are measured",
    "mbfeat:threads": "--threads says how many take part",
    "mbfeat:targetError": "every render takes the samples of its rung; ask with --error",
    "mbfeat:timeLimit": "every render takes the samples of its rung; ask with --seconds",
    "mbfeat:viewAov": "errors are those of the image",
}
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
    if rungs[-1] > MOST_SPP:
        raise UsageError(f"--spp {rungs[-1]}: a pixel has at most {MOST_SPP} samples")
    if not 1 <= options.seeds <= MOST_SEEDS:
        raise UsageError(f"--seeds {options.seeds}: from 1 to {MOST_SEEDS} are measured")
    if options.metric not in NAMES:
        raise UsageError(f"--metric {options.metric}: there are {', '.join(NAMES)}")
    for name in ("seconds", "error"):
        if any(not (value > 0 and math.isfinite(value)) for value in getattr(options, name)):
            raise UsageError(f"--{name}: give a number above zero")
    spp = REFERENCE_FACTOR * rungs[-1] if options.reference_spp is None else options.reference_spp
    if spp < 2:
        raise UsageError(
            f"--reference-spp {spp}: at least 2, one for each of the halves that show its noise"
        )
    return Scale(rungs, options.seeds, spp, options.metric)


def subject(options: argparse.Namespace, file: Path) -> Subject:
    """What is rendered; looks at the stage. Raises InspectionError."""
    if options.width is not None and options.width < 1:
        raise UsageError(f"--width {options.width}: an image is at least one pixel wide")
    cores = usable_cores()
    threads = len(cores) if options.threads is None else options.threads
    if not 1 <= threads <= len(cores):
        raise UsageError(f"--threads {threads}: from 1 to {len(cores)}, the number of cores")
    settings = _settings(options)
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
    bound = tuple(cores[-threads:])
    return Subject(file, facts, width, height, settings, threads, bound)


def _settings(options: argparse.Namespace) -> tuple[tuple[str, str], ...]:
    given = _checked(options.overrides)
    alike = FIXED | (peers.SETTINGS if options.peers is not None else {})
    return tuple((alike | given).items())


def _checked(pairs: Sequence[str]) -> dict[str, str]:
    """NAME=VALUE pairs as settings of a render. Raises UsageError."""
    from mbfeat.options import check_overrides

    given, problems = check_overrides(list(pairs))
    problems += [f"--set {name}: {RESERVED[name]}" for name, _ in given if name in RESERVED]
    if problems:
        raise UsageError("; ".join(problems))
    return dict(given)


def variant(text: str) -> Variant:
    """One of the command line; its settings are checked. Raises VariantError or UsageError."""
    found = variants.parsed(text)
    try:
        _checked([f"{name}={value}" for name, value in found.settings.items()])
    except UsageError as error:
        said = str(error).replace("--set ", "")
        raise UsageError(f"--variant {text}: {said}") from None
    return found


def height_of(facts: StageFacts, width: int) -> int:
    """The height that fits the stage's resolution, else what its camera sees."""
    aspect = facts.width / facts.height if facts.width and facts.height else facts.aspect
    return max(round(width / aspect), 1)


def chosen(found: Sequence[Variant], only: str | None) -> list[Variant]:
    """Those that are named, and raw and whole paths, to which others are compared."""
    if not only:
        return list(found)
    wanted = [name.strip() for name in only.split(",") if name.strip()]
    known = [variant.name for variant in found]
    for name in wanted:
        if name not in known:
            raise UsageError(
                f"--only {name}: there is no such variant; there are {', '.join(known)}"
            )
    if any(variant.is_whole for variant in found if variant.name in wanted):
        wanted.append(WHOLE)
    return [variant for variant in found if variant.name in (RAW, *wanted)]
