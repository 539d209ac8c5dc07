"""Stages by other people, in a folder beside the checkout; skipped where it is absent.

They have missing files, MaterialX materials, subdivision surfaces, payloads, draw modes, and one
has neither camera nor light.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from rendering import read_parts

STAGES = Path(__file__).resolve().parents[3] / "shared" / "stages"
BALL = "StandardShaderBall/standard_shader_ball_scene.usda"
TEAPOT = "Teapot/Teapot.usd"
DRAW_MODES = "Teapot/DrawModes.usd"

pytestmark = pytest.mark.skipif(not STAGES.is_dir(), reason=f"there is no {STAGES}")


class Result:
    """What a run of usdrecord said and made."""

    def __init__(self, run: subprocess.CompletedProcess[str], image: Path) -> None:
        assert run.returncode == 0, run.stderr
        assert "Traceback" not in run.stderr
        self.summary = run.stdout
        self.warnings = [line for line in run.stderr.splitlines() if "warning:" in line]
        errors = [line for line in run.stderr.splitlines() if "error:" in line.lower()]
        assert errors == []
        (part,) = read_parts(image)
        self.color: NDArray[np.float32] = part.layers()["color"]
        self.header = part.header
        assert np.isfinite(self.color).all() and (self.color >= 0.0).all()
        assert self.header["mbfeat:nonFiniteSamples"] == "0"


@pytest.fixture
def record(tmp_path: Path) -> Callable[..., Result]:
    """Renders a stage with usdrecord at a few samples."""

    def call(stage: str, *arguments: str) -> Result:
        image = tmp_path / "image.exr"
        command = [
            sys.executable, "-m", "mbfeat.usdrecord", "-w", "64",
            "--set", "mbfeat:samplesPerPixel=8", *arguments, str(STAGES / stage), str(image),
        ]  # fmt: skip
        run = subprocess.run(
            command, cwd=tmp_path, env=dict(os.environ), capture_output=True, text=True, timeout=240
        )
        return Result(run, image)

    return call


def test_shader_ball_renders_and_names_what_it_lacks(record: Callable[..., Result]) -> None:
    result = record(BALL, "--camera", "camera")
    assert result.color.shape == (64, 64, 4)
    assert (result.color[..., 3] == 1.0).all()  # the camera stands in a closed studio
    ball = result.color[12:40, 14:50, :3]
    assert 0.01 < np.median(ball) < 2.0
    assert ball.std() > 0.01  # shaded, not flat
    assert "textures" in result.header["mbfeat:effects"]
    missing = [line for line in result.warnings if "ground.ACEScg.exr" in line]
    assert len(missing) == 1
    assert "/standard_shader_ball_scene/materials/ground" in missing[0]
    assert "fallback" in missing[0]
    # The same thing is said once, and there are no more things than this.
    assert len(set(result.warnings)) == len(result.warnings) <= 4


def test_stage_without_camera_and_light_is_framed_and_lit(record: Callable[..., Result]) -> None:
    result = record(TEAPOT)
    assert "free camera" in result.summary
    assert result.warnings == []
    alpha, color = result.color[..., 3], result.color[..., :3]
    rows, columns = np.nonzero(alpha > 0.5)
    height, width = alpha.shape
    # The whole teapot is in the image, and fills a good part of it.
    assert rows.min() > 0 and rows.max() < height - 1
    assert columns.min() > 0 and columns.max() < width - 1
    assert columns.max() - columns.min() > 0.4 * width
    assert (color[alpha == 0.0] == 0.0).all()
    # Green glaze, lit from the camera.
    red, green, blue = np.median(color[alpha == 1.0], axis=0)
    assert green > 0.05 and green > 1.2 * red and green > 2.0 * blue


def test_stage_without_light_is_black_without_the_camera_light(
    record: Callable[..., Result],
) -> None:
    result = record(TEAPOT, "--disableCameraLight")
    assert (result.color[..., 3] == 1.0).any()
    assert not result.color[..., :3].any()


def test_draw_modes_with_missing_cards_render(record: Callable[..., Result]) -> None:
    result = record(DRAW_MODES)
    assert (result.color[..., 3] > 0.5).sum() > 20
    assert "cutouts" in result.header["mbfeat:effects"]
    cards = [line for line in result.warnings if "cards/" in line]
    assert len(cards) == len(set(cards)) == 12
    for line in cards:
        assert "/World/" in line and "fallback" in line
