"""A scene in plain arrays: what the translations to all renderers start from.

Needs nothing but numpy, since every renderer has a Python environment of its own. Matrices act on
column vectors, lengths are metres, +y is up, colours are linear Rec.709, images have their top row
first.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Matrix = NDArray[np.float64]
Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Material:
    """One of three closures.

    ``diffuse`` is Lambert's with `colour`; ``metal`` reflects `colour` at every angle by a GGX lobe
    of width roughness^2, or perfectly at 0; ``glass`` is an interface to index `ior`, of the same
    lobe, that tints nothing. All but glass look the same from both sides.
    """

    name: str
    kind: Literal["diffuse", "metal", "glass"]
    colour: Colour = (1.0, 1.0, 1.0)
    texture: int | None = None  # in Scene.textures, instead of `colour`
    roughness: float = 0.0
    ior: float = 1.0


@dataclass(frozen=True)
class Mesh:
    """Triangles in their own space; the outside sees them counter-clockwise."""

    name: str
    material: int
    points: Floats  # [n, 3]
    triangles: NDArray[np.int32]  # [m, 3]
    normals: Floats | None  # [n, 3], unit; None: flat
    uvs: Floats | None  # [n, 2], (0, 0) is the bottom left of a texture
    placements: Matrix  # [k, 4, 4] to the world; more than one: instances


@dataclass(frozen=True)
class RectLight:
    """Emits `radiance` along local -z; from behind there is nothing."""

    matrix: Matrix
    width: float
    height: float
    radiance: Colour


@dataclass(frozen=True)
class SphereLight:
    """Emits `radiance` outwards."""

    centre: tuple[float, float, float]
    radius: float
    radiance: Colour


@dataclass(frozen=True)
class DomeLight:
    """The sky, seen by the camera too: `radiance`, times a latitude-longitude image.

    In local space the image's top is +y, its centre +z, and its left half holds +x.
    """

    matrix: Matrix  # the upper 3 x 3 is a rotation
    radiance: Colour
    texture: int | None = None


@dataclass(frozen=True)
class Camera:
    """A pinhole that looks along local -z; film back by focal length, across."""

    matrix: Matrix
    width_by_focal_length: float


@dataclass
class Scene:
    """Everything in the world."""

    camera: Camera
    meshes: list[Mesh] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    textures: list[Floats] = field(default_factory=list)  # [height, width, 3], repeated, bilinear
    rects: list[RectLight] = field(default_factory=list)
    spheres: list[SphereLight] = field(default_factory=list)
    domes: list[DomeLight] = field(default_factory=list)

    @property
    def triangle_count(self) -> int:
        """Triangles, every instance counted."""
        return sum(len(mesh.triangles) * len(mesh.placements) for mesh in self.meshes)


def save(scene: Scene, folder: Path) -> None:
    """Writes scene.json and arrays.npz into an existing folder."""
    arrays: dict[str, NDArray[Any]] = {}

    def plain(value: Any, name: str) -> Any:
        """Replaces arrays by their names in the archive."""
        if isinstance(value, np.ndarray):
            arrays[name] = value
            return {"array": name}
        if isinstance(value, dict):
            return {key: plain(part, f"{name}.{key}") for key, part in value.items()}
        if isinstance(value, list | tuple):
            return [plain(part, f"{name}.{i}") for i, part in enumerate(value)]
        return value

    text = json.dumps(plain(asdict(scene), "scene"), indent=1)
    np.savez(folder / "arrays.npz", **arrays)  # type: ignore[arg-type]
    (folder / "scene.json").write_text(text, encoding="utf-8")


def load(folder: Path) -> Scene:
    """What save() wrote."""
    with np.load(folder / "arrays.npz") as archive:
        arrays = dict(archive)

    def whole(value: Any) -> Any:
        if isinstance(value, dict):
            if set(value) == {"array"}:
                return arrays[value["array"]]
            return {key: whole(part) for key, part in value.items()}
        if isinstance(value, list):
            parts = [whole(part) for part in value]
            return tuple(parts) if all(isinstance(p, float) for p in parts) else parts
        return value

    data = whole(json.loads((folder / "scene.json").read_text(encoding="utf-8")))
    return Scene(
        camera=Camera(**data["camera"]),
        meshes=[Mesh(**row) for row in data["meshes"]],
        materials=[Material(**row) for row in data["materials"]],
        textures=list(data["textures"]),
        rects=[RectLight(**row) for row in data["rects"]],
        spheres=[SphereLight(**row) for row in data["spheres"]],
        domes=[DomeLight(**row) for row in data["domes"]],
    )
