"""What a scene class works with: a stage, random numbers, materials, textures and lights."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

from training import stagekit as kit
from training.scenes import shapes, skies, textures
from training.scenes.textures import Generator

MATERIALS = "/World/Materials"
Vector = tuple[float, float, float]


@dataclass
class Builder:
    """One scene in the making; `folder` receives its textures, which the stage names relatively.

    `held_out` chooses which families of meshes and textures it may use.
    """

    folder: Path
    rng: Generator
    held_out: bool = False
    stage: Usd.Stage = field(default_factory=kit.new_stage)
    texture_size: int = 256
    _count: int = 0

    def name(self, stem: str) -> str:
        """A prim name that is not used yet."""
        self._count += 1
        return f"{stem}{self._count:03d}"

    def uniform(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def chance(self, probability: float) -> bool:
        return bool(self.rng.random() < probability)

    # Materials

    def texture_file(self) -> str:
        """Writes a new texture; its path from the stage."""
        families = textures.HELD_OUT if self.held_out else textures.TRAINING
        family = families[str(self.rng.choice(sorted(families)))]
        name = f"{self.name('texture')}.png"
        self.folder.mkdir(parents=True, exist_ok=True)
        pixels = textures.srgb8(family(self.rng, self.texture_size))
        Image.fromarray(pixels).save(self.folder / name, compress_level=1)
        return f"./{name}"

    def material(self, **inputs: object) -> UsdShade.Material:
        return kit.preview_material(self.stage, f"{MATERIALS}/{self.name('Material')}", **inputs)

    def colour(self, low: float = 0.05, high: float = 0.9) -> Vector:
        value = self.uniform(low, high)
        tint = self.rng.uniform(0.3, 1.0, 3)
        return tuple(float(c) for c in value * tint / tint.max())  # type: ignore[return-value]

    def diffuse(self, *, textured: bool | None = None, roughness: float = 1.0) -> UsdShade.Material:
        """A Lambert surface, or with less roughness a plastic; textured by choice or by chance."""
        if textured is None:
            textured = self.chance(0.6)
        ior = 1.0 if roughness >= 1.0 else 1.5
        if not textured:
            return self.material(diffuseColor=self.colour(), roughness=roughness, ior=ior)
        path = f"{MATERIALS}/{self.name('Map')}"
        output = kit.texture(self.stage, path, self.texture_file(), color_space="sRGB")
        return self.material(diffuseColor=output, roughness=roughness, ior=ior)

    def anything(self) -> UsdShade.Material:
        """A surface of everyday objects: matt, plastic, and now and then metal."""
        pick = self.rng.random()
        if pick < 0.65:
            return self.diffuse()
        if pick < 0.88:
            return self.diffuse(roughness=self.uniform(0.08, 0.6))
        return self.metal(self.uniform(0.15, 0.5))

    def metal(self, roughness: float) -> UsdShade.Material:
        tone = [(0.95, 0.93, 0.9), (0.95, 0.75, 0.4), (0.9, 0.6, 0.5), (0.6, 0.6, 0.62)]
        colour = tone[int(self.rng.integers(len(tone)))]
        return self.material(diffuseColor=colour, metallic=1.0, roughness=roughness)

    def mirror(self) -> UsdShade.Material:
        value = self.uniform(0.85, 0.98)
        return self.material(diffuseColor=(value,) * 3, metallic=1.0, roughness=0.0)

    def glass(self, roughness: float = 0.0, ior: float | None = None) -> UsdShade.Material:
        tint = tuple(1.0 - 0.12 * float(v) * self.chance(0.5) for v in self.rng.random(3))
        index = self.uniform(1.35, 1.7) if ior is None else ior
        return self.material(diffuseColor=tint, opacity=0.0, ior=index, roughness=roughness)

    def emitter(self, radiance: float, *, textured: bool = False) -> UsdShade.Material:
        if not textured:
            colour = np.array(self.colour(0.8, 1.0)) * radiance
            return self.material(
                diffuseColor=(0, 0, 0), emissiveColor=tuple(map(float, colour)), roughness=1.0
            )
        path = f"{MATERIALS}/{self.name('Map')}"
        scale = (radiance, radiance, radiance, 1.0)
        output = kit.texture(self.stage, path, self.texture_file(), color_space="sRGB", scale=scale)
        return self.material(diffuseColor=(0, 0, 0), emissiveColor=output, roughness=1.0)

    # Things

    def put(self, prim: UsdGeom.Gprim, material: UsdShade.Material) -> UsdGeom.Gprim:
        return kit.bind(prim, material)

    def quad(
        self, origin: Vector, u: Vector, v: Vector, material: UsdShade.Material, tiles: float = 1.0
    ) -> UsdGeom.Mesh:
        prim = kit.quad(self.stage, f"/World/{self.name('Quad')}", origin, u, v)
        return self.put(shapes.tiled(prim, tiles, tiles), material)

    def box(self, low: Vector, high: Vector, material: UsdShade.Material) -> UsdGeom.Mesh:
        return self.put(kit.box(self.stage, f"/World/{self.name('Box')}", low, high), material)

    def thing(
        self,
        position: Vector,
        size: float,
        material: UsdShade.Material | None = None,
        family: str | None = None,
    ) -> UsdGeom.Mesh:
        """A mesh of a random family that stands at `position`."""
        families = shapes.HELD_OUT if self.held_out else shapes.TRAINING
        maker = families[family or str(self.rng.choice(sorted(families)))]
        prim = maker(self.stage, f"/World/{self.name('Thing')}", self.rng)
        kit.place(
            prim, translate=position, rotate=(0, self.uniform(0, 360), 0), scale=(size, size, size)
        )
        return self.put(prim, material or self.anything())

    def things(self, count: int, low: Vector, high: Vector, size: tuple[float, float]) -> None:
        """`count` things in a box of positions, apart from one another where there is room."""
        placed: list[tuple[float, float, float]] = []
        for _ in range(count):
            s = self.uniform(*size)
            for _ in range(12):
                x, z = self.uniform(low[0], high[0]), self.uniform(low[2], high[2])
                if all(math.hypot(x - a, z - b) > 0.45 * (s + t) for a, b, t in placed):
                    break
            placed.append((x, z, s))
            self.thing((x, self.uniform(low[1], high[1]), z), s)

    # Surroundings

    def room(self, width: float, height: float, depth: float, *, open_front: bool = False) -> None:
        """Floor, walls and ceiling about x = z = 0, the floor at y = 0; normals inwards."""
        w, h, d = width / 2, height, depth / 2
        self.quad((-w, 0, d), (width, 0, 0), (0, 0, -depth), self.diffuse(textured=True), 3)
        self.quad((-w, h, -d), (width, 0, 0), (0, 0, depth), self.diffuse(textured=False))
        self.quad((-w, 0, -d), (width, 0, 0), (0, h, 0), self.diffuse(), 2)
        self.quad((-w, 0, d), (0, 0, -depth), (0, h, 0), self.diffuse(), 2)
        self.quad((w, 0, -d), (0, 0, depth), (0, h, 0), self.diffuse(), 2)
        if not open_front:
            self.quad((w, 0, d), (-width, 0, 0), (0, h, 0), self.diffuse(), 2)

    def ground(self, size: float = 12.0) -> None:
        self.quad(
            (-size, 0, size), (2 * size, 0, 0), (0, 0, -2 * size), self.diffuse(textured=True), 8
        )

    def ceiling_lights(self, height: float, spread: float) -> None:
        """One to three rectangles under the ceiling."""
        for _ in range(int(self.rng.integers(1, 4))):
            x, z = self.uniform(-spread, spread), self.uniform(-spread, spread)
            side = self.uniform(0.9, 2.0)
            self.rect_light((x, height - 0.02, z), (x, 0, z), side, self.uniform(14, 36) / side**2)

    def rect_light(self, position: Vector, target: Vector, side: float, radiance: float) -> None:
        warmth = self.uniform(0.6, 1.0)
        kit.rect_light(
            self.stage,
            f"/World/Lights/{self.name('Rect')}",
            position,
            target,
            (side, side),
            radiance,
            (1.0, 0.5 + 0.5 * warmth, warmth),
        )

    def lamp(self, position: Vector, radius: float, power: float) -> None:
        """A sphere light; `power` is its radiance times its squared radius."""
        light = UsdLux.SphereLight.Define(self.stage, f"/World/Lights/{self.name('Lamp')}")
        light.CreateRadiusAttr(radius)
        light.CreateIntensityAttr(power / radius**2)
        light.CreateColorAttr(Gf.Vec3f(*self.colour(0.9, 1.0)))
        kit.place(light, translate=position)

    def sky(self, *, sun: bool, intensity: float = 1.0) -> None:
        """A dome with a sky of its own."""
        name = f"{self.name('sky')}.hdr"
        self.folder.mkdir(parents=True, exist_ok=True)
        skies.write_hdr(self.folder / name, skies.sky(self.rng, 128, sun=sun))
        dome = UsdLux.DomeLight.Define(self.stage, f"/World/Lights/{self.name('Sky')}")
        dome.CreateTextureFileAttr(Sdf.AssetPath(f"./{name}"))
        dome.CreateTextureFormatAttr(UsdLux.Tokens.latlong)
        dome.CreateIntensityAttr(intensity)
        kit.place(dome, rotate=(0, self.uniform(0, 360), 0))

    def sun(self, intensity: float) -> None:
        light = UsdLux.DistantLight.Define(self.stage, f"/World/Lights/{self.name('Sun')}")
        light.CreateAngleAttr(self.uniform(0.3, 2.0))
        light.CreateIntensityAttr(intensity)
        light.CreateColorAttr(Gf.Vec3f(1.0, self.uniform(0.75, 1.0), self.uniform(0.5, 0.95)))
        kit.place(light, rotate=(-self.uniform(20, 75), self.uniform(0, 360), 0))

    def daylight(self) -> None:
        """Sky and sun, the sun either a light of its own or in the sky's texture."""
        if self.chance(0.5):
            self.sky(sun=True)
        else:
            self.sky(sun=False)
            self.sun(10 ** self.uniform(3.2, 4.5))

    def camera(self, position: Vector, target: Vector, focal: float) -> None:
        kit.camera(self.stage, "/World/Camera", position, target, focal_length=focal)
