"""Render products: what a stage's settings ask for ends up in files, to the pixel."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom

import hydrakit
from mbfeat import _core


def read(path: Path) -> OpenEXR.File:
    return OpenEXR.File(str(path), separate_channels=True)


def channels(path: Path, part: int = 0) -> dict[str, np.ndarray]:
    return {name: c.pixels for name, c in read(path).parts[part].channels.items()}


def header(path: Path, part: int = 0) -> dict[str, Any]:
    return dict(read(path).parts[part].header)


def window(path: Path) -> tuple[int, int, int, int]:
    """Left, top, width and height of a file's data window."""
    low, high = header(path)["dataWindow"]
    return int(low[0]), int(low[1]), int(high[0] - low[0] + 1), int(high[1] - low[1] + 1)


@pytest.fixture
def stage() -> Usd.Stage:
    """A shaded scene with texture coordinates and settings of 4 samples."""
    made = hydrakit.make_stage()
    quad = hydrakit.add_quad(made)
    primvar = UsdGeom.PrimvarsAPI(quad).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex"
    )
    primvar.Set([Gf.Vec2f(0, 0), Gf.Vec2f(1, 0), Gf.Vec2f(1, 1), Gf.Vec2f(0, 1)])
    UsdGeom.Xformable(quad).AddRotateYOp().Set(30.0)
    hydrakit.add_settings(made)
    return made


def test_products_have_their_own_size_camera_and_layers(stage: Usd.Stage, tmp_path: Path) -> None:
    other = UsdGeom.Camera.Define(stage, "/World/other")
    UsdGeom.Xformable(other).AddTranslateOp().Set(Gf.Vec3d(0.0, 0.0, 4.0))
    color = hydrakit.add_var(stage, "beauty", "color", layer="color", stored_as="half")
    albedo = hydrakit.add_var(stage, "firstAlbedo", "mbfeat:albedo:0")
    ids = hydrakit.add_var(stage, "ids", "primId")
    depth = hydrakit.add_var(stage, "z", "cameraDepth", layer="far.depth")
    coordinates = hydrakit.add_var(stage, "uv", "st", "primvar")
    hydrakit.add_product(
        stage, "one", tmp_path / "one.exr", [color, albedo, ids, depth, coordinates]
    )
    second = hydrakit.add_product(stage, "two", tmp_path / "two.exr", [color])
    second.CreateResolutionAttr(Gf.Vec2i(20, 30))
    second.CreateCameraRel().SetTargets([other.GetPath()])

    assert hydrakit.record(stage, tmp_path / "beauty.exr", 48)

    one = channels(tmp_path / "one.exr")
    assert one["R"].shape == (16, 32) and one["R"].dtype == np.float16
    assert {"R", "G", "B", "A"} <= set(one)
    assert one["firstAlbedo.R"].dtype == np.float32
    assert one["ids.Y"].dtype == np.uint32
    assert one["ids.Y"].max() == 0xFFFFFFFF  # the background's -1
    assert one["far.depth.Z"].max() == pytest.approx(8.0, abs=1.0)
    assert any(name.startswith("uv.") for name in one)
    two = channels(tmp_path / "two.exr")
    assert set(two) == {"R", "G", "B", "A"} and two["R"].shape == (30, 20)
    images = hydrakit.last_frame().images
    assert [camera for _, camera, _ in images] == ["/World/camera", "/World/other"]


def test_crop_and_overscan_change_no_pixel(stage: Usd.Stage, tmp_path: Path) -> None:
    color = hydrakit.add_var(stage, "beauty", "color", layer="color")
    hydrakit.add_product(stage, "full", tmp_path / "full.exr", [color])
    crop = hydrakit.add_product(stage, "crop", tmp_path / "crop.exr", [color])
    crop.CreateDataWindowNDCAttr(Gf.Vec4f(0.25, 0.3, 0.76, 0.8))
    over = hydrakit.add_product(stage, "over", tmp_path / "over.exr", [color])
    over.CreateDataWindowNDCAttr(Gf.Vec4f(-0.25, -0.5, 1.125, 1.25))

    hydrakit.record(stage, tmp_path / "beauty.exr")

    # A pixel is in when its centre is: columns 8 to 23 (24.32 - 0.5 rounds up to 24), rows 4 to
    # 10 from the top (the window ends 3.2 and 11.2 rows from it).
    assert window(tmp_path / "crop.exr") == (8, 3, 16, 8)
    assert window(tmp_path / "over.exr") == (-8, -4, 44, 28)
    low, high = header(tmp_path / "crop.exr")["displayWindow"]
    assert list(low) == [0, 0] and list(high) == [31, 15]
    full = channels(tmp_path / "full.exr")
    cropped = channels(tmp_path / "crop.exr")
    wide = channels(tmp_path / "over.exr")
    for name in "RGBA":
        assert np.array_equal(cropped[name], full[name][3:11, 8:24])
        assert np.array_equal(wide[name][4:20, 8:40], full[name])
    assert full["R"].std() > 0.0


@pytest.mark.parametrize(
    ("policy", "half_width", "half_height"),
    [
        ("expandAperture", 2.0, 2.0),
        ("cropAperture", 1.0, 1.0),
        ("adjustApertureWidth", 1.0, 1.0),
        ("adjustApertureHeight", 2.0, 2.0),
        ("adjustPixelAspectRatio", 2.0, 1.0),
    ],
)
def test_conform_policies_fit_the_aperture_to_the_image(
    policy: str, half_width: float, half_height: float, tmp_path: Path
) -> None:
    stage = hydrakit.make_stage()
    quad = hydrakit.add_quad(stage)
    quad.GetPointsAttr().Set(
        [(-4.0, -4.0, 0.0), (4.0, -4.0, 0.0), (4.0, 4.0, 0.0), (-4.0, 4.0, 0.0)]
    )
    primvar = UsdGeom.PrimvarsAPI(quad).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex"
    )
    primvar.Set([Gf.Vec2f(-4, -4), Gf.Vec2f(4, -4), Gf.Vec2f(4, 4), Gf.Vec2f(-4, 4)])
    settings = hydrakit.add_settings(stage, (64, 64), samplesPerPixel=16)
    settings.CreateAspectRatioConformPolicyAttr(policy)
    uv = hydrakit.add_var(stage, "uv", "primvars:st")
    hydrakit.add_product(stage, "one", tmp_path / "one.exr", [uv])

    hydrakit.record(stage, tmp_path / "beauty.exr")

    # The camera sees 4 x 2 at the quad's distance; the image is square.
    film = hydrakit.last_film()
    st = film.resolve("primvars:st")
    pixel = 2.0 * half_width / 64, 2.0 * half_height / 64
    assert st[32, -1, 0] == pytest.approx(half_width - pixel[0] / 2, abs=pixel[0])
    assert st[32, 0, 0] == pytest.approx(-half_width + pixel[0] / 2, abs=pixel[0])
    assert st[0, 32, 1] == pytest.approx(half_height - pixel[1] / 2, abs=pixel[1])
    assert st[-1, 32, 1] == pytest.approx(-half_height + pixel[1] / 2, abs=pixel[1])


def test_depth_of_field_can_be_switched_off(stage: Usd.Stage, tmp_path: Path) -> None:
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/World/camera"))
    camera.CreateFStopAttr(0.05)
    camera.CreateFocusDistanceAttr(2.0)
    color = hydrakit.add_var(stage, "beauty", "color", layer="color")
    hydrakit.add_product(stage, "blurred", tmp_path / "blurred.exr", [color])
    sharp = hydrakit.add_product(stage, "sharp", tmp_path / "sharp.exr", [color])
    sharp.CreateDisableDepthOfFieldAttr(True)

    hydrakit.record(stage, tmp_path / "beauty.exr")
    sharp_image = channels(tmp_path / "sharp.exr")["R"]
    blurred = channels(tmp_path / "blurred.exr")["R"]
    camera.GetFStopAttr().Set(0.0)
    hydrakit.record(stage, tmp_path / "beauty.exr")

    assert np.array_equal(sharp_image, channels(tmp_path / "sharp.exr")["R"])
    assert not np.allclose(sharp_image, blurred, atol=0.05)


def test_layout_compression_and_header_entries_come_from_the_product(
    stage: Usd.Stage, tmp_path: Path
) -> None:
    color = hydrakit.add_var(stage, "beauty", "color", layer="color")
    albedo = hydrakit.add_var(stage, "albedo", "albedo")
    product = hydrakit.add_product(stage, "one", tmp_path / "one.exr", [color, albedo]).GetPrim()
    token, string = Sdf.ValueTypeNames.Token, Sdf.ValueTypeNames.String
    product.CreateAttribute("mbfeat:exr:layout", token).Set("multipart")
    product.CreateAttribute("mbfeat:exr:compression", token).Set("piz")
    product.CreateAttribute("driver:parameters:OpenEXR:artist", string).Set("somebody")

    hydrakit.record(stage, tmp_path / "beauty.exr")

    parts = read(tmp_path / "one.exr").parts
    assert len(parts) == 2
    assert "PIZ" in str(header(tmp_path / "one.exr")["compression"])
    assert header(tmp_path / "one.exr")["owner"] == "somebody"  # OpenEXR's name for it
    assert header(tmp_path / "one.exr")["mbfeat:setting:samplesPerPixel"] == "4 (prim)"


def test_deep_products_hold_every_path(stage: Usd.Stage, tmp_path: Path) -> None:
    color = hydrakit.add_var(stage, "beauty", "color", layer="color")
    hydrakit.add_product(stage, "one", tmp_path / "one.exr", [color])
    deep = hydrakit.add_product(stage, "deep", tmp_path / "deep.exr", [color])
    deep.CreateProductTypeAttr("deepRaster")

    hydrakit.record(stage, tmp_path / "beauty.exr")

    film = hydrakit.last_film()  # one camera and window: both products share the film
    assert len(hydrakit.last_frame().images) == 1
    layout = [field.name for field in film.path_sample_layout]
    assert film.path_samples is not None
    red = film.path_samples[..., layout.index("R")]
    assert red.shape == (16, 32, 4)
    deep_red = channels(tmp_path / "deep.exr")["R"]
    assert np.array_equal(np.stack([np.stack(list(row)) for row in deep_red]), red)


def test_a_stale_file_is_not_taken_for_a_product_that_failed(
    stage: Usd.Stage, tmp_path: Path
) -> None:
    color = hydrakit.add_var(stage, "beauty", "color", layer="color")
    twin = hydrakit.add_var(stage, "twin", "color", layer="color")
    good = tmp_path / "good.exr"
    bad = tmp_path / "bad.exr"
    good.write_text("old")
    hydrakit.add_product(stage, "good", good, [color])
    product = hydrakit.add_product(stage, "bad", bad, [color])
    hydrakit.record(stage, tmp_path / "beauty.exr")
    assert bad.exists()
    product.CreateOrderedVarsRel().SetTargets([color, twin])

    hydrakit.record(stage, tmp_path / "beauty.exr")

    assert channels(good)["R"].shape == (16, 32)
    assert not bad.exists()
    report = hydrakit.last_frame().report
    assert report.written == [str(good)]
    assert any("/Render/bad" in error and "color" in error for error in report.errors)


def test_the_viewport_shows_the_first_product(stage: Usd.Stage, tmp_path: Path) -> None:
    color = hydrakit.add_var(stage, "beauty", "color", layer="color")
    hydrakit.add_product(stage, "one", tmp_path / "missing" / "one.exr", [color])
    hydrakit.record(stage, tmp_path / "beauty.exr", 32)
    shown = channels(tmp_path / "beauty.exr")
    film = hydrakit.last_film().resolve("color")
    assert np.array_equal(shown["R"], film[..., 0])


def test_settings_rise_from_prim_to_environment_to_command_line(
    stage: Usd.Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def samples() -> int:
        hydrakit.record(stage, tmp_path / "beauty.exr")
        return int(hydrakit.last_film().sample_counts.min())

    assert samples() == 4
    monkeypatch.setenv("MBFEAT_SAMPLES_PER_PIXEL", "6")
    assert samples() == 6
    _core.Host.set_overrides([("mbfeat:samplesPerPixel", "7")])
    try:
        assert samples() == 7
    finally:
        _core.Host.set_overrides([])
    sources = {n: s for n, _, s in hydrakit.last_frame().report.settings}
    assert sources["mbfeat:samplesPerPixel"] == _core.SettingSource.COMMAND_LINE


def test_failed_product_leaves_files_that_are_not_ours(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bystander = tmp_path / "notes.png"
    bystander.write_bytes(b"not an image of ours")
    stage = hydrakit.make_stage()
    hydrakit.add_quad(stage)
    hydrakit.add_settings(stage)
    color = hydrakit.add_var(stage, "color", "color")
    again = hydrakit.add_var(stage, "again", "color", layer="color")
    hydrakit.add_product(stage, "bad", bystander, [color, again])
    hydrakit.record(stage, tmp_path / "image.exr")
    assert bystander.read_bytes() == b"not an image of ours"
    assert "color" in capfd.readouterr().err


def test_two_products_of_one_file_are_an_error(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    stage = hydrakit.make_stage()
    hydrakit.add_quad(stage)
    hydrakit.add_settings(stage)
    color = hydrakit.add_var(stage, "color", "color")
    normal = hydrakit.add_var(stage, "normal", "normal")
    hydrakit.add_product(stage, "first", tmp_path / "same.exr", [color, normal])
    hydrakit.add_product(stage, "second", tmp_path / "." / "same.exr", [color])
    hydrakit.record(stage, tmp_path / "image.exr")
    assert any(name.startswith("normal") for name in channels(tmp_path / "same.exr"))
    messages = capfd.readouterr().err
    assert "first" in messages and "second" in messages
