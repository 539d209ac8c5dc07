"""Files that render products become, through Hydra: layouts, values, windows, headers."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbfeat import __version__, _core
from rendering import (
    CONTRIBUTIONS,
    EVERY_AOV,
    EXTENDED,
    PAPER,
    SETTINGS,
    Part,
    add_product,
    kit,
    open_scene,
    read_parts,
    record,
)

RESOLUTION = (24, 14)
SAMPLES = 5
INTEGERS = {
    "primId", "instanceId", "elementId", "sampleCount", "nonFinite",
    *[name for name in EXTENDED if ":event:" in name],
}  # fmt: skip
PRIMVARS = ["primvars:st", "primvars:displayColor"]


def suffixes(aov: str) -> str:
    """Channel suffixes of an AOV, in order, from the documentation."""
    if aov in ("color", "mbfeat:raw"):
        return "RGBA"
    if aov == "alpha":
        return "A"
    if aov in INTEGERS or ":roughness:" in aov:
        return "Y"
    if aov in ("depth", "cameraDepth") or ":distance:" in aov or aov.endswith(":depth"):
        return "Z"
    if "ormal" in aov.rpartition(":")[2] or ":normal:" in aov or aov in ("Neye", "primvars:st"):
        return "XYZ"
    return "RGB"


def channels(aov: str) -> list[str]:
    """Full EXR channel names of a layer that is named by its AOV."""
    return [suffix if aov == "color" else f"{aov}.{suffix}" for suffix in suffixes(aov)]


class Files:
    """One render of the cockpit with a product of each kind."""

    def __init__(self, folder: Path) -> None:
        stage = open_scene("cockpit")
        stage.GetPrimAtPath(SETTINGS).GetAttribute("mbfeat:samplesPerPixel").Set(SAMPLES)
        everything = [*EVERY_AOV, *PRIMVARS]
        add_product(
            stage, folder / "single.exr", everything, resolution=RESOLUTION,
            attributes={
                "driver:parameters:OpenEXR:compression": "piz",
                "driver:parameters:artist": "A. Painter",
                "driver:parameters:OpenEXR:shot": "12b",
            },
        )  # fmt: skip
        self.half_aovs = ["color", *PAPER, "primId"]
        add_product(
            stage, folder / "multi.exr", self.half_aovs, resolution=RESOLUTION,
            attributes={"mbfeat:exr:layout": "multipart", "mbfeat:exr:compression": "zips"},
        )  # fmt: skip
        add_product(stage, folder / "extended.exr", ["color"], deep=True, resolution=RESOLUTION)
        # Another resolution is another film, which nobody asks for the extended set.
        add_product(stage, folder / "deep.exr", ["color"], deep=True, resolution=(9, 5))
        self.frame = record(stage, folder, pixelFilter="box", pixelFilterWidth=1, seed=11)
        assert self.frame.report.errors == []
        self.parts: dict[str, list[Part]] = {
            name: read_parts(folder / f"{name}.exr")
            for name in ("single", "multi", "extended", "deep")
        }
        self.film, self.small_film = (image[0] for image in self.frame.images)
        self.folder = folder


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Files:
    return Files(tmp_path_factory.mktemp("products"))


def film_channel(film: _core.Film, aov: str, channel: str) -> np.ndarray:
    return film.resolve(aov)[..., suffixes(aov).index(channel[-1])]


def test_table_holds_exactly_the_documented_aovs() -> None:
    assert {aov.name for aov in _core.aov_table()} == set(EVERY_AOV)
    assert {aov.name for aov in _core.aov_table() if aov.is_integer} == INTEGERS
    for aov in _core.aov_table():
        assert "".join(aov.channels) == suffixes(aov.name), aov.name


def test_single_part_holds_every_channel_with_its_type_and_value(files: Files) -> None:
    (part,) = files.parts["single"]
    aovs = [*EVERY_AOV, *PRIMVARS]
    expected = {channel: aov for aov in aovs for channel in channels(aov)}
    assert list(part.channels) == sorted(expected)  # the order that EXR prescribes
    assert len([c for aov in PAPER for c in channels(aov)]) == 54
    for channel, aov in expected.items():
        assert part.types[channel] == ("uint" if aov in INTEGERS else "float"), channel
        values = film_channel(files.film, aov, channel)
        stored = part.channels[channel]
        assert np.array_equal(stored.view(values.dtype), values), channel
    assert _core.check_product_file(str(files.folder / "single.exr")) == []


def test_layers_carry_something(files: Files) -> None:
    """No layer of the cockpit's image is constant but those that have to be."""
    (part,) = files.parts["single"]
    constant = {
        layer for layer, values in part.layers().items() if (values == values.flat[0]).all()
    }
    # No prim of the cockpit has displayColor, and all pixels are sampled alike.
    assert constant == {"sampleCount", "nonFinite", "primvars:displayColor"}
    assert (part.channels["sampleCount.Y"] == SAMPLES).all()
    assert (part.channels["nonFinite.Y"] == 0).all()


def test_background_of_integers_is_all_ones_and_the_header_says_so(files: Files) -> None:
    (part,) = files.parts["single"]
    background = part.channels["alpha.A"] == 0.0
    assert background.any() and not background.all()
    for name in ("primId.Y", "elementId.Y"):
        assert (part.channels[name][background] == 0xFFFFFFFF).all(), name
        inside = part.channels[name][part.channels["alpha.A"] == 1.0]
        assert (inside < 0x7FFFFFFF).all(), name
    assert "0xFFFFFFFF" in part.header["mbfeat:signedIntegers"]


def test_multi_part_has_a_part_a_layer_in_the_authored_order(files: Files) -> None:
    parts = files.parts["multi"]
    assert [part.name for part in parts] == files.half_aovs
    for part in parts:
        aov = part.name
        assert list(part.channels) == sorted(channels(aov))
        assert part.header[f"mbfeat:aov:{aov}"] == aov
        for channel, stored in part.channels.items():
            assert np.array_equal(
                stored.view(files.film.resolve(aov).dtype),
                film_channel(files.film, aov, channel),
            )
    assert _core.check_product_file(str(files.folder / "multi.exr")) == []


def test_windows_aspect_and_compression_are_in_every_header(files: Files) -> None:
    for name, parts in files.parts.items():
        size = (9, 5) if name == "deep" else RESOLUTION
        for part in parts:
            assert part.window("dataWindow") == part.window("displayWindow") == (0, 0, *size)
            assert part.header["pixelAspectRatio"] == 1.0
            wanted = {"single": "PIZ"}.get(name, "ZIPS")
            assert f".{wanted}_" in str(part.header["compression"])


def test_header_says_what_was_rendered_and_where_settings_came_from(
    files: Files,
) -> None:
    for parts in files.parts.values():
        for part in parts:
            header = part.header
            assert header["mbfeat:version"] == __version__
            assert header["mbfeat:seed"] == "11"
            assert header["mbfeat:samplesPerPixel"] == str(SAMPLES)
            assert {"transmission", "rough glass", "textures", "environment"} <= set(
                header["mbfeat:effects"].split(", ")
            )
            assert "cutouts" in header["mbfeat:effectsAbsent"].split(", ")
            assert 0.0 < float(header["mbfeat:renderSeconds"]) < 600.0
            assert header["mbfeat:nonFiniteSamples"] == "0"
            assert header["mbfeat:setting:seed"] == "11 (command line)"
            assert header["mbfeat:setting:pixelFilter"] == "box (command line)"
            assert header["mbfeat:setting:samplesPerPixel"] == f"{SAMPLES} (prim)"
            assert header["mbfeat:setting:clampDirect"] == "0 (default)"
            recorded = {key for key in header if key.startswith("mbfeat:setting:")}
            assert recorded == {
                "mbfeat:setting:" + row.name.removeprefix("mbfeat:")
                for row in _core.setting_table()
            }
    (single,) = files.parts["single"]
    assert single.header["owner"] == "A. Painter"
    assert single.header["shot"] == "12b"


def test_setting_from_the_environment_is_told_as_such(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MBFEAT_MAX_BOUNCES", "3")
    stage = open_scene("white_sky")
    add_product(stage, tmp_path / "a.exr", resolution=(4, 4))
    record(stage, tmp_path, samplesPerPixel=1)
    (part,) = read_parts(tmp_path / "a.exr")
    assert part.header["mbfeat:setting:maxBounces"] == "3 (environment)"


def deep_channels(extended: bool) -> list[str]:
    names = ["R", "G", "B", "A", "Z", "subpixel.X", "subpixel.Y", "validMask"]
    for aov in PAPER + (EXTENDED if extended else []):
        names += channels(aov)
    return names


@pytest.mark.parametrize("name", ["deep", "extended"])
def test_deep_file_is_the_array_in_memory(name: str, files: Files) -> None:
    (part,) = files.parts[name]
    film = files.film if name == "extended" else files.small_film
    expected = deep_channels(name == "extended")
    layout = [field.name for field in film.path_sample_layout]
    assert layout == expected
    assert sorted(part.channels) == sorted(expected)
    samples = film.path_samples
    assert samples is not None
    width, height = film.resolution
    assert samples.shape == (height, width, SAMPLES, len(expected))
    integers = {"validMask", *[c for c in expected if ":event:" in c]}
    for index, channel in enumerate(expected):
        assert part.types[channel] == ("uint" if channel in integers else "float"), channel
        stored = np.array(part.channels[channel].tolist())
        assert stored.shape == (height, width, SAMPLES), channel
        assert np.array_equal(stored, samples[..., index]), channel
    assert part.header["maxSamplesPerPixel"] == SAMPLES
    assert _core.check_product_file(str(files.folder / f"{name}.exr")) == []


def test_paths_average_to_the_image_under_a_box_filter(files: Files) -> None:
    (deep,), (single,) = files.parts["extended"], files.parts["single"]

    def mean(channel: str) -> np.ndarray:
        return np.array(deep.channels[channel].tolist(), dtype=np.float64).mean(axis=-1)

    features = [c for aov in PAPER for c in channels(aov)]
    extended = [c for aov in EXTENDED if ":event:" not in aov for c in channels(aov)]
    for channel in ["R", "G", "B", "A", *features, *extended]:
        image = single.channels[channel]
        assert np.allclose(mean(channel), image, rtol=1e-6, atol=1e-7), channel


def test_paths_are_valid_in_themselves(files: Files) -> None:
    """Mask, positions, distances and features agree with each other, path by path."""
    (deep,) = files.parts["extended"]
    values = {name: np.array(pixels.tolist()) for name, pixels in deep.channels.items()}
    mask = values["validMask"]
    assert np.isin(mask, [0, 1, 3, 7, 15, 31, 63]).all()
    assert 63 in mask
    assert np.array_equal(mask > 0, values["A"] == 1.0)
    assert np.array_equal(mask > 0, values["Z"] > 0.0)
    for axis in "XY":
        assert ((values[f"subpixel.{axis}"] >= 0) & (values[f"subpixel.{axis}"] < 1)).all()
    for k in range(6):
        reached = (mask >> k & 1).astype(bool)
        normal = np.stack([values[f"mbfeat:normal:{k}.{axis}"] for axis in "XYZ"], axis=-1)
        lengths = np.linalg.norm(normal, axis=-1)
        assert np.allclose(lengths[reached], 1.0, atol=1e-5)
        for aov in [a for a in PAPER + EXTENDED if a.endswith(f":{k}")]:
            for channel in channels(aov):
                assert not values[channel][~reached].any(), channel
        albedo = np.stack([values[f"mbfeat:albedo:{k}.{c}"] for c in "RGB"], axis=-1)
        assert albedo.min() >= 0.0 and albedo.max() <= 1.0
        assert (values[f"mbfeat:distance:{k}.Z"][reached] > 0.0).all()
    assert np.array_equal(values["mbfeat:distance:0.Z"], values["Z"])


def test_nothing_but_color_is_recorded_when_nothing_else_is_asked_for(tmp_path: Path) -> None:
    stage = open_scene("white_sky")
    add_product(stage, tmp_path / "a.exr", resolution=(4, 4))
    frame = record(stage, tmp_path, samplesPerPixel=1)
    ((film, _, _),) = frame.images
    assert [aov.name for aov in film.aovs] == ["color"]
    assert film.path_samples is None


# Windows, cameras, resolutions


def crop_of(part: Part, window: tuple[int, int, int, int]) -> dict[str, np.ndarray]:
    x0, y0, _, _ = part.window("dataWindow")
    x, y, width, height = window
    return {
        name: pixels[y - y0 : y - y0 + height, x - x0 : x - x0 + width]
        for name, pixels in part.channels.items()
    }


def test_crop_and_overscan_to_the_pixel_and_equal_to_the_bit(tmp_path: Path) -> None:
    """A pixel is in where its centre is in, and holds the same bits whatever is around it."""
    aovs = ["color", "alpha", "primId", "variance", *PAPER, *CONTRIBUTIONS]
    stage = open_scene("cockpit")
    windows = {
        "full": ((0.0, 0.0, 1.0, 1.0), (0, 0, 20, 12)),
        "centre": ((0.25, 0.25, 0.75, 0.75), (5, 3, 10, 6)),
        "fraction": ((0.26, 0.0, 0.28, 0.5), (5, 6, 1, 6)),  # 5.2 to 5.6: the centre 5.5 is in
        "corner": ((0.0, 0.9, 0.1, 1.0), (0, 0, 2, 1)),  # 10.8 to 12 from the bottom: one row
        "overscan": ((-0.1, -0.25, 1.2, 1.25), (-2, -3, 26, 18)),
        "beside": ((1.0, 1.0, 1.5, 1.5), (20, -6, 10, 6)),
    }
    for name, (window, _) in windows.items():
        add_product(stage, tmp_path / f"{name}.exr", aovs, resolution=(20, 12), window=window)
    frame = record(stage, tmp_path, samplesPerPixel=3)
    assert frame.report.errors == [] and frame.report.warnings == 0
    parts = {name: read_parts(tmp_path / f"{name}.exr")[0] for name in windows}
    for name, (_, pixels) in windows.items():
        part = parts[name]
        assert part.window("dataWindow") == pixels, name
        assert part.window("displayWindow") == (0, 0, 20, 12), name
        x, y, width, height = pixels
        assert part.channels["R"].shape == (height, width)
        common = (max(x, 0), max(y, 0))
        size = (min(x + width, 20) - common[0], min(y + height, 12) - common[1])
        if min(size) <= 0:
            continue
        here, whole = (crop_of(p, (*common, *size)) for p in (part, parts["full"]))
        for channel, values in whole.items():
            assert here[channel].tobytes() == values.tobytes(), (name, channel)
    over = crop_of(parts["overscan"], (20, -3, 4, 3))
    beside = crop_of(parts["beside"], (20, -3, 4, 3))
    for channel, values in over.items():
        assert beside[channel].tobytes() == values.tobytes(), channel


def test_empty_data_window_is_told_and_the_whole_image_rendered(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    stage = open_scene("white_sky")
    add_product(stage, tmp_path / "a.exr", resolution=(6, 4), window=(0.5, 0.5, 0.5, 0.9))
    frame = record(stage, tmp_path, samplesPerPixel=1)
    assert frame.report.warnings == 1
    assert read_parts(tmp_path / "a.exr")[0].window("dataWindow") == (0, 0, 6, 4)
    told = capfd.readouterr().err
    assert "/Render/Products/a" in told and "dataWindowNDC" in told


def test_pixels_of_no_width_are_told_and_square_ones_rendered(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    stage = open_scene("white_sky")
    product = add_product(stage, tmp_path / "a.exr", resolution=(6, 4))
    product.CreatePixelAspectRatioAttr(-2.0)
    frame = record(stage, tmp_path, samplesPerPixel=1)
    assert frame.report.warnings == 1
    assert read_parts(tmp_path / "a.exr")[0].header["pixelAspectRatio"] == 1.0
    told = capfd.readouterr().err
    assert "/Render/Products/a" in told and "pixelAspectRatio is -2" in told


def test_several_cameras_and_resolutions_in_one_render(tmp_path: Path) -> None:
    stage = open_scene("cockpit")
    kit().camera(stage, "/World/Side", (4.0, 0.5, 1.0), (0.0, 0.0, 0.0), focal_length=46.0)
    wanted = {
        "wide": ((24, 10), "/World/Camera"),
        "tall": ((7, 16), "/World/Camera"),
        "side": ((24, 10), "/World/Side"),
    }
    for name, (size, camera) in wanted.items():
        add_product(stage, tmp_path / f"{name}.exr", resolution=size, camera=camera)
    frame = record(stage, tmp_path, samplesPerPixel=2)
    assert frame.report.errors == []
    assert [(film.resolution, camera) for film, camera, _ in frame.images] == list(wanted.values())
    together = {name: read_parts(tmp_path / f"{name}.exr")[0] for name in wanted}
    for name, (size, camera) in wanted.items():
        alone = open_scene("cockpit")
        kit().camera(alone, "/World/Side", (4.0, 0.5, 1.0), (0.0, 0.0, 0.0), focal_length=46.0)
        add_product(alone, tmp_path / f"{name}_alone.exr", resolution=size, camera=camera)
        record(alone, tmp_path, samplesPerPixel=2)
        (part,) = read_parts(tmp_path / f"{name}_alone.exr")
        for channel, values in part.channels.items():
            assert together[name].channels[channel].tobytes() == values.tobytes(), name
    assert not np.array_equal(together["wide"].channels["R"], together["side"].channels["R"])


@pytest.mark.parametrize(
    ("policy", "size", "aspect", "radius_x", "radius_y"),
    [
        # The sphere fills the fraction tan(asin(1 / 6)) 80 / 18 of a square aperture.
        ("expandAperture", (40, 20), 1.0, 10, 10),
        ("adjustApertureWidth", (40, 20), 1.0, 10, 10),
        ("adjustApertureHeight", (20, 40), 1.0, 10, 10),
        ("adjustApertureHeight", (40, 60), 1.0, 20, 20),
        ("cropAperture", (40, 20), 1.0, 20, 20),
        ("adjustPixelAspectRatio", (40, 20), 0.5, 20, 10),
        ("expandAperture", (20, 40), 2.0, 10, 20),
    ],
)
def test_aspect_ratio_policies_place_the_sphere(
    policy: str, size: tuple[int, int], aspect: float, radius_x: float, radius_y: float,
    tmp_path: Path,
) -> None:  # fmt: skip
    stage = open_scene("white_sky")
    product = add_product(stage, tmp_path / "a.exr", ["color", "alpha"], resolution=size)
    product.CreateAspectRatioConformPolicyAttr(policy)
    if policy != "adjustPixelAspectRatio":
        product.CreatePixelAspectRatioAttr(aspect)
    record(stage, tmp_path, samplesPerPixel=64, pixelFilterWidth=1)
    (part,) = read_parts(tmp_path / "a.exr")
    assert part.header["pixelAspectRatio"] == pytest.approx(aspect)
    fraction = math.tan(math.asin(1.0 / 6.0)) * 80.0 / 18.0
    x = (np.arange(size[0] * 16) + 0.5) / 16 - size[0] / 2
    y = (np.arange(size[1] * 16) + 0.5) / 16 - size[1] / 2
    inside = np.hypot(*np.meshgrid(x / (radius_x * fraction), y / (radius_y * fraction))) < 1.0
    covered = inside.reshape(size[1], 16, size[0], 16).mean(axis=(1, 3))
    alpha = part.channels["alpha.A"]
    # The polygonal sphere lies up to 0.3 % inside the true one: 0.05 pixels at the rim.
    assert np.abs(alpha - covered).max() < 0.2
    assert abs(alpha.mean() - covered.mean()) < 0.004


# Names and types of layers


def add_var(stage: Any, product: Any, name: str, source: str, **attributes: str) -> None:
    from pxr import Sdf, UsdRender

    var = UsdRender.Var.Define(stage, f"/Render/Vars/{name}")
    var.CreateSourceNameAttr(source)
    for key, text in attributes.items():
        attribute = {
            "layer": "driver:parameters:aov:name",
            "format": "driver:parameters:aov:format",
        }.get(key)
        if attribute:
            var.GetPrim().CreateAttribute(attribute, Sdf.ValueTypeNames.String).Set(text)
        elif key == "data_type":
            var.CreateDataTypeAttr(text)
        else:
            var.CreateSourceTypeAttr(text)
    product.CreateOrderedVarsRel().AddTarget(var.GetPath())


def test_layers_are_named_by_driver_name_else_by_the_var_and_typed_by_format_else_data_type(
    tmp_path: Path,
) -> None:
    stage = open_scene("mirror")
    product = add_product(stage, tmp_path / "a.exr", ["color"], resolution=(6, 6))
    add_var(stage, product, "bounce", "mbfeat:albedo:1", data_type="color3h")
    add_var(stage, product, "unused", "mbfeat:normal:1", layer="mirrored", data_type="vector3h")
    add_var(stage, product, "full", "mbfeat:normal:0", data_type="half3", format="float")
    add_var(stage, product, "small", "albedo", data_type="color3f", format="half")
    add_var(stage, product, "again", "albedo", data_type="color3f")
    add_var(stage, product, "ids", "primId", data_type="int")
    add_var(stage, product, "uv", "st", source_type="primvar")
    frame = record(stage, tmp_path, samplesPerPixel=2)
    assert frame.report.errors == []
    (part,) = read_parts(tmp_path / "a.exr")
    expected = {
        "color": "float", "bounce": "half", "mirrored": "half", "full": "float",
        "small": "half", "again": "float", "ids": "uint", "uv": "float",
    }  # fmt: skip
    layers = part.layers()
    assert set(layers) == set(expected)
    for channel, kind in part.types.items():
        assert kind == expected[channel.rpartition(".")[0] or "color"], channel
    ((film, _, _),) = frame.images
    assert np.array_equal(layers["bounce"], film.resolve("mbfeat:albedo:1").astype(np.float16))
    assert np.array_equal(layers["small"], layers["again"].astype(np.float16))
    assert np.array_equal(layers["uv"], film.resolve("primvars:st"))
    assert part.header["mbfeat:aov:uv"] == "primvars:st"
    assert _core.check_product_file(str(tmp_path / "a.exr")) == []


def test_values_too_large_for_a_half_are_clamped_and_told(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    stage = open_scene("white_sky")
    stage.GetPrimAtPath("/World/Sky").GetAttribute("inputs:intensity").Set(1e6)
    add_product(stage, tmp_path / "a.exr", ["color"], resolution=(4, 4), half=True)
    frame = record(stage, tmp_path, samplesPerPixel=1)
    (part,) = read_parts(tmp_path / "a.exr")
    assert (part.channels["R"] == np.float16(65504)).all()
    assert "48 values" in part.header["mbfeat:halfOverflow"]
    assert "65504" in capfd.readouterr().err
    assert frame.report.warnings == 1


Edit = Callable[[Any, Any], None]


def duplicate_name(stage: Any, product: Any) -> None:
    add_var(stage, product, "one", "albedo", layer="same")
    add_var(stage, product, "two", "normal", layer="same")


def clashing_channels(stage: Any, product: Any) -> None:
    add_var(stage, product, "one", "alpha", layer="")  # the unnamed layer: color's A again


def unknown_compression(stage: Any, product: Any) -> None:
    from pxr import Sdf

    product.GetPrim().CreateAttribute("mbfeat:exr:compression", Sdf.ValueTypeNames.Token).Set("7z")


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (duplicate_name, ["two layers", "'same'"]),
        (clashing_channels, ["two layers", "'color'"]),
        (unknown_compression, ["compression", "'7z'", "zips"]),
    ],
)
def test_what_a_file_cannot_hold_is_an_error_and_no_file(
    edit: Edit, words: list[str], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    stage = open_scene("white_sky")
    product = add_product(stage, tmp_path / "bad.exr", resolution=(4, 4))
    edit(stage, product)
    add_product(stage, tmp_path / "good.exr", resolution=(4, 4))
    frame = record(stage, tmp_path, samplesPerPixel=1)
    (error,) = frame.report.errors
    for word in ["/Render/Products/bad", *words]:
        assert word in error
    assert not (tmp_path / "bad.exr").exists()
    assert (tmp_path / "good.exr").exists()
    assert words[0] in capfd.readouterr().err
