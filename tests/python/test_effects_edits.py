"""Effects come and go with edits: nothing is rebuilt or kept for what is not there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import hydrakit

pytestmark = pytest.mark.parametrize("scene_index", [False, True], ids=["legacy", "sceneIndex"])

NOTHING = {
    "meshes": 0,
    "placements": 0,
    "topBvh": 0,
    "lightBvh": 0,
    "materialBindings": 0,
    "lightTables": 0,
    "imagesLoaded": 0,
}
MATERIALS = NOTHING | {"materialBindings": 1, "lightTables": 1}
LIGHTS = NOTHING | {"lightTables": 1}


def run(name: str, scene_index: bool, folder: Path) -> Any:
    return hydrakit.run_scenario(name, scene_index, folder, "effect_scenarios.py")


def test_effects_come_and_go_without_a_rebuild(scene_index: bool, tmp_path: Path) -> None:
    result = run("on_the_fly", scene_index, tmp_path)
    seen = result["seen"]
    first = seen["first"]
    # The engine asks for depth beside the AOV that is shown.
    assert first["present"] == ["environment", "first hit"]
    assert first["prebuilt"] == "diffuse"
    assert first["builds"] == MATERIALS | {"meshes": 1, "topBvh": 1}

    glass = seen["glass"]
    assert glass["present"] == ["reflection", "transmission", "rough glass", *first["present"]]
    assert glass["askedBy"]["transmission"] == {"count": 1, "first": ["/World/look"]}
    assert glass["prebuilt"] == "glass"
    assert glass["builds"] == MATERIALS
    for name in ("no glass", "plain dome", "no blur", "pinhole", "no features", "glows no more"):
        assert seen[name]["present"] == first["present"], name
        assert seen[name]["prebuilt"] == "diffuse", name
    assert seen["no glass"]["builds"] == MATERIALS

    textured = seen["textured dome"]
    assert "light textures" in textured["present"]
    assert textured["askedBy"]["light textures"]["first"] == ["/World/dome"]
    assert textured["builds"] == LIGHTS | {"imagesLoaded": 1}
    assert textured["memory"]["images"] == 1
    assert textured["memory"]["imageBytes"] > 0
    assert seen["plain dome"]["builds"] == LIGHTS
    assert seen["plain dome"]["memory"]["images"] == 0

    assert seen["lens"]["present"] == ["environment", "depth of field", "first hit"]
    assert seen["lens"]["askedBy"]["depth of field"]["first"] == ["/World/camera"]
    for name in ("lens", "no blur", "pinhole", "features", "no features"):
        assert seen[name]["builds"] == NOTHING, name

    assert seen["features"]["present"] == ["environment", "path features"]
    assert seen["features"]["askedBy"]["path features"]["first"] == ["mbfeat:albedo:1"]
    assert seen["features"]["memory"]["filmAovs"] == 2
    assert seen["features"]["memory"]["filmBytes"] > first["memory"]["filmBytes"]
    assert seen["no features"]["memory"]["filmBytes"] == first["memory"]["filmBytes"]

    assert "emissive geometry" in seen["glows"]["present"]
    assert seen["glows"]["memory"]["emitterBytes"] > 0
    assert seen["glows"]["builds"] == MATERIALS
    assert seen["glows no more"]["memory"]["emitterBytes"] == 0
    assert all(result["same"])


def test_effects_are_forced_on_and_taken_away(scene_index: bool, tmp_path: Path) -> None:
    result = run("requests", scene_index, tmp_path)
    seen = result["seen"]
    assert "clearcoat" in seen["auto"]["present"]
    assert seen["full"]["present"] == seen["auto"]["present"]
    assert seen["full"]["prebuilt"] == "full"
    assert "transmission" in seen["more"]["handled"]
    assert "transmission" not in seen["more"]["present"]
    assert "clearcoat" not in seen["less"]["present"]
    assert seen["less"]["prebuilt"] == "opaque"
    assert seen["full"]["builds"] == NOTHING
    assert seen["less"]["builds"] == MATERIALS
    assert all(result["same"])
    assert result["less is none"]
    assert not result["less is auto"]


def test_few_lights_are_not_in_the_acceleration_structure(
    scene_index: bool, tmp_path: Path
) -> None:
    seen = run("many_lights", scene_index, tmp_path)["seen"]
    assert [seen[n]["memory"]["lightsInBvh"] for n in ("none", "four", "nine", "four again")] == [
        0,
        0,
        9,
        0,
    ]
    assert "many lights" in seen["nine"]["present"]
    assert seen["nine"]["askedBy"]["many lights"]["count"] == 9
    assert seen["four"]["builds"] == LIGHTS
    # Those have a structure of their own: no surface is built again for them.
    assert seen["nine"]["builds"] == LIGHTS | {"lightBvh": 1}
    assert seen["brighter"]["builds"] == LIGHTS | {"lightBvh": 1}
    assert seen["four again"]["builds"] == LIGHTS
    assert seen["four, brighter"]["builds"] == LIGHTS
