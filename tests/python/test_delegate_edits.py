"""Edits of what is seen and of where instances stand, between renders, in both modes of Hydra."""

from __future__ import annotations

from pathlib import Path

import pytest

import hydrakit

pytestmark = pytest.mark.parametrize("scene_index", [False, True], ids=["legacy", "sceneIndex"])


def test_edits_of_purpose_show_and_hide(scene_index: bool, tmp_path: Path) -> None:
    seen = hydrakit.run_scenario("purposes", scene_index, tmp_path)
    assert seen == {
        "default": True,
        "guide": False,
        "guides shown": True,
        "guides hidden": False,
        "default again": True,
        "guide again": False,
    }


def test_instance_attributes_that_go_are_forgotten(scene_index: bool, tmp_path: Path) -> None:
    places = hydrakit.run_scenario("instance_attributes", scene_index, tmp_path)
    assert places["all"] == ["-2 0 0, 0 -2 0, 0 0 2, 5 0 0"]
    assert places["no scales"] == ["-1 0 0, 0 -1 0, 0 0 1, 5 0 0"]
    assert places["no orientations"] == ["1 0 0, 0 1 0, 0 0 1, 5 0 0"]
    assert places["scales again"] == ["3 0 0, 0 3 0, 0 0 3, 5 0 0"]


def test_invisible_instancers_place_nothing(scene_index: bool, tmp_path: Path) -> None:
    counts = hydrakit.run_scenario("instancer_visibility", scene_index, tmp_path)
    assert counts == {
        "visible": 4,
        "inner hidden": 0,
        "inner shown": 4,
        "outer hidden": 0,
        "outer shown": 4,
        "parent hidden": 0,
        "parent shown": 4,
    }


def test_an_invisible_native_instance_hides_no_other(scene_index: bool, tmp_path: Path) -> None:
    counts = hydrakit.run_scenario("native_instance_visibility", scene_index, tmp_path)
    assert counts == {"both": 2, "second": 1, "none": 0, "first": 1}
