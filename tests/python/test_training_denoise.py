"""The renderer's denoiser agrees with PyTorch: whole images, tiles, missing samples, lanes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is only in ./run training's environment")
pytest.importorskip("onnx", reason="onnx is only in ./run training's environment")

from mbfeat import _core  # noqa: E402
from test_training_export import network  # noqa: E402
from test_training_model import VARIANTS  # noqa: E402
from training import export  # noqa: E402
from training.dataset import layout  # noqa: E402
from training.model.inputs import network_input  # noqa: E402
from training.model.sksn import Sksn  # noqa: E402

KINDS = [name for name in VARIANTS if "pyramid" not in VARIANTS[name]]
FIELDS = [field.name for field in _core.path_sample_fields(True)]
TOLERANCE = 1e-4


def random_paths(height: int, width: int, samples: int, seed: int = 5) -> Any:
    """Paths with what a renderer may record, in the film's layout."""
    rng = np.random.default_rng(seed)
    paths = rng.random((height, width, samples, len(FIELDS)), dtype=np.float32)
    for i, name in enumerate(FIELDS):
        if name == "validMask":
            paths[..., i] = 2 ** rng.integers(0, 7, paths.shape[:-1]) - 1
        elif ":event:" in name:
            paths[..., i] = rng.choice([5, 9, 17, 18, 10], paths.shape[:-1])
    # As the data sets keep them: what halves can hold.
    return paths.astype(np.float16).astype(np.float32)


def torch_input(paths: Any, turn: Any, features: str) -> Any:
    place = {name: i for i, name in enumerate(FIELDS)}
    half = np.stack([paths[..., place[name]] for name in layout.HALF])
    as_bytes = np.stack([paths[..., place[name]] for name in layout.BYTES])
    return network_input(
        half.transpose(3, 0, 1, 2).astype(np.float16),
        as_bytes.transpose(3, 0, 1, 2).astype(np.uint8),
        turn,
        features,
    )


def rotation() -> Any:
    matrix, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    return np.ascontiguousarray(matrix, dtype=np.float32)


def exported(name: str, folder: Path) -> tuple[Sksn, Any]:
    model = network(name)
    file = folder / f"{name}.onnx"
    export.export(model, file, whole=False)
    return model, _core.DenoiseModel.open(str(file))


def close(a: Any, b: Any) -> bool:
    return bool((np.abs(a - b) <= TOLERANCE * np.maximum(np.abs(b), 1.0)).all())


@pytest.mark.parametrize("name", KINDS)
def test_image_is_that_of_pytorch(name: str, tmp_path: Path) -> None:
    """Any size and number of samples; one path in a row of a pixel that no batch is filled with."""
    model, opened = exported(name, tmp_path)
    for height, width, samples in ((1, 1, 1), (23, 37, 4), (40, 19, 37)):
        paths, turn = random_paths(height, width, samples), rotation()
        x = torch_input(paths, turn, model.config.features)
        with torch.inference_mode():
            expected = model(x[None])[0].numpy()
        found, about = _core.denoise_paths(opened, paths, FIELDS, turn)
        assert found.shape == (1, 3, height, width)
        assert close(found[0], expected)
        assert about["repaired"] == about["empty"] == 0


@pytest.mark.parametrize("name", KINDS)
def test_tiles_and_threads_change_nothing(name: str, tmp_path: Path) -> None:
    model, opened = exported(name, tmp_path)
    size = 2 * model.config.receptive_field + 3 * model.config.unit
    paths, turn = random_paths(size, size + 5, 3), rotation()
    whole, about = _core.denoise_paths(opened, paths, FIELDS, turn, threads=1)
    assert about["tiles"] == 1
    tiled, about = _core.denoise_paths(
        opened, paths, FIELDS, turn, tile=3 * model.config.unit, threads=2
    )
    assert about["tiles"] > 4
    assert close(tiled, whole)


def test_images_as_large_as_a_table_are_images(tmp_path: Path) -> None:
    """The table of two passes is 2 x 26 numbers, as an image of 25 x 1 pixels and its margin."""
    model, opened = exported("atrous", tmp_path)
    paths, turn = random_paths(1, 25, 3).swapaxes(0, 1).copy(), rotation()
    for given in (paths, paths.swapaxes(0, 1).copy()):
        with torch.inference_mode():
            expected = model(torch_input(given, turn, model.config.features)[None])[0].numpy()
        found, _ = _core.denoise_paths(opened, given, FIELDS, turn)
        assert close(found[0], expected)


@pytest.mark.parametrize("parts", [1, 2, 3])
def test_tiles_are_as_large_as_the_memory_allows(parts: int, tmp_path: Path) -> None:
    """And as many as that takes, of about one size: a thin last one would be mostly margin."""
    model, opened = exported("atrous", tmp_path)
    unit, height, width = model.config.unit, 8, 320
    margin = -(-model.config.receptive_field // unit) * unit
    side = -(-width // (parts * unit)) * unit
    pixels = height * min(side + 2 * margin, width)
    working = export.contract(model.config, whole=False).workingFloats
    memory = 4 * working * pixels * 1.001 / 2**30
    paths, turn = random_paths(height, width, 1), rotation()
    tiled, about = _core.denoise_paths(opened, paths, FIELDS, turn, memory=memory)
    assert about["tiles"] == parts and about["tile_size"] == max(side, height)
    whole, _ = _core.denoise_paths(opened, paths, FIELDS, turn)
    assert close(tiled, whole)


@pytest.mark.parametrize("name", KINDS)
def test_paths_that_are_not_finite_are_left_out(name: str, tmp_path: Path) -> None:
    """The image is that of the pixel's other paths; one without any is black, not NaN."""
    model, opened = exported(name, tmp_path)
    paths, turn = random_paths(12, 14, 4), rotation()
    bad = paths.copy()
    bad[3, 5, 1, FIELDS.index("G")] = np.nan
    bad[8, 2, 3, FIELDS.index("mbfeat:albedo:0.R")] = np.inf
    found, about = _core.denoise_paths(opened, bad, FIELDS, turn)
    assert about["repaired"] == 2 and np.isfinite(found).all()
    share = np.full((4, 1, 12, 14), 0.25, dtype=np.float32)
    share[:, 0, 3, 5], share[:, 0, 8, 2] = 1 / 3, 1 / 3
    share[1, 0, 3, 5] = share[3, 0, 8, 2] = 0.0
    if model.config.layers:
        x = torch_input(np.nan_to_num(bad, posinf=0.0), turn, model.config.features)
        with torch.inference_mode():
            state = model.hidden(x[None], torch.from_numpy(share)[None])
            expected = model.splatted(state)[0].numpy()
        assert close(found[0], expected)
    none = paths.copy()
    none[6, 6, :, 0] = np.nan
    found, about = _core.denoise_paths(opened, none, FIELDS, turn)
    assert about["repaired"] == 4 and np.isfinite(found).all()
    alone = np.full((1, 1, 2, len(FIELDS)), np.nan, dtype=np.float32)
    found, about = _core.denoise_paths(opened, alone, FIELDS, turn)
    assert (found == 0.0).all()


@pytest.mark.parametrize("name", KINDS)
def test_pixels_may_have_different_numbers_of_paths(name: str, tmp_path: Path) -> None:
    """Those that are not there count for nothing, whatever their memory holds."""
    _, opened = exported(name, tmp_path)
    paths, turn = random_paths(20, 16, 6), rotation()
    counts = np.random.default_rng(9).integers(1, 7, (20, 16)).astype(np.uint32)
    found, about = _core.denoise_paths(opened, paths, FIELDS, turn, counts=counts)
    other = paths.copy()
    other[np.arange(6) >= counts[..., None]] = np.nan
    again, _ = _core.denoise_paths(opened, other, FIELDS, turn, counts=counts)
    assert about["repaired"] == 0
    assert np.array_equal(found, again)


@pytest.mark.parametrize("name", KINDS)
def test_colours_that_add_up_still_do(name: str, tmp_path: Path) -> None:
    _, opened = exported(name, tmp_path)
    paths, turn = random_paths(18, 21, 3), rotation()
    a, b, whole = (FIELDS.index(n) for n in ("mbfeat:direct:1.R", "mbfeat:direct:2.R", "R"))
    for k in range(3):
        paths[..., whole + k] = paths[..., a + k] + paths[..., b + k]
    found, _ = _core.denoise_paths(
        opened, paths, FIELDS, turn, lights=["R", "mbfeat:direct:1.R", "mbfeat:direct:2.R"]
    )
    assert np.allclose(found[0], found[1] + found[2], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(("alike", "groups"), [(0, 0), (3, 0), (9, 3), (10, 4)])
@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("kernel", [1, 5, 13, 17])
def test_splat_is_that_of_pytorch(kernel: int, apart: bool, alike: int, groups: int) -> None:
    """On all lanes, with any number of threads, with logits that overflow an exponential."""
    from training.model.splat import distances, splat

    rng = np.random.default_rng(kernel)
    units, channels, lights, height, width = 3, 9, 5, 41, 150
    hidden = rng.normal(size=(units, channels, height, width)).astype(np.float32)
    light = rng.random((units, lights, height, width), dtype=np.float32)
    weight = rng.normal(size=(kernel**2, channels)).astype(np.float32)
    bias = rng.normal(size=kernel**2).astype(np.float32)
    features = rng.normal(size=(units, alike, height, width)).astype(np.float32) if alike else None
    shape = (units, groups, height, width)
    scales = rng.normal(size=shape).astype(np.float32) if groups else None
    for strength in (1.0, 100.0):
        scaled = strength * weight
        logits = np.einsum("tc,uchw->uthw", scaled, hidden) + bias[None, :, None, None]
        logits = logits.astype(np.float32)
        if alike:
            given_scales = torch.from_numpy(scales) if groups else None
            logits -= distances(torch.from_numpy(features), kernel, given_scales).numpy()
        units_of = slice(None), None
        given = (logits[units_of], light[units_of]) if apart else (logits[None], light[None])
        expected = splat(*(torch.from_numpy(a) for a in given)).numpy()
        expected = expected.sum(axis=0)
        for lanes in (_core.SplatLanes.SCALAR, _core.SplatLanes.NARROW, _core.SplatLanes.WIDE):
            settings: dict[str, Any] = {"apart": apart, "lanes": lanes, "alike": features}
            settings["scales"] = scales
            found = _core.splat(hidden, light, scaled, bias, threads=2, **settings)
            # The logits themselves are rounded: of hundreds, to 1e-4.
            assert np.allclose(found, expected, rtol=2e-5 * strength, atol=2e-5 * strength)
            one = _core.splat(hidden, light, scaled, bias, threads=1, **settings)
            assert np.array_equal(found, one)
