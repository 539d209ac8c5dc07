"""The benchmark's statistics, tables and command, and that its stages render.

A peer is tested where its environment is set up, which is when the benchmark was run in this
checkout.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbfeat import cli
from mbfeat.devtools import peer_steps
from mbfeat.devtools.layout import this_layout
from peers import command, errors, measure, report, stages
from peers.process import RendererError, RendererProcess, own_installation
from peers.references import ReferenceStore
from peers.rendering import Job

TRUTH = np.random.default_rng(3).uniform(0.05, 2.0, (64, 96, 3))
SPREAD = 0.8  # of a sample, by the true value


def noisy(spp: int, seed: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """An image of independent samples."""
    noise = np.random.default_rng([spp, seed]).normal(size=TRUTH.shape)
    return np.asarray(TRUTH * (1.0 + SPREAD * noise / np.sqrt(spp)))


CONSTANT = float(np.mean((SPREAD * TRUTH) ** 2 / (TRUTH**2 + errors.REGULARISER)))


def ladder(reference: Any, rungs: tuple[int, ...] = (4, 16, 64)) -> dict[int, list[float]]:
    return {
        spp: [errors.relative_mse(noisy(spp, seed), reference) for seed in range(5)]
        for spp in rungs
    }


# The relative spread of an error of these 18432 numbers is sqrt(2 / 18432), about 1 %; the tests
# below have fixed seeds and allow 4 %.


def test_fit_finds_the_constant_of_independent_samples() -> None:
    fit = errors.fit(ladder(TRUTH), float("inf"), 0.01)
    assert fit.constant == pytest.approx(CONSTANT, rel=0.04)
    assert fit.spp == pytest.approx(CONSTANT / 0.01, rel=0.04)
    assert fit.low <= fit.constant <= fit.high
    assert fit.exponent == pytest.approx(1.0, abs=0.02)
    assert not fit.extrapolated


def test_fit_knows_the_noise_of_the_reference() -> None:
    reference = noisy(256, 99)
    wrong = errors.fit(ladder(reference), float("inf"), 0.01)
    right = errors.fit(ladder(reference), 256, 0.01)
    assert wrong.constant > 1.08 * CONSTANT
    assert right.constant == pytest.approx(CONSTANT, rel=0.04)


def test_fit_is_not_moved_by_one_bad_seed() -> None:
    rows = ladder(TRUTH)
    for row in rows.values():
        row[2] *= 100.0
    assert errors.fit(rows, float("inf"), 0.01).constant == pytest.approx(CONSTANT, rel=0.04)


def test_fit_uses_the_rungs_next_to_the_target() -> None:
    rows = ladder(TRUTH, (4, 16, 64, 256))
    rows[4] = [50.0 * error for error in rows[4]]
    fit = errors.fit(rows, float("inf"), 0.01)
    assert fit.constant == pytest.approx(CONSTANT, rel=0.04)


def test_fit_says_when_it_extrapolates() -> None:
    assert errors.fit(ladder(TRUTH, (4, 16)), float("inf"), 0.01).extrapolated


def test_image_without_noise_needs_no_samples() -> None:
    assert errors.fit({4: [0.0, 0.0]}, 256, 0.01).spp == 0.0


def test_spread_is_the_error_without_a_reference() -> None:
    images = [noisy(16, seed) for seed in range(5)]
    assert errors.spread_mse(images) == pytest.approx(CONSTANT / 16, rel=0.04)
    with pytest.raises(ValueError, match="two images"):
        errors.spread_mse(images[:1])


def test_difference_of_images_averages_noise() -> None:
    assert errors.relative_difference(1.1 * TRUTH, TRUTH) == pytest.approx(0.1, rel=0.02)
    assert errors.relative_difference(noisy(4, 1), noisy(4, 2)) < 0.08
    odd = TRUTH[:61, :90]
    assert errors.relative_difference(odd, odd) == 0.0


def test_references_are_kept_and_extended(tmp_path: Path) -> None:
    store = ReferenceStore(tmp_path / "references")
    path = store.path("room", "mbfeat", "320x180x12", "key")
    assert path != store.path("room", "mbfeat", "320x180x12", "other key")
    reference = store.load(path, TRUTH.shape[:2])
    assert (reference.spp, reference.chunks) == (0, 0)
    for seed in range(3):
        reference.add(noisy(64, seed).astype(np.float32), 64)
    store.save(path, reference)
    again = store.load(path, TRUTH.shape[:2])
    assert (again.spp, again.chunks, again.samples) == (192, 3, [128, 64])
    np.testing.assert_allclose(again.image, np.mean([noisy(64, s) for s in range(3)], 0), rtol=1e-5)
    np.testing.assert_allclose(again.halves[1], noisy(64, 1), rtol=1e-5)
    assert again.next_seed == reference.next_seed
    path.write_bytes(b"damaged")
    assert store.load(path, TRUTH.shape[:2]).spp == 0


def test_a_reference_takes_the_place_of_one_of_an_older_build(tmp_path: Path) -> None:
    store = ReferenceStore(tmp_path)
    sizes = ["320x180x12", "128x72x12"]
    for size in sizes:
        store.save(store.path("room", "mbfeat", size, "old"), store.load(Path("none"), (2, 2)))
    newer = store.path("room", "mbfeat", sizes[0], "new")
    store.save(newer, store.load(Path("none"), (2, 2)))
    kept = {store.path("room", "mbfeat", sizes[1], "old"), newer}
    assert set(tmp_path.iterdir()) == kept


# ---- tables


def row(rate: float, spp: float, **more: Any) -> dict[str, Any]:
    return {
        "version": "Some 1.0",
        "msamples_per_s": rate,
        "msamples_per_s_range": [0.9 * rate, 1.1 * rate],
        "msamples_per_s_rounds": [0.9 * rate, rate, 1.1 * rate],
        "spp_to_relmse_0_01": spp,
        "spp_to_relmse_0_01_range": [0.95 * spp, 1.05 * spp],
        "spp_extrapolated": False,
        "seconds_to_relmse_0_01": spp / rate,
        "seconds_to_relmse_0_01_range": [0.8 * spp / rate, 1.2 * spp / rate],
        "reference_noise": 0.003,
        **more,
    }


def results() -> dict[str, Any]:
    own, peer = row(0.5, 40.0, scene="room"), row(2.0, 20.0, mean_relative_difference=0.004)
    peer.update(measure.compared(own, peer))
    own.update(peers={"mitsuba": peer}, time_to_error_ratio=peer["time_ratio"])
    failed = {"scene": "dome", "failures": {"cycles": "cycles ended with signal 11"}}
    return {
        "date": "2026-01-02",
        "command": "./run mbfeat bench --peers",
        "machine": {"cpu": "Some CPU", "cores": 2, "load_average": [7.0, 8.0]},
        "threads": 2,
        "settings": {
            "width": 320, "height": 180, "bounces": 12, "rounds": 3, "seeds": 5,
            "most_spp": 1024, "clock": "cpu",
        },
        "scenes": [own, failed],
    }  # fmt: skip


def test_ratios_are_ours_by_the_peers() -> None:
    (scene, _) = results()["scenes"]
    peer = scene["peers"]["mitsuba"]
    assert peer["rate_ratio"] == pytest.approx(0.25)
    assert peer["spp_ratio"] == pytest.approx(2.0)
    assert peer["time_ratio"] == pytest.approx(8.0)
    low, high = peer["time_ratio_range"]
    assert low < 8.0 < high
    assert scene["time_to_error_ratio"] == pytest.approx(8.0)


def test_tables_name_every_scene_and_failure() -> None:
    text = report.summary(results())
    assert "| room | MBFeat | 0.500 (0.450 .. 0.550) | 40.0 (38.0 .. 42.0) |" in text
    assert "| room | Mitsuba | 0.250 (0.250 .. 0.250) | 2.00" in text
    assert "| dome | Cycles | failed: cycles ended with signal 11 |" in text


def test_section_of_the_page_is_replaced_and_notes_by_hand_stay(tmp_path: Path) -> None:
    page = tmp_path / "benchmarks.md"
    page.write_text("# Benchmarks\n\nfirst\n", encoding="utf-8")
    report.write_section(results(), page)
    once = page.read_text(encoding="utf-8")
    assert once.startswith("# Benchmarks\n\nfirst\n\n## Against Mitsuba and Cycles\n")
    assert "other programs wanted the same cores" in once
    report.write_section(results(), page)
    assert page.read_text(encoding="utf-8") == once
    page.write_text(f"{once}\n{report.MARK}\n\nWhy.\n\n## Last\n\nend\n", encoding="utf-8")
    report.write_section(results(), page)
    again = page.read_text(encoding="utf-8")
    assert again.count(report.HEADING) == 1
    assert again.endswith(f"{report.MARK}\n\nWhy.\n\n## Last\n\nend\n")


def test_json_has_null_for_what_is_not_finite() -> None:
    value = {"a": [1.0, float("nan")], "b": {"c": float("inf")}}
    assert json.dumps(command.finite(value)) == '{"a": [1.0, null], "b": {"c": null}}'


# ---- the command


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--scenes", "rom"], "there is no scene 'rom'"),
        (["--peers", "arnold"], "there is no peer 'arnold'"),
        (["--threads", "100000"], "--threads 100000 needs as many cores"),
        (["--seeds", "1"], "--seeds has to be at least 2"),
        (["--json", "/nowhere/at/all.json"], "there is no folder /nowhere/at"),
    ],
)
def test_wrong_arguments_are_told_before_anything_is_done(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["bench", *arguments]) == 2
    assert said in capsys.readouterr().err


def test_outside_of_a_checkout_the_command_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    installed = tmp_path / "site-packages" / "mbfeat" / "cli.py"
    monkeypatch.setattr(cli, "__file__", str(installed))
    assert cli.main(["bench", "--quick"]) == 1
    assert "this is no checkout" in capsys.readouterr().err


def test_every_peer_has_pinned_requirements() -> None:
    layout = this_layout()
    for peer in peer_steps.PEERS:
        text = (layout.devtools / f"requirements-{peer}.txt").read_text(encoding="utf-8")
        packages = [line for line in text.splitlines() if line and line[0] != "#"]
        assert packages[0].startswith("pip==")
        assert all("==" in line for line in packages)
        assert peer in measure.TRANSLATIONS
        assert peer in report.PEER_NAMES


def test_own_renders_are_measured_and_written(tmp_path: Path) -> None:
    file = tmp_path / "out.json"
    arguments = [
        "--scenes", "room", "--width", "32", "--rounds", "1", "--seconds", "0.01", "--seeds", "2",
        "--max-spp", "16", "--max-reference-spp", "128", "--threads", "1", "--json", str(file),
    ]  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-P", "-m", "mbfeat.cli", "bench", *arguments],
        env=dict(os.environ), capture_output=True, text=True, timeout=240, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "| room | MBFeat |" in done.stdout
    result = json.loads(file.read_text(encoding="utf-8"))
    assert {"date", "machine", "threads", "settings", "command"} <= set(result)
    (scene,) = result["scenes"]
    assert scene["scene"] == "room"
    assert scene["peers"] == {}
    assert scene["msamples_per_s"] > 0.0
    pixels = 32 * 18
    rate = scene["msamples_per_s"] * 1e6
    expected = scene["spp_to_relmse_0_01"] * pixels / rate
    assert scene["seconds_to_relmse_0_01"] == pytest.approx(expected)
    assert 1.0 < scene["spp_to_relmse_0_01"] < 1000.0


# ---- renders


def render(name: str, source: Path, tmp_path: Path, spp: int) -> Any:
    """The room, or another stage, at 64 x 36."""
    installations = {install.name: install for install in command._installations(this_layout(), [])}
    if name != measure.OWN:
        (installations[name],) = command._installations(this_layout(), [name])[1:]
    job = Job(64, 36, 12, 1)
    cores = sorted(os.sched_getaffinity(0))[-1:]
    with RendererProcess(installations[name], source, job, cores, tmp_path / f"{name}.log") as one:
        image = one.render(spp, 1).image
        again = one.render(1, 2)
    assert again.seconds > 0.0
    assert again.cpu > 0.0
    assert image.shape == (36, 64, 3)
    assert np.isfinite(image).all()
    assert (image >= 0.0).all()
    return image


@pytest.mark.parametrize("name", stages.NAMES)
def test_stages_render(name: str, tmp_path: Path) -> None:
    stage = stages.prepare(name, this_layout()).stage
    image = render(measure.OWN, stage, tmp_path, 16)
    assert 0.05 < image.mean() < 2.0
    assert (image.mean(axis=2) > 0.0).mean() > 0.98


def test_a_renderer_that_ends_is_told_with_its_output(tmp_path: Path) -> None:
    missing = tmp_path / "missing.usda"
    log = tmp_path / "own.log"
    with pytest.raises(RendererError, match=r"mbfeat ended with status 1: .*own\.log"):
        RendererProcess(own_installation(), missing, Job(16, 9, 2, 1), [0], log)


@pytest.mark.parametrize("peer", list(peer_steps.PEERS))
@pytest.mark.parametrize("name", ["room", "stairs"])
def test_peers_make_the_same_image(peer: str, name: str, tmp_path: Path) -> None:
    """Means of blocks of 8 x 8 pixels at 256 samples a pixel; noise alone makes 1 %."""
    layout = this_layout()
    if not (layout.peers / peer / "bin" / "python").exists():
        pytest.skip(f"{peer} is not set up; ./run mbfeat bench --peers {peer} does it")
    files = stages.prepare(name, layout)
    theirs = render(peer, files.arrays, tmp_path, 256)
    ours = render(measure.OWN, files.stage, tmp_path, 256)
    assert errors.relative_difference(theirs, ours) < 0.03
    assert theirs.mean() == pytest.approx(ours.mean(), rel=0.01)
