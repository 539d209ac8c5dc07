"""Metrics against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mbfeat import metrics
from mbfeat.metrics import flip


def constant(value: float, size: int = 24) -> metrics.Image:
    return np.full((3, size, size), value)


def test_paper_metrics_of_constants() -> None:
    found = metrics.all_metrics(constant(0.5), constant(0.25))
    x, y, e = 0.5, 0.25, 1e-4
    assert found["relMSE"] == pytest.approx((x - y) ** 2 / (y**2 + e))
    tx, ty = x / (1 + x), y / (1 + y)
    assert found["tonemappedRelMSE"] == pytest.approx((tx - ty) ** 2 / (ty**2 + e))
    assert found["MSE"] == pytest.approx((x - y) ** 2)
    assert found["relL1"] == pytest.approx((x - y) / (y + e))
    assert found["L1"] == pytest.approx(x - y)


def test_black_reference_weighs_by_epsilon() -> None:
    found = metrics.all_metrics(constant(0.01), constant(0.0))
    assert found["relMSE"] == pytest.approx(1e-4 / 1e-4)
    assert found["relL1"] == pytest.approx(0.01 / 1e-4)


def test_metrics_average_over_pixels_and_channels() -> None:
    image, reference = constant(0.5), constant(0.5)
    image[1, :12] = 0.75  # a sixth of all values
    assert metrics.all_metrics(image, reference)["MSE"] == pytest.approx(0.0625 / 6)


def test_equal_images_have_no_error() -> None:
    image = np.random.default_rng(1).random((3, 32, 40))
    assert all(abs(value) < 1e-12 for value in metrics.all_metrics(image, image).values())


def test_ssim_of_constants_is_its_luminance_term() -> None:
    x, y, c = 0.6, 0.3, 0.01**2
    expected = (2 * x * y + c) / (x * x + y * y + c)
    assert metrics.ssim(constant(x), constant(y)) == pytest.approx(expected)
    noise = np.random.default_rng(2).random((3, 64, 64))
    inverted = metrics.ssim(noise, 1 - noise)
    assert -1.0 <= inverted < -0.8


def test_flip_of_complementary_colours_and_bounds() -> None:
    """Flat images have no features: FLIP is the colour difference, 1 for the largest there is."""
    green, blue = np.zeros((3, 80, 80)), np.zeros((3, 80, 80))
    green[1], blue[2] = 1.0, 1.0
    np.testing.assert_allclose(flip.flip(green, blue), 1.0, atol=1e-9)
    grey = flip.flip(constant(0.5, 80), constant(0.5, 80))
    np.testing.assert_allclose(grey, 0.0, atol=1e-9)


def test_flip_of_greys_follows_its_definition() -> None:
    """Of two greys only L* differs; the difference is in the lower part of the mapping."""
    a, b = 0.5, 0.45

    def lightness(s: float) -> float:
        linear = ((s + 0.055) / 1.055) ** 2.4
        return 116 * linear ** (1 / 3) - 16

    green = flip._lab(np.array([0.0, 1.0, 0.0]).reshape(3, 1, 1))
    blue = flip._lab(np.array([0.0, 0.0, 1.0]).reshape(3, 1, 1))
    largest = float(flip._hyab(green, blue)[0, 0]) ** 0.7
    expected = 0.95 / (0.4 * largest) * abs(lightness(a) - lightness(b)) ** 0.7
    found = flip.flip(constant(a, 80), constant(b, 80))
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_flip_sees_edges_and_is_symmetric() -> None:
    a, b = constant(0.2, 80), constant(0.2, 80)
    b[:, :, 40:] = 0.3
    found = flip.flip(a, b)
    np.testing.assert_allclose(found, flip.flip(b, a))
    assert found.min() >= 0 and found.max() <= 1
    # The edge itself differs more than the flat part that is brighter by as much.
    assert found[40, 38:42].max() > 1.1 * found[40, 75]


def test_primary_white_is_neutral() -> None:
    lab = flip._lab(np.ones((3, 1, 1)))
    np.testing.assert_allclose(lab.ravel(), [100.0, 0.0, 0.0], atol=1e-9)
    opponent = flip._opponent(np.full((3, 2, 2), 0.7))
    np.testing.assert_allclose(flip._rgb(opponent), flip._linear(np.full((3, 2, 2), 0.7)))


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_images_that_cannot_be_compared_are_refused(bad: float) -> None:
    image = constant(0.5)
    image[0, 0, 0] = bad
    with pytest.raises(ValueError, match="not finite"):
        metrics.all_metrics(image, constant(0.5))
    with pytest.raises(ValueError, match="one size"):
        metrics.all_metrics(constant(0.5), constant(0.5, 12))
