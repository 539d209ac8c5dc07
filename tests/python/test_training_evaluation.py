"""The comparison: its statistics, its features, and the whole of it on a tiny set."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mbfeat import metrics
from training import evaluate
from training.dataset.layout import BYTES, HALF, SPECULAR, channels
from training.dataset.plan import Plan
from training.dataset.reader import Item
from training.dataset.references import References
from training.evaluation import auxiliary, data, networks, page, report
from training.evaluation.statistics import Row, ratio


def rows(first: list[float], second: list[float]) -> list[Row]:
    made = []
    for method, values in (("a", first), ("b", second)):
        for image, value in enumerate(values):
            found = dict.fromkeys(metrics.NAMES, value)
            made.append(Row(method, "group", "diffuse", 8, image, found, 0.5))
    return made


def test_ratio_is_of_means_and_its_interval_covers_it() -> None:
    """True ratio 0.5; with 200 sets of 40 images the 95 % interval covers it at least 175 times.

    A binomial of 200 and 0.93, what the bootstrap reaches at 40 images, is below that in 1 of 1000.
    """
    rng = np.random.default_rng(3)
    covered = 0
    for _ in range(200):
        b = rng.gamma(2.0, 1.0, 40)
        a = 0.5 * b * rng.gamma(4.0, 0.25, 40)
        found = ratio(rows(a.tolist(), b.tolist()), "a", "b", "MSE")
        assert found.value == pytest.approx(a.mean() / b.mean())
        assert found.low <= found.value <= found.high
        covered += found.low <= 0.5 <= found.high
    assert covered >= 175


def test_ratio_of_proportional_methods_has_no_spread() -> None:
    found = ratio(rows([1.0, 2.0, 4.0], [2.0, 4.0, 8.0]), "a", "b", "L1")
    assert (found.value, found.low, found.high) == (0.5, 0.5, 0.5)
    with pytest.raises(ValueError, match="same images"):
        ratio(rows([1.0], [1.0, 2.0]), "a", "b", "L1")


def mirror_item() -> Item:
    """Every path meets a mirror of tint 0.5 and then a wall of albedo 0.8."""
    half = np.zeros((2, len(HALF), 4, 4), dtype=np.float16)
    half[:, channels("mbfeat:albedo:0")] = 1.0
    half[:, channels("mbfeat:albedo:1")] = 0.8
    half[:, channels("mbfeat:throughput:1")] = 0.5
    half[:, channels("mbfeat:normal:1.Z")] = 1.0
    as_bytes = np.zeros((2, len(BYTES), 4, 4), dtype=np.uint8)
    as_bytes[:, 0] = 0b11
    as_bytes[:, 1] = SPECULAR
    reference = np.ones((3, 4, 4), dtype=np.float32)
    return Item({}, half, as_bytes, reference, reference)


def test_auxiliary_features_look_through_the_mirror() -> None:
    albedo, normal = auxiliary.first_non_delta(mirror_item(), 2)
    np.testing.assert_allclose(albedo, 0.4, rtol=1e-3)
    np.testing.assert_array_equal(normal[2], 1.0)
    plain, _ = auxiliary.first_hit(mirror_item(), 2)
    np.testing.assert_array_equal(plain, 1.0)


def test_report_has_every_class_and_method() -> None:
    made = rows([1.0, 2.0], [2.0, 2.0])
    ratios = {"a/b": {"L1": ratio(made, "a", "b", "L1")}}
    text = report.table(made, ratios)
    assert "group, 8 samples a pixel, 2 images" in text and "all, 8 samples" in text
    assert "0.750" in text
    content = report.as_json(made, ratios, {"windows": 2})
    assert content["ratios"]["a/b"]["L1"] == 0.75
    assert content["intervals"]["a/b"]["L1"][0] <= 0.75
    assert {g["method"] for g in content["groups"]} == {"a", "b"}
    json.dumps(content)


def test_sheet_shows_crops_side_by_side(tmp_path: Path) -> None:
    flat = np.full((3, 8, 8), 0.5)
    report.sheet(tmp_path / "sheet.png", [("one", {"raw": flat, "reference": flat})])
    picture = np.asarray(Image.open(tmp_path / "sheet.png"))
    assert picture.shape == (report.CROP + report.HEADER, 2 * report.CROP, 3)
    left, right = picture[report.HEADER :, : report.CROP], picture[report.HEADER :, report.CROP :]
    np.testing.assert_array_equal(left, right)
    assert left.min() > 200  # the reference's bright parts are near white


@pytest.fixture
def few_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small data sets to compare on."""
    small = {"windows": 1, "size": 16, "spp": 4, "reference_spp": 8, "seed": 5}
    plans = {
        "test": Plan(split="test", scenes=2, **small),
        "stages": Plan(split="stages", scenes=1, **small),
    }
    monkeypatch.setattr(data, "PLANS", plans)
    monkeypatch.setattr(evaluate, "PLANS", plans)


def test_command_compares_the_networks_that_come_along(
    few_windows: None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Without torch; the images are those that the renderer makes of the same paths."""
    monkeypatch.setitem(sys.modules, "torch", None)
    out = tmp_path / "result.json"
    options = ["--data", str(tmp_path / "data"), "--threads", "1", "--json", str(out)]
    assert evaluate.main([*options, "--samples", "4"]) == 0
    content = json.loads(out.read_text())
    methods = {group["method"] for group in content["groups"]}
    assert methods >= {"raw", *networks.shipped()} and set(networks.shipped()) >= {"best", "fast"}
    assert all(image["seconds"] >= 0 for image in content["images"])
    assert evaluate.main([*options, "--samples", "5"]) == 1
    assert "the data has 4 samples, not 5" in capsys.readouterr().err


def test_networks_that_cannot_be_run_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("missing.onnx", "broken.onnx", "missing.pt"):
        file = tmp_path / name
        if name.startswith("broken"):
            file.write_bytes(b"no network")
        assert evaluate.main(["--model", f"best={file}", "--data", str(tmp_path)]) == 1
        assert name in capsys.readouterr().err
    assert evaluate.main(["--page", str(tmp_path / "none.json")]) == 1
    assert "none.json: it is no result" in capsys.readouterr().err
    assert evaluate.main(["--model", "best", "--data", str(tmp_path)]) == 1
    assert "write NAME=FILE" in capsys.readouterr().err


def test_kept_references_are_of_the_windows_that_are_compared() -> None:
    for name, plan in data.PLANS.items():
        kept = References.read(data.references_file(name))
        assert kept.fits(plan) and len(kept) == plan.scenes * plan.windows


def test_command_compares_trained_networks(
    few_windows: None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    torch = pytest.importorskip("torch", reason="torch is only in ./run training's environment")
    from training import checkpoints
    from training.config import Config
    from training.model.sksn import Sksn

    files = []
    for name in ("gbuffer", "paths"):
        torch.manual_seed(1)
        settings = ["model.width=8", "model.unet=[8, 8]", f"model.features={name}"]
        config = Config.read("reduced", *settings)
        file = tmp_path / f"{name}.pt"
        weights = Sksn(config.model).state_dict()
        checkpoints.save(file, {"config": config.to_dict(), "average": weights, "model": {}})
        files += ["--model", f"{name}={file}"]
    out = tmp_path / "result.json"
    options = ["--data", str(tmp_path / "data"), "--samples", "2", "4", "--threads", "1"]
    outputs = ["--json", str(out), "--sheet", str(tmp_path / "sheet.png")]
    assert evaluate.main([*files, *options, *outputs]) == 0
    content = json.loads(out.read_text())
    assert set(content["ratios"]["paths/gbuffer"]) == set(metrics.NAMES)
    assert {g["samples"] for g in content["groups"]} == {2, 4}
    assert {g["group"] for g in content["groups"]} >= {"vitrine", "aquarium", "livingroom", "all"}
    assert "livingroom, 4 samples a pixel, 1 images" in capsys.readouterr().out
    assert (tmp_path / "sheet.png").exists()
    monkeypatch.setattr(page, "DOCS", tmp_path / "docs")
    assert evaluate.main(["--page", str(out)]) == 0
    text = (tmp_path / "docs" / "comparison.md").read_text()
    found = content["ratios"]["paths/gbuffer"]["MSE"]
    aim = page.AIMS["paths/gbuffer"]["MSE"]
    assert f"| paths/gbuffer | MSE | {found:.3f} |" in text
    assert f"{aim:g}: " + ("reached" if found <= aim else f"missed by {found - aim:.3f}") in text
    assert "| vitrine |" in text and "(images/comparison.png)" in text
    assert (tmp_path / "docs" / "images" / "comparison.png").exists()
    again = data.with_samples(data.dataset(tmp_path / "data", "test"), 0, 6, threads=1)
    assert again.half.shape[0] == 6
