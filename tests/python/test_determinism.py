"""The image depends on the scene, the settings and the seed: not on threads, tiles or the run."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rendering import (
    EVERY_AOV,
    SCENES,
    SETTINGS,
    add_product,
    committed_stages,
    open_scene,
    read_parts,
    record,
)

# No multiple of a tile's side, so that tiles are cut off at the right and at the bottom.
RESOLUTION = (37, 21)
SETUPS = [(1, 16), (2, 16), (7, 16), (2, 8), (7, 64)]


def add_products(stage: Any, folder: Path) -> None:
    add_product(stage, folder / "image.exr", EVERY_AOV, resolution=RESOLUTION)
    add_product(stage, folder / "paths.exr", ["color"], deep=True, resolution=RESOLUTION)


def pixels(folder: Path) -> dict[str, bytes]:
    """The bits of every channel of both products."""
    found = {}
    for file in ("image.exr", "paths.exr"):
        (part,) = read_parts(folder / file)
        for name, values in part.channels.items():
            deep = values.dtype == object
            flat = np.concatenate(values.ravel().tolist()) if deep else values
            found[f"{file}:{name}"] = flat.tobytes()
    return found


def different(a: dict[str, bytes], b: dict[str, bytes]) -> list[str]:
    assert a.keys() == b.keys()
    return [name for name in a if a[name] != b[name]]


def rendered(scene: str, folder: Path, **settings: object) -> dict[str, bytes]:
    folder.mkdir()
    stage = open_scene(scene)
    add_products(stage, folder)
    frame = record(stage, folder, samplesPerPixel=5, **settings)
    assert frame.report.errors == []
    return pixels(folder)


@pytest.mark.parametrize("scene", committed_stages())
def test_bits_are_the_same_for_any_threads_and_tiles(scene: str, tmp_path: Path) -> None:
    images = [
        rendered(scene, tmp_path / f"{threads}_{tile}", threads=threads, tileSize=tile)
        for threads, tile in SETUPS
    ]
    for setup, image in zip(SETUPS[1:], images[1:], strict=True):
        assert different(images[0], image) == [], f"{setup[0]} threads, tiles of {setup[1]}"


@pytest.mark.parametrize("scene", committed_stages())
def test_bits_are_the_same_for_every_kernel(scene: str, tmp_path: Path) -> None:
    """Scalar code and SIMD lanes of every width; the last is what this processor has widest."""
    images = [
        rendered(scene, tmp_path / kernel, kernel=kernel) for kernel in ("scalar", "avx2", "avx512")
    ]
    assert different(images[0], images[1]) == []
    assert different(images[0], images[2]) == []


def split(scene: str, folder: Path, **settings: object) -> tuple[dict[str, bytes], int]:
    """The bits of an image whose paths may split, which recorded ones do not, and into how many."""
    folder.mkdir()
    stage = open_scene(scene)
    add_product(stage, folder / "image.exr", resolution=RESOLUTION)
    frame = record(stage, folder, **settings)
    assert frame.report.errors == []
    (part,) = read_parts(folder / "image.exr")
    report: Any = frame.report.to_dict()
    bits = {name: values.tobytes() for name, values in part.channels.items()}
    return bits, int(report["kernel"]["branches"])


def test_bits_are_the_same_where_paths_split(tmp_path: Path) -> None:
    setups: list[dict[str, object]] = [{"threads": 1, "tileSize": 16}, {"threads": 7}]
    setups += [{"kernel": kernel} for kernel in ("scalar", "avx2", "avx512")]
    whole, _ = split("interior", tmp_path / "whole", samplesPerPixel=5, splitting=1)
    # Left to a trial, at as many samples as make one worth while.
    for splitting, spp in ((2, 5), (4, 5), (0, 32)):
        made = [
            split(
                "interior",
                tmp_path / f"{splitting}_{i}",
                samplesPerPixel=spp,
                splitting=splitting,
                **setup,
            )
            for i, setup in enumerate(setups)
        ]
        first, branches = made[0]
        assert branches == splitting or (splitting == 0 and branches > 1)
        assert "R" in different(whole, first)
        for setup, (image, others) in zip(setups[1:], made[1:], strict=True):
            assert others == branches
            assert different(first, image) == [], f"{splitting}: {setup}"


def test_another_seed_is_another_image_and_the_same_one_the_same(tmp_path: Path) -> None:
    first, again, other = (
        rendered("interior", tmp_path / name, seed=seed)
        for name, seed in (("first", 3), ("again", 3), ("other", 4))
    )
    assert different(first, again) == []
    assert {"image.exr:R", "image.exr:variance.G", "paths.exr:subpixel.X"} <= set(
        different(first, other)
    )


def test_more_samples_begin_with_the_same_paths(tmp_path: Path) -> None:
    few, many = ({}, {})  # type: tuple[dict[str, Any], dict[str, Any]]
    for count, paths in ((3, few), (8, many)):
        stage = open_scene("cockpit")
        add_product(stage, tmp_path / f"paths_{count}.exr", deep=True, resolution=(6, 5))
        record(stage, tmp_path, samplesPerPixel=count)
        (part,) = read_parts(tmp_path / f"paths_{count}.exr")
        for name, values in part.channels.items():
            paths[name] = np.concatenate(values.ravel().tolist()).reshape(30, count)
    for name, values in few.items():
        assert values.tobytes() == np.ascontiguousarray(many[name][:, :3]).tobytes(), name


def test_command_line_threads_and_tiles_do_not_show(tmp_path: Path) -> None:
    """The same through usdrecord --set, image and products."""
    from pxr import Usd

    results = []
    for threads, tile in ((1, 64), (7, 8)):
        folder = tmp_path / f"{threads}_{tile}"
        folder.mkdir()
        stage = Usd.Stage.CreateNew(str(folder / "stage.usda"))
        stage.GetRootLayer().subLayerPaths.append(str(SCENES / "cockpit.usda"))
        add_products(stage, folder)
        stage.GetRootLayer().Save()
        command = [
            sys.executable, "-m", "mbfeat.usdrecord", "--quiet", "-rs", SETTINGS,
            "--set", f"mbfeat:threads={threads}", "--set", f"mbfeat:tileSize={tile}",
            "--set", "mbfeat:samplesPerPixel=3", "stage.usda", "main.exr",
        ]  # fmt: skip
        run = subprocess.run(
            command, cwd=folder, env=dict(os.environ), capture_output=True, text=True, timeout=120
        )
        assert run.returncode == 0, run.stderr
        (main,) = read_parts(folder / "main.exr")
        assert main.header["mbfeat:setting:threads"] == f"{threads} (command line)"
        results.append(
            {**pixels(folder), **{name: v.tobytes() for name, v in main.channels.items()}}
        )
    assert different(*results) == []
