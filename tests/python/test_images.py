"""Display images: the sRGB curve, OpenColorIO, files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mbfeat import _core, images
from mbfeat.images import ColorCorrection


def ramp() -> NDArray[np.float32]:
    """Float32 [1, 64, 4] from 0 to 2 with varying alpha."""
    values = np.linspace(0.0, 2.0, 64, dtype=np.float32)
    return np.stack([values, values / 2, values / 4, values / 2], axis=-1)[None].copy()


def srgb(linear: NDArray[np.float32]) -> NDArray[np.float64]:
    """IEC 61966-2-1, for values from 0."""
    values = linear.astype(np.float64)
    return np.where(
        values <= 0.0031308, 12.92 * values, 1.055 * np.maximum(values, 0) ** (1 / 2.4) - 0.055
    )


def test_srgb_is_the_transfer_curve_and_leaves_alpha() -> None:
    image = ramp()
    images.correct(image, ColorCorrection("sRGB"))
    assert np.allclose(image[..., :3], srgb(ramp())[..., :3], atol=1e-6)
    assert np.array_equal(image[..., 3], ramp()[..., 3])


def test_disabled_correction_changes_nothing() -> None:
    image = ramp()
    images.correct(image, ColorCorrection("disabled"))
    assert np.array_equal(image, ramp())


@pytest.mark.parametrize("config", ["ocio://cg-config-latest", "ocio://studio-config-latest"])
def test_aces_view_maps_highlights_into_range(config: str) -> None:
    correction = ColorCorrection("openColorIO", config=config)
    images.check_correction(correction)
    image = ramp() * 50
    images.correct(image, correction)
    # ACES 1.0 leaves highlights a few percent above display white.
    assert image[..., :3].min() >= -1e-4 and 0.9 < image[..., :3].max() < 1.05
    assert np.all(np.diff(image[0, :, 0]) >= -1e-4)
    assert np.allclose(image[..., 3], ramp()[..., 3] * 50, rtol=1e-5)


def test_untonemapped_srgb_view_is_the_curve() -> None:
    config = _core.ColorConfig.open("ocio://cg-config-latest")
    assert "Un-tone-mapped" in config.views(config.default_display)
    image = ramp()[:, :32]
    image = np.ascontiguousarray(image)
    config.to_display(image, view="Un-tone-mapped")
    assert np.allclose(image[..., :3], srgb(ramp()[:, :32])[..., :3], atol=2e-3)


def test_mistakes_in_the_config_are_named_before_rendering() -> None:
    with pytest.raises(_core.Error, match=r"nothing\.ocio"):
        images.check_correction(ColorCorrection("openColorIO", config="nothing.ocio"))
    with pytest.raises(_core.Error, match="no such view"):
        images.check_correction(ColorCorrection("openColorIO", view="no such view"))


def test_written_files_are_whole_and_alone(tmp_path: Path) -> None:
    image = ramp()
    for name in ("a.png", "a.jpg", "a.bmp", "a.tga", "a.hdr"):
        _core.write_image(str(tmp_path / name), image)
    assert len(list(tmp_path.iterdir())) == 5
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(_core.Error, match=r"a\.gif"):
        _core.write_image(str(tmp_path / "a.gif"), image)
    assert len(list(tmp_path.iterdir())) == 5


def test_paths_that_cannot_be_written_are_told_before_rendering(tmp_path: Path) -> None:
    assert images.problem_with_folder(str(tmp_path / "image.png")) == ""
    assert "no folder" in images.problem_with_folder(str(tmp_path / "none" / "image.png"))
    assert "is a folder" in images.problem_with_folder(str(tmp_path))
    assert images.problem_with_format("a/b.exr") == images.problem_with_format("b.PNG") == ""
    assert ".webp" in images.problem_with_format("b.webp")


def test_film_becomes_the_image_of_its_extension(tmp_path: Path) -> None:
    film = _core.make_film(1, 1)
    record = _core.PathRecord()
    record.radiance = (0.5, 0.25, 0.125)
    record.alpha = 1.0
    film.add(0, 0, record)
    report = _core.RenderReport()
    images.write_image(str(tmp_path / "a.exr"), film, report, ColorCorrection("sRGB"))
    images.write_image(str(tmp_path / "a.tga"), film, report, ColorCorrection("sRGB"))
    assert _core.check_product_file(str(tmp_path / "a.exr")) == []
    pixel = (tmp_path / "a.tga").read_bytes()[-4:]
    expected = np.rint(srgb(np.array([0.125, 0.25, 0.5], dtype=np.float32)) * 255)
    assert list(pixel[:3]) == expected.astype(int).tolist()  # stored as blue, green, red, alpha
