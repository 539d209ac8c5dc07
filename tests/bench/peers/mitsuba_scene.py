"""Mitsuba 3: a scene of peers.scene as its dictionaries, and its path tracer.

Runs in Mitsuba's own environment. The variant is the one that compiles to vector code on the CPU,
with RGB colours and float32.
"""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from peers import scene
from peers.rendering import Job, Rendered

VARIANT = "llvm_ad_rgb"
# Stratified samples have half the error of the default's at the same cost, so it would be unfair to
# leave them off. Their number has to be a square.
SAMPLER = "multijitter"
# Samples that are in flight at once take memory; more of them are made one after the other.
LANES = 1 << 24


def colour(value: scene.Colour) -> dict[str, Any]:
    return {"type": "rgb", "value": list(value)}


def transform(matrix: scene.Matrix) -> Any:
    return mi.ScalarTransform4f(np.asarray(matrix, dtype=np.float64))


class MitsubaRenderer:
    """The path integrator on one scene; see peers.rendering.Renderer."""

    def __init__(self, folder: Path, job: Job) -> None:
        mi.set_variant(VARIANT)
        dr.set_thread_count(job.threads)
        versions = f"Mitsuba {mi.__version__}, Dr.Jit {dr.__version__}"
        self.version = f"{versions}, {VARIANT}, {SAMPLER}"
        self._job = job
        self._source = scene.load(folder)
        self._objects: dict[str, Any] = {"type": "scene"}
        self._add_all()
        self._scene = mi.load_dict(self._objects)

    def render(self, spp: int, seed: int) -> Rendered:
        most = max(1, LANES // (self._job.width * self._job.height))
        power = min(spp, 4 ** int(math.log(most, 4)))
        counts = [power] * (spp // power) + ([spp % power] if spp % power else [])
        if any(math.isqrt(count) ** 2 != count for count in counts):
            raise ValueError(f"{spp} samples cannot be stratified; ask for a power of 4")
        sums = np.zeros((self._job.height, self._job.width, 3))
        seconds = cpu = 0.0
        for i, count in enumerate(counts):
            started, used = time.perf_counter(), time.process_time()
            image = mi.render(self._scene, spp=count, seed=(1000 * seed + i) % 2**32)
            dr.eval(image)
            dr.sync_thread()
            seconds += time.perf_counter() - started
            cpu += time.process_time() - used
            sums += count * np.array(image, dtype=np.float64)
        return Rendered((sums / spp).astype(np.float32), seconds, cpu)

    # ---- translation

    def _add_all(self) -> None:
        source = self._source
        # An index n means max_depth n + 1: there a light that the camera sees has depth 1.
        depth = self._job.bounces + 1
        self._objects["integrator"] = {"type": "path", "max_depth": depth}
        self._objects["sensor"] = self._sensor()
        materials = [self._bsdf(material) for material in source.materials]
        for i, mesh in enumerate(source.meshes):
            self._add_mesh(f"mesh{i}", mesh, materials[mesh.material])
        black = mi.load_dict({"type": "diffuse", "reflectance": colour((0.0, 0.0, 0.0))})
        for i, rect in enumerate(source.rects):
            # Mitsuba's rectangle is [-1, 1]^2 and looks along +z.
            size = np.diag([-rect.width / 2, rect.height / 2, -1.0, 1.0])
            self._objects[f"rect{i}"] = {
                "type": "rectangle",
                "to_world": transform(rect.matrix @ size),
                "bsdf": black,
                "emitter": {"type": "area", "radiance": colour(rect.radiance)},
            }
        for i, sphere in enumerate(source.spheres):
            self._objects[f"sphere{i}"] = {
                "type": "sphere",
                "center": list(sphere.centre),
                "radius": sphere.radius,
                "bsdf": black,
                "emitter": {"type": "area", "radiance": colour(sphere.radiance)},
            }
        if len(source.domes) > 1:
            raise ValueError("Mitsuba has one sky at most")
        for dome in source.domes:
            self._objects["sky"] = self._sky(dome)

    def _sensor(self) -> dict[str, Any]:
        camera = self._source.camera
        # Its camera looks along +z with +x to the left.
        turned = camera.matrix @ np.diag([-1.0, 1.0, -1.0, 1.0])
        return {
            "type": "perspective",
            "to_world": transform(turned),
            "fov_axis": "x",
            "fov": float(np.degrees(2.0 * np.arctan(camera.width_by_focal_length / 2.0))),
            "near_clip": 1e-3,
            "far_clip": 1e5,
            "film": {
                "type": "hdrfilm",
                "width": self._job.width,
                "height": self._job.height,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
            "sampler": {"type": SAMPLER},
        }

    def _bsdf(self, material: scene.Material) -> Any:
        alpha = material.roughness**2
        rough: dict[str, Any] = {"distribution": "ggx", "alpha": alpha} if alpha > 0.0 else {}
        prefix = "rough" if rough else ""
        if material.kind == "glass":
            index = {"int_ior": material.ior, "ext_ior": 1.0}
            return mi.load_dict({"type": f"{prefix}dielectric", **rough, **index})
        reflectance = colour(material.colour)
        if material.texture is not None:
            # v runs upwards in USD and downwards in a bitmap, whose first row is the top.
            image = np.ascontiguousarray(self._source.textures[material.texture][::-1])
            bitmap = mi.Bitmap(image)
            reflectance = {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": "repeat"}
        if material.kind == "metal":
            inner = {"type": f"{prefix}conductor", "material": "none", **rough}
            inner["specular_reflectance"] = reflectance
        else:
            inner = {"type": "diffuse", "reflectance": reflectance}
        return mi.load_dict({"type": "twosided", "bsdf": inner})

    def _add_mesh(self, name: str, source: scene.Mesh, bsdf: Any) -> None:
        if len(source.placements) == 1:
            self._objects[name] = self._mesh(name, source, source.placements[0], bsdf)
            return
        mesh = self._mesh(name, source, np.eye(4), bsdf)
        self._objects[name] = {"type": "shapegroup", "mesh": mesh}
        for i, matrix in enumerate(source.placements):
            self._objects[f"{name}at{i}"] = {
                "type": "instance",
                "to_world": transform(matrix),
                "shapegroup": {"type": "ref", "id": name},
            }

    def _mesh(self, name: str, source: scene.Mesh, matrix: scene.Matrix, bsdf: Any) -> Any:
        properties = mi.Properties()
        properties["bsdf"] = bsdf
        mesh = mi.Mesh(
            name,
            vertex_count=len(source.points),
            face_count=len(source.triangles),
            has_vertex_normals=source.normals is not None,
            has_vertex_texcoords=source.uvs is not None,
            props=properties,
        )
        linear = matrix[:3, :3]
        triangles = source.triangles
        if np.linalg.det(linear) < 0.0:
            triangles = triangles[:, ::-1]
        values = mi.traverse(mesh)
        points = source.points @ linear.T + matrix[:3, 3]
        values["vertex_positions"] = mi.Float(points.astype(np.float32).reshape(-1))
        values["faces"] = mi.UInt32(np.ascontiguousarray(triangles, dtype=np.uint32).reshape(-1))
        if source.normals is not None:
            normals = source.normals @ np.linalg.inv(linear)
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
            values["vertex_normals"] = mi.Float(normals.astype(np.float32).reshape(-1))
        if source.uvs is not None:
            values["vertex_texcoords"] = mi.Float(source.uvs.reshape(-1))
        values.update()
        return mesh

    def _sky(self, dome: scene.DomeLight) -> dict[str, Any]:
        if dome.texture is None:
            return {"type": "constant", "radiance": colour(dome.radiance)}
        image = self._source.textures[dome.texture] * np.array(dome.radiance, np.float32)
        return {
            "type": "envmap",
            "bitmap": mi.Bitmap(np.ascontiguousarray(image)),
            "to_world": transform(dome.matrix),
        }
