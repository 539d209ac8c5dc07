"""Training: the loss falls, resumed runs are the same to the bit, two processes equal one."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

torch = pytest.importorskip("torch", reason="torch is only in ./run training's environment")

from training import checkpoints, export, initial, train  # noqa: E402
from training.config import Config  # noqa: E402
from training.dataset.reader import Dataset  # noqa: E402
from training.model.config import ConfigError  # noqa: E402
from training.trainer import CHECKPOINT, MODEL, Trainer, TrainingError  # noqa: E402
from training_sets import TINY, synthetic_set  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthetic_set(tmp_path_factory.mktemp("training") / "data")


@pytest.fixture(autouse=True)
def one_thread() -> None:
    torch.set_num_threads(1)


def trainer(folder: Path, data: Path, *settings: str, name: str = "reduced") -> Trainer:
    config = Config.read(name, *TINY, *settings)
    return Trainer(folder, config, [Dataset(data)], seed=3)


def weights(folder: Path) -> dict[str, Any]:
    content = checkpoints.load(folder / CHECKPOINT)
    return {**content["model"], **{f"average {n}": v for n, v in content["average"].items()}}


@pytest.mark.parametrize("name", ["reduced", "layered", "best", "fast", "guided"])
def test_loss_falls(name: str, data: Path, tmp_path: Path) -> None:
    settings = ["model.vertex_encoder=8"] if name == "best" else []
    run = trainer(tmp_path, data, *settings, "model.kernel=9", "optimisation.rate=1e-2", name=name)
    run.total_steps = 80

    def loss() -> float:
        """Of the same eight patches, which training does not see."""
        batch = run.batches.batch(10_000, range(8))
        with torch.no_grad():
            return float(run.objective(batch.x, batch.reference, batch.pairs, False))

    before = loss()
    for _ in range(80):
        run.advance()
    assert loss() < 0.8 * before


def test_resumed_run_is_the_same_to_the_bit(data: Path, tmp_path: Path) -> None:
    trainer(tmp_path / "whole", data).run(12)
    trainer(tmp_path / "parts", data).run(12, stop_after=5)
    assert not (tmp_path / "parts" / MODEL).exists()
    trainer(tmp_path / "parts", data).run(12, stop_after=1)
    trainer(tmp_path / "parts", data).run(12)
    whole, parts = weights(tmp_path / "whole"), weights(tmp_path / "parts")
    assert whole.keys() == parts.keys()
    assert all(torch.equal(whole[name], parts[name]) for name in whole)
    content = checkpoints.load(tmp_path / "parts" / MODEL)
    assert content["step"] == content["total_steps"] == 12
    assert (tmp_path / "parts" / "tensorboard").is_dir()


def test_another_seed_is_another_run(data: Path, tmp_path: Path) -> None:
    config = Config.read("reduced", *TINY)
    for seed in (1, 2):
        Trainer(tmp_path / str(seed), config, [Dataset(data)], seed=seed).run(2)
    first, second = weights(tmp_path / "1"), weights(tmp_path / "2")
    assert any(not torch.equal(first[name], second[name]) for name in first)


def test_two_processes_equal_one(data: Path, tmp_path: Path) -> None:
    """Up to the order in which gradients are added."""
    arguments = ["--data", str(data), "--config", "reduced", "--steps", "6", "--threads", "1"]
    arguments += [part for setting in TINY for part in ("--set", setting)]
    assert train.main([str(tmp_path / "one"), *arguments]) == 0
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{os.environ.get('PYTHONPATH', '')}"}
    command = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--local-addr"]
    command += ["127.0.0.1", "--nproc-per-node", "2", "-m", "training.train"]
    finished = subprocess.run(
        [*command, str(tmp_path / "two"), *arguments],
        cwd=ROOT, env=environment, capture_output=True, text=True, timeout=240, check=False,
    )  # fmt: skip
    assert finished.returncode == 0, finished.stderr[-2000:]
    one, two = weights(tmp_path / "one"), weights(tmp_path / "two")
    for name in one:
        torch.testing.assert_close(two[name], one[name], atol=2e-5, rtol=2e-3)
    assert checkpoints.load(tmp_path / "two" / CHECKPOINT)["processes"] == 2


def test_minutes_become_a_number_of_steps_that_a_resumed_run_keeps(
    data: Path, tmp_path: Path
) -> None:
    run = trainer(tmp_path, data)
    run.run(0, minutes=0.01, stop_after=1)
    assert run.total_steps >= 1
    again = trainer(tmp_path, data)
    again.run(0, minutes=60.0, stop_after=0)
    assert again.total_steps == run.total_steps


def test_checkpoints_of_other_runs_are_refused(data: Path, tmp_path: Path) -> None:
    trainer(tmp_path, data).run(1)
    with pytest.raises(TrainingError, match="another configuration"):
        trainer(tmp_path, data, "model.width=4").run(2)
    (tmp_path / CHECKPOINT).write_bytes(b"nothing")
    with pytest.raises(checkpoints.CheckpointError, match="is no checkpoint"):
        trainer(tmp_path, data).run(2)


def test_loss_that_is_not_finite_stops_the_run(data: Path, tmp_path: Path) -> None:
    run = trainer(tmp_path, data)
    run.total_steps = 5
    with torch.no_grad():
        next(run.model.parameters()).fill_(float("nan"))
    with pytest.raises(TrainingError, match="not finite"):
        run.advance()


def test_batches_depend_on_step_and_place_alone(data: Path, tmp_path: Path) -> None:
    batches = trainer(tmp_path, data).batches
    together = batches.batch(7, [0, 1])
    apart = [batches.batch(7, [slot]) for slot in (0, 1)]
    assert torch.equal(together.x, torch.cat([b.x for b in apart]))
    assert torch.equal(together.reference, torch.cat([b.reference for b in apart]))
    assert not torch.equal(batches.batch(8, [0]).reference, apart[0].reference)


def test_what_cannot_be_trained_is_named(data: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="too small"):
        trainer(tmp_path, data, "data.patch=64")
    with pytest.raises(ValueError, match="fewer than"):
        trainer(tmp_path, data, "data.spp_max=8")
    with pytest.raises(ConfigError, match=r"model\.widht is unknown"):
        Config.read("reduced", "model.widht=3")
    assert train.main([str(tmp_path), "--data", str(tmp_path / "none"), "--steps", "1"]) == 1


@pytest.mark.parametrize("name", ["reduced", "best"])
def test_training_goes_on_from_an_exported_network(name: str, data: Path, tmp_path: Path) -> None:
    """With its averaged weights, rounded to what the file holds; the origin is kept."""
    pytest.importorskip("onnx", reason="onnx is only in ./run training's environment")
    settings = ["model.vertex_encoder=8"] if name == "best" else []
    first = trainer(tmp_path / "first", data, *settings, name=name)
    first.run(4)
    file = tmp_path / "first.onnx"
    assert export.main([str(tmp_path / "first" / MODEL), str(file), "--half"]) == 0
    start = initial.read(file)
    config, sets = first.config, [Dataset(data)]
    second = Trainer(tmp_path / "second", config, sets, seed=3, initial=start)
    expected = first.averaged().state_dict()
    for key, value in second.model.state_dict().items():
        torch.testing.assert_close(value, expected[key], rtol=2.0**-10, atol=1e-6)
    second.run(2)
    origin = checkpoints.load_model(tmp_path / "second" / MODEL).history["origin"]
    assert origin["file"] == "first.onnx" and origin["history"]["step"] == 4
    with pytest.raises(TrainingError, match="other weights"):
        Trainer(tmp_path / "second", config, sets, seed=3).run(3)
    other = Config.read("reduced", *TINY, "model.width=12")
    with pytest.raises(TrainingError, match=r"first\.onnx is a network of another configuration"):
        Trainer(tmp_path / "third", other, sets, seed=3, initial=start)


def test_guides_are_added_to_a_network_that_had_fewer(data: Path, tmp_path: Path) -> None:
    """It gives the same image as long as the new ones' scales are 0, and learns from there."""
    before = ["model.vertex_encoder=8", "model.guide_roughness=false"]
    first = trainer(tmp_path / "first", data, *before, name="best")
    first.run(2)
    start = initial.read(tmp_path / "first" / MODEL)
    config = Config.read("best", *TINY, "model.vertex_encoder=8")
    assert config.model.guide_roughness
    second = Trainer(tmp_path / "second", config, [Dataset(data)], seed=3, initial=start)
    assert second.model.scales is not None
    made = Trainer(tmp_path / "made", config, [Dataset(data)], seed=3).model
    assert made.scales is not None
    assert torch.equal(second.model.scales.bias[3:], made.scales.bias[3:])
    x = second.batches.batch(0, [0]).x
    with torch.no_grad():
        second.model.scales.weight[3:] = 0.0
        second.model.scales.bias[3:] = 0.0
        torch.testing.assert_close(second.model(x), first.averaged()(x))
    second.run(2)


def test_files_that_are_no_networks_are_named(tmp_path: Path) -> None:
    pytest.importorskip("onnx", reason="onnx is only in ./run training's environment")
    for name in ("none.onnx", "none.pt"):
        with pytest.raises(checkpoints.CheckpointError, match=name.replace(".", r"\.")):
            initial.read(tmp_path / name)
        (tmp_path / name).write_bytes(b"no network")
        with pytest.raises(checkpoints.CheckpointError, match=name.replace(".", r"\.")):
            initial.read(tmp_path / name)
