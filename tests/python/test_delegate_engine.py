"""Interactive hosts: UsdImagingGL's engine with edits between renders, in both modes of Hydra."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import hydrakit

pytestmark = pytest.mark.parametrize("scene_index", [False, True], ids=["legacy", "sceneIndex"])


def test_every_edit_shows_in_the_next_image(scene_index: bool, tmp_path: Path) -> None:
    result = hydrakit.run_scenario("edits", scene_index, tmp_path)
    # The quad of side 2 at distance 8 covers half of the 4 x 2 that the camera sees at that
    # distance in width, and all of its height.
    assert result["first"]["columns"] == [8, 23]
    assert result["again"] == result["first"]
    red, green, _ = result["first"]["center"]
    assert red > 10 * green
    assert result["green"]["center"][1] > 10 * result["green"]["center"][0]
    assert result["moved"]["columns"] == [16, 31]
    assert result["hidden"]["pixels"] == 0
    assert result["hidden"]["center"] == pytest.approx([1.0, 1.0, 1.0])
    assert result["shown"] == result["moved"]
    assert result["added"]["columns"] == [8, 31]
    assert result["removed"]["columns"] == [8, 23]
    assert result["nearer"]["columns"] == [0, 31]
    assert result["resized"] == [64, 32]
    assert "bounds -0.5 -0.5 0, 0.5 0.5 0" in result["shrunk"]


def test_any_aov_can_be_bound_or_shown_as_color(scene_index: bool, tmp_path: Path) -> None:
    result = hydrakit.run_scenario("view_aov", scene_index, tmp_path)
    assert result["missing"] == []
    assert result["unnamed"] == []
    assert result["not_bound"] == []
    assert result["not_shown"] == []
    assert result["with_wrong_name"] == "color"


def test_an_edit_restarts_the_render_at_once(scene_index: bool, tmp_path: Path) -> None:
    result = hydrakit.run_scenario("restart", scene_index, tmp_path)
    # The best of four: other processes may hold the cores while one is timed.
    assert min(result["seconds"]["camera"]) < 0.05
    assert min(result["seconds"]["prim"]) < 0.05
    assert max(result["fractions"]) < 0.01
    assert not result["converged"]


def test_an_impatient_host_leaves_the_cores_to_the_render(
    scene_index: bool, tmp_path: Path
) -> None:
    result = hydrakit.run_scenario("impatient", scene_index, tmp_path)
    assert not result["converged"]
    # Each execution waits a millisecond for the end of the render.
    assert result["rate"] < 1010.0


def test_pause_holds_and_stop_ends_until_restart(scene_index: bool, tmp_path: Path) -> None:
    result = hydrakit.run_scenario("pause_stop", scene_index, tmp_path)
    before, after, resumed = result["fractions"]
    assert 0.0 < before == after < resumed
    assert result["paused"] == "paused"
    assert result["stopped"] == {"converged": True, "stage": "stopped"}
    assert result["samples"] == 2


def test_a_delegate_may_die_while_it_renders(scene_index: bool, tmp_path: Path) -> None:
    assert hydrakit.run_scenario("two_delegates", scene_index, tmp_path)["equal"]


def test_nested_instancers_multiply_out(scene_index: bool, tmp_path: Path) -> None:
    transforms = hydrakit.run_scenario("instances", scene_index, tmp_path)["transforms"]
    for y in (0, 10):
        assert f"transform 1 0 0, 0 1 0, 0 0 1, 1.5 {y} 100" in transforms
        assert f"transform 2 0 0, 0 2 0, 0 0 2, 3 {y} 100" in transforms
        assert f"transform -1 0 0, 0 -1 0, 0 0 1, 2.5 {y} 100" in transforms


def test_implicit_surfaces_are_meshes_of_their_size(scene_index: bool, tmp_path: Path) -> None:
    result: dict[str, Any] = hydrakit.run_scenario("shapes", scene_index, tmp_path)
    assert result["cube"] == [-2.0, -2.0, -2.0, 2.0, 2.0, 2.0]
    assert result["plane"] == [-2.0, -1.0, 0.0, 2.0, 1.0, 0.0]
    # Round ones are polygons inside the surface, which they touch at the poles and the axes.
    for name, half in (
        ("sphere", (2.0, 2.0, 2.0)),
        ("cone", (1.0, 1.0, 2.0)),
        ("cylinder", (1.0, 1.0, 2.0)),
        ("capsule", (0.5, 0.5, 2.5)),
    ):
        for axis in range(3):
            assert 0.94 * half[axis] <= result[name][3 + axis] <= half[axis]
            assert -half[axis] <= result[name][axis] <= -0.94 * half[axis]


def test_subsets_have_their_own_materials(scene_index: bool, tmp_path: Path) -> None:
    slots = hydrakit.run_scenario("subsets", scene_index, tmp_path)["slots"]
    assert slots == ["/World/mesh", "/World/a", "/World/b"]


def test_meshes_keep_the_primvars_that_are_read(scene_index: bool, tmp_path: Path) -> None:
    result = hydrakit.run_scenario("primvars_on_demand", scene_index, tmp_path)
    assert result == {"before": [], "after": ["tint"]}


def test_materialx_surfaces_show_their_nearest_inputs(scene_index: bool, tmp_path: Path) -> None:
    result = hydrakit.run_scenario("materialx", scene_index, tmp_path)
    assert result["gold"]["diffuseColor"] == "0.9 0.8 0.4"
    assert result["gold"]["metallic"] == "1 1 1"
    assert result["gold"]["roughness"] == "0.3 0.3 0.3"
    assert result["glass"]["diffuseColor"] == "0.5 1 0.5"
    assert result["glass"]["opacity"] == "0 0 0"
    assert result["glass"]["opacityMode"] == "transparent"
    assert result["lamp"]["emissiveColor"] == "3 1.5 0.75"
    assert result["leaf"]["opacity"] == "0.25 0.25 0.25"
    assert result["leaf"]["opacityMode"] == "presence"
    assert result["leaf"]["opacityThreshold"] == "0.5 0.5 0.5"


def test_repaired_data_counts_no_more(scene_index: bool, tmp_path: Path) -> None:
    result = hydrakit.run_scenario("repairs", scene_index, tmp_path)
    spoilt = {name: counts for name, counts in result.items() if name.endswith("spoilt")}
    assert len(spoilt) == 8
    # An AOV that is not there is an error, which does not count as a warning but holds the image
    # back as well.
    for name, (warnings, errors) in spoilt.items():
        assert errors == 1, name
        assert (warnings > 0) == (name != "viewAov spoilt"), name
    good = {name: [0, 0] for name in result if name not in spoilt and name != "frame 2"}
    assert {name: result[name] for name in good} == good
    assert result["frame 2"] == [1, 1]


def test_lights_cast_shadows_unless_told_not_to(scene_index: bool, tmp_path: Path) -> None:
    result = hydrakit.run_scenario("shadows", scene_index, tmp_path)
    assert result["on"] == result["on again"] == 0.0
    assert result["off"] > 0.0
