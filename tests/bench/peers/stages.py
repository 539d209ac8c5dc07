"""The stages of the benchmark, made ready for all renderers in .mbfeat/peers/."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from mbfeat.devtools import environment
from mbfeat.devtools.layout import Layout, digest, read_stamp, write_whole
from peers.measure import SceneFiles

TESTS = Path(__file__).resolve().parents[2]
MAKER = TESTS / "scenes" / "make_bench_scenes.py"
NAMES = ("room", "mirrors", "dome", "stairs", "field", "lamps")
LARGE = ("field",)  # not committed, but made on demand


class StageError(Exception):
    """A stage could not be made or read; the message says why."""


def prepare(name: str, layout: Layout) -> SceneFiles:
    """Makes the stage if it is a large one, and reads it into arrays."""
    if name in LARGE:
        return read(name, _made(name, layout), layout)
    return read(name, TESTS / "scenes" / "bench" / f"{name}.usda", layout)


def read(name: str, stage: Path, layout: Layout) -> SceneFiles:
    """Reads a stage into arrays that are kept under `name`. Raises StageError."""
    arrays = layout.peers / "scenes" / name
    arrays.mkdir(parents=True, exist_ok=True)
    _python(layout, name, "-m", "peers.reader", str(stage), str(arrays))
    parts = [(arrays / file).read_bytes() for file in ("scene.json", "arrays.npz")]
    return SceneFiles(name, stage, arrays, digest(*parts))


def _made(name: str, layout: Layout) -> Path:
    folder = layout.peers / "stages"
    stage, stamp = folder / f"{name}.usdc", folder / f"{name}.stamp"
    key = digest(MAKER.read_bytes(), (MAKER.parent / "stagekit.py").read_bytes())
    if read_stamp(stamp) != key or not stage.exists():
        _python(layout, name, str(MAKER), "--large", "--out", str(folder))
        write_whole(stamp, key)
    return stage


def _python(layout: Layout, name: str, *arguments: str) -> None:
    """Runs Python with usd-core, since this process has the other OpenUSD."""
    variables = environment.for_usd_core(layout, os.environ)
    paths = [str(TESTS / "bench"), variables["PYTHONPATH"]]
    variables["PYTHONPATH"] = os.pathsep.join(paths)
    done = subprocess.run(
        [sys.executable, *arguments], env=variables, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or ["it ended without a message"]
        raise StageError(f"the stage {name} could not be made ready: {lines[-1]}")
