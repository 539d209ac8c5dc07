"""A foreign application hosts the plug-in: Blender, which finds it by PXR_PLUGINPATH_NAME alone.

Blender runs in a process and a virtual environment of its own, without any module or variable of
ours, and registers MBFeat by the script of the documentation. What it renders is compared with what
our own recorder makes of Blender's USD export, and with closed forms.
"""

from __future__ import annotations

import os
import re
import subprocess
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import rendering
from mbfeat.devtools import blender, setup, steps
from mbfeat.devtools.console import SetupError
from mbfeat.devtools.layout import this_layout

pytestmark = pytest.mark.slow

# Blender's passes in the documentation's script, and the AOVs that fill them.
PASSES = {
    "Combined": "color",
    "Distance": "cameraDepth",
    "Normal": "normal",
    "Albedo 1": "mbfeat:albedo:1",
}
Image = NDArray[np.float32]


@dataclass(frozen=True)
class Rendered:
    """What the session left."""

    folder: Path
    said: dict[str, str]  # on standard error, by render

    def passes(self, name: str) -> dict[str, Image]:
        """A picture's passes, [height, width, channels]."""
        layers: dict[str, Image] = {}
        for part in rendering.read_parts(self.folder / f"{name}.exr"):
            layers |= part.layers()
        return {layer.removeprefix("ViewLayer."): pixels for layer, pixels in layers.items()}

    def color(self, name: str) -> Image:
        return self.passes(name)["Combined"]


@pytest.fixture(scope="module")
def blender_python() -> Path:
    """The interpreter that has the module bpy."""
    layout = this_layout()
    try:
        setup.set_up(layout, list(blender.STEPS))
    except SetupError as error:
        pytest.skip(f"Blender is not there to host the plug-in: {error}")
    return layout.blender / "bin" / "python"


@pytest.fixture(scope="module")
def rendered(
    blender_python: Path, build_dir: Path, root: Path, tmp_path_factory: pytest.TempPathFactory
) -> Rendered:
    """One session of Blender, all pictures of it."""
    folder = tmp_path_factory.mktemp("blender")
    page = (root / "python" / "mbfeat" / "docs" / "rendering.md").read_text(encoding="utf-8")
    script = re.search(r"## From Blender.*?```python\n(.*?)```", page, re.DOTALL)
    assert script is not None
    (folder / "engine.py").write_text(script[1], encoding="utf-8")
    texture = root / "tests" / "scenes" / "textures" / "checker.png"
    session = Path(__file__).with_name("blender_session.py")
    finished = subprocess.run(
        [blender_python, session, folder / "engine.py", texture, folder],
        env={
            "PATH": os.environ["PATH"],
            "HOME": str(folder),
            "TMPDIR": str(folder),
            "PXR_PLUGINPATH_NAME": str(build_dir / "plugin" / "usd"),
            "TF_DEBUG": "HD_RPRIM_CLEANED",
            "TF_DEBUG_OUTPUT_FILE": "stderr",
        },
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    if "cannot open shared object file" in finished.stderr and not steps.DPKG_INFO.is_dir():
        pytest.skip(f"Blender lacks a system library: {finished.stderr.strip().splitlines()[-1]}")
    assert finished.returncode == 0, finished.stdout + finished.stderr
    sections = re.split(r"^==== (\w+)\n", finished.stderr, flags=re.MULTILINE)
    return Rendered(folder, dict(zip(sections[1::2], sections[2::2], strict=True)))


def recorded(rendered: Rendered, name: str, *, white: bool, **settings: Any) -> dict[str, Image]:
    """What our own recorder makes of Blender's USD export.

    Blender exports its white lights with a colour temperature, whose colour is not quite white:
    `white` turns that off.
    """
    from pxr import Usd, UsdGeom, UsdRender

    stage = Usd.Stage.Open(str(rendered.folder / f"{name}.usda"))
    stage.SetEditTarget(stage.GetSessionLayer())
    cameras = [prim.GetPath() for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera)]
    UsdRender.Settings.Define(stage, rendering.SETTINGS).CreateCameraRel().SetTargets(cameras)
    for prim in stage.Traverse() if white else ():
        temperature = prim.GetAttribute("inputs:enableColorTemperature")
        if temperature:
            temperature.Set(False)
    return rendering.render(
        stage, rendered.folder, PASSES.values(), resolution=(64, 32), **settings
    )


@pytest.mark.parametrize(
    ("picture", "stage", "white"),
    [("native", "materialx", True), ("exported", "preview_surface", False)],
)
def test_pictures_are_those_of_our_recorder(
    rendered: Rendered, picture: str, stage: str, white: bool
) -> None:
    passes = rendered.passes(picture)
    own = recorded(rendered, stage, white=white, samplesPerPixel=64, seed=1)
    assert set(passes) == set(PASSES)
    for name, aov in PASSES.items():
        expected = own[aov]
        assert passes[name].shape == (32, 64, expected.shape[2]), name
        assert np.isfinite(passes[name]).all()
        # The same random numbers meet the same scene, only placed by other matrices: paths differ
        # where they just hit or miss an edge.
        off = np.abs(passes[name] - expected).max(axis=2) > 1e-4 * (1 + np.abs(expected).max())
        assert np.count_nonzero(off) <= 0.02 * off.size, name
        assert passes[name].mean() == pytest.approx(expected.mean(), rel=1e-3), name
        assert expected.std() > 0.05, name  # or the comparison would say little


def test_known_radiances(rendered: Rendered) -> None:
    middle = np.s_[13:19, 29:35]  # pixels that the ball covers
    grey = rendered.passes("grey")
    assert grey["Combined"][2, 2] == pytest.approx([1.0, 1.0, 1.0, 0.0])  # the sky
    # Matte grey of 0.5 under a sky of 1, to five standard errors: a false alarm in 10^6 seeds.
    seen = grey["Combined"][middle].reshape(-1, 4)
    error = 5 * float(seen.std(axis=0).max()) / seen.shape[0] ** 0.5
    assert error < 0.01
    assert seen.mean(axis=0) == pytest.approx([0.5, 0.5, 0.5, 1.0], abs=error)
    assert grey["Distance"][middle].min() == pytest.approx(9.0, abs=0.02)
    assert grey["Distance"][2, 2] == 0.0
    shining = rendered.color("shining")[middle].reshape(-1, 4)
    assert shining == pytest.approx(np.tile([2.0, 1.0, 0.5, 1.0], (36, 1)), rel=1e-5)


def test_settings_of_each_type_reach_the_delegate(rendered: Rendered) -> None:
    first = rendered.color("seed_1")
    assert (rendered.color("seed_1_again") == first).all()
    assert (rendered.color("seed_2") != first).mean() > 0.3
    # The script takes the frame for the seed.
    assert (rendered.color("frame_2") == rendered.color("seed_2")).all()
    for name, levels in (("box_1", [0, 1]), ("box_4", [0, 0.25, 0.5, 0.75, 1])):
        assert np.unique(rendered.color(name)[..., 3]).tolist() == levels
    assert np.abs(rendered.color("wide") - first).max() > 0.1
    assert rendered.color("not_robust") == pytest.approx(first, abs=0.05)
    emission = rendered.color("emission")[..., :3]
    assert emission.max(axis=(0, 1)) == pytest.approx([2.0, 1.0, 0.5], rel=1e-3)
    for name, said in rendered.said.items():
        problem = "Warning: in " in said or "Coding Error" in said or "rror: in" in said
        assert problem == (name == "misspelt"), said
    assert '"mbfeat:samplesPerPixel"' in rendered.said["misspelt"]


def test_edits_between_renders_of_one_delegate(rendered: Rendered) -> None:
    still = rendered.color("still")
    assert (rendered.color("seed_1") == still).all()
    assert np.abs(rendered.color("moved") - still).max() > 0.5
    assert (rendered.color("back") == still).all()
    ball = still[16, 32]
    green = rendered.color("green")[16, 32]
    assert ball[0] > 3 * ball[2] and green[1] > 3 * green[0]
    assert np.abs(rendered.color("hidden") - still).max() > 0.5
    assert (rendered.color("removed") == rendered.color("hidden")).all()
    dim, bright = (rendered.color(name)[..., :3].sum() for name in ("as_bright", "brighter"))
    assert 1.2 * dim < bright < 2 * dim


def test_sizes_and_parts_of_the_picture(rendered: Rendered) -> None:
    assert rendered.color("odd").shape == (17, 33, 4)
    part = rendered.color("part")
    whole = rendered.color("removed")[16:32, 16:48]
    assert part.shape == whole.shape
    # The same view with other random numbers.
    assert part[..., :3].mean() == pytest.approx(whole[..., :3].mean(), rel=0.05)
    assert (part[..., 3] == 1).all()


def test_instanced_meshes_are_synced_as_often_as_others(rendered: Rendered) -> None:
    cleaned = re.findall(r"^Rprim Cleaned: (\S+)$", rendered.said["native"], re.MULTILINE)
    counts = Counter(cleaned)
    assert any("/Instancer/" in path for path in counts)
    assert len(counts) >= 4
    assert len(set(counts.values())) == 1, counts
