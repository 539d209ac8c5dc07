"""Data sets: what a window holds, and that runs resume, verify and share."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from training import generate, verify
from training.dataset import items, layout, references
from training.dataset.plan import Plan, PlanError
from training.dataset.reader import Dataset
from training.dataset.references import References
from training.dataset.rendering import StageRenderer, Window
from training.dataset.shards import ShardError, ShardFiles, ShardWriter, checksum

ROOT = Path(__file__).resolve().parents[2]
SCENES = ROOT / "tests" / "scenes"
PLAN = Plan(
    split="train", seed=7, scenes=4, windows=2, size=16, spp=4, reference_spp=16, scenes_per_shard=2
)
ARGUMENTS = [
    "--split=train", "--seed=7", "--scenes=4", "--windows=2", "--size=16", "--spp=4",
    "--reference-spp=16", "--scenes-per-shard=2", "--threads=1",
]  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("data") / "set"
    assert generate.main([str(folder), *ARGUMENTS]) == 0
    return folder


def bits(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in sorted(folder.glob("shard-*.bin"))}


def test_window_shows_the_same_part_as_the_whole_image() -> None:
    renderer = StageRenderer(SCENES / "mirror.usda", threads=1)
    whole = renderer.samples(Window.whole(32, 24), 2, 5)
    part = renderer.samples(Window((32, 24), 10, 6, 12, 9), 2, 5)
    np.testing.assert_array_equal(whole.half[..., 6:15, 10:22], part.half)
    np.testing.assert_array_equal(whole.bytes[..., 6:15, 10:22], part.bytes)


def test_samples_are_the_paths_whose_mean_is_the_image() -> None:
    renderer = StageRenderer(SCENES / "interior.usda", threads=1)
    window = Window.whole(24, 16)
    samples = renderer.samples(window, 8, 3)
    image, _ = renderer.color(window, 8, 3)
    # Half floats have 11 bits.
    mean = samples.half[:, :3].astype(np.float64).mean(axis=0)
    assert (np.abs(mean - image) <= 2.0**-10 * np.abs(image) + 1e-6).all()
    valid = samples.bytes[:, 0]
    albedo = samples.half[:, layout.channels("mbfeat:albedo:0")]
    assert (albedo[np.broadcast_to((valid & 1)[:, None] == 0, albedo.shape)] == 0).all()
    assert samples.clipped == 0 and np.isfinite(samples.half).all()


def test_camera_rotation_makes_normals_face_the_rays_of_their_pixels() -> None:
    """Rays as they are in the camera's own axes: right, up, and -z forward."""
    renderer = StageRenderer(SCENES / "interior.usda", threads=1)
    samples = renderer.samples(Window.whole(32, 18), 1, 1)
    normal = samples.half[0, layout.channels("mbfeat:normal:0")].astype(np.float64)
    turned = np.einsum("ij,jhw->ihw", renderer.world_to_camera, normal)
    # The stage's camera has a focal length of 22 and an aperture of 36 x 20.25.
    sub = samples.half[0, layout.channels("subpixel.X", "subpixel.Y")].astype(np.float64)
    row, column = np.mgrid[0:18, 0:32]
    right = ((column + sub[0]) / 32 - 0.5) * 36 / 22
    up = -((row + sub[1]) / 18 - 0.5) * 20.25 / 22
    facing = -(turned[0] * right + turned[1] * up - turned[2])
    hit = np.linalg.norm(normal, axis=0) > 0.5
    assert hit.all() and (facing[hit] > -2e-3).all()
    np.testing.assert_allclose(
        renderer.world_to_camera @ renderer.world_to_camera.T, np.eye(3), atol=1e-5
    )


def test_reference_halves_tell_its_error() -> None:
    """The mean squared half difference is the variance: of 768 values, within 40 % (4 sigma)."""
    renderer = StageRenderer(SCENES / "interior.usda", threads=1)
    window = Window.whole(16, 16)
    plan = Plan(split="train", seed=1, scenes=1, size=16, reference_spp=64, floor=0.0)
    found = items.reference_of(plan, ("train", 1, 0, 0), renderer, window)
    other = items.reference_of(plan, ("train", 2, 0, 0), renderer, window)
    assert found[2] == other[2] == 64
    own = items.floor_of(found[0], found[1])
    real = items.relative_error(found[0], other[0]) / 2
    assert own == pytest.approx(real, rel=0.4)


def test_generated_set_verifies_and_reads_back(
    made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert verify.main([str(made)]) == 0
    assert "8 items, 0 problems" in capsys.readouterr().out
    dataset = Dataset(made)
    assert len(dataset) == 8 and dataset.missing == [] and dataset.plan == PLAN
    item = dataset[3]
    assert item.half.shape == (4, len(layout.HALF), 16, 16) and item.half.dtype == np.float16
    assert item.bytes.shape == (4, len(layout.BYTES), 16, 16)
    assert item.reference.shape == (3, 16, 16) and item.reference.dtype == np.float32
    raw = item.half[:, :3].astype(np.float64).mean(axis=0)
    assert item.about["raw"] == pytest.approx(items.relative_error(raw, item.reference), rel=1e-3)
    assert [dataset.about(i)["scene"] for i in range(8)] == [0, 0, 1, 1, 2, 2, 3, 3]


def test_shards_made_apart_equal_those_made_together(made: Path, tmp_path: Path) -> None:
    for shard in ("1", "0"):
        assert generate.main([str(tmp_path), *ARGUMENTS, "--shards", shard]) == 0
    assert bits(tmp_path) == bits(made)


def test_killed_generation_goes_on_and_makes_the_same_bits(made: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "training.generate", str(tmp_path), *ARGUMENTS]
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{os.environ.get('PYTHONPATH', '')}"}
    killed = 0
    for _ in range(4):
        process = subprocess.Popen(
            command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True
        )
        assert process.stdout is not None
        seen = 0
        for line in process.stdout:
            seen += line.startswith("[")
            if seen == 2 and killed < 3:
                time.sleep(0.05)  # somewhere in the next item
                process.send_signal(signal.SIGKILL)
                killed += 1
                break
        process.stdout.close()
        if process.wait() == 0:
            break
    assert killed >= 2
    assert bits(tmp_path) == bits(made)
    assert verify.main([str(tmp_path)]) == 0
    assert [p.name for p in tmp_path.glob("*.journal")] == []


def test_torn_tail_of_a_shard_is_cut_off(tmp_path: Path) -> None:
    files = ShardFiles(tmp_path, 0)
    arrays = [{"a": np.arange(100 + i, dtype=np.float32)} for i in range(3)]
    with ShardWriter(files) as writer:
        for i in range(2):
            writer.append({"scene": i}, arrays[i])
    with files.data.open("ab") as file:
        file.write(b"half an item")
    with files.journal.open("a") as journal:
        journal.write('{"about": {"scene": 2}, "arr')
    with ShardWriter(files) as writer:
        assert [entry["about"]["scene"] for entry in writer.entries] == [0, 1]
        writer.append({"scene": 2}, arrays[2])
        writer.finish()
    entries = files.entries()
    assert [entry["about"]["scene"] for entry in entries] == [0, 1, 2]
    assert all(checksum(files.data, entry) == entry["sha256"] for entry in entries)
    assert all(place["offset"] % 64 == 0 for e in entries for place in e["arrays"].values())


def test_two_writers_of_a_shard_do_not_meet(tmp_path: Path) -> None:
    with ShardWriter(ShardFiles(tmp_path, 0)):
        with pytest.raises(ShardError, match="another process"):
            ShardWriter(ShardFiles(tmp_path, 0))
        ShardWriter(ShardFiles(tmp_path, 1)).close()


def test_damage_is_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert generate.main([str(tmp_path), *ARGUMENTS, "--shards", "0"]) == 0
    files = ShardFiles(tmp_path, 0)
    content = bytearray(files.data.read_bytes())
    content[len(content) // 2] ^= 1
    files.data.write_bytes(bytes(content))
    assert verify.main([str(tmp_path)]) == 1
    printed = capsys.readouterr().out
    assert "the checksum is wrong" in printed and "shard 1 is not complete" in printed
    files.data.write_bytes(bytes(content[:-5]))
    assert verify.main([str(tmp_path)]) == 1
    assert "bytes instead of" in capsys.readouterr().err


def test_kept_references_are_not_rendered_again(made: Path, tmp_path: Path) -> None:
    """The same windows, samples and references; some are kept, the others rendered."""
    kept = tmp_path / "references.npz"
    assert references.main([str(made), str(kept)]) == 0
    whole = References.read(kept)
    assert len(whole) == 8 and whole.plan == PLAN
    References(PLAN, [k for k in whole.items if k.about["window"] == 1]).write(kept)
    folder = tmp_path / "set"
    assert generate.main([str(folder), *ARGUMENTS, "--references", str(kept)]) == 0
    for old, new in zip(Dataset(made), Dataset(folder), strict=True):
        np.testing.assert_array_equal(old.half, new.half)
        np.testing.assert_array_equal(old.bytes, new.bytes)
        assert [old.about[n] for n in references.KEPT] == [new.about[n] for n in references.KEPT]
        error = np.abs(old.reference - new.reference)
        if new.about["window"] == 0:
            assert error.max() == 0
        else:
            assert error.max() > 0 and (error <= 2.0**-11 * np.abs(old.reference) + 1e-7).all()
            assert new.about["seconds"] < old.about["seconds"]


def test_references_of_another_set_are_refused(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = tmp_path / "references.npz"
    assert references.main([str(made), str(kept)]) == 0
    other = [a if not a.startswith("--seed") else "--seed=8" for a in ARGUMENTS]
    assert generate.main([str(tmp_path / "b"), *other, "--references", str(kept)]) == 1
    assert "references of another data set" in capsys.readouterr().err
    kept.write_bytes(b"no archive")
    assert generate.main([str(tmp_path / "c"), *ARGUMENTS, "--references", str(kept)]) == 1
    assert "references.npz holds no references" in capsys.readouterr().err


def test_other_arguments_are_refused_rather_than_mixed(
    made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert generate.main([str(made), "--spp", "2"]) == 1
    assert "spp is 4, not 2" in capsys.readouterr().err
    assert generate.main([str(made), "--shards", "2-9"]) == 1
    assert "the shards 0 to 1" in capsys.readouterr().err
    with pytest.raises(PlanError, match="no split"):
        Plan(split="tests", seed=1, scenes=1)


def test_hand_made_stages_are_a_split(tmp_path: Path) -> None:
    options = ["--split=stages", "--seed=1", "--scenes=3", "--windows=1", "--size=16", "--spp=1"]
    assert generate.main([str(tmp_path), *options, "--reference-spp=4", "--threads=1"]) == 0
    dataset = Dataset(tmp_path)
    assert [dataset.about(i)["class"] for i in range(3)] == ["livingroom", "staircase", "cockpit"]


def test_plan_is_readable_json(made: Path) -> None:
    content = json.loads((made / "dataset.json").read_text())
    assert content["seed"] == 7 and content["format"] == 1
