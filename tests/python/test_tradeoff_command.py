"""``mbfeat tradeoff`` on stages, by small renders in processes of their own."""

from __future__ import annotations

import argparse
import importlib.util
import json
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tradeoff_kit
from mbfeat import cli
from mbfeat.devtools.layout import this_layout
from mbfeat.metrics import NAMES
from mbfeat.tradeoff import (
    command,
    filters,
    inspection,
    options,
    page,
    peers,
    renders,
    request,
    variants,
)
from mbfeat.tradeoff.kept import subject_key
from mbfeat.tradeoff.renders import PHASES, StageRenderer, Subject, session_layer
from mbfeat.tradeoff.wording import not_found
from rendering import EVERY_AOV

STAGES = Path(__file__).resolve().parents[3] / "shared" / "stages"
BALL = STAGES / "StandardShaderBall" / "standard_shader_ball_scene.usda"
TEAPOT = STAGES / "Teapot" / "Teapot.usd"
MITSUBA = this_layout().peers / "mitsuba" / "bin" / "python"
SMALL = ["--spp", "1,4", "--seeds", "1", "--reference-spp", "8", "--only", "raw"]
FILES = {"tradeoff.json", "tradeoff.csv", "tradeoff.html", "tradeoff.png"}

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("matplotlib") is None, reason="charts need matplotlib"
)

Run = Callable[..., tuple[int, dict[str, Any], str, str]]


@pytest.fixture
def run(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> Run:
    """Runs the command; returns exit code, tradeoff.json, and what it printed."""

    def runner(*arguments: str | Path, out: str = "out") -> tuple[int, dict[str, Any], str, str]:
        folder = tmp_path / out
        capfd.readouterr()
        code = cli.main(["tradeoff", "--out", str(folder), *map(str, arguments)])
        said = capfd.readouterr()
        file = folder / "tradeoff.json"
        made = json.loads(file.read_text()) if file.exists() else {}
        return code, made, said.out, said.err

    return runner


def test_a_stage_is_measured_and_nothing_is_rendered_twice(
    run: Run, scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stage = scenes / "interior.usda"
    few = "few bounces:mbfeat:maxBounces=0"
    arguments = [stage, "--width", "32", *SMALL, "--variant", few]
    arguments[arguments.index("raw")] = "few bounces"
    code, made, out, _ = run(*arguments, "--seconds", "1000", "--error", "0.001")
    assert code == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {*FILES, "kept"}
    points = made["points"]
    assert [(p["variant"], p["samples_per_pixel"]) for p in points] == [
        ("raw", 1),
        ("few bounces", 1),
        ("raw", 4),
        ("few bounces", 4),
    ]
    for point in points:
        assert set(point["seconds"]) == set(PHASES)
        assert sum(point["seconds"].values()) == pytest.approx(point["total_seconds"])
        assert point["seconds"]["load"] > 0.0
        assert point["seconds"]["sampling"] > 0.0
        assert set(point["errors"]) == set(NAMES)
    assert all(point in points for point in made["pareto"])
    assert made["reference"]["noise"]["relMSE"] > 0.0
    assert made["reference"]["samples_per_pixel"] == 8
    seconds, error = made["answers"]
    assert (seconds["question"], seconds["asked"]) == ("seconds", 1000.0)
    assert (error["question"], error["asked"]) == ("error", 0.001)
    assert "mbfeat:samplesPerPixel" in seconds["command"]
    # Without bounces it is only the lights that are seen: nearly all of the brightness is missing.
    bias = {row["variant"]: row["bias"]["median"] for row in made["rungs"]}
    assert bias["few bounces"] < -0.5
    assert abs(bias["raw"]) < 0.2
    assert "Without --reference" in out
    assert "8 samples a pixel" in out
    assert "epsilon" in out

    def refuse(*_: Any) -> Any:
        raise AssertionError("it was rendered before")

    monkeypatch.setattr(StageRenderer, "render", refuse)
    code, again, _, _ = run(*arguments)
    assert code == 0
    assert again["points"] == points


def test_a_stage_without_render_settings_and_a_given_reference(run: Run, tmp_path: Path) -> None:
    """The camera is chosen on the command line; the reference is a render of usdrecord's."""
    stage = tmp_path / "plain.usda"
    stage.write_text(PLAIN, encoding="utf-8")
    facts = inspection.inspect(stage, "/Eye")
    assert facts.settings == ""
    image, second = tmp_path / "a.exr", tmp_path / "b.exr"
    subject = Subject(stage, facts, 24, 16, (), 1, (0,))
    for seed, file in enumerate((image, second)):
        shot = StageRenderer(subject).render(variants.raw(), 16, 1000 + seed)
        save_exr(file, shot.image)
    arguments = [stage, "--camera", "/Eye", *SMALL]
    code, made, _, _ = run(*arguments, "--reference", image, "--reference", second)
    assert code == 0
    assert (made["width"], made["height"]) == (24, 16)
    assert made["reference"]["kind"] == "given"
    assert made["reference"]["noise"]["MSE"] >= 0.0
    code, made, _, _ = run(*arguments, "--reference", image)
    assert code == 0
    assert made["reference"]["noise"] is None
    assert "not known" in made["answers"][0]["text"]
    code, _, _, err = run(*arguments, "--reference", image, "--width", "30")
    assert code == 2
    assert "24 pixels wide" in err
    shot.image[1, 2, 3] = np.nan
    save_exr(image, shot.image)
    code, _, _, err = run(*arguments, "--reference", image)
    assert code == 1
    assert str(image) in err and "not finite: 1 of 384 pixels" in err


def test_what_is_asked_for_wrongly_is_said_before_anything_is_rendered(
    run: Run, scenes: Path, tmp_path: Path
) -> None:
    stage = scenes / "interior.usda"
    empty = tmp_path / "empty.usda"
    empty.write_text("#usda 1.0\n", encoding="utf-8")
    for arguments, code, words in (
        ([tmp_path / "none.usda"], 2, "there is no such file"),
        ([stage, "--spp", "many"], 2, "--spp many"),
        ([stage, "--metric", "beauty"], 2, "relMSE"),
        ([stage, "--seconds", "0"], 2, "above zero"),
        ([stage, "--seconds", "nan"], 2, "above zero"),
        ([stage, "--spp", "1,2000000"], 2, "at most 1048576"),
        ([stage, "--seeds", "100"], 2, "from 1 to 99"),
        ([stage, "--reference-spp", "1"], 2, "at least 2"),
        ([stage, "--width", "-5"], 2, "at least one pixel"),
        ([stage, "--threads", "-1"], 2, "--threads -1"),
        ([stage, "--threads", "0"], 2, "--threads 0"),
        ([stage, "--set", "mbfeat:maxBounce=1"], 2, "mbfeat:maxBounces"),
        ([stage, "--set", "mbfeat:samplesPerPixel=8"], 2, "--spp"),
        ([stage, "--set", "mbfeat:targetError=0.1"], 2, "--error"),
        ([stage, "--variant", "few"], 2, "NAME:SETTING=VALUE"),
        ([stage, "--variant", "few:mbfeat:maxBounce=1"], 2, "mbfeat:maxBounces"),
        ([stage, "--variant", "few:mbfeat:seed=3"], 2, "--seeds"),
        ([stage, "--camera", "/Nowhere"], 1, "/World/Camera"),
        ([stage, "--reference", empty], 1, "could not be read as an EXR file"),
        ([empty], 1, "the stage has no camera"),
    ):
        found, _, _, err = run(*arguments)
        assert found == code, err
        assert words in err, err
        assert "Traceback" not in err


def test_settings_of_the_stage_do_not_change_what_is_measured(tmp_path: Path) -> None:
    """Its data window, denoiser, targets and AOV to look at are those of its own renders."""
    plain, own = tmp_path / "plain.usda", tmp_path / "own.usda"
    plain.write_text(PLAIN, encoding="utf-8")
    own.write_text(PLAIN.replace("#usda 1.0", "#usda 1.0\n" + METADATA) + SETTINGS, "utf-8")
    images = []
    for stage in (plain, own):
        parser = argparse.ArgumentParser()
        options.add(parser.add_subparsers())
        arguments = ["tradeoff", str(stage), "--width", "24", "--camera", "/Eye", "--threads", "1"]
        subject = request.subject(parser.parse_args(arguments), stage)
        images.append(StageRenderer(subject).render(variants.raw(), 4, 1).image)
    assert images[0].shape == (3, 16, 24)
    np.testing.assert_array_equal(images[0], images[1])


def test_images_are_rendered_anew_when_a_texture_changes_and_missing_ones_are_named(
    tmp_path: Path,
) -> None:
    stage = tmp_path / "textured.usda"
    stage.write_text(PLAIN + TEXTURED, encoding="utf-8")
    facts = inspection.inspect(stage, "/Eye")
    assert facts.missing == [str(tmp_path / "wood.png")]
    (sentence,) = not_found(facts.missing)
    assert "wood.png" in sentence
    keys = set()
    for content in (b"", b"first", b"second one"):
        (tmp_path / "wood.png").write_bytes(content)
        facts = inspection.inspect(stage, "/Eye")
        assert facts.missing == []
        keys.add(subject_key(Subject(stage, facts, 24, 16, (), 1, (0,))))
    assert len(keys) == 3


def test_interrupted_runs_say_how_to_go_on(
    run: Run, scenes: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(StageRenderer, "render", stop)
    code, _, _, err = run(scenes / "interior.usda", *SMALL)
    assert code == 130
    assert "the same command goes on" in err


def test_an_installed_model_is_measured_through_render_settings(
    run: Run, scenes: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tradeoff_kit.install_models(monkeypatch, {"paths": "multiBounce"})
    known = tradeoff_kit.KnownRenderer()
    monkeypatch.setattr(command, "StageRenderer", lambda *_: known)
    arguments = ["--spp", "1,4", "--seeds", "2", "--reference-spp", "8", "--only", "paths"]
    code, made, _, _ = run(scenes / "interior.usda", "--width", "64", *arguments)
    assert code == 0
    assert {p["variant"] for p in made["points"]} == {"raw", "whole paths", "paths"}
    settings = made["variants"]["paths"]["settings"]
    assert settings == {"mbfeat:denoise:enabled": "true", "mbfeat:denoise:model": "paths"}
    assert "multiBounce" in made["variants"]["paths"]["title"]


def test_session_layer_replaces_the_products_of_the_stage(tmp_path: Path, scenes: Path) -> None:
    from pxr import Sdf, Usd

    facts = inspection.StageFacts("/Render/Settings", "/World/Camera", 640, 360, 1.8, [])
    subject = Subject(scenes / "interior.usda", facts, 32, 18, (), 1, (0,))
    session = Sdf.Layer.CreateAnonymous(".usda")
    assert session.ImportFromString(
        session_layer(subject, tmp_path / "product.exr", variants.FIRST_NON_DELTA)
    )
    stage = Usd.Stage.Open(Sdf.Layer.FindOrOpen(str(subject.stage)), session)
    settings = stage.GetPrimAtPath("/Render/Settings")
    (product,) = settings.GetRelationship("products").GetTargets()
    assert tuple(stage.GetPrimAtPath(product).GetAttribute("resolution").Get()) == (32, 18)
    wanted = stage.GetPrimAtPath(product).GetRelationship("orderedVars").GetTargets()
    sources = [stage.GetPrimAtPath(path).GetAttribute("sourceName").Get() for path in wanted]
    assert sources == ["color", *variants.FIRST_NON_DELTA]


def test_features_of_filters_are_aovs() -> None:
    for variant in variants.open_image_denoise():
        assert set(variant.features) <= set(EVERY_AOV)
        assert variant.filter in filters.RECIPES


def test_a_network_of_mbfeat_reconstructs_and_its_seconds_are_told_apart(scenes: Path) -> None:
    found = variants.denoise_models()
    if not found:
        pytest.skip("ONNX Runtime is not installed")
    stage = scenes / "interior.usda"
    subject = Subject(stage, inspection.inspect(stage), 64, 36, (), 1, (0,))
    raw = StageRenderer(subject).render(variants.raw(), 4, 1)
    shot = StageRenderer(subject).render(found[0], 4, 1)
    assert shot.seconds["inference"] > 0.0
    assert shot.seconds["splat"] > 0.0
    assert raw.seconds["inference"] == raw.seconds["splat"] == 0.0
    assert roughness(shot.image) < 0.6 * roughness(raw.image)
    assert shot.image.mean() == pytest.approx(raw.image.mean(), rel=0.1)


@pytest.mark.skipif(filters.interpreter() is None, reason="pyoidn is not installed")
def test_open_image_denoise_filters_in_a_process_of_its_own(scenes: Path) -> None:
    stage = scenes / "interior.usda"
    subject = Subject(stage, inspection.inspect(stage), 64, 36, (), 1, (0,))
    python = filters.interpreter()
    assert python is not None
    with filters.OidnProcess(python, 1, (0,)) as apply:
        renderer = StageRenderer(subject, apply)
        raw = renderer.render(variants.raw(), 4, 1)
        for variant in variants.open_image_denoise():
            shot = renderer.render(variant, 4, 1)
            assert shot.seconds["inference"] > 0.0
            assert shot.image.shape == raw.image.shape
            # Neighbours are more alike, and the brightness stays.
            assert roughness(shot.image) < 0.5 * roughness(raw.image)
            assert shot.image.mean() == pytest.approx(raw.image.mean(), rel=0.1)


@pytest.mark.skipif(not MITSUBA.exists(), reason="Mitsuba 3 is not installed (--peers)")
def test_a_peer_renders_the_same_scene_and_counts_its_start(scenes: Path) -> None:
    with ExitStack() as stack:
        stage = scenes / "bench" / "room.usda"
        settings = tuple(peers.SETTINGS.items())
        subject = Subject(stage, inspection.inspect(stage), 48, 27, settings, 1, (0,))
        (variant,) = peers.variants(["mitsuba"])
        peer = peers.PeerRenderer("mitsuba", peers.PeerStage(stage), (48, 27), 1, (0,), stack)
        theirs = peer.render(variant, 64, 1)
        ours = StageRenderer(subject).render(variants.raw(), 64, 1)
    assert theirs.seconds["load"] > 0.0
    assert theirs.seconds["sampling"] > 0.0
    assert theirs.image.shape == ours.image.shape
    # The two renderers' means agree to 0.5 % when converged; the noise of either is below 1 %.
    assert theirs.image.mean() == pytest.approx(ours.image.mean(), rel=0.03)


def test_a_stage_that_cannot_be_translated_is_measured_without_peers(
    run: Run, scenes: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "StageRenderer", lambda *_: tradeoff_kit.KnownRenderer())
    monkeypatch.setattr(peers, "set_up", lambda _: None)
    code, made, out, _ = run(scenes / "cockpit.usda", "--peers", "--width", "64", *SMALL)
    assert code == 0
    assert {point["variant"] for point in made["points"]} == {"raw"}
    assert set(made["left_out"]) == {"mitsuba", "cycles"}
    assert "only MBFeat is measured" in out
    assert made["settings"]["mbfeat:pixelFilter"] == "box"


@pytest.mark.skipif(not BALL.is_file(), reason=f"there is no {BALL}")
def test_a_stage_by_other_people_is_measured(run: Run) -> None:
    code, made, _, _ = run(BALL, "--width", "32", *SMALL)
    assert code == 0
    assert made["points"]
    assert all(np.isfinite(list(p["errors"].values())).all() for p in made["points"])


@pytest.mark.skipif(not TEAPOT.is_file(), reason=f"there is no {TEAPOT}")
def test_a_stage_without_a_camera_is_refused_with_advice(run: Run) -> None:
    code, _, _, err = run(TEAPOT, *SMALL)
    assert code == 1
    assert "Teapot.usd" in err
    assert "camera" in err


def test_page_is_written_from_folders(
    run: Run, scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "StageRenderer", lambda *_: tradeoff_kit.KnownRenderer())
    code, made, _, _ = run(scenes / "interior.usda", "--width", "64", *SMALL)
    assert code == 0
    monkeypatch.setattr(page, "DOCS", tmp_path / "docs")
    assert cli.main(["tradeoff", "--page", str(tmp_path / "none")]) == 1
    assert cli.main(["tradeoff", "--page", str(tmp_path / "out")]) == 0
    text = (tmp_path / "docs" / "accuracy.md").read_text()
    assert made["machine"]["cpu"] in text
    assert "images/accuracy-interior.png" in text
    assert (tmp_path / "docs" / "images" / "accuracy-interior.png").stat().st_size > 0


def test_limits_are_measured_as_far_as_the_stage_calls_for_them(
    run: Run, scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dark = {"1 reflection": 0.9, "no caustics": 0.8}
    known = tradeoff_kit.KnownRenderer(dark=dark)
    monkeypatch.setattr(command, "StageRenderer", lambda *_: known)
    arguments = ["--spp", "1,4", "--seeds", "2", "--reference-spp", "8", "--limits"]
    code, made, out, _ = run(scenes / "mirror.usda", "--width", "64", *arguments)
    assert code == 0
    # There is no glass in it, and its camera has no lens.
    limited = ["2 diffuse bounces", "1 reflection", "no caustics"]
    assert list(made["variants"]) == ["raw", "whole paths", *limited]
    assert "2 transmissions is no variant: the stage does not call for transmission" in out
    assert "no blur is no variant: the stage does not call for depth of field" in out
    lost = {row["limit"]: row["lost"] for row in made["limits"]}
    assert lost["no caustics"] > lost["1 reflection"] > lost["2 diffuse bounces"]
    assert "What limits save and lose" in out
    assert "What limits save and lose" in (tmp_path / "out" / "tradeoff.html").read_text()
    monkeypatch.setattr(page, "DOCS", tmp_path / "docs")
    assert cli.main(["tradeoff", "--page", str(tmp_path / "out")]) == 0
    text = (tmp_path / "docs" / "accuracy.md").read_text()
    assert "## mirror, with limits" in text
    assert "| no caustics (mbfeat:caustics=false) |" in text
    for name in ("accuracy-mirror-with-limits.png", "limits-mirror.png"):
        assert f"images/{name}" in text
        assert (tmp_path / "docs" / "images" / name).stat().st_size > 0


def test_what_usdrecord_says_of_the_stage_is_passed_on_once(tmp_path: Path) -> None:
    stage = tmp_path / "wrong.usda"
    wrong = SETTINGS.replace("double mbfeat:targetError = 0.5", "int mbfeat:maxBounces = -4")
    stage.write_text(PLAIN.replace("#usda 1.0", "#usda 1.0\n" + METADATA) + wrong, "utf-8")
    facts = inspection.inspect(stage, "/Eye")
    told: list[str] = []
    renderer = StageRenderer(Subject(stage, facts, 24, 16, (), 1, (0,)), None, told.append)
    renderer.render(variants.raw(), 1, 1)
    renderer.render(variants.raw(), 1, 2)
    (message,) = [line for line in told if "mbfeat:maxBounces" in line]
    assert "/Render/Settings" in message
    assert len(set(told)) == len(told)


def test_a_failed_render_is_told_in_the_words_of_usdrecord(scenes: Path) -> None:
    stage = scenes / "interior.usda"
    subject = Subject(stage, inspection.inspect(stage), 16, 9, (), 1, (0,))
    bad = variants.Variant("bad", "", {"mbfeat:maxBounces": "-1"})
    with pytest.raises(renders.RenderError, match=r"bad, 1 samples: .*maxBounces"):
        StageRenderer(subject).render(bad, 1, 1)


def roughness(image: np.ndarray) -> float:
    """How much neighbours differ."""
    return float(np.abs(np.diff(image, axis=2)).mean())


def save_exr(path: Path, image: np.ndarray) -> None:
    import OpenEXR

    channels = {name: np.ascontiguousarray(image[i]) for i, name in enumerate("RGB")}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, channels).write(str(path))


PLAIN = """#usda 1.0
def Camera "Eye"
{
    float focalLength = 20
    float horizontalAperture = 24
    float verticalAperture = 16
    double3 xformOp:translate = (0, 0, 4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Sphere "Ball"
{
}
def DistantLight "Sun"
{
    float inputs:intensity = 3
}
def DomeLight "Sky"
{
}
"""
METADATA = '(renderSettingsPrimPath = "/Render/Settings")'
SETTINGS = """def Scope "Render"
{
    def RenderSettings "Settings"
    {
        rel camera = </Eye>
        uniform int2 resolution = (48, 32)
        uniform float4 dataWindowNDC = (0.25, 0.25, 0.75, 0.75)
        custom bool mbfeat:denoise:enabled = true
        custom double mbfeat:targetError = 0.5
        custom string mbfeat:viewAov = "mbfeat:normal:0"
    }
}
"""
TEXTURED = """def Material "Wood"
{
    def Shader "Image"
    {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./wood.png@
    }
}
"""
