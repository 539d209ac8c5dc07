"""Families of meshes about one unit in size, standing on y = 0; some are for held-out scenes only.

A family takes a stage, a path and random numbers. All have st, so that any can carry a texture.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdGeom

from training import stagekit as kit
from training.scenes.textures import Generator

Points = NDArray[np.float64]
Family = Callable[[Usd.Stage, str, Generator], UsdGeom.Mesh]


def grid_mesh(stage: Usd.Stage, path: str, points: Points, st: Points) -> UsdGeom.Mesh:
    """A smooth surface through points [rows, columns, 3]; its normal is d/column x d/row."""
    rows, columns = points.shape[:2]
    across = np.gradient(points, axis=1)
    along = np.gradient(points, axis=0)
    for axis, edge in ((1, across), (0, along)):  # a closed surface has one normal at its seam
        first, last = np.take(points, 0, axis), np.take(points, -1, axis)
        if np.allclose(first, last, atol=1e-9):
            mean = 0.5 * (np.take(edge, 0, axis) + np.take(edge, -1, axis))
            if axis == 1:
                edge[:, 0] = edge[:, -1] = mean
            else:
                edge[0] = edge[-1] = mean
    normals = np.cross(across, along)
    size = np.linalg.norm(normals, axis=-1, keepdims=True)
    centre = points.reshape(-1, 3).mean(axis=0)
    normals = np.where(size > 1e-12, normals / np.maximum(size, 1e-12), points - centre)
    faces = [
        (r * columns + c, r * columns + c + 1, (r + 1) * columns + c + 1, (r + 1) * columns + c)
        for r in range(rows - 1)
        for c in range(columns - 1)
    ]
    return kit.mesh(
        stage,
        path,
        points.reshape(-1, 3).tolist(),
        faces,
        normals=normals.reshape(-1, 3).tolist(),
        st=st.reshape(-1, 2).tolist(),
    )


def spherical(
    stage: Usd.Stage, path: str, radius: Callable[[Points], Points], rows: int, columns: int
) -> UsdGeom.Mesh:
    """A star-shaped surface: `radius` of unit directions [..., 3]; moved to stand on y = 0."""
    v, u = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
    theta, phi = np.pi * v, 2 * np.pi * u
    theta = np.clip(theta, 1e-3, np.pi - 1e-3)
    direction = np.stack(
        [np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], axis=-1
    )
    direction[:, -1] = direction[:, 0]
    points = direction * radius(direction)[..., None]
    points[..., 1] -= points[..., 1].min()
    return grid_mesh(stage, path, points, np.stack([2 * u, 1 - v], axis=-1))


def tube(
    stage: Usd.Stage, path: str, curve: Points, radius: float, *, closed: bool, sides: int = 14
) -> UsdGeom.Mesh:
    """A tube along points [n, 3]; moved to stand on y = 0."""
    if closed:
        curve = np.concatenate([curve, curve[:1]])
    tangent = np.gradient(curve, axis=0)
    if closed:
        tangent[0] = tangent[-1] = curve[1] - curve[-2]
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    # Carried along, so that the tube does not twist against itself from ring to ring.
    normal = np.cross(tangent[0], [0.3, 1.0, 0.2])
    frames = []
    for t in tangent:
        normal = normal - t * np.dot(normal, t)
        normal /= np.linalg.norm(normal)
        frames.append((normal, np.cross(t, normal)))
    phi = np.linspace(0, 2 * np.pi, sides + 1)
    phi[-1] = 0.0
    rings = [
        c + radius * (np.cos(phi)[:, None] * a + np.sin(phi)[:, None] * b)
        for c, (a, b) in zip(curve, frames, strict=True)
    ]
    points = np.stack(rings)
    if closed:
        points[-1] = points[0]
    points[..., 1] -= points[..., 1].min()
    v, u = np.meshgrid(np.linspace(0, 8, len(curve)), np.linspace(0, 1, sides + 1), indexing="ij")
    return grid_mesh(stage, path, points, np.stack([u, v], axis=-1))


def turned(
    stage: Usd.Stage, path: str, profile: Sequence[tuple[float, float]], columns: int = 40
) -> UsdGeom.Mesh:
    """A profile (radius, height), upwards, turned about +y, with st."""
    rows = np.array(profile, dtype=float)
    u = np.linspace(0, 1, columns + 1)
    phi = 2 * np.pi * u
    phi[-1] = 0.0
    r, h = rows[:, :1], rows[:, 1:]
    points = np.stack([r * np.cos(phi), h + 0 * phi, -r * np.sin(phi)], axis=-1)
    v = np.linspace(0, 2, len(rows))[:, None]
    return grid_mesh(stage, path, points, np.stack([2 * u + 0 * v, v + 0 * u], axis=-1))


def box(stage: Usd.Stage, path: str, rng: Generator) -> UsdGeom.Mesh:
    w, h, d = rng.uniform(0.25, 0.5, 3)
    return kit.box(stage, path, (-w, 0, -d), (w, 2 * h, d))


def ball(stage: Usd.Stage, path: str, rng: Generator) -> UsdGeom.Mesh:
    radius = rng.uniform(0.35, 0.5)
    return spherical(stage, path, lambda d: np.full(d.shape[:-1], radius), 25, 49)


def vase(stage: Usd.Stage, path: str, rng: Generator) -> UsdGeom.Mesh:
    knots = rng.uniform(0.12, 0.45, 5)
    heights = np.linspace(0, 1, 25)
    radii = np.interp(heights, np.linspace(0, 1, 5), knots)
    radii = np.convolve(np.pad(radii, 3, mode="edge"), np.ones(7) / 7, mode="valid")
    height = rng.uniform(0.7, 1.2)
    profile = [(1e-3, 0.0), *zip(radii, heights * height, strict=True), (1e-3, height)]
    return turned(stage, path, [(float(r), float(h)) for r, h in profile])


def cone(stage: Usd.Stage, path: str, rng: Generator) -> UsdGeom.Mesh:
    radius, height, top = rng.uniform(0.3, 0.5), rng.uniform(0.6, 1.1), rng.uniform(0.0, 0.2)
    return turned(stage, path, [(radius, 0.0), (top + 1e-3, height), (1e-3, height)])


def torus(stage: Usd.Stage, path: str, rng: Generator) -> UsdGeom.Mesh:
    phi = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    ring = 0.38 * np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=-1)
    return tube(stage, path, ring, float(rng.uniform(0.07, 0.16)), closed=True)


def superquadric(stage: Usd.Stage, path: str, rng: Generator) -> UsdGeom.Mesh:
    power = rng.uniform(2.5, 7.0)

    def radius(d: Points) -> Points:
        return np.asarray(0.45 / (np.abs(d) ** power).sum(axis=-1) ** (1 / power))

    return spherical(stage, path, radius, 31, 61)


def blob(stage: Usd.Stage, path: str, rng: Generator) -> UsdGeom.Mesh:
    waves, phases = rng.normal(0, 2.5, (5, 3)), rng.uniform(0, 2 * np.pi, 5)

    def radius(d: Points) -> Points:
        return np.asarray(0.42 + 0.035 * np.sin(d @ waves.T + phases).sum(axis=-1))

    return spherical(stage, path, radius, 33, 65)


# Held out: never in a training scene.


def knot(stage: Usd.Stage, path: str, rng: Generator) -> UsdGeom.Mesh:
    p, q = [(2, 3), (3, 2), (2, 5)][int(rng.integers(3))]
    t = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    r = 0.3 + 0.12 * np.cos(q * t)
    curve = np.stack([r * np.cos(p * t), r * np.sin(p * t), 0.14 * np.sin(q * t)], axis=-1)
    return tube(stage, path, curve, 0.06, closed=True, sides=10)


def spring(stage: Usd.Stage, path: str, rng: Generator) -> UsdGeom.Mesh:
    turns = int(rng.integers(3, 7))
    t = np.linspace(0, 1, 24 * turns)
    phi = 2 * np.pi * turns * t
    curve = np.stack([0.3 * np.cos(phi), 0.9 * t, 0.3 * np.sin(phi)], axis=-1)
    return tube(stage, path, curve, 0.05, closed=False, sides=10)


def star(stage: Usd.Stage, path: str, rng: Generator) -> UsdGeom.Mesh:
    lobes = int(rng.integers(4, 8))

    def radius(d: Points) -> Points:
        phi = np.arctan2(d[..., 2], d[..., 0])
        ring = np.hypot(d[..., 0], d[..., 2])
        return np.asarray(0.32 + 0.16 * ring * np.abs(np.cos(0.5 * lobes * phi)))

    return spherical(stage, path, radius, 31, 8 * lobes + 1)


def twisted(stage: Usd.Stage, path: str, rng: Generator) -> UsdGeom.Mesh:
    turn, n = float(rng.uniform(0.5, 1.6)), 24
    corner = 0.28 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]])
    v = np.linspace(0, 1, n)
    angle = turn * math.pi * v[:, None]
    x = corner[:, 0] * np.cos(angle) - corner[:, 1] * np.sin(angle)
    z = corner[:, 0] * np.sin(angle) + corner[:, 1] * np.cos(angle)
    points = np.stack([x, np.broadcast_to(1.1 * v[:, None], x.shape), -z], axis=-1)
    # Each side is a surface of its own: the edges stay sharp.
    rows, normals, st, faces = [], [], [], []
    for side in range(4):
        strip = points[:, side : side + 2]
        normal = np.cross(
            np.repeat(strip[:, 1:] - strip[:, :1], 2, axis=1), np.gradient(strip, axis=0)
        )
        first = 2 * n * side
        rows.append(strip.reshape(-1, 3))
        normals.append((normal / np.linalg.norm(normal, axis=-1, keepdims=True)).reshape(-1, 3))
        st += [(u, 2 * w) for w in v for u in (0.0, 1.0)]
        faces += [
            (first + 2 * i, first + 2 * i + 1, first + 2 * i + 3, first + 2 * i + 2)
            for i in range(n - 1)
        ]
    rows.append(points[-1, :4])
    normals.append(np.tile([0.0, 1.0, 0.0], (4, 1)))
    st += [(0, 0), (1, 0), (1, 1), (0, 1)]
    faces.append((8 * n, 8 * n + 1, 8 * n + 2, 8 * n + 3))
    return kit.mesh(
        stage,
        path,
        np.concatenate(rows).tolist(),
        faces,
        normals=np.concatenate(normals).tolist(),
        st=st,
    )


TRAINING: dict[str, Family] = {
    f.__name__: f for f in (box, ball, vase, cone, torus, superquadric, blob)
}
HELD_OUT: dict[str, Family] = {f.__name__: f for f in (knot, spring, star, twisted)}


def tiled(prim: UsdGeom.Mesh, across: float, along: float) -> UsdGeom.Mesh:
    """Scales the texture coordinates; returns the mesh."""
    primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("st")
    primvar.Set([Gf.Vec2f(uv[0] * across, uv[1] * along) for uv in primvar.Get()])
    return prim


def wavy(
    stage: Usd.Stage, path: str, rng: Generator, size: float, height: float, cells: int = 48
) -> UsdGeom.Mesh:
    """A horizontal square about the origin with ripples of about `height`; normal up."""
    axis = np.linspace(-size, size, cells)
    x, z = np.meshgrid(axis, -axis)
    waves = rng.normal(0, 5.0 / size, (6, 2))
    phases = rng.uniform(0, 2 * np.pi, 6)
    y = height * np.sin(x[..., None] * waves[:, 0] + z[..., None] * waves[:, 1] + phases).mean(
        axis=-1
    )
    st = np.stack([x, z], axis=-1) / (2 * size) + 0.5
    return grid_mesh(stage, path, np.stack([x, y, z], axis=-1), st)


def bent(
    stage: Usd.Stage, path: str, width: float, height: float, angle: float, cells: int = 48
) -> UsdGeom.Mesh:
    """An upright sheet bent about +y through `angle` radians (negative: hollow); faces +z."""
    u, v = np.meshgrid(np.linspace(0, 1, cells), np.linspace(0, 1, 2))
    radius = width / angle
    phi = (u - 0.5) * angle
    points = np.stack([radius * np.sin(phi), height * v, radius * (np.cos(phi) - 1)], axis=-1)
    return grid_mesh(stage, path, points, np.stack([u, v], axis=-1))
