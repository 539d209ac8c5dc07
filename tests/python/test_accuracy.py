"""Renders that stop at a target error or a time limit, and what they say of it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mbfeat.options import check_overrides
from rendering import (
    SCENES,
    SETTINGS,
    add_product,
    open_scene,
    read_parts,
    record,
)

RESOLUTION = (48, 32)


def test_target_error_is_reached_and_written_down(tmp_path: Path) -> None:
    stage = open_scene("cockpit")
    aovs = ["color", "sampleCount"]
    add_product(stage, tmp_path / "image.exr", aovs, resolution=RESOLUTION)
    frame = record(stage, tmp_path, samplesPerPixel=4096, targetError=0.25)
    taken = frame.report.sampling
    assert taken.stopped == "targetError"
    assert taken.error is not None
    assert 0.05 < taken.error <= 0.25
    assert 16 <= taken.fewest < taken.most < 4096
    (part,) = read_parts(tmp_path / "image.exr")
    counts = part.channels["sampleCount.Y"]
    assert (counts.min(), counts.max()) == (taken.fewest, taken.most)
    assert counts.mean() == pytest.approx(taken.mean)
    assert part.header["mbfeat:stopped"] == "targetError"
    assert float(part.header["mbfeat:estimatedError"]) == taken.error
    assert f"most {taken.most}" in part.header["mbfeat:samplesTaken"]
    told = json.loads(frame.report.json())["sampling"]
    assert told["stopped"] == "targetError"
    assert told["estimatedError95"] == taken.error95


def test_deep_products_have_the_paths_that_each_pixel_took(tmp_path: Path) -> None:
    stage = open_scene("cockpit")
    add_product(stage, tmp_path / "image.exr", ["color"], resolution=RESOLUTION)
    add_product(stage, tmp_path / "paths.exr", deep=True, resolution=RESOLUTION)
    frame = record(stage, tmp_path, samplesPerPixel=96, targetError=0.3, pixelFilter="box")
    assert frame.report.errors == []
    assert frame.report.sampling.fewest < frame.report.sampling.most
    color = read_parts(tmp_path / "image.exr")[0].layers()["color"]
    red = read_parts(tmp_path / "paths.exr")[0].channels["R"]
    counts = np.vectorize(len)(red)
    assert (counts.min(), counts.max()) == (
        frame.report.sampling.fewest,
        frame.report.sampling.most,
    )
    means = np.vectorize(lambda paths: float(np.mean(paths, dtype=np.float64)))(red)
    np.testing.assert_allclose(means, color[..., 0], rtol=1e-5, atol=1e-6)


def test_time_limit_writes_whole_products(tmp_path: Path) -> None:
    stage = open_scene("interior")
    add_product(stage, tmp_path / "image.exr", ["color", "sampleCount"], resolution=RESOLUTION)
    frame = record(stage, tmp_path, samplesPerPixel=1_000_000, timeLimit=1.0)
    assert frame.report.sampling.stopped == "timeLimit"
    assert not frame.report.interrupted
    assert 0.9 < frame.report.total_seconds < 10.0  # a busy machine is slow to write
    (part,) = read_parts(tmp_path / "image.exr")
    assert part.channels["sampleCount.Y"].min() >= 1
    assert part.header["mbfeat:stopped"] == "timeLimit"
    assert np.isfinite(part.channels["R"]).all()


def test_without_target_and_limit_nothing_is_estimated(tmp_path: Path) -> None:
    stage = open_scene("mirror")
    add_product(stage, tmp_path / "image.exr", ["color"], resolution=(8, 8))
    taken = record(stage, tmp_path, samplesPerPixel=5).report.sampling
    assert (taken.fewest, taken.mean, taken.most) == (5, 5.0, 5)
    assert (taken.stopped, taken.error, taken.error95) == ("samples", None, None)
    assert "mbfeat:estimatedError" not in read_parts(tmp_path / "image.exr")[0].header


def test_settings_prim_sets_the_target(tmp_path: Path) -> None:
    from pxr import Sdf

    stage = open_scene("interior")
    add_product(stage, tmp_path / "image.exr", ["color"], resolution=(32, 32))
    prim = stage.GetPrimAtPath(SETTINGS)
    prim.CreateAttribute("mbfeat:targetError", Sdf.ValueTypeNames.Double).Set(0.3)
    prim.CreateAttribute("mbfeat:adaptive", Sdf.ValueTypeNames.Bool).Set(False)
    taken = record(stage, tmp_path, samplesPerPixel=2048).report.sampling
    assert taken.stopped == "targetError"
    assert taken.fewest == taken.most


def test_bad_values_name_what_is_right() -> None:
    good, problems = check_overrides(
        ["mbfeat:targetError=-1", "mbfeat:timeLimit=soon", "mbfeat:adaptive=maybe"]
    )
    assert good == []
    assert "a number from 0 to 1000" in problems[0]
    assert "a number from 0 to" in problems[1]
    assert "true or false" in problems[2]


def test_command_line_says_why_it_stopped(tmp_path: Path) -> None:
    command = [
        sys.executable, "-m", "mbfeat.usdrecord", "--imageWidth", "48",
        "--set", "mbfeat:targetError=0.3", "--set", "mbfeat:samplesPerPixel=2048",
        str(SCENES / "interior.usda"), str(tmp_path / "image.exr"),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "stopped at the target error; estimated error" in done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["interior", "cockpit", "mirror", "pane"])
def test_estimated_error_is_the_true_one(scene: str, tmp_path: Path) -> None:
    """Root mean square over four seeds, within 20 %; about 5 % is what the seeds scatter."""

    def image(name: str, **settings: object) -> tuple[np.ndarray, float]:
        stage = open_scene(scene)
        file = tmp_path / f"{name}.exr"
        add_product(stage, file, ["color"], resolution=RESOLUTION)
        frame = record(stage, tmp_path, **settings)
        color = read_parts(file)[0].layers()["color"][..., :3].astype(np.float64)
        return color, frame.report.sampling.error or 0.0

    reference, _ = image("reference", samplesPerPixel=2048, seed=99)
    truth, told = [], []
    for seed in range(4):
        color, error = image(f"image_{seed}", samplesPerPixel=64, timeLimit=1e6, seed=seed)
        squares = (color - reference) ** 2 / (reference**2 + 0.01)
        truth.append(squares.mean() / (1 + 64 / 2048))  # the reference has noise of its own
        told.append(error**2)
    assert np.sqrt(np.mean(told)) == pytest.approx(np.sqrt(np.mean(truth)), rel=0.2)
