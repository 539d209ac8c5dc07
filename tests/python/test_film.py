"""Films, products and reports through the extension module."""

from __future__ import annotations

import gc
import json
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from mbfeat import _core, layout


def record(radiance: tuple[float, float, float], alpha: float = 1.0) -> _core.PathRecord:
    made = _core.PathRecord()
    made.radiance = radiance
    made.alpha = alpha
    return made


@pytest.fixture
def film() -> _core.OwnFilm:
    """A film of 3 x 2 pixels whose pixel (2, 1) has two samples."""
    made = _core.make_film(
        3, 2, ["primId", "mbfeat:albedo:1"], keep_path_samples=True, samples_per_pixel=2
    )
    first = record((1.0, 2.0, 3.0))
    first.prim_id = 5
    first.vertex_count = 2
    first.set_features(1, [0.5, 0.25, 0.125, 0.0, 0.0, 1.0, 7.0, 8.0, 9.0])
    made.add(2, 1, first)
    made.add(2, 1, record((3.0, 4.0, 5.0), alpha=0.0))
    return made


def test_aovs_resolve_to_arrays_from_the_top(film: _core.OwnFilm) -> None:
    color = film.resolve("color")
    assert color.shape == (2, 3, 4) and color.dtype == np.float32
    assert color[1, 2].tolist() == [2.0, 3.0, 4.0, 0.5]
    assert not color[0].any()
    ids = film.resolve("primId")
    assert ids.shape == (2, 3, 1) and ids.dtype == np.int32
    assert ids[0, 0, 0] == -1
    assert film.resolve("mbfeat:albedo:1")[1, 2].tolist() == [0.25, 0.125, 0.0625]
    assert film.sample_counts.tolist() == [[0, 0, 0], [0, 0, 2]]


def test_unbound_aov_is_an_error_that_lists_the_bound_ones(film: _core.OwnFilm) -> None:
    with pytest.raises(_core.Error, match=r"depth: .*color, primId, mbfeat:albedo:1"):
        film.resolve("depth")
    with pytest.raises(_core.Error, match="albedo:6"):
        _core.make_film(3, 2, ["mbfeat:albedo:6"])
    with pytest.raises(_core.Error, match="outside"):
        film.add(3, 0, record((0.0, 0.0, 0.0)))


def test_path_samples_are_the_films_memory_and_keep_it_alive(film: _core.OwnFilm) -> None:
    names = [field.name for field in film.path_sample_layout]
    samples = film.path_samples
    assert samples is not None
    assert samples.shape == (2, 3, 2, len(names)) and not samples.flags.writeable
    film.add(0, 0, record((9.0, 0.0, 0.0)))
    assert samples[0, 0, 0, names.index("R")] == 9.0  # no copy: the later sample shows
    del film
    gc.collect()
    made = [_core.make_film(64, 64, [], True, False, 4) for _ in range(4)]  # would reuse it
    assert samples[1, 2, :, names.index("R")].tolist() == [1.0, 3.0]
    assert samples[1, 2, 0, names.index("mbfeat:direct:1.B")] == 9.0
    assert samples[1, 2, 0, names.index("validMask")] == 3.0
    assert len(made) == 4


def test_film_without_kept_paths_has_none() -> None:
    assert _core.make_film(2, 2).path_samples is None


def test_deep_file_equals_the_array_in_memory(film: _core.OwnFilm, tmp_path: Path) -> None:
    for x in range(3):
        for y in range(2):
            while film.sample_counts[y, x] < 2:
                film.add(x, y, record((float(x), float(y), 0.1)))
    path = tmp_path / "deep.exr"
    _core.write_product(_core.ProductSpec(str(path), deep=True), film, _core.RenderReport())
    samples = film.path_samples
    assert samples is not None
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        for index, field in enumerate(film.path_sample_layout):
            pixels = channels[field.name].pixels
            for y in range(2):
                for x in range(3):
                    stored = np.asarray(pixels[y, x], dtype=np.float32)
                    assert stored.tolist() == samples[y, x, :, index].tolist(), field.name


def test_product_conforms_to_the_table_and_is_listed(film: _core.OwnFilm, tmp_path: Path) -> None:
    path = str(tmp_path / "image.exr")
    layers = [
        _core.ProductLayer("color", "color", _core.PixelType.HALF),
        _core.ProductLayer("primId", "ids"),
        _core.ProductLayer("mbfeat:albedo:1", "second"),
    ]
    _core.write_product(_core.ProductSpec(path, layers), film, _core.RenderReport())
    found = layout.read_layout(path)
    assert found.problems == []
    assert found.resolution == (3, 2)
    rows = {row.aov: (row.layer, row.type, row.vertex, row.bytes) for row in found.layers}
    assert rows == {
        "color": ("color", "half", -1, 8),
        "primId": ("ids", "uint", -1, 4),
        "mbfeat:albedo:1": ("second", "float", 1, 12),
    }
    assert found.bytes == 24
    assert layout.is_exr(path)


def test_failed_write_is_an_error_and_leaves_nothing(film: _core.OwnFilm, tmp_path: Path) -> None:
    path = str(tmp_path / "none" / "image.exr")
    product = _core.ProductSpec(path, [_core.ProductLayer("color")])
    assert any("none" in problem for problem in _core.validate_product(product))
    with pytest.raises(_core.Error, match=r"image\.exr"):
        _core.write_product(product, film, _core.RenderReport())
    assert list(tmp_path.iterdir()) == []


def test_report_is_a_dictionary() -> None:
    report = _core.RenderReport()
    assert report.to_dict() == json.loads(report.json())
    assert report.errors == [] and not report.interrupted


def test_host_hands_on_what_it_is_given() -> None:
    _core.Host.set_overrides([("mbfeat:seed", "3")])
    assert _core.Host.overrides() == [("mbfeat:seed", "3")]
    _core.Host.set_overrides([])
    _core.Host.request_stop()
    assert _core.Host.stop_requested()
    _core.Host.clear_stop()
    assert not _core.Host.stop_requested()
    _core.Host.drop_last_frame()
    assert _core.Host.last_frame() is None
