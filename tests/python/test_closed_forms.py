"""Images whose values are known in closed form, rendered through Hydra.

Monte Carlo means are compared at five standard errors of the mean, estimated from the spread of the
pixels, which are independent: a comparison of a correct renderer fails with a probability of 6e-7
when its random numbers change, all of this file together with less than 1e-4.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rendering import (
    CONTRIBUTIONS,
    EXTENDED,
    FIRST_NON_DELTA,
    Image,
    add_product,
    committed_stages,
    kit,
    open_scene,
    read_parts,
    record,
    render,
)

SIGMAS = 5.0
REFLECT, TRANSMIT, DIFFUSE, SPECULAR, EMISSION = 1, 2, 4, 16, 32


def assert_mean(values: Image, expected: float, rounding: float = 1e-5, noise: float = 0.1) -> None:
    """The mean of independent values is what is expected, up to noise and relative rounding.

    The channels of a grey image are the same number three times: give one of them. Fails as well
    where the noise hides a relative difference of `noise`.
    """
    values = np.asarray(values, dtype=np.float64).ravel()
    error = values.std(ddof=1) / math.sqrt(values.size)
    difference = values.mean() - expected
    assert abs(difference) <= SIGMAS * error + rounding * abs(expected), (
        f"mean {values.mean():.6g}, expected {expected:.6g}, standard error {error:.2g}"
    )
    assert SIGMAS * error <= noise * abs(expected), "too much noise"


def deep_paths(
    stage: Any, scratch: Path, resolution: tuple[int, int], samples: int
) -> dict[str, Image]:
    """Fields of all paths, extended ones too, [height, width, samples]."""
    add_product(stage, scratch / "deep.exr", EXTENDED, deep=True, resolution=resolution)
    record(stage, scratch, samplesPerPixel=samples, pixelFilterWidth=1)
    (part,) = read_parts(scratch / "deep.exr")
    shape = (resolution[1], resolution[0], samples)
    return {
        name: np.concatenate(pixels.ravel().tolist()).reshape(shape)
        for name, pixels in part.channels.items()
    }


def vector(paths: dict[str, Image], layer: str, suffixes: str) -> Image:
    return np.stack([paths[f"{layer}.{suffix}"] for suffix in suffixes], axis=-1)


# The decomposition


@pytest.mark.parametrize("bounces", [0, 2, 24])
@pytest.mark.parametrize("scene", committed_stages())
def test_emission_contributions_and_tail_sum_to_color(
    scene: str, bounces: int, tmp_path: Path
) -> None:
    layers = render(
        open_scene(scene), tmp_path, ["color", *CONTRIBUTIONS],
        resolution=(16, 12), samplesPerPixel=4, maxBounces=bounces,
    )  # fmt: skip
    parts = np.stack([layers[aov].astype(np.float64) for aov in CONTRIBUTIONS])
    color = layers["color"][..., :3].astype(np.float64)
    # Rounding of each float sum and of each stored value.
    bound = 16 * 2.0**-24 * np.abs(parts).sum(axis=0)
    assert (np.abs(parts.sum(axis=0) - color) <= bound).all()
    lit = {name for name, values in zip(CONTRIBUTIONS, parts, strict=True) if values.any()}
    allowed = {"mbfeat:contribution:emission", *CONTRIBUTIONS[1 : 1 + bounces]}
    allowed |= {"mbfeat:contribution:tail"} if bounces > 6 else set()
    assert lit <= allowed
    if bounces and scene in ("cockpit", "interior", "garden"):
        assert "mbfeat:contribution:1" in lit and color.any()


@pytest.mark.parametrize("smooth", [True, False])
def test_furnace_has_radiance_one_and_a_geometric_series(smooth: bool, tmp_path: Path) -> None:
    stage = open_scene("furnace")
    # Where interpolated normals and facets disagree about the side of a direction, the path ends:
    # with smooth normals a furnace of facets loses a part in a thousand and more at each bounce.
    loss = 1e-3 if smooth else 0.0
    if not smooth:
        stage.GetPrimAtPath("/World/Sphere").GetAttribute("normals").Block()
    layers = render(
        stage, tmp_path, ["color", *CONTRIBUTIONS],
        resolution=(24, 24), samplesPerPixel=512 if smooth else 256,
    )  # fmt: skip
    assert (layers["mbfeat:contribution:emission"] == 0.5).all()
    assert_mean(layers["color"][..., 0], 1.0, 1e-5 + loss)
    for k in range(6):
        contribution = layers[f"mbfeat:contribution:{k}"][..., 0]
        assert_mean(contribution, 0.5 ** (k + 2), 1e-5 + loss * (k + 1))
    assert_mean(layers["mbfeat:contribution:tail"][..., 0], 0.5**7, 1e-5 + loss * 8, 0.25)


def test_convex_sphere_under_a_white_sky_scatters_once(tmp_path: Path) -> None:
    stage = open_scene("white_sky")
    layers = render(
        stage, tmp_path, ["color", "alpha", *CONTRIBUTIONS],
        resolution=(24, 24), samplesPerPixel=128, pixelFilterWidth=1,
    )  # fmt: skip
    alpha = layers["alpha"][..., 0]
    inside, outside = alpha == 1.0, alpha == 0.0
    assert inside.sum() > 200 and outside.sum() > 200
    assert_mean(layers["mbfeat:contribution:0"][inside][:, 0], 0.5, 5e-4)
    assert (layers["mbfeat:contribution:emission"][outside] == 1.0).all()
    assert (layers["mbfeat:contribution:emission"][inside] == 0.0).all()
    for later in CONTRIBUTIONS[2:]:
        assert not layers[later].any(), later
    assert (layers["color"][outside] == [1.0, 1.0, 1.0, 0.0]).all()


# Lights: irradiance of a floor


def polygon_irradiance(vertices: Image, point: Image, normal: Image) -> float:
    """Lambert's formula: irradiance of a point by a polygon of radiance 1, counter-clockwise seen
    from the point, above its horizon."""
    rays = vertices - point
    rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    total = 0.0
    for a, b in zip(rays, np.roll(rays, -1, axis=0), strict=True):
        edge = np.cross(a, b)
        angle = math.atan2(float(np.linalg.norm(edge)), float(a @ b))
        total += angle * float(edge @ normal) / float(np.linalg.norm(edge))
    return abs(total) / 2.0


def cylinder_irradiance(height: float, radius: float, length: float) -> float:
    """Irradiance of the origin, facing up, by the side of a cylinder along x at that height, of
    radiance 1: the integral over the side, by the midpoint rule."""
    phi = (np.arange(2000) + 0.5) / 2000 * 2 * np.pi
    x = ((np.arange(1000) + 0.5) / 1000 - 0.5) * length
    x, phi = np.meshgrid(x, phi)
    y, z = height + radius * np.sin(phi), radius * np.cos(phi)
    squared = x**2 + y**2 + z**2
    facing = np.maximum(-(y * np.sin(phi) + z * np.cos(phi)), 0.0)
    area = 2 * np.pi * radius / 2000 * length / 1000
    return float((y * facing / squared**2).sum() * area)


HEIGHT = 2.0
CONE = math.radians(20.0)  # half angle of the distant light
RECT = np.array(
    [(-0.5, HEIGHT, -0.75), (0.5, HEIGHT, -0.75), (0.5, HEIGHT, 0.75), (-0.5, HEIGHT, 0.75)]
)


def above(prim: Any) -> Any:
    """Places a light above the floor's origin, facing down where it has a direction."""
    return kit().place(prim, translate=(0, HEIGHT, 0), rotate=(-90, 0, 0))


def make_rect(stage: Any) -> tuple[Any, float, float]:
    from pxr import UsdLux

    light = UsdLux.RectLight.Define(stage, "/World/Light")
    light.CreateWidthAttr(1.0)
    light.CreateHeightAttr(1.5)
    above(light)
    return light, polygon_irradiance(RECT, np.zeros(3), np.array([0, 1, 0])), 1.5


def make_tilted_rect(stage: Any) -> tuple[Any, float, float]:
    """Rotated, scaled unevenly and off the axis: its area is that of the scaled rectangle."""
    from pxr import Gf, UsdGeom, UsdLux

    light = UsdLux.RectLight.Define(stage, "/World/Light")
    light.CreateWidthAttr(2.0)
    light.CreateHeightAttr(1.0)
    kit().place(light, translate=(1.5, HEIGHT, -0.5), rotate=(-60, 25, 10), scale=(0.5, 1.6, 3.0))
    matrix = UsdGeom.Xformable(light).GetLocalTransformation()
    corners = [(-1, -0.5, 0), (1, -0.5, 0), (1, 0.5, 0), (-1, 0.5, 0)]
    vertices = np.array([list(matrix.Transform(Gf.Vec3d(*corner))) for corner in corners])
    return light, polygon_irradiance(vertices, np.zeros(3), np.array([0, 1, 0])), 1.6


def make_disk(stage: Any) -> tuple[Any, float, float]:
    from pxr import UsdLux

    light = UsdLux.DiskLight.Define(stage, "/World/Light")
    light.CreateRadiusAttr(0.7)
    above(light)
    return light, math.pi * 0.49 / (HEIGHT**2 + 0.49), math.pi * 0.49


def make_sphere(stage: Any) -> tuple[Any, float, float]:
    from pxr import UsdLux

    light = UsdLux.SphereLight.Define(stage, "/World/Light")
    light.CreateRadiusAttr(0.4)
    above(light)
    return light, math.pi * (0.4 / HEIGHT) ** 2, 4 * math.pi * 0.16


def make_cylinder(stage: Any) -> tuple[Any, float, float]:
    from pxr import UsdLux

    light = UsdLux.CylinderLight.Define(stage, "/World/Light")
    light.CreateRadiusAttr(0.3)
    light.CreateLengthAttr(1.6)
    kit().place(light, translate=(0, HEIGHT, 0))
    return light, cylinder_irradiance(HEIGHT, 0.3, 1.6), 2 * math.pi * 0.3 * 1.6


def make_distant(stage: Any) -> tuple[Any, float, float]:
    """40 degrees off the zenith; normalised it gives irradiance 1 to a surface that faces it."""
    from pxr import UsdLux

    light = UsdLux.DistantLight.Define(stage, "/World/Light")
    light.CreateAngleAttr(math.degrees(2 * CONE))
    kit().place(light, rotate=(-90 + 40, 0, 0))
    projected = math.pi * math.sin(CONE) ** 2
    return light, projected * math.cos(math.radians(40)), projected


def make_dome(stage: Any) -> tuple[Any, float, float]:
    from pxr import UsdLux

    return UsdLux.DomeLight.Define(stage, "/World/Light"), math.pi, 1.0


LIGHTS = [
    make_rect, make_tilted_rect, make_disk, make_sphere, make_cylinder, make_distant, make_dome,
]  # fmt: skip


def floor_stage() -> Any:
    """A floor of albedo 0.5, of which the camera sees a hundredth around the origin."""
    stage = kit().new_stage()
    white = kit().preview_material(
        stage, "/World/Material", diffuseColor=(0.5, 0.5, 0.5), roughness=1.0, ior=1.0
    )
    kit().bind(kit().quad(stage, "/World/Floor", (-9, 0, 9), (18, 0, 0), (0, 0, -18)), white)
    # Below the lights, a little beside the axis, since a camera cannot look along its up vector.
    kit().camera(stage, "/World/Camera", (0, 1, 0.1), (0, 0, 0), focal_length=3600.0, aspect=1.0)
    kit().render_settings(stage, "/World/Camera", (16, 16))
    return stage


@pytest.mark.parametrize("normalize", [False, True])
@pytest.mark.parametrize("make", LIGHTS)
def test_lights_give_their_analytic_irradiance(make: Any, normalize: bool, tmp_path: Path) -> None:
    """Radiance is intensity x 2^exposure x colour, divided by the world-space area if normalised:
    of a cylinder its side, of a distant light the projected solid angle."""
    from pxr import Gf

    stage = floor_stage()
    light, irradiance, area = make(stage)
    light.CreateIntensityAttr(3.0)
    light.CreateExposureAttr(-1.5)
    light.CreateColorAttr(Gf.Vec3f(1.0, 0.5, 0.25))
    light.CreateNormalizeAttr(normalize)
    layers = render(
        stage, tmp_path, ["color", "mbfeat:contribution:0", "mbfeat:contribution:emission"],
        samplesPerPixel=64,
    )  # fmt: skip
    color = layers["color"][..., :3]
    radiance = 3.0 * 2.0**-1.5 / (area if normalize else 1.0)
    for channel, tint in enumerate((1.0, 0.5, 0.25)):
        # 1e-4: the patch that is seen is not quite a point.
        assert_mean(color[..., channel], 0.5 / math.pi * irradiance * radiance * tint, 1e-4)
    assert np.array_equal(color, layers["mbfeat:contribution:0"])
    assert not layers["mbfeat:contribution:emission"].any()


def test_emissive_mesh_is_a_rect_light(tmp_path: Path) -> None:
    stage = floor_stage()
    glow = kit().preview_material(
        stage, "/World/Glow", diffuseColor=(0, 0, 0), emissiveColor=(2.0, 1.0, 0.5),
        roughness=1.0, ior=1.0,
    )  # fmt: skip
    card = kit().quad(stage, "/World/Card", (-0.5, HEIGHT, -0.75), (1, 0, 0), (0, 0, 1.5))
    kit().bind(card, glow)
    layers = render(stage, tmp_path, ["color", *CONTRIBUTIONS], samplesPerPixel=256)
    irradiance = polygon_irradiance(RECT, np.zeros(3), np.array([0, 1, 0]))
    for channel, radiance in enumerate((2.0, 1.0, 0.5)):
        value = 0.5 / math.pi * irradiance * radiance
        assert_mean(layers["color"][..., channel], value, 1e-4)
    assert np.array_equal(layers["color"][..., :3], layers["mbfeat:contribution:0"])


def test_two_lights_add_up(tmp_path: Path) -> None:
    from pxr import UsdLux

    stage = floor_stage()
    _, irradiance, _ = make_disk(stage)
    dome = UsdLux.DomeLight.Define(stage, "/World/Dome")
    dome.CreateIntensityAttr(0.25)
    layers = render(stage, tmp_path, ["color"], samplesPerPixel=256)
    shadowless = irradiance + 0.25 * math.pi
    # The disk hides the dome behind it, for the part of its solid angle.
    hidden = 0.25 * irradiance
    assert_mean(layers["color"][..., 0], 0.5 / math.pi * (shadowless - hidden), 1e-4)


# Vertex features by hand


def camera_directions(
    paths: dict[str, Image], resolution: tuple[int, int], half: float
) -> tuple[Image, Image]:
    """x and y of the rays (x, y, -1) of a camera without rotation, from their subpixels."""
    width, height = resolution
    x = ((np.arange(width)[None, :, None] + paths["subpixel.X"]) / width * 2 - 1) * half
    y = (1 - (np.arange(height)[:, None, None] + paths["subpixel.Y"]) / height * 2) * half
    return x, y


def test_mirror_shows_the_card_at_vertex_1(tmp_path: Path) -> None:
    """The mirror is the plane z = x: it turns a direction (x, y, -1) into (-1, y, x)."""
    size = (12, 12)
    paths = deep_paths(open_scene("mirror"), tmp_path, size, 8)
    x, y = camera_directions(paths, size, 18.0 / 90.0)
    t = 4.0 / (1.0 + x)  # where 4 - t = t x
    hit = np.stack([t * x, t * y, t * x], axis=-1)
    seen = (np.abs(hit[..., 0]) < 0.7) & (np.abs(hit[..., 1]) < 0.99)
    missed = (np.abs(hit[..., 0]) > 0.71) | (np.abs(hit[..., 1]) > 1.01)
    assert seen.sum() > 500 and missed.sum() > 50
    assert not paths["validMask"][missed].any()
    assert (paths["validMask"][seen] & 3 == 3).all()

    length = np.sqrt(x**2 + y**2 + 1)
    s = hit[..., 0] + 3.0  # to the card at x = -3
    paths = {name: values[seen] for name, values in paths.items()}
    assert np.allclose(paths["Z"], (t * length)[seen], rtol=1e-5)
    assert np.allclose(paths["mbfeat:distance:1.Z"], (s * length)[seen], rtol=1e-5)
    root = math.sqrt(0.5)
    for layer, suffixes, value in (
        ("mbfeat:albedo:0", "RGB", (1.0, 1.0, 1.0)),
        ("mbfeat:normal:0", "XYZ", (-root, 0.0, root)),
        ("mbfeat:direct:0", "RGB", (0.0, 0.0, 0.0)),
        ("mbfeat:albedo:1", "RGB", (0.1, 0.6, 0.2)),
        ("mbfeat:normal:1", "XYZ", (1.0, 0.0, 0.0)),
        ("mbfeat:throughput:0", "RGB", (1.0, 1.0, 1.0)),
        ("mbfeat:throughput:1", "RGB", (1.0, 1.0, 1.0)),
    ):
        assert np.allclose(vector(paths, layer, suffixes), value, atol=1e-6), layer
    assert (paths["mbfeat:event:0.Y"] == REFLECT | SPECULAR).all()
    assert (paths["mbfeat:roughness:0.Y"] == 0.0).all()
    assert (paths["mbfeat:event:1.Y"] == REFLECT | DIFFUSE).all()
    assert (paths["mbfeat:roughness:1.Y"] == 1.0).all()


def test_mirror_image_is_lit_by_lamberts_formula(tmp_path: Path) -> None:
    """What the mirror shows of the card is its albedo / pi x the irradiance where it is seen."""
    size = (16, 16)
    layers = render(
        open_scene("mirror"), tmp_path,
        ["color", "alpha", "primId", "mbfeat:contribution:1", *FIRST_NON_DELTA],
        resolution=size, samplesPerPixel=64, pixelFilterWidth=1,
    )  # fmt: skip
    y, x = np.mgrid[0:16, 0:16]
    x, y = ((x + 0.5) / 8 - 1) * 0.2, (1 - (y + 0.5) / 8) * 0.2
    t = 4.0 / (1.0 + x)
    s = t * x + 3.0
    inside = (np.abs(t * x) < 0.55) & (np.abs(t * y) < 0.85)
    # The light: 2 x 2 at (0, 4, 2), facing the origin.
    direction = np.array([0.0, -4.0, -2.0]) / math.sqrt(20.0)
    right = np.array([1.0, 0.0, 0.0])
    up = np.cross(right, direction)
    corners = [np.array([0, 4, 2]) + a * right + b * up for a, b in
               ((-1, -1), (1, -1), (1, 1), (-1, 1))]  # fmt: skip
    points = np.stack([np.full_like(x, -3.0), t * y + s * y, t * x + s * x], axis=-1)
    normal = np.array([1.0, 0.0, 0.0])
    expected = np.array(
        [polygon_irradiance(np.array(corners), point, normal) for point in points[inside]]
    )
    ratio = layers["mbfeat:contribution:1"][inside][:, 1] / (0.6 / math.pi * 5.0 * expected)
    # 1e-3: the irradiance at a pixel's centre is not quite its mean.
    assert_mean(ratio, 1.0, 1e-3)
    assert np.allclose(layers["mbfeat:firstNonDelta:albedo"][inside], (0.1, 0.6, 0.2), atol=1e-6)
    assert np.allclose(layers["mbfeat:firstNonDelta:normal"][inside], (1, 0, 0), atol=1e-6)
    assert np.allclose(layers["mbfeat:firstNonDelta:tint"][inside], 1.0, atol=1e-6)
    depth = ((t + s) * np.sqrt(x**2 + y**2 + 1))[inside]
    assert np.allclose(layers["mbfeat:firstNonDelta:depth"][inside][:, 0], depth, rtol=5e-3)


def test_first_hit_aovs_of_the_nearest_sample(tmp_path: Path) -> None:
    """Depths and normals of the mirror, from the path nearest each pixel's centre."""
    stage, size = open_scene("mirror"), (8, 8)
    aovs = ["depth", "cameraDepth", "normal", "Neye", "albedo", "primId", "elementId", "instanceId"]
    add_product(stage, tmp_path / "first.exr", aovs, resolution=size)
    paths = deep_paths(stage, tmp_path, size, 8)
    layers = read_parts(tmp_path / "first.exr")[0].layers()
    x, _ = camera_directions(paths, size, 18.0 / 90.0)
    from_centre = (paths["subpixel.X"] - 0.5) ** 2 + (paths["subpixel.Y"] - 0.5) ** 2
    nearest = from_centre.argmin(axis=-1)[..., None]
    t = np.take_along_axis(4.0 / (1.0 + x), nearest, axis=-1)[..., 0]
    all_hit = (paths["A"] == 1.0).all(axis=-1)
    assert all_hit.sum() > 30
    camera_depth, depth = layers["cameraDepth"][..., 0], layers["depth"][..., 0]
    assert np.allclose(camera_depth[all_hit], t[all_hit], rtol=1e-5)
    near, far = 0.01, 1000.0
    projected = far * (t - near) / (t * (far - near))
    assert np.allclose(depth[all_hit], projected[all_hit], rtol=1e-5)
    none_hit = (paths["A"] == 0.0).all(axis=-1)
    assert (camera_depth[none_hit] == 0.0).all() and (depth[none_hit] == 1.0).all()
    root = math.sqrt(0.5)
    for layer in ("normal", "Neye"):  # the camera looks along -z, up is +y: the same axes
        assert np.allclose(layers[layer][all_hit], (-root, 0.0, root), atol=1e-6)
    assert np.allclose(layers["albedo"][all_hit], 1.0)
    for layer, value in (("elementId", 0), ("instanceId", 0)):
        assert (layers[layer][all_hit] == value).all() and (
            layers[layer][none_hit] == 2**32 - 1
        ).all()
    assert len(np.unique(layers["primId"][all_hit])) == 1


def test_glass_pane_transmits_and_bends_by_the_textbook(tmp_path: Path) -> None:
    """Each face reflects 0.04, the ray inside has the length that Snell's law gives, and the card
    stands at vertex 2."""
    size = (24, 24)
    paths = deep_paths(open_scene("pane"), tmp_path, size, 128)
    x, y = camera_directions(paths, size, 18.0 / 180.0)
    through = (
        (paths["mbfeat:event:0.Y"] == TRANSMIT | SPECULAR)
        & (paths["mbfeat:event:1.Y"] == TRANSMIT | SPECULAR)
    )  # fmt: skip
    reflected = paths["mbfeat:event:0.Y"] == REFLECT | SPECULAR
    assert (reflected | (paths["mbfeat:event:0.Y"] == TRANSMIT | SPECULAR)).all()
    # Angles up to 8 degrees change the reflectance by less than a part in a thousand.
    assert_mean(reflected.astype(float), 0.04, 2e-3)
    assert_mean(through.astype(float), 0.96**2, 2e-3)
    sine = np.sqrt((x**2 + y**2) / (x**2 + y**2 + 1)) / 1.5
    inside = 0.1 / np.sqrt(1 - sine**2)
    distance = paths["mbfeat:distance:1.Z"]
    assert np.allclose(distance[through], inside[through], rtol=1e-4)
    assert (paths["validMask"][through] & 7 == 7).all()
    picked = {name: values[through] for name, values in paths.items()}
    for layer, suffixes, value in (
        ("mbfeat:albedo:0", "RGB", (1.0, 1.0, 1.0)),
        ("mbfeat:normal:0", "XYZ", (0.0, 0.0, 1.0)),
        ("mbfeat:normal:1", "XYZ", (0.0, 0.0, 1.0)),  # facing the ray, inside the glass
        ("mbfeat:albedo:2", "RGB", (0.6, 0.4, 0.2)),
        ("mbfeat:normal:2", "XYZ", (0.0, 0.0, 1.0)),
        ("mbfeat:throughput:2", "RGB", (1.0, 1.0, 1.0)),
    ):
        assert np.allclose(vector(picked, layer, suffixes), value, atol=1e-5), layer
    behind = picked["mbfeat:distance:2.Z"]
    assert np.allclose(behind, (1.9 * np.sqrt(x**2 + y**2 + 1))[through], rtol=1e-4)
    assert not paths["validMask"][reflected & (paths["validMask"] > 1)].any()


def test_glass_pane_lets_through_what_all_its_reflections_leave(tmp_path: Path) -> None:
    """Two faces of reflectance F transmit (1 - F) / (1 + F); the card is black but for its glow,
    lest it be lit by its own reflection."""
    stage = open_scene("pane")
    stage.GetPrimAtPath("/World/Materials/Card/Surface").GetAttribute("inputs:diffuseColor").Set(
        (0.0, 0.0, 0.0)
    )
    layers = render(stage, tmp_path, ["color"], samplesPerPixel=256)
    assert_mean(layers["color"][..., 0], 0.96 / 1.04, 1e-3)


def test_what_stands_behind_glass_is_first_non_delta(tmp_path: Path) -> None:
    layers = render(
        open_scene("pane"), tmp_path, FIRST_NON_DELTA,
        resolution=(12, 12), samplesPerPixel=256, pixelFilterWidth=1,
    )  # fmt: skip
    seen = 0.96 / 1.04  # share of the paths that reach the card
    for channel, albedo in enumerate((0.6, 0.4, 0.2)):
        assert_mean(layers["mbfeat:firstNonDelta:albedo"][..., channel], albedo * seen, 1e-3)
    assert_mean(layers["mbfeat:firstNonDelta:normal"][..., 2], seen, 1e-3)
    assert_mean(layers["mbfeat:firstNonDelta:tint"][..., 0], seen, 1e-3)
