"""``./run mbfeat bench``: measures scene after scene, shows where it is, keeps what it has."""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mbfeat.devtools import peer_steps, setup
from mbfeat.devtools.console import Console, SetupError
from mbfeat.devtools.layout import Layout, this_layout, write_whole
from mbfeat.machine import cpu_name
from peers import report, stages
from peers.measure import SceneMeasurement, Settings, scene_entry
from peers.process import Installation, installation, own_installation
from peers.references import ReferenceStore
from peers.rendering import Job

QUICK = {
    "width": 128,
    "rounds": 3,
    "seconds": 1.0,
    "seeds": 2,
    "max_spp": 64,
    "max_reference_spp": 256,
}
FULL = {
    "width": 320,
    "rounds": 5,
    "seconds": 4.0,
    "seeds": 5,
    "max_spp": 1024,
    "max_reference_spp": 8192,
}


class UsageError(Exception):
    """The arguments do not fit; the message says what to change."""


def run(options: argparse.Namespace) -> int:
    """Measures as the options of the command line say; returns the exit code."""
    layout = this_layout()
    if "MBFEAT_BUILD_DIR" not in os.environ:
        sys.stderr.write("mbfeat: bench: start it with ./run mbfeat bench, which sets it up\n")
        return 1
    try:
        names = _chosen(options.scenes, stages.NAMES, "scene")
        peers = _chosen(options.peers, tuple(peer_steps.PEERS), "peer") if options.peers else []
        settings = _settings(options)
        _check_output(options.json)
    except UsageError as error:
        sys.stderr.write(f"mbfeat: bench: {error}\n")
        return 2
    try:
        setup.set_up(layout, peer_steps.steps_for(peers))
    except SetupError as error:
        sys.stderr.write(f"mbfeat: bench: {error}\n")
        return 1
    result = _about(settings)
    load = result["machine"]["load_average"][0]
    if load > len(os.sched_getaffinity(0)) and settings.clock == "wall":
        sys.stderr.write(
            f"mbfeat: bench: the load average is {load:.1f}, so other programs take a share of "
            "the wall seconds; wait for a quiet machine, or count --clock cpu\n"
        )
    try:
        failed = _measure(result, names, _installations(layout, peers), settings, layout, options)
    except KeyboardInterrupt:
        sys.stderr.write("\nmbfeat: bench: interrupted; finished scenes and references are kept\n")
        failed = 130
    if result["scenes"]:
        print(report.summary(result))
        if options.json:
            print(f"wrote {options.json}")
    return failed


def _measure(
    result: dict[str, Any],
    names: Sequence[str],
    installations: Sequence[Installation],
    settings: Settings,
    layout: Layout,
    options: argparse.Namespace,
) -> int:
    """Measures the scenes into `result`, which is written after each; returns the exit code."""
    console = Console()
    store = ReferenceStore(layout.peers / "references")
    failed = 0
    for number, name in enumerate(names, 1):
        console.start(f"[{number}/{len(names)}] {name}")
        try:
            files = stages.prepare(name, layout)
        except stages.StageError as error:
            sys.stderr.write(f"mbfeat: bench: {error}\n")
            failed = 1
            continue
        logs = layout.log("bench").with_suffix("")
        measurement = SceneMeasurement(files, settings, store, logs, console.update)
        measurement.run(installations)
        console.done()
        for text in measurement.failures.values():
            sys.stderr.write(f"mbfeat: bench: {name}: {text}\n")
            failed = 1
        result["scenes"].append(scene_entry(measurement, name, settings))
        result["machine"]["load_average"][1] = os.getloadavg()[0]
        if options.json:
            write_whole(options.json, json.dumps(finite(result), indent=2) + "\n")
    return failed


def finite(value: Any) -> Any:
    """The same with null for what JSON has no number for."""
    if isinstance(value, dict):
        return {key: finite(part) for key, part in value.items()}
    if isinstance(value, list):
        return [finite(part) for part in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _installations(layout: Layout, peers: Sequence[str]) -> list[Installation]:
    return [own_installation(), *(installation(peer, layout) for peer in peers)]


def _settings(options: argparse.Namespace) -> Settings:
    """The settings, from what was given and what --quick or its absence stands for."""
    given = {name: getattr(options, name) for name in FULL}
    values = {
        name: (QUICK if options.quick else FULL)[name] if value is None else value
        for name, value in given.items()
    }
    cores = sorted(os.sched_getaffinity(0))
    if options.threads > len(cores):
        raise UsageError(f"--threads {options.threads} needs as many cores; there are {len(cores)}")
    least = {"width": 16, "rounds": 1, "seconds": 0.01, "seeds": 2, "max_spp": 4}
    for name, low in least.items():
        if values[name] < low:
            raise UsageError(f"--{name.replace('_', '-')} has to be at least {low}")
    width = int(values["width"])
    return Settings(
        Job(width, width * 9 // 16, options.bounces, options.threads),
        cores[-options.threads :],
        rounds=int(values["rounds"]),
        seconds=values["seconds"],
        seeds=int(values["seeds"]),
        most_spp=int(values["max_spp"]),
        most_reference_spp=int(values["max_reference_spp"]),
        any_build=options.any_build,
        clock=options.clock,
    )


def _chosen(text: str | None, known: Sequence[str], kind: str) -> list[str]:
    """The names in a list with commas; all of them for none."""
    names = [name.strip() for name in (text or "").split(",") if name.strip()] or list(known)
    for name in names:
        if name not in known:
            raise UsageError(f"there is no {kind} {name!r}; there are {', '.join(known)}")
    return list(dict.fromkeys(names))


def _check_output(path: Path | None) -> None:
    """What is wrong shows before an hour of measuring rather than after."""
    if path is not None and not path.resolve().parent.is_dir():
        raise UsageError(f"{path}: there is no folder {path.parent}; make it first")
    if path is not None and path.is_dir():
        raise UsageError(f"{path}: it is a folder; name a file")


def _about(settings: Settings) -> dict[str, Any]:
    load = os.getloadavg()[0]
    return {
        "date": datetime.now(UTC).date().isoformat(),
        "command": " ".join(["./run", "mbfeat", *sys.argv[1:]]),
        "machine": {
            "cpu": cpu_name(),
            "cores": os.cpu_count(),
            "system": platform.platform(),
            "load_average": [load, load],  # at the start and at the end
        },
        "threads": settings.job.threads,
        "settings": {
            "width": settings.job.width,
            "height": settings.job.height,
            "bounces": settings.job.bounces,
            "rounds": settings.rounds,
            "seconds": settings.seconds,
            "seeds": settings.seeds,
            "most_spp": settings.most_spp,
            "target": settings.target,
            "clock": settings.clock,
            "cores": list(settings.cores),
        },
        "scenes": [],
    }
