"""Denoising through Hydra, from files, and what happens where it cannot be done."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbfeat import _core, denoise
from rendering import CONTRIBUTIONS, SCENES, SETTINGS, add_product, open_scene, read_parts, record

SIZE = (48, 27)
AOVS = ("color", "mbfeat:raw", "sampleCount", *CONTRIBUTIONS)
FILM: dict[str, object] = {"samplesPerPixel": 4, "pixelFilter": "box"}
ON: dict[str, object] = FILM | {"denoise:enabled": True}


def image(file: Path, layer: str = "color") -> Any:
    return read_parts(file)[0].layers()[layer]


def rendered(tmp_path: Path, **settings: object) -> tuple[Path, Any]:
    """A raster product with all that is reconstructed, and the frame."""
    file = tmp_path / "image.exr"
    stage = open_scene("cockpit")
    add_product(stage, file, AOVS, resolution=SIZE)
    return file, record(stage, tmp_path, **settings)


def test_models_that_come_with_mbfeat() -> None:
    found = denoise.models()
    assert {"best", "fast"} <= set(found)
    for model in found.values():
        assert model.features == "extended"
        assert model.file.stat().st_size < 10e6


def test_color_is_reconstructed_and_its_parts_with_it(tmp_path: Path) -> None:
    file, frame = rendered(tmp_path, **ON)
    assert frame.report.errors == []
    color, raw = image(file), image(file, "mbfeat:raw")
    assert np.isfinite(color).all()
    assert np.array_equal(color[..., 3], raw[..., 3])
    assert not np.allclose(color[..., :3], raw[..., :3], rtol=0.01)
    parts = sum(image(file, name) for name in CONTRIBUTIONS)
    assert np.allclose(parts, color[..., :3], rtol=1e-4, atol=1e-5)
    phases = dict(frame.report.seconds)
    assert {"feature recording", "inference", "splat"} <= set(phases)
    assert min(phases.values()) >= 0.0
    named = {name: text for name, text, _ in frame.report.settings}
    assert named["mbfeat:denoise:enabled"] == "true"


def test_raw_image_is_that_of_a_render_without(tmp_path: Path) -> None:
    file, _ = rendered(tmp_path, **ON)
    raw = image(file, "mbfeat:raw")
    file, frame = rendered(tmp_path, **FILM)
    assert np.array_equal(image(file), raw)
    assert np.array_equal(image(file, "mbfeat:raw"), raw)
    assert "inference" not in dict(frame.report.seconds)
    assert "mbfeat:denoise:enabled" not in {name for name, _, _ in frame.report.settings}


@pytest.mark.parametrize(
    "change", [{"threads": 1}, {"tileSize": 7}, {"denoise:tile": 8}, {"kernel": "scalar"}], ids=str
)
def test_image_depends_on_no_tiles_threads_or_kernels(
    tmp_path: Path, change: dict[str, object]
) -> None:
    file, _ = rendered(tmp_path, **ON)
    before = image(file)
    file, _ = rendered(tmp_path, **(ON | change))
    assert np.allclose(image(file), before, rtol=1e-4, atol=1e-5)


def test_viewports_show_the_reconstruction(tmp_path: Path) -> None:
    """The film that a viewer is shown, without products."""
    stage = open_scene("cockpit")
    raw = record(stage, tmp_path, **FILM).images[0][0].resolve("color")
    film, _, _ = record(stage, tmp_path, **ON).images[0]
    assert not np.allclose(film.resolve("color")[..., :3], raw[..., :3], rtol=0.01)


@pytest.mark.parametrize("model", ["best", "fast"])
def test_deep_file_gives_the_image_of_the_render(tmp_path: Path, model: str) -> None:
    deep, raster = tmp_path / "deep.exr", tmp_path / "raster.exr"
    stage = open_scene("cockpit")
    add_product(stage, deep, ["color", "mbfeat:event:0"], resolution=SIZE, deep=True)
    add_product(stage, raster, ["color", "mbfeat:raw"], resolution=SIZE)
    record(stage, tmp_path, **ON, **{"denoise:model": model})
    out, preview = tmp_path / "out.exr", tmp_path / "preview.png"
    report = denoise.denoise(deep, out, model=model, raw=True, preview=preview)
    assert np.allclose(image(out), image(raster), rtol=1e-4, atol=1e-5)
    assert np.allclose(image(out, "mbfeat:raw"), image(raster, "mbfeat:raw"), rtol=1e-5, atol=1e-6)
    assert preview.stat().st_size > 0
    assert {"read", "inference", "splat"} == set(dict(report.seconds))


def pass_stage(tmp_path: Path, attributes: str, pass_type: str = "denoise") -> Path:
    """A stage that sublayers the cockpit and adds a pass."""
    file = tmp_path / "stage.usda"
    file.write_text(
        f"""#usda 1.0
(
    subLayers = [@{SCENES / "cockpit.usda"}@]
)
over "Render" {{
    def RenderPass "denoise" (prepend apiSchemas = ["MBFeatDenoiseAPI"]) {{
        uniform token passType = "{pass_type}"
        rel renderSource = <{SETTINGS}>
        {attributes}
    }}
}}
"""
    )
    return file


def usdrecord(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mbfeat.usdrecord", "--renderer", "MBFeat", "--imageWidth=40"]
    return subprocess.run(
        [*command, "--set", "mbfeat:samplesPerPixel=2", *map(str, arguments)],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=300,
    )


def test_pass_of_type_denoise_denoises(tmp_path: Path) -> None:
    """Unless it says no; other passes don't; the command line is over the pass."""
    raw, out = tmp_path / "raw.exr", tmp_path / "out.exr"
    named = "--renderPassPrimPath", "/Render/denoise"
    done = usdrecord(pass_stage(tmp_path, "", "beauty"), raw, *named)
    assert done.returncode == 0, done.stderr
    assert "inference" not in done.stdout
    done = usdrecord(
        pass_stage(tmp_path, "uniform asset mbfeat:denoise:model = @fast@"), out, *named
    )
    assert done.returncode == 0, done.stderr
    assert "inference" in done.stdout and "mbfeat:denoise:model=fast" in done.stdout
    assert not np.allclose(image(out), image(raw), rtol=0.01)
    off = "mbfeat:denoise:enabled=false"
    for attribute, arguments in (
        ("uniform bool mbfeat:denoise:enabled = false", ()),
        ("", ("--set", off)),
    ):
        done = usdrecord(pass_stage(tmp_path, attribute), out, *named, *arguments)
        assert done.returncode == 0, done.stderr
        assert np.array_equal(image(out), image(raw))
    done = usdrecord(pass_stage(tmp_path, "uniform int mbfeat:denoise:tile = -3"), out, *named)
    assert done.returncode == 1 and "/Render/denoise" in done.stderr


@pytest.mark.parametrize(
    "model,complaint",
    [
        ("nosuch", "Name an ONNX file, or one of those"),
        ("/nosuch/model.onnx", "cannot be read"),
        ("garbage.onnx", "ONNX Runtime cannot use this network"),
    ],
)
def test_raw_image_stays_where_the_model_cannot_be_used(
    tmp_path: Path, model: str, complaint: str
) -> None:
    """It is written, an error says why, and the exit code tells."""
    if model == "garbage.onnx":
        model = str(tmp_path / model)
        Path(model).write_bytes(b"this is no network")
    file, frame = rendered(tmp_path, **ON, **{"denoise:model": model})
    assert len(frame.report.errors) == 1
    assert (
        complaint in frame.report.errors[0] and "stays as it is rendered" in frame.report.errors[0]
    )
    assert np.array_equal(image(file), image(file, "mbfeat:raw"))


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("classPlanes", b"01", "classPlanes"),
        ("classes", b"2", "classes"),
        ("guides", b"9", "guides"),
        ("format", b"9", "format"),
        ("kernel", b"8", "kernel"),
    ],
)
def test_contradicting_metadata_is_told(
    name: str, value: bytes, words: str, tmp_path: Path
) -> None:
    """Nothing is read beyond what such a file holds."""
    content = Path(dict(_core.installed_models())["best"]).read_bytes()
    # A key, and a value of the same length as the new one.
    place = content.index(f"mbfeat:{name}".encode()) + len(f"mbfeat:{name}")
    assert content[place : place + 2] == bytes([0x12, len(value)])
    file = tmp_path / "bad.onnx"
    file.write_bytes(content[: place + 2] + value + content[place + 2 + len(value) :])
    with pytest.raises(RuntimeError, match=words):
        _core.DenoiseModel.open(str(file))


def test_raw_image_stays_without_the_library(tmp_path: Path) -> None:
    raw, out = tmp_path / "raw.exr", tmp_path / "out.exr"
    stage = SCENES / "cockpit.usda"
    usdrecord(stage, raw)
    done = usdrecord(
        stage, out, "--set", "mbfeat:denoise:enabled=true", MBFEAT_ONNXRUNTIME="/nosuch.so"
    )
    assert done.returncode == 1
    assert "MBFEAT_ONNXRUNTIME" in done.stderr and "stays as it is rendered" in done.stderr
    assert np.array_equal(image(out), image(raw))


def test_files_that_cannot_be_denoised(tmp_path: Path) -> None:
    """Each error names the file or setting, and leaves no file behind."""
    flat, plain, out = tmp_path / "flat.exr", tmp_path / "plain.exr", tmp_path / "out.exr"
    stage = open_scene("cockpit")
    add_product(stage, flat, ["color"], resolution=SIZE)
    add_product(stage, plain, ["color"], resolution=SIZE, deep=True)
    record(stage, tmp_path, **FILM)
    for source, complaint in (
        (flat, str(flat)),
        (plain, "mbfeat:event:0"),
        (tmp_path / "nosuch.exr", "nosuch.exr"),
    ):
        with pytest.raises(denoise.DenoiseError, match=complaint):
            denoise.denoise(source, out)
        assert not out.exists()
    with pytest.raises(denoise.DenoiseError, match="tiff"):
        denoise.denoise(plain, tmp_path / "out.tiff")


def test_fewer_features_are_another_image(tmp_path: Path) -> None:
    file, _ = rendered(tmp_path, **ON)
    images = [image(file)]
    for shown in ("firstHit", "none"):
        file, frame = rendered(tmp_path, **ON, **{"denoise:features": shown})
        assert frame.report.errors == []
        assert np.isfinite(image(file)).all()
        images.append(image(file))
    assert not np.array_equal(images[0], images[1])
    assert not np.array_equal(images[1], images[2])


def test_films_from_python_take_odd_sizes_and_counts() -> None:
    """One pixel, primes, one sample, and many more than any network was trained with."""
    fields = [field.name for field in _core.path_sample_fields(True)]
    model = _core.DenoiseModel.open("best")
    turn = np.eye(3, dtype=np.float32)
    rng = np.random.default_rng(2)
    for height, width, samples in ((1, 1, 1), (13, 7, 1), (3, 31, 200)):
        paths = rng.random((height, width, samples, len(fields)), dtype=np.float32)
        found, _ = _core.denoise_paths(model, paths, fields, turn)
        assert np.isfinite(found).all()
        low, high = paths[..., :3].min(), paths[..., :3].max()
        # Three classes may each have a mean: their sum is at most three times the largest.
        assert found.min() >= min(low, 0.0) and found.max() <= 3 * high
    equal = np.tile(rng.random((1, 1, 1, len(fields)), dtype=np.float32), (9, 11, 4, 1))
    equal[..., fields.index("validMask")] = 1
    for k in range(6):
        equal[..., fields.index(f"mbfeat:event:{k}.Y")] = 5
    found, _ = _core.denoise_paths(model, equal, fields, turn)
    assert np.allclose(found[0], equal[0, 0, 0, :3, None, None], rtol=1e-5)
    zero = np.zeros((9, 11, 4, len(fields)), dtype=np.float32)
    found, _ = _core.denoise_paths(model, zero, fields, turn)
    assert (found == 0).all()


def test_reconstruction_leans_towards_the_image_where_it_is_biased(tmp_path: Path) -> None:
    """With many samples it is not worse than the rendered image, though the network blurs.

    Also the parts still add up. The errors are means over 1296 pixels of a fixed seed.
    """
    settings = {"pixelFilter": "box", "samplesPerPixel": 256}
    file, _ = rendered(tmp_path, **settings, seed=77)
    truth = image(file)[..., :3]

    def error(found: Any) -> float:
        return float(np.mean((found[..., :3] - truth) ** 2 / (truth**2 + 0.01)))

    ours = settings | {"samplesPerPixel": 64, "denoise:enabled": True}
    file, _ = rendered(tmp_path, **ours, **{"denoise:combine": False, "denoise:features": "none"})
    blurred, raw = error(image(file)), error(image(file, "mbfeat:raw"))
    file, _ = rendered(tmp_path, **ours, **{"denoise:features": "none"})
    color = image(file)
    assert error(color) < 1.05 * raw
    assert error(color) < 1.05 * blurred
    parts = sum(image(file, name) for name in CONTRIBUTIONS)
    assert np.allclose(parts, color[..., :3], rtol=1e-4, atol=1e-5)
