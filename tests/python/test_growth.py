"""``./run mbfeat bench --growth``: what it fits, its command, its page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from growth import fits, page, report
from growth.axes import axes
from mbfeat import cli

METRICS = set(fits.METRICS)


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A quick run of all axes."""
    file = tmp_path_factory.mktemp("growth") / "growth.json"
    assert cli.main(["bench", "--growth", "--quick", "--threads", "1", "--json", str(file)]) == 0
    return dict(json.loads(file.read_text(encoding="utf-8")))


def test_a_quick_run_measures_every_axis(quick: dict[str, Any]) -> None:
    expected = axes(1, quick=True)
    assert [*quick["axes"]] == [axis.name for axis in expected]
    for axis in expected:
        points = quick["axes"][axis.name]["points"]
        assert [point["value"] for point in points] == axis.values
        for point in points:
            assert set(point) >= METRICS
            assert all(0 <= point[m]["low"] <= point[m]["high"] for m in METRICS - {"translate_s"})
    assert quick["quick"]
    assert {aim["what"].split(",")[0] for aim in quick["aims"]} >= {
        "fixed cost at 16 samples a pixel at 64 x 36",
        "first pixel of 10",
        "camera move at 160 x 90 to reduced resolution",
        "camera move at 160 x 90 to one sample a pixel",
    }


def test_the_stages_have_what_their_axis_says(quick: dict[str, Any]) -> None:
    def scenes(axis: str) -> dict[int, dict[str, int]]:
        return {point["value"]: point["scene"] for point in quick["axes"][axis]["points"]}

    for triangles, scene in scenes("triangles").items():
        assert scene["triangles"] == pytest.approx(triangles, rel=0.1)
    for instances, scene in scenes("instances").items():
        assert scene["instances"] >= instances
    for lights, scene in scenes("lights").items():
        assert scene["lights"] == lights
    for megabytes, scene in scenes("textures").items():
        assert scene["textureBytes"] == pytest.approx(1e6 * megabytes, rel=0.02)


def test_samples_cost_linearly(quick: dict[str, Any]) -> None:
    slope = quick["axes"]["samples"]["slopes"]["sampling_cpu_s"]
    assert 0.6 < slope["median"] < 1.4  # a generous bound: the renders take some ms
    texels = quick["axes"]["textures"]["points"]
    assert texels[1]["image_mb"]["median"] > 3 * texels[0]["image_mb"]["median"]


def test_a_viewer_shows_an_image(quick: dict[str, Any]) -> None:
    found = quick["interactive"]
    assert found["moves"] == 2
    for clock in ("wall", "cpu"):
        median = {name: found[name][clock]["median"] for name in ("first_pixel", "first_image")}
        assert 0 < median["first_pixel"] <= median["first_image"]
        assert 0 < found["coarse"][clock]["median"] <= found["full"][clock]["median"]


def test_the_page_has_every_axis(quick: dict[str, Any]) -> None:
    text = page.page(quick)
    for axis in quick["axes"]:
        assert f"## {page.TITLES[axis]}" in text
        assert page.NOTES[axis] in text
    assert "## First pixel and camera moves" in text
    assert "small sizes" in report.about(quick)


def test_plots_are_drawn(quick: dict[str, Any]) -> None:
    from growth.charts import png

    for name in ("triangles", "aovs"):
        assert png(quick["axes"][name], "about").startswith(b"\x89PNG")


def test_every_plot_of_the_page_is_there() -> None:
    text = page.PAGE.read_text(encoding="utf-8")
    shown = [part.split(")")[0] for part in text.split("](images/")[1:]]
    assert shown
    assert all((page.IMAGES / name).is_file() for name in shown)


def test_a_slope_is_that_of_what_is_added() -> None:
    values = [1, 10, 100, 1000]
    costs = [[5.0 + (v - 1) ** 2 * 0.01] * 3 for v in values]
    fit = fits.slope(values, costs)
    assert fit is not None
    assert fit["median"] == pytest.approx(2.0)
    assert fit["from"] == 10
    assert fits.slope(values, [[5.0], [5.1], [5.0], [5.2]]) is None  # less than 5 %
    noisy = [[5.0, 9.0], [6.0, 9.5], [12.0, 9.0], [13.0, 12.0]]
    assert fits.slope(values, noisy) is None  # less than twice the range of the first


def test_misuse_is_a_usage_error(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert cli.main(["bench", "--growth", "--axes", "colours"]) == 2
    assert cli.main(["bench", "--growth", "--rounds", "0"]) == 2
    assert cli.main(["bench", "--growth", "--threads", "4096"]) == 2
    assert cli.main(["bench", "--page", "growth.json"]) == 2
    assert cli.main(["bench", "--growth", "--page", str(tmp_path / "missing.json")]) == 1
    assert "missing.json" in capsys.readouterr().err
