"""The command ``mbfeat``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from mbfeat import _core, cli, pages, stubs

STAGE = """#usda 1.0
(
    renderSettingsPrimPath = "/Render/settings"
)
def Camera "camera" {}
def Scope "Render"
{
    def RenderSettings "settings"
    {
        rel camera = </camera>
        rel products = [</Render/beauty>, </Render/paths>]
        uniform int2 resolution = (64, 32)
    }
    def RenderProduct "beauty"
    {
        token productName = "FOLDER/beauty.exr"
        rel orderedVars = [</Render/color>, </Render/second>, </Render/ids>, </Render/st>]
    }
    def RenderProduct "paths"
    {
        token productName = "FOLDER/paths.exr"
        uniform token productType = "deepRaster"
    }
    def RenderVar "color"
    {
        uniform token dataType = "color4h"
    }
    def RenderVar "second"
    {
        uniform string sourceName = "mbfeat:albedo:1"
        string driver:parameters:aov:name = "vertexOne"
        string driver:parameters:aov:format = "half3"
    }
    def RenderVar "ids"
    {
        uniform string sourceName = "primId"
        uniform token dataType = "half"
    }
    def RenderVar "st"
    {
        uniform string sourceName = "st"
        uniform token sourceType = "primvar"
    }
}
"""


@pytest.fixture
def stage(tmp_path: Path) -> Path:
    path = tmp_path / "stage.usda"
    path.write_text(STAGE.replace("FOLDER", str(tmp_path)))
    return path


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    status = cli.main(list(arguments))
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def test_aovs_lists_the_whole_table(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "aovs", "--json")
    rows = json.loads(out)
    assert status == 0
    assert [row["aov"] for row in rows] == [aov.name for aov in _core.aov_table()]
    paper = [
        r
        for r in rows
        if r["aov"].split(":")[1:2] and r["aov"].split(":")[1] in ("albedo", "normal", "direct")
    ]
    assert len(paper) == 18 and sum(row["bytes"] for row in paper) == 54 * 4
    status, out, _ = run(capsys, "aovs")
    assert status == 0 and "mbfeat:direct:5" in out


def test_aovs_of_a_stage_are_what_its_products_will_hold(
    stage: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, out, _ = run(capsys, "aovs", str(stage), "--json")
    beauty, paths = json.loads(out)
    assert status == 0
    assert beauty["source"] == "/Render/beauty" and beauty["resolution"] == [64, 32]
    assert [(row["layer"], row["aov"], row["type"]) for row in beauty["layers"]] == [
        ("color", "color", "half"),
        ("vertexOne", "mbfeat:albedo:1", "half"),
        ("ids", "primId", "uint"),
        ("st", "primvars:st", "float"),
    ]
    assert beauty["layers"][1]["channels"] == ["vertexOne.R", "vertexOne.G", "vertexOne.B"]
    assert beauty["bytes"] == 8 + 6 + 4 + 12
    assert paths["deep"]
    fields = [field.name for field in _core.path_sample_fields()]
    assert sorted(c for row in paths["layers"] for c in row["channels"]) == sorted(fields)


def test_aovs_of_a_stage_tell_what_cannot_be_written(
    stage: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stage.write_text(stage.read_text().replace('"mbfeat:albedo:1"', '"mbfeat:albdo:1"'))
    status, out, _ = run(capsys, "aovs", str(stage))
    assert status == 1 and "mbfeat:albdo:1" in out and "mbfeat:albedo:1" in out


def test_aovs_checks_a_file_against_the_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    film = _core.make_film(2, 2, ["mbfeat:normal:3"])
    path = str(tmp_path / "good.exr")
    layers = [_core.ProductLayer("color"), _core.ProductLayer("mbfeat:normal:3", "bend")]
    _core.write_product(_core.ProductSpec(path, layers), film, _core.RenderReport())
    status, out, _ = run(capsys, "aovs", path)
    assert status == 0 and "mbfeat:normal:3" in out and "differs" not in out

    wrong = str(tmp_path / "wrong.exr")
    pixels = np.zeros((2, 2), dtype=np.float32)
    channels = {name: OpenEXR.Channel(pixels) for name in ("mbfeat:normal:3.X", "odd.Q")}
    OpenEXR.File({"type": OpenEXR.scanlineimage}, channels).write(wrong)
    status, out, _ = run(capsys, "aovs", wrong)
    assert status == 1 and "differs" in out


def test_unreadable_input_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = tmp_path / "broken.exr"
    broken.write_bytes(b"\x76\x2f\x31\x01 cut off")
    missing = tmp_path / "missing.usda"
    for path in (broken, missing):
        status, out, err = run(capsys, "aovs", str(path))
        assert (status, out) == (1, "")
        assert path.name in err and len(err.splitlines()) == 1


def test_settings_lists_names_defaults_and_variables(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "settings", "--json")
    rows = {row["name"]: row for row in json.loads(out)}
    assert status == 0 and len(rows) == len(_core.setting_table())
    assert rows["mbfeat:samplesPerPixel"]["default"] == 64
    assert rows["mbfeat:samplesPerPixel"]["environment"] == "MBFEAT_SAMPLES_PER_PIXEL"
    status, out, _ = run(capsys, "settings")
    assert status == 0 and "mbfeat:onError" in out and "one of warn, abort" in out


def test_generated_pages_are_up_to_date() -> None:
    assert pages.outdated() == [], "run: ./run mbfeat docs"


def test_type_stub_is_up_to_date() -> None:
    assert stubs.outdated() == [], "run: ./run mbfeat stubs"


def test_check_finds_an_outdated_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys, "schema", str(tmp_path))[0] == 0
    assert run(capsys, "schema", "--check", str(tmp_path))[0] == 0
    (tmp_path / "plugInfo.json").write_text("{}")
    status, out, _ = run(capsys, "schema", "--check", str(tmp_path))
    assert status == 1 and "plugInfo.json" in out
    assert (tmp_path / "plugInfo.json").read_text() == "{}"


def test_usage_errors_exit_with_two() -> None:
    for arguments in ([], ["nonsense"], ["aovs", "a", "b"]):
        with pytest.raises(SystemExit) as exit_:
            cli.main(arguments)
        assert exit_.value.code == 2
