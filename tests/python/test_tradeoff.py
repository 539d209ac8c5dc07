"""Error against time: what is measured of a renderer whose noise and seconds are known."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tradeoff_kit as kit
from mbfeat.metrics import NAMES, all_metrics
from mbfeat.metrics.bias import squared_bias
from mbfeat.tradeoff import analysis, crops, limits, page, variants
from mbfeat.tradeoff.command import PROBE_SEED
from mbfeat.tradeoff.measure import MOST_SEEDS, split_recording, tasks
from mbfeat.tradeoff.reference import FIRST_SEED, SEEDS
from mbfeat.tradeoff.renders import PHASES, RenderError, phases
from mbfeat.tradeoff.request import MOST_SPP
from mbfeat.tradeoff.variants import OWN, RAW, WHOLE, VariantError


def test_every_variant_is_measured_at_every_rung_with_every_seed(tmp_path: Path) -> None:
    measured = kit.measure(kit.KnownRenderer(), tmp_path)
    assert len(measured.points) == 2 * len(kit.RUNGS) * 3
    for point in measured.points:
        assert set(point["errors"]) == set(NAMES)
        assert sum(point["seconds"].values()) == pytest.approx(point["total_seconds"])
    seeds = {(p["samples_per_pixel"], p["seed"]) for p in measured.points}
    assert len(seeds) == len(kit.RUNGS) * 3  # no two rungs share noise, all variants do


def test_no_measured_image_shares_the_seed_of_another_rung_or_of_the_reference() -> None:
    rungs = (1, 2, 3, 9_000, 9_999, 10_000, 19_999, 20_000, MOST_SPP)
    work = tasks([variants.raw()], rungs, MOST_SEEDS)
    seeds = [task.random_seed for task in work]
    assert len(set(seeds)) == len(seeds)
    assert not any(FIRST_SEED <= seed < FIRST_SEED + SEEDS for seed in seeds)
    assert PROBE_SEED not in seeds


def test_finished_renders_are_not_made_again(tmp_path: Path) -> None:
    first = kit.measure(kit.KnownRenderer(), tmp_path)
    again = kit.KnownRenderer()
    second = kit.measure(again, tmp_path)
    assert again.calls == []
    assert second.points == first.points
    longer = kit.KnownRenderer()
    kit.measure(longer, tmp_path, seeds=4)
    assert len(longer.calls) == 2 * len(kit.RUNGS)


def test_an_interrupted_run_goes_on_where_it_was(tmp_path: Path) -> None:
    broken = kit.KnownRenderer()
    broken.failure, broken.fails_at = KeyboardInterrupt(), 5
    with pytest.raises(KeyboardInterrupt):
        kit.measure(broken, tmp_path)
    rest = kit.KnownRenderer()
    measured = kit.measure(rest, tmp_path)
    assert len(rest.calls) == len(measured.points) - 5
    assert not set(rest.calls) & set(broken.calls)


def test_a_variant_that_fails_is_left_out_with_its_reason(tmp_path: Path) -> None:
    measured = kit.measure(kit.KnownRenderer(broken=["paths"]), tmp_path)
    assert {point["variant"] for point in measured.points} == {RAW}
    assert "out of memory" in measured.left_out["paths"]
    with pytest.raises(RenderError, match="out of memory"):
        kit.measure(kit.KnownRenderer(broken=[RAW]), tmp_path / "raw")


def test_another_reference_measures_kept_images_anew(tmp_path: Path) -> None:
    first = kit.measure(kit.KnownRenderer(), tmp_path)
    other = kit.KnownRenderer()
    reference = kit.rendered_reference(kit.KnownRenderer(), 64, tmp_path / "reference")
    second = kit.measure(other, tmp_path, against=reference)
    assert other.calls == []
    assert second.points[0]["errors"] != first.points[0]["errors"]


# ---- reference and bias


def test_noise_of_a_rendered_reference_is_its_error(tmp_path: Path) -> None:
    reference = kit.rendered_reference(kit.KnownRenderer(), 256, tmp_path)
    found = all_metrics(reference.image, kit.truth())
    assert reference.floor is not None
    # 6912 values: the relative deviation of either is 2 %, so five of them are 10 %.
    for name in ("relMSE", "MSE", "relL1", "L1"):
        assert reference.floor[name] == pytest.approx(found[name], rel=0.1)
    assert reference.about["samples_per_pixel"] == 256


def test_an_interrupted_reference_goes_on(tmp_path: Path) -> None:
    whole = kit.rendered_reference(kit.KnownRenderer(), 256, tmp_path / "whole")
    broken = kit.KnownRenderer()
    broken.failure, broken.fails_at = KeyboardInterrupt(), 2
    with pytest.raises(KeyboardInterrupt):
        kit.rendered_reference(broken, 256, tmp_path / "broken")
    rest = kit.KnownRenderer()
    resumed = kit.rendered_reference(rest, 256, tmp_path / "broken")
    np.testing.assert_array_equal(resumed.image, whole.image)
    assert not set(rest.calls) & set(broken.calls)


def test_bias_is_what_seeds_do_not_average_away() -> None:
    rng = np.random.default_rng(7)
    y = kit.truth()
    noise = [0.3 * rng.standard_normal(y.shape) * y for _ in range(4)]
    fair = squared_bias([y + n for n in noise], y)
    biased = squared_bias([1.05 * y + n for n in noise], y)
    assert fair is not None
    assert biased is not None
    # The estimate's deviation is 0.3^2 / 4 * sqrt(2.7 / 6912) = 4.4e-4; five of them.
    assert abs(fair) < 2.2e-3
    assert biased == pytest.approx(0.05**2, abs=2.2e-3)
    assert squared_bias([y], y) is None
    # The noise of the reference, a relMSE of 0.01, is none of theirs.
    rough = y * (1.0 + 0.1 * rng.standard_normal(y.shape))
    own = all_metrics(rough, y)["relMSE"]
    with_floor = squared_bias([y + n for n in noise], rough, own)
    assert with_floor is not None
    assert abs(with_floor) < 2.2e-3


# ---- where the seconds go


def test_phases_add_up_to_the_whole() -> None:
    reported = [
        {"phase": "commit", "seconds": 0.5},
        {"phase": "sampling", "seconds": 2.0},
        {"phase": "inference", "seconds": 0.25},
        {"phase": "splat", "seconds": 0.125},
        {"phase": "write", "seconds": 0.0625},
        {"phase": "something new", "seconds": 0.03125},
    ]
    seconds = phases(reported, 0.0625, 4.0)
    assert list(seconds) == list(PHASES)
    assert sum(seconds.values()) == pytest.approx(4.0)
    assert seconds["build"] == 0.5
    assert seconds["write"] == 0.125
    assert seconds["other"] == 0.03125


def test_recording_is_what_sampling_takes_longer_with_features(tmp_path: Path) -> None:
    chosen = [variants.raw(), variants.whole(), kit.MODEL]
    measured = kit.measure(kit.KnownRenderer(), tmp_path, chosen=chosen)
    for point in measured.points:
        spp = point["samples_per_pixel"]
        assert point["seconds"]["sampling"] == pytest.approx(kit.EACH * spp)
        expected = 0.0 if point["variant"] in (RAW, WHOLE) else kit.RECORDING * spp
        assert point["seconds"].get("recording", 0.0) == pytest.approx(expected)


def test_recording_that_the_renderer_tells_counts_at_least() -> None:
    whole = {"variant": WHOLE, "samples_per_pixel": 4, "seed": 1, "records": False}
    whole |= {"seconds": {"sampling": 2.0, "recording": 0.0}}
    for told, sampling, expected in ((0.5, 2.0, 0.5), (0.5, 3.0, 1.5), (0.25, 1.5, 0.25)):
        seconds = {"sampling": sampling, "recording": told}
        point = whole | {"variant": "paths", "records": True, "seconds": seconds}
        split_recording([whole, point])
        assert seconds["recording"] == pytest.approx(expected)
        assert sum(seconds.values()) == pytest.approx(sampling + told)


def test_the_seconds_of_a_rung_add_up_to_its_median() -> None:
    def point(load: float, sampling: float) -> dict[str, Any]:
        return {
            "total_seconds": load + sampling,
            "seconds": {"load": load, "sampling": sampling},
        }

    # Medians of the phases would be 1 and 2, which make no total that was measured.
    odd = [point(1.0, 5.0), point(3.0, 1.0), point(1.0, 2.0)]
    seconds = analysis.middle_seconds(odd)
    assert (seconds["load"], seconds["sampling"]) == (3.0, 1.0)
    even = analysis.middle_seconds([*odd, point(2.0, 3.0)])
    assert (even["load"], even["sampling"]) == (2.5, 2.0)


# ---- variants


def test_installed_models_become_variants(monkeypatch: pytest.MonkeyPatch) -> None:
    kit.install_models(monkeypatch, {"fast": "firstHit", "full": "extended"})
    fast, full = variants.denoise_models()
    assert (fast.name, full.name) == ("fast", "full")
    assert "firstHit" in fast.title
    assert full.settings == {"mbfeat:denoise:enabled": "true", "mbfeat:denoise:model": "full"}
    assert full.records
    kit.install_models(monkeypatch, {})
    assert variants.denoise_models() == []


def test_variants_of_the_command_line() -> None:
    variant = variants.parsed("few bounces:mbfeat:maxBounces=2,mbfeat:clampIndirect=10")
    assert variant.name == "few bounces"
    assert variant.settings == {"mbfeat:maxBounces": "2", "mbfeat:clampIndirect": "10"}
    for bad in ("few", "few:", ":mbfeat:maxBounces=2", "few:mbfeat:maxBounces"):
        with pytest.raises(VariantError, match="NAME:SETTING=VALUE"):
            variants.parsed(bad)
    with pytest.raises(VariantError, match="two variants"):
        variants.check_names([variants.raw(), variants.raw()])


# ---- limits


def test_limits_are_those_that_the_effects_of_a_stage_give_a_meaning_to() -> None:
    def names(*present: str) -> list[str]:
        return [limit.name for limit in limits.for_effects(present)]

    assert names() == ["2 diffuse bounces"]
    assert names("reflection") == ["2 diffuse bounces", "1 reflection", "no caustics"]
    assert "2 transmissions" not in names("reflection", "depth of field")
    assert "no blur" in names("depth of field")
    assert names("reflection", "transmission", "depth of field") == [
        limit.name for limit in limits.LIMITS
    ]


def test_what_a_limit_loses_is_told_from_images_of_the_same_noise(tmp_path: Path) -> None:
    limit = limits.LIMITS[0]
    renderer = kit.KnownRenderer(dark={limit.name: 0.9})
    chosen = [variants.raw(), variants.whole(), limit.variant]
    measured = kit.measure(renderer, tmp_path, chosen=chosen)
    references = {OWN: kit.exact_reference()}
    (row,) = limits.rows(measured, [limit], references)
    assert row["samples_per_pixel"] == max(kit.RUNGS)
    assert row["sampling"]["median"] == pytest.approx(0.9)
    # A tenth of the light is lost: 0.1 of the brightness, and 0.01 of relMSE, but for the epsilon
    # and the noise of 64 samples, which is 0.09 of the value a pixel and cancels over 6912 values.
    assert row["bias"]["median"] == pytest.approx(-0.1, abs=0.002)
    assert row["lost"] == pytest.approx(0.01, rel=0.05)
    assert row["errors"]["relMSE"]["full"] == pytest.approx(kit.NOISE / 64, rel=0.1)
    ((full, limited, difference),) = limits.pictures(measured, [row])
    assert full.pixels.shape == limited.pixels.shape == difference.pixels.shape
    assert full.pixels.mean() > limited.pixels.mean()
    expected = (full.pixels - limited.pixels) / limits.FULL_SCALE
    np.testing.assert_allclose(difference.pixels, expected.clip(0.0, 1.0), atol=1e-12)
    head, (cells,) = limits.cells([row])
    assert len(head) == len(cells)
    assert cells[0] == "2 diffuse bounces (mbfeat:maxDiffuseBounces=2)"


def test_a_limit_that_could_not_be_rendered_has_no_row(tmp_path: Path) -> None:
    limit = limits.LIMITS[0]
    renderer = kit.KnownRenderer(broken=[limit.name])
    chosen = [variants.raw(), variants.whole(), limit.variant]
    measured = kit.measure(renderer, tmp_path, chosen=chosen)
    assert limits.rows(measured, [limit], {OWN: kit.exact_reference()}) == []


# ---- front and answers


def test_front_holds_all_that_nothing_beats(tmp_path: Path) -> None:
    points = kit.measure(kit.KnownRenderer(), tmp_path).points
    front = analysis.pareto(points, "relMSE")

    def place(point: Any) -> tuple[float, float]:
        return point["total_seconds"], point["errors"]["relMSE"]

    assert front
    for point in points:
        beaten = [
            other
            for other in points
            if place(other) != place(point)
            and place(other)[0] <= place(point)[0]
            and place(other)[1] <= place(point)[1]
        ]
        assert (point in front) == (not beaten)
    assert [place(p)[1] for p in front] == sorted((place(p)[1] for p in front), reverse=True)


def known_curves(tmp_path: Path) -> list[analysis.Curve]:
    rows = kit.rows_of(kit.measure(kit.KnownRenderer(), tmp_path, seeds=5))
    return analysis.curves(rows, "relMSE", OWN)


def test_best_within_seconds_is_between_the_measured(tmp_path: Path) -> None:
    found = known_curves(tmp_path)
    seconds = kit.START + 32 * kit.EACH
    answer = analysis.answer_seconds(found, seconds, "relMSE", 1e-6)
    estimates = {row["variant"]: row for row in answer["variants"]}
    # Five seeds of 6912 values: the median is within 3 %; samples are whole.
    assert estimates[RAW]["spp"] == 32
    assert estimates[RAW]["error"] == pytest.approx(kit.NOISE / 32, rel=0.05)
    model = (seconds - kit.START - kit.INFERENCE) / (kit.EACH + kit.RECORDING)
    assert estimates["paths"]["spp"] == pytest.approx(model, abs=1)
    assert all(row["seconds"] <= seconds for row in answer["variants"])
    assert answer["best"]["variant"] == "paths"
    assert "paths" in answer["text"]
    assert "interpolated" in answer["text"]


def test_time_to_an_error_is_that_of_the_fastest_variant(tmp_path: Path) -> None:
    found = known_curves(tmp_path)
    answer = analysis.answer_error(found, kit.NOISE / 32, "relMSE", 1e-6)
    estimates = {row["variant"]: row for row in answer["variants"]}
    assert estimates[RAW]["spp"] == pytest.approx(32, rel=0.05)
    assert estimates[RAW]["seconds"] == pytest.approx(kit.START + 32 * kit.EACH, rel=0.05)
    assert all(row["error"] <= kit.NOISE / 32 for row in answer["variants"])
    fastest = min(answer["variants"], key=lambda row: row["seconds"])
    assert answer["best"] == fastest


def test_no_answer_is_worse_than_a_measured_rung_on_a_busy_machine() -> None:
    """Seconds that fall with samples are noise: they must not hide the rung that took fewer."""
    measured = {
        "slow first": [(1, 5.5, 0.07), (4, 4.2, 0.03)],
        RAW: [(1, 4.1, 0.9), (64, 6.3, 0.2)],
    }
    rows = [
        {
            "variant": name,
            "renderer": OWN,
            "samples_per_pixel": spp,
            "total_seconds": {"median": seconds},
            "seconds": {"sampling": 0.1, "recording": 0.0},
            "errors": {"relMSE": {"median": error}},
        }
        for name, rungs in measured.items()
        for spp, seconds, error in rungs
    ]
    found = analysis.curves(rows, "relMSE", OWN)
    best = analysis.answer_seconds(found, 5.0, "relMSE", 1e-6)["best"]
    assert (best["variant"], best["spp"], best["error"]) == ("slow first", 4, 0.03)
    assert (best["seconds"], best["basis"]) == (4.2, "measured")
    best = analysis.answer_error(found, 0.08, "relMSE", 1e-6)["best"]
    assert best["seconds"] <= 4.2
    # What one sample took was not measured as 4.2 s.
    only_first = found[0].at_samples(1)
    assert (only_first.seconds, only_first.basis) == (4.2, "interpolated")


def test_nothing_is_claimed_of_a_reconstruction_beyond_what_was_measured(tmp_path: Path) -> None:
    found = known_curves(tmp_path)
    answer = analysis.answer_seconds(found, 200.0, "relMSE", 1e-6)
    estimates = {row["variant"]: row for row in answer["variants"]}
    assert estimates[RAW]["basis"] == "extrapolated"
    assert estimates[RAW]["spp"] == pytest.approx((200.0 - kit.START) / kit.EACH, abs=1)
    assert estimates["paths"]["spp"] == kit.RUNGS[-1]
    assert estimates["paths"]["basis"] == "measured"


def test_questions_without_an_answer_get_the_reason(tmp_path: Path) -> None:
    found = known_curves(tmp_path)
    none = analysis.answer_seconds(found, 0.5, "relMSE", 1e-6)
    assert none["best"] is None
    assert "no image" in none["text"]
    never = analysis.answer_error(found, 1e-9, "relMSE", 1e-12)
    assert never["best"] is None
    assert "--spp" in never["text"]
    near = analysis.answer_error(found, 0.01, "relMSE", 0.005)
    assert "0.005 itself" in near["text"]
    assert "not known" in analysis.answer_error(found, 0.01, "relMSE", None)["text"]


# ---- what is shown


def result(tmp_path: Path) -> tuple[dict[str, Any], list[crops.Crop]]:
    measured = kit.measure(kit.KnownRenderer(), tmp_path / "kept")
    rows = kit.rows_of(measured)
    found = analysis.curves(rows, "relMSE", OWN)
    seconds, _, shown = crops.crops(rows, measured, {OWN: kit.exact_reference()}, "relMSE")
    made = {
        "date": "2026-01-02",
        "command": "./run mbfeat tradeoff room.usda --out DIR",
        "scene": "room <1>",
        "width": kit.WIDTH,
        "height": kit.HEIGHT,
        "threads": 2,
        "seeds": 3,
        "machine": {"cpu": "a processor", "load_average": [5.0, 6.0]},
        "metric": "relMSE",
        "epsilons": {"relMSE": 1e-4},
        "missing": ["lost/wood.png"],
        "reference": {"text": "Reference: truth.exr, given.", "noise": None},
        "references": {"cycles": {"text": "Reference: 64 samples a pixel."}},
        "variants": {"paths": {"title": "a model of six vertices"}},
        "points": measured.points,
        "rungs": rows,
        "answers": [analysis.answer_seconds(found, 5.0, "relMSE", None)],
        "crops": {"text": f"What {seconds} s buy."},
        "limits": [],
        "left_out": {"cycles": "it is not installed"},
    }
    return made, shown


def test_html_holds_everything_and_needs_no_other_file(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from mbfeat.tradeoff import charts, web

    made, shown = result(tmp_path)
    chart = charts.png(made, shown, dpi=40)
    assert chart.startswith(b"\x89PNG")
    text = web.page(made, chart, shown)
    assert re.findall(r'(?:src|href)="(?!data:)', text) == []
    assert "http" not in text
    assert text.count('src="data:image/png') == 1 + len(shown)
    assert "room &lt;1&gt;" in text
    assert made["answers"][0]["text"] in text
    assert "busy with other work" in text
    assert "it is not installed" in text
    assert "not found: lost/wood.png" in text
    assert "cycles: Reference: 64 samples a pixel." in text
    assert "a model of six vertices" in text
    for row in made["rungs"]:
        assert f"<td>{row['samples_per_pixel']}</td>" in text


def test_csv_has_a_line_for_each_measurement(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from mbfeat.tradeoff import web

    made, _ = result(tmp_path)
    rows = list(csv.DictReader(io.StringIO(web.csv_text(made["points"]))))
    assert len(rows) == len(made["points"])
    for row, point in zip(rows, made["points"], strict=True):
        assert float(row["relMSE"]) == point["errors"]["relMSE"]
        parts = sum(float(row[f"{phase}_seconds"]) for phase in PHASES)
        assert parts == pytest.approx(float(row["total_seconds"]))


def test_page_has_machine_answers_and_every_rung(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    made, _ = result(tmp_path)
    text = page.page([made])
    flowing = " ".join(text.split())
    for wanted in ("2026-01-02", "a processor", "2 threads", made["answers"][0]["text"]):
        assert wanted in flowing
    assert "busy with other work" in flowing
    tables = [line for line in text.splitlines() if line.startswith(("| raw |", "| paths |"))]
    assert len(tables) == 2 * len(made["rungs"])


def test_crops_are_of_one_window_and_at_most_the_time(tmp_path: Path) -> None:
    measured = kit.measure(kit.KnownRenderer(), tmp_path)
    rows = kit.rows_of(measured)
    seconds, window, shown = crops.crops(rows, measured, {OWN: kit.exact_reference()}, "relMSE")
    assert [crop.title for crop in shown] == ["reference", RAW, "paths"]
    assert {crop.pixels.shape for crop in shown} == {(window.height, window.width, 3)}
    _, chosen = crops.equal_time(rows)
    assert all(row["total_seconds"]["median"] <= seconds for row in chosen)


def test_a_limit_is_shown_where_it_changes_the_image_even_if_that_is_a_few_pixels() -> None:
    full = np.full((3, 60, 100), 0.5)
    limited = full.copy()
    limited[:, 50, 85] = 0.1
    window = crops.most_changed(limited, full)
    assert window.x <= 85 < window.x + window.width
    assert window.y <= 50 < window.y + window.height


def test_the_shown_window_is_a_hard_one() -> None:
    y = np.full((3, 60, 100), 0.5)
    x = y.copy()
    rng = np.random.default_rng(3)
    x[:, 20:60, 60:100] += 0.2 * rng.standard_normal((3, 40, 40))
    x[:, 2, 2] = 1e4  # one odd pixel makes no hard part
    window = crops.hardest(x, y)
    assert window.x >= 50
    assert window.y >= 10
