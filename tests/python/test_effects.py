"""``mbfeat effects``, and kernels for what a stage calls for: they make the full kernel's image."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mbfeat import _core, cli
from mbfeat.effects.command import found, table
from mbfeat.effects.measure import cases_of
from mbfeat.effects.page import page
from mbfeat.effects.rendering import EffectsError, Rendering, Variant, aovs_of

SCENES = Path(__file__).resolve().parents[1] / "scenes"
STAGES = sorted(SCENES.glob("*.usda")) + sorted((SCENES / "bench").glob("*.usda"))
FEATURES = ("color", "mbfeat:albedo:1", "mbfeat:direct:2", "mbfeat:contribution:0", "primId")


@pytest.fixture(scope="module")
def interior() -> Iterator[Rendering]:
    with Rendering(SCENES / "interior.usda", width=32) as rendering:
        yield rendering


@pytest.mark.parametrize("stage", STAGES, ids=lambda stage: stage.stem)
def test_the_specialised_image_is_the_full_kernels(stage: Path) -> None:
    with Rendering(stage, width=48) as rendering:
        for kernel in ("avx2", "auto"):
            images = {}
            for effects in ("auto", "full"):
                report = rendering.render(
                    Variant(effects, FEATURES), samplesPerPixel="3", kernel=kernel
                )
                images[effects] = report["digest"]
                wanted = "full" if effects == "full" else report["kernel"]["prebuilt"]
                assert report["kernel"]["prebuilt"] == wanted
            assert images["auto"] == images["full"], kernel


def test_the_stage_says_what_it_calls_for_and_who_asks(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["effects", str(SCENES / "cockpit.usda"), "--width", "32", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    effects = {effect["name"]: effect for effect in result["effects"]}
    assert effects["rough glass"]["prims"] == ["/World/Materials/Glass"]
    assert effects["textures"]["count"] == 2
    assert effects["environment"]["prims"] == ["/World/Lights/Sky"]
    assert "clearcoat" in result["absent"]
    assert result["cost"] == {}
    names = [row.name for row in _core.effect_table()]
    assert sorted([*effects, *result["absent"]]) == sorted(names)
    assert result["kernel"]["prebuilt"] == "glass"
    assert result["memory"]["images"] == 2


def test_a_stage_that_calls_for_everything_gets_the_full_kernel(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert cli.main(["effects", str(SCENES / "everything.usda"), "--width", "32", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["absent"] == []
    assert result["kernel"]["prebuilt"] == "full"


def test_what_nobody_reads_is_not_there(interior: Rendering) -> None:
    report = interior.render(interior.own, samplesPerPixel="1")
    assert report["effects"]["present"] == ["area lights"]
    memory = report["memory"]
    assert memory["images"] == memory["primvars"] == memory["emitterBytes"] == 0
    assert memory["lightsInBvh"] == 0
    assert memory["filmAovs"] == 1
    with_features = interior.render(
        Variant("auto", (*interior.own.aovs, *aovs_of("first non-delta"))), samplesPerPixel="1"
    )
    assert with_features["memory"]["filmBytes"] > memory["filmBytes"]
    assert with_features["memory"]["pathStateBytesEach"] > memory["pathStateBytesEach"]
    assert "first non-delta" in with_features["effects"]["present"]


def test_cost_is_measured_for_every_effect_that_something_can_stand_for(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    chart = tmp_path / "costs.svg"
    arguments = ["effects", str(SCENES / "mirror.usda"), "--width", "24", "--json", "--measure"]
    arguments += ["--rounds", "1", "--seconds", "0.01", "--chart", str(chart)]
    assert cli.main(arguments) == 0
    result = json.loads(capsys.readouterr().out)
    assert 0.0 < result["specialised_over_full"] < 20.0  # of renders too short to mean anything
    assert result["same_image_as_full"]
    present = [effect["name"] for effect in result["effects"]]
    own = Variant("auto", ("color",))
    assert set(result["cost"]) == {c.effect for c in cases_of(own, present, result["absent"])}
    for cost in result["cost"].values():
        spread = cost["seconds_per_million"]
        assert spread["low"] <= spread["median"] <= spread["high"]
    assert "<svg" in chart.read_text(encoding="utf-8")
    assert any("time by that of the full kernel" in line for line in table(result))
    text = page([result])
    assert "# Effects on demand" in text
    assert "### mirror" in text


def test_effects_are_taken_away_or_forced_on_one_by_one() -> None:
    own = Variant("auto", ("color", "mbfeat:albedo:0"))
    names = [row.name for row in _core.effect_table()]
    present = ["textures", "instancing", "path features"]
    absent = [name for name in names if name not in present]
    cases = {case.effect: case for case in cases_of(own, present, absent)}
    assert cases["textures"].variant.effects == "auto, -textures"
    assert cases["clearcoat"].variant.effects == "auto, +clearcoat"
    assert cases["path features"].variant.aovs == ("color",)
    assert "mbfeat:contribution:tail" in cases["contributions"].variant.aovs
    assert cases["path samples"].variant.deep
    assert "instancing" not in cases  # nothing could stand in its place


def test_misuse_is_a_usage_error(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert cli.main(["effects"]) == 2
    assert cli.main(["effects", "a.usda", "--measure", "--chart", "costs.pdf"]) == 2
    assert cli.main(["effects", "a.usda", "--chart", "costs.png"]) == 2
    assert "--measure" in capsys.readouterr().err
    with pytest.raises(EffectsError):
        Rendering(tmp_path / "missing.usda").__enter__()


def test_what_cannot_be_measured_is_said_before_anything_is_rendered(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for arguments, words in (
        (["--width", "0"], "--width 0"),
        (["--rounds", "0"], "--rounds 0"),
        (["--threads", "-1"], "--threads -1"),
        (["--threads", "100000"], "cores"),
        (["--seconds", "nan"], "above zero"),
        (["--measure", "--chart", str(tmp_path / "none" / "c.png")], "there is no folder"),
    ):
        assert cli.main(["effects", "a.usda", *arguments]) == 2
        assert words in capsys.readouterr().err


def test_a_stage_without_a_camera_is_seen_as_a_whole(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    stage = tmp_path / "far.usda"
    for axis in "YZ":
        stage.write_text(NO_CAMERA.replace("AXIS", axis), encoding="utf-8")
        assert cli.main(["effects", str(stage), "--width", "32", "--json"]) == 0
        result = json.loads(capsys.readouterr().out)
        assert result["camera"] == "/MBFeatEffects/Camera"
        effects = {effect["name"]: effect["prims"] for effect in result["effects"]}
        assert effects["metal"] == ["/Metal"]
        (light,) = effects["environment"]
        assert "light at the camera" in light
        with Rendering(stage, width=32) as rendering:
            report = rendering.render(Variant("auto", ("color",)), samplesPerPixel="4")
        # Paths that meet the metal sphere go on: it is in view.
        assert report["trace"]["rays"] > 1.05 * report["trace"]["paths"]


def test_a_stage_with_several_cameras_asks_which(
    capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    stage = tmp_path / "cameras.usda"
    cameras = 'def Camera "Left"\n{\n}\ndef Camera "Right"\n{\n}\n'
    stage.write_text(NO_CAMERA.replace("AXIS", "Y") + cameras, encoding="utf-8")
    assert cli.main(["effects", str(stage), "--width", "32"]) == 1
    assert "/Left, /Right" in capfd.readouterr().err


def test_a_missing_stage_is_named(tmp_path: Path) -> None:
    command = [sys.executable, "-P", "-m", "mbfeat", "effects", str(tmp_path / "missing.usda")]
    command[3:4] = ["mbfeat.cli"]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    assert answer.returncode == 1
    assert "missing.usda" in answer.stderr
    assert "Traceback" not in answer.stderr


def test_a_report_without_rendering_is_understood() -> None:
    report: dict[str, Any] = {
        "effects": {
            "present": ["textures"],
            "absent": ["metal"],
            "askedBy": {"textures": {"count": 3, "first": ["/A", "/B", "/C"]}},
        },
        "kernel": {"instructions": "avx2", "prebuilt": "opaque", "handled": []},
        "scene": {},
        "memory": {},
    }
    result = {"stage": "a.usda", "cost": {}, **found(report)}
    lines = table(result)
    assert "a.usda: kernel avx2, built for opaque surfaces" in lines[0]
    assert any("/A, /B and 1 more" in line for line in lines)
    assert "absent: metal" in lines


def test_records_have_room_for_what_is_recorded(interior: Rendering) -> None:
    # The last of the tests that share the rendering: a primvar that was an AOV stays loaded.
    def bytes_each(*aovs: str) -> int:
        report = interior.render(Variant("auto", ("color", *aovs)), samplesPerPixel="1")
        return int(report["memory"]["recordBytesEach"])

    least = bytes_each()
    everything = bytes_each("mbfeat:albedo:0", "mbfeat:roughness:0", "primvars:st")
    # One cache line a path; 704 bytes with all parts.
    assert everything == 11 * least
    assert least < bytes_each("mbfeat:albedo:0") < bytes_each("mbfeat:contribution:1")
    assert bytes_each("mbfeat:contribution:1") < bytes_each("primId") < everything


NO_CAMERA = """#usda 1.0
(upAxis = "AXIS")
def Sphere "Ball" (prepend apiSchemas = ["MaterialBindingAPI"])
{
    double radius = 50
    double3 xformOp:translate = (1000, -300, 20)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    rel material:binding = </Metal>
}
def Material "Metal"
{
    token outputs:surface.connect = </Metal/Surface.outputs:surface>
    def Shader "Surface"
    {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:metallic = 1
        token outputs:surface
    }
}
"""
