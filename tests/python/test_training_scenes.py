"""The procedural stages: reproducible, varied, and with held-out classes, meshes and textures."""

from __future__ import annotations

import hashlib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdUtils

from training.keyed import generator, render_seed
from training.scenes import catalogue, shapes, skies, textures


def contents(folder: Path) -> dict[str, str]:
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in folder.iterdir()}


@pytest.mark.parametrize("name", catalogue.CLASSES)
def test_stage_of_every_class_is_the_same_again(name: str, tmp_path: Path) -> None:
    split = "test" if catalogue.CLASSES[name].is_held_out else "train"
    index = next(i for i in range(400) if catalogue.class_of(split, 3, i).name == name)
    first, entry = catalogue.write_stage(tmp_path / "a", split, 3, index)
    catalogue.write_stage(tmp_path / "b", split, 3, index)
    assert entry.name == name
    assert contents(tmp_path / "a") == contents(tmp_path / "b")
    stage = Usd.Stage.Open(str(first))
    assert UsdGeom.Camera(stage.GetPrimAtPath("/World/Camera"))
    _, _, unresolved = UsdUtils.ComputeAllDependencies(str(first))
    assert unresolved == []
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get())
            assert np.isfinite(points).all() and points.shape[0] >= 3


def test_another_seed_or_number_is_another_stage(tmp_path: Path) -> None:
    stages = {
        catalogue.write_stage(tmp_path / f"{seed}-{index}", "test", seed, index)[0].read_bytes()
        for seed, index in ((1, 0), (2, 0), (1, 5))
    }
    assert len(stages) == 3


def test_shares_of_the_classes_are_met_by_any_run_of_scenes() -> None:
    """The sequence of classes has low discrepancy: 100 scenes are within 4 of every share."""
    for seed in range(5):
        found = Counter(catalogue.class_of("train", seed, i).name for i in range(200, 300))
        for entry in catalogue.TRAINING:
            assert abs(found[entry.name] - 100 * entry.share) <= 4
    shares = dict.fromkeys(("reflection", "refraction", "diffuse"), 0.0)
    for entry in catalogue.TRAINING:
        shares[entry.light] += entry.share
    assert sum(shares.values()) == pytest.approx(1.0)
    assert catalogue.CLASSES["diffuse_room"].share == pytest.approx(0.3)


def test_held_out_scenes_share_nothing_with_training() -> None:
    training = {catalogue.class_of("train", 1, i).name for i in range(500)}
    held_out = {catalogue.class_of("test", 1, i).name for i in range(50)}
    assert training == {entry.name for entry in catalogue.TRAINING}
    assert held_out == {entry.name for entry in catalogue.HELD_OUT}
    assert not training & held_out
    assert not set(textures.TRAINING) & set(textures.HELD_OUT)
    assert not set(shapes.TRAINING) & set(shapes.HELD_OUT)


@pytest.mark.parametrize("family", [*textures.TRAINING, *textures.HELD_OUT])
def test_textures_are_colours_that_vary(family: str) -> None:
    maker = (textures.TRAINING | textures.HELD_OUT)[family]
    for seed in range(3):
        image = maker(generator("texture", seed), 64)
        assert image.shape == (64, 64, 3)
        assert np.isfinite(image).all() and image.min() >= 0.0
        assert textures.srgb8(image).std() > 2.0


@pytest.mark.parametrize("family", [*shapes.TRAINING, *shapes.HELD_OUT])
def test_meshes_stand_on_the_floor_with_normals_outwards(family: str) -> None:
    """Most of each surface faces away from its centre line, whatever its shape."""
    maker = (shapes.TRAINING | shapes.HELD_OUT)[family]
    stage = Usd.Stage.CreateInMemory()
    mesh = maker(stage, "/Thing", generator("mesh", 1))
    points = np.array(mesh.GetPointsAttr().Get())
    assert abs(points[:, 1].min()) < 1e-5 and points[:, 1].max() < 2.0
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get())
    indices = np.array(mesh.GetFaceVertexIndicesAttr().Get())
    assert counts.sum() == indices.size and indices.max() < len(points)
    st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    expected = len(points) if st.GetInterpolation() == "vertex" else indices.size
    assert len(st.Get()) == expected
    # Volume by the divergence theorem is positive where faces are wound outwards.
    volume, first = 0.0, 0
    for count in counts:
        corners = points[indices[first : first + count]]
        for i in range(1, count - 1):
            volume += np.dot(corners[0], np.cross(corners[i], corners[i + 1])) / 6
        first += count
    assert volume > 1e-4
    normals = mesh.GetNormalsAttr().Get()
    if normals is not None:
        lengths = np.linalg.norm(np.array(normals), axis=1)
        assert np.abs(lengths - 1).max() < 1e-3


def test_sun_is_three_decades_brighter_than_its_sky(tmp_path: Path) -> None:
    for seed in range(4):
        image = skies.sky(generator("sky", seed), 64, sun=True)
        assert image.max() / np.median(image) > 500
        file = tmp_path / f"{seed}.hdr"
        skies.write_hdr(file, image)
        header, _, pixels = file.read_bytes().partition(b"-Y 64 +X 128\n")
        assert header.startswith(b"#?RADIANCE")
        rgbe = np.frombuffer(pixels, dtype=np.uint8).reshape(64, 128, 4)
        read = rgbe[..., :3] * 2.0 ** (rgbe[..., 3:].astype(float) - 136)
        # One step of the mantissa of the largest component.
        assert (np.abs(read - image) <= image.max(axis=-1, keepdims=True) / 127).all()


def test_random_numbers_depend_on_every_part_of_their_name() -> None:
    names: list[tuple[str | int, ...]] = [("a", 1), ("a", 2), ("b", 1), ("a", "1"), ("a1",)]
    assert len({float(generator(*name).random()) for name in names}) == len(names)
    seeds = {render_seed("input", split, i) for split in ("train", "test") for i in range(500)}
    assert len(seeds) == 1000 and max(seeds) < 2**53
