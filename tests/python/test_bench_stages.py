"""The benchmark's reader of stages: exact arrays, and a clear refusal of what is not comparable.

These tests run with usd-core's ``pxr``, as the benchmark reads stages.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

from peers import reader, scene
from rendering import SCENES, kit

pytestmark = pytest.mark.usd_core

BENCH = sorted((SCENES / "bench").glob("*.usda"))


@pytest.fixture
def stage() -> Any:
    """A quad of a Lambert material before a camera, to be added to."""
    stage = kit().new_stage()
    material = kit().preview_material(
        stage, "/World/Paint", diffuseColor=(0.25, 0.5, 0.75), roughness=1.0, ior=1.0
    )
    quad = kit().quad(stage, "/World/Quad", (0, 0, 0), (2, 0, 0), (0, 3, 0))
    kit().bind(kit().place(quad, translate=(1, 2, 3)), material)
    kit().camera(stage, "/World/Camera", (0, 0, 5), (0, 0, 0), focal_length=18.0)
    kit().render_settings(stage, "/World/Camera", (32, 18))
    return stage


@pytest.fixture
def read(tmp_path: Path) -> Callable[[Any], scene.Scene]:
    """Writes a stage and reads it as the benchmark does, through its files."""

    def call(stage: Any) -> scene.Scene:
        file = tmp_path / "stage.usda"
        stage.GetRootLayer().Export(str(file))
        scene.save(reader.read(file), tmp_path)
        return scene.load(tmp_path)

    return call


def test_mesh_camera_and_material_come_through(
    stage: Any, read: Callable[[Any], scene.Scene]
) -> None:
    result = read(stage)
    assert result.camera.width_by_focal_length == pytest.approx(2.0)
    np.testing.assert_allclose(result.camera.matrix[:3, 3], [0, 0, 5])
    (mesh,) = result.meshes
    np.testing.assert_array_equal(mesh.points, [[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0]])
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [0, 2, 3]])
    np.testing.assert_array_equal(mesh.uvs, [[0, 0], [1, 0], [1, 1], [0, 1]])
    assert mesh.normals is None
    np.testing.assert_allclose(
        mesh.placements, [[[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]]
    )
    assert result.materials[mesh.material].kind == "diffuse"
    assert result.materials[mesh.material].colour == (0.25, 0.5, 0.75)


def test_left_handed_meshes_are_turned(stage: Any, read: Callable[[Any], scene.Scene]) -> None:
    mesh = UsdGeom.Mesh.Get(stage, "/World/Quad")
    mesh.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    np.testing.assert_array_equal(read(stage).meshes[0].triangles, [[2, 1, 0], [3, 2, 0]])


def test_values_of_corners_give_every_corner_a_point(
    stage: Any, read: Callable[[Any], scene.Scene]
) -> None:
    box = kit().box(stage, "/World/Box", (0, 0, 0), (1, 1, 1))
    kit().bind(box, UsdShade.Material.Get(stage, "/World/Paint"))
    mesh = next(m for m in read(stage).meshes if m.name == "/World/Box")
    assert mesh.points.shape == (24, 3)
    assert mesh.uvs is not None
    assert mesh.uvs.shape == (24, 2)
    corners = mesh.points[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outwards = (normals * (corners.mean(axis=1) - 0.5)).sum(axis=1)
    assert len(outwards) == 12
    assert (outwards > 0).all()


def test_polygons_become_fans() -> None:
    triangles = reader._fans(np.array([3, 5, 4]))
    expected = [[0, 1, 2], [3, 4, 5], [8, 9, 10], [3, 5, 6], [8, 10, 11], [3, 6, 7]]
    np.testing.assert_array_equal(triangles, expected)


def test_instances_stand_where_openusd_puts_them(
    stage: Any, read: Callable[[Any], scene.Scene]
) -> None:
    instancer = UsdGeom.PointInstancer.Define(stage, "/World/Field")
    instancer.AddTranslateOp().Set(Gf.Vec3d(0, 0, -7))
    root = UsdGeom.Xform.Define(stage, "/World/Field/Stone")
    root.AddScaleOp().Set(Gf.Vec3f(2))
    part = kit().box(stage, "/World/Field/Stone/Part", (0, 0, 0), (1, 1, 1))
    kit().place(part, translate=(0, 1, 0))
    kit().bind(part, UsdShade.Material.Get(stage, "/World/Paint"))
    instancer.CreatePrototypesRel().AddTarget(root.GetPath())
    instancer.CreateProtoIndicesAttr([0, 0, 0])
    instancer.CreatePositionsAttr([(0, 0, 0), (10, 0, 0), (20, 0, 0)])
    half = 0.5**0.5
    turned = Gf.Quath(half, 0, half, 0)
    instancer.CreateOrientationsAttr([Gf.Quath(1), turned, Gf.Quath(1)])
    instancer.CreateInvisibleIdsAttr([2])
    result = read(stage)
    (mesh,) = [m for m in result.meshes if "Field" in m.name]
    corner = np.array([1.0, 0.0, 0.0, 1.0])  # of the box; (2, 2, 0) on the scaled prototype
    places = mesh.placements @ corner
    np.testing.assert_allclose(places[:, :3], [[2, 2, -7], [10, 2, -9]], atol=2e-3)
    assert result.triangle_count == 2 + 2 * 12


def test_lights_keep_their_radiance(stage: Any, read: Callable[[Any], scene.Scene]) -> None:
    rect = kit().rect_light(stage, "/World/Rect", (0, 4, 0), (0, 0, 0), (2, 3), 5.0, (1, 0.5, 0.25))
    rect.CreateExposureAttr(1.0)
    sphere = UsdLux.SphereLight.Define(stage, "/World/Sphere")
    kit().place(sphere, translate=(1, 2, 3), scale=(2, 2, 2))
    sphere.CreateRadiusAttr(0.25)
    UsdLux.DomeLight.Define(stage, "/World/Sky").CreateIntensityAttr(0.5)
    result = read(stage)
    assert result.rects[0].radiance == (10.0, 5.0, 2.5)
    assert (result.rects[0].width, result.rects[0].height) == (2.0, 3.0)
    np.testing.assert_allclose(-result.rects[0].matrix[:3, 2], [0, -1, 0], atol=1e-6)
    assert result.spheres[0].radius == pytest.approx(0.5)
    assert result.spheres[0].centre == (1.0, 2.0, 3.0)
    assert result.domes[0].radiance == (0.5, 0.5, 0.5)


def test_textures_are_linear_and_shared(stage: Any, read: Callable[[Any], scene.Scene]) -> None:
    file = str(SCENES / "textures" / "checker.png")
    for i in range(2):
        colour = kit().texture(stage, f"/World/T{i}/Map", file)
        material = kit().preview_material(
            stage, f"/World/T{i}", diffuseColor=colour, roughness=1.0, ior=1.0
        )
        kit().bind(kit().quad(stage, f"/World/Q{i}", (0, 0, i), (1, 0, 0), (0, 1, 0)), material)
    result = read(stage)
    (texture,) = result.textures
    assert texture.shape == (64, 64, 3)
    np.testing.assert_allclose(texture[0, 0], [0.1144, 0.1274, 0.1620], atol=1e-4)
    used = [m.texture for m in result.materials]
    assert used.count(0) == 2


def emissive(stage: Any) -> None:
    surface = UsdShade.Shader.Get(stage, "/World/Paint/Surface")
    surface.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).Set((1, 0, 0))


def coated(stage: Any) -> None:
    UsdShade.Shader.Get(stage, "/World/Paint/Surface").GetInput("ior").Set(1.5)


def half_metal(stage: Any) -> None:
    surface = UsdShade.Shader.Get(stage, "/World/Paint/Surface")
    surface.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(0.5)


def tinted_glass(stage: Any) -> None:
    surface = UsdShade.Shader.Get(stage, "/World/Paint/Surface")
    surface.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(0.0)


def subdivided(stage: Any) -> None:
    mesh = UsdGeom.Mesh.Get(stage, "/World/Quad")
    mesh.GetSubdivisionSchemeAttr().Set(UsdGeom.Tokens.catmullClark)


def implicit(stage: Any) -> None:
    UsdGeom.Sphere.Define(stage, "/World/Quad2")


def sun(stage: Any) -> None:
    UsdLux.DistantLight.Define(stage, "/World/Sun")


def cone(stage: Any) -> None:
    light = UsdLux.SphereLight.Define(stage, "/World/Spot")
    UsdLux.ShapingAPI.Apply(light.GetPrim()).CreateShapingConeAngleAttr(20.0)


def unbound(stage: Any) -> None:
    UsdShade.MaterialBindingAPI(stage.GetPrimAtPath("/World/Quad")).UnbindAllBindings()


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (emissive, "/World/Paint: emissiveColor"),
        (coated, "/World/Paint: the coat of ior 1.5"),
        (half_metal, "/World/Paint: metallic or opacity between"),
        (tinted_glass, "/World/Paint: glass whose diffuseColor is not white"),
        (subdivided, "/World/Quad: only meshes of subdivisionScheme none"),
        (implicit, "/World/Quad2: only meshes"),
        (sun, "/World/Sun: this DistantLight"),
        (cone, "/World/Spot: shaping"),
        (unbound, "/World/Quad: it has no material"),
    ],
)
def test_what_is_not_comparable_is_refused_by_name(
    stage: Any, read: Callable[[Any], scene.Scene], spoil: Callable[[Any], None], said: str
) -> None:
    spoil(stage)
    with pytest.raises(reader.UnsupportedError) as caught:
        read(stage)
    assert said in str(caught.value)


@pytest.mark.parametrize("file", BENCH, ids=[file.stem for file in BENCH])
def test_committed_stages_are_comparable(file: Path) -> None:
    result = reader.read(file)
    assert result.triangle_count > 200
    assert result.rects or result.spheres or result.domes
    for mesh in result.meshes:
        assert mesh.triangles.max() < len(mesh.points)
        assert np.isfinite(mesh.points).all()
    # What the camera sees directly of a light is black to Cycles.
    for light in result.spheres if file.stem == "lamps" else []:
        assert not _in_sight(result.camera, np.array(light.centre), light.radius)
    if file.stem == "lamps":
        assert len(result.spheres) == 100


def _in_sight(camera: scene.Camera, point: Any, radius: float) -> bool:
    """Whether a sphere reaches into the view of an image of 16:9."""
    x, y, z = (np.linalg.inv(camera.matrix) @ [*point, 1.0])[:3]
    if z - radius > 0.0:
        return False
    slope = camera.width_by_focal_length / 2.0
    wide = abs(x) < -z * slope + radius * (1 + slope * slope) ** 0.5
    slope *= 9 / 16
    high = abs(y) < -z * slope + radius * (1 + slope * slope) ** 0.5
    return bool(wide and high)


def test_the_large_stage_is_the_same_every_time(tmp_path: Path) -> None:
    folders = [tmp_path / "a", tmp_path / "b"]
    for folder in folders:
        command = [sys.executable, str(SCENES / "make_bench_scenes.py"), "--large", "--out"]
        subprocess.run([*command, str(folder)], check=True, capture_output=True)
    first, second = (reader.read(folder / "field.usdc") for folder in folders)
    assert first.triangle_count == second.triangle_count >= 1_000_000
    for a, b in zip(first.meshes, second.meshes, strict=True):
        np.testing.assert_array_equal(a.points, b.points)
        np.testing.assert_array_equal(a.placements, b.placements)
    np.testing.assert_array_equal(first.textures[0], second.textures[0])


def test_committed_stages_are_what_the_script_writes(tmp_path: Path) -> None:
    command = [sys.executable, str(SCENES / "make_bench_scenes.py"), "--out", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True)
    for file in BENCH:
        ours, written = (Sdf.Layer.FindOrOpen(str(p)) for p in (file, tmp_path / file.name))
        assert ours.ExportToString() == written.ExportToString(), file.name
    assert {p.name for p in tmp_path.glob("*.usda")} == {p.name for p in BENCH}


def test_read_is_a_command_that_says_what_is_wrong(stage: Any, tmp_path: Path) -> None:
    coated(stage)
    file = tmp_path / "stage.usda"
    stage.GetRootLayer().Export(str(file))
    command = [sys.executable, "-m", "peers.reader", str(file), str(tmp_path)]
    done = subprocess.run(
        command, cwd=SCENES.parent / "bench", capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert done.stderr.startswith(f"{file}: /World/Paint: the coat")
    assert Usd.Stage.Open(str(file))
