"""Cycles: a scene of peers.scene as objects and nodes of Blender's Python module.

Runs in Blender's own environment. Blender's axes are left alone: the camera says where up is. Only
a sky has to be turned, since images of the sky have their poles on Blender's z. Blender's rect and
sphere lights are used, which the camera does not see; everything else does.
"""

from __future__ import annotations

import math
import tempfile
import time
from pathlib import Path
from typing import Any

import bpy
import mathutils
import numpy as np

from peers import scene
from peers.rendering import Job, Rendered


class CyclesRenderer:
    """The path tracer on the CPU on one scene; see peers.rendering.Renderer."""

    def __init__(self, folder: Path, job: Job) -> None:
        self.version = f"Cycles of Blender {bpy.app.version_string}"
        self._job = job
        self._source = scene.load(folder)
        self._scratch = tempfile.TemporaryDirectory(prefix="mbfeat-bench-")
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self._settings()
        self._camera()
        self._images = [self._image(i) for i in range(len(self._source.textures))]
        self._materials = [self._material(m) for m in self._source.materials]
        for mesh in self._source.meshes:
            self._mesh(mesh)
        for rect in self._source.rects:
            self._rect(rect)
        for sphere in self._source.spheres:
            self._sphere(sphere)
        self._world()

    def render(self, spp: int, seed: int) -> Rendered:
        settings = bpy.context.scene
        settings.cycles.samples = spp
        settings.cycles.seed = seed
        file = Path(self._scratch.name) / "render.exr"
        file.unlink(missing_ok=True)
        settings.render.filepath = str(file)
        started, used = time.perf_counter(), time.process_time()
        bpy.ops.render.render(write_still=True)
        seconds, cpu = time.perf_counter() - started, time.process_time() - used
        return Rendered(self._read(file), seconds, cpu)

    def _read(self, file: Path) -> scene.Floats:
        image = bpy.data.images.load(str(file))
        width, height = image.size
        values = np.empty(width * height * 4, dtype=np.float32)
        image.pixels.foreach_get(values)
        bpy.data.images.remove(image)
        return np.ascontiguousarray(values.reshape(height, width, 4)[::-1, :, :3])

    # ---- translation

    def _settings(self) -> None:
        """What all renderers are given; everything else stays as Blender has it."""
        whole = bpy.context.scene
        render, cycles, job = whole.render, whole.cycles, self._job
        render.engine = "CYCLES"
        render.resolution_x, render.resolution_y = job.width, job.height
        render.resolution_percentage = 100
        render.threads_mode, render.threads = "FIXED", job.threads
        render.use_persistent_data = True  # the scene is built once, not for every render
        render.image_settings.file_format = "OPEN_EXR"
        render.image_settings.color_depth = "32"
        render.image_settings.color_mode = "RGB"
        cycles.device = "CPU"
        cycles.pixel_filter_type = "BOX"
        # Its count of bounces leaves out the first scattering: 0 is direct light.
        bounces = max(job.bounces - 1, 0)
        cycles.max_bounces = bounces
        for kind in ("diffuse", "glossy", "transmission"):
            setattr(cycles, f"{kind}_bounces", bounces)
        cycles.transparent_max_bounces = bounces
        cycles.use_adaptive_sampling = False
        cycles.use_denoising = False
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
        cycles.blur_glossy = 0.0
        cycles.caustics_reflective = cycles.caustics_refractive = True

    def _add(self, name: str, data: Any, matrix: scene.Matrix) -> Any:
        thing = bpy.data.objects.new(name, data)
        thing.matrix_world = mathutils.Matrix(matrix.tolist())
        bpy.context.scene.collection.objects.link(thing)
        return thing

    def _camera(self) -> None:
        source = self._source.camera
        camera = bpy.data.cameras.new("Camera")
        camera.sensor_fit = "HORIZONTAL"
        camera.sensor_width = 36.0
        camera.lens = 36.0 / source.width_by_focal_length
        camera.clip_start, camera.clip_end = 1e-3, 1e5
        bpy.context.scene.camera = self._add("Camera", camera, source.matrix)

    def _image(self, index: int) -> Any:
        """The texture as a file of floats, so that nobody's colour management has a say."""
        values = self._source.textures[index]
        height, width = values.shape[:2]
        image = bpy.data.images.new(f"Texture{index}", width, height, float_buffer=True)
        image.colorspace_settings.name = "Non-Color"
        pixels = np.ones((height, width, 4), dtype=np.float32)
        pixels[..., :3] = values[::-1]
        image.pixels.foreach_set(pixels.reshape(-1))
        image.pack()
        return image

    def _material(self, source: scene.Material) -> Any:
        material = bpy.data.materials.new(source.name)
        nodes, links = material.node_tree.nodes, material.node_tree.links
        nodes.clear()
        kinds = {
            "diffuse": "ShaderNodeBsdfDiffuse",
            "metal": "ShaderNodeBsdfAnisotropic",
            "glass": "ShaderNodeBsdfGlass",
        }
        shader = nodes.new(kinds[source.kind])
        shader.inputs["Color"].default_value = (*source.colour, 1.0)
        shader.inputs["Roughness"].default_value = source.roughness
        if source.kind != "diffuse":
            shader.distribution = "GGX"
        if source.kind == "glass":
            shader.inputs["IOR"].default_value = source.ior
        if source.texture is not None:
            texture = nodes.new("ShaderNodeTexImage")
            texture.image = self._images[source.texture]
            texture.interpolation, texture.extension = "Linear", "REPEAT"
            links.new(texture.outputs["Color"], shader.inputs["Color"])
        output = nodes.new("ShaderNodeOutputMaterial")
        links.new(shader.outputs["BSDF"], output.inputs["Surface"])
        return material

    def _mesh(self, source: scene.Mesh) -> None:
        mesh = bpy.data.meshes.new(source.name)
        corners = np.ascontiguousarray(source.triangles.reshape(-1))
        mesh.vertices.add(len(source.points))
        mesh.vertices.foreach_set("co", source.points.reshape(-1))
        mesh.loops.add(len(corners))
        mesh.loops.foreach_set("vertex_index", corners)
        mesh.polygons.add(len(source.triangles))
        mesh.polygons.foreach_set("loop_start", np.arange(0, len(corners), 3, dtype=np.int32))
        if source.uvs is not None:
            layer = mesh.uv_layers.new(name="st")
            layer.uv.foreach_set("vector", source.uvs[corners].reshape(-1))
        mesh.update(calc_edges=True)
        smooth = np.full(len(source.triangles), source.normals is not None)
        mesh.polygons.foreach_set("use_smooth", smooth)
        if source.normals is not None:
            mesh.normals_split_custom_set_from_vertices(source.normals.tolist())
        mesh.materials.append(self._materials[source.material])
        for i, matrix in enumerate(source.placements):
            placed = self._add(f"{source.name}{i}", mesh, matrix)
            # The smooth normals are used as they are, without Blender's help against terminators.
            placed.cycles.shadow_terminator_geometry_offset = 0.0
            placed.cycles.shadow_terminator_offset = 0.0

    def _rect(self, source: scene.RectLight) -> None:
        """A light of the power that gives the radiance; Blender divides it by area and pi."""
        light = bpy.data.lights.new("Rect", "AREA")
        light.shape = "RECTANGLE"
        light.size, light.size_y = source.width, source.height
        stretch = np.linalg.norm(source.matrix[:3, :3], axis=0)
        area = source.width * stretch[0] * source.height * stretch[1]
        self._light(light, math.pi * area, source.radiance, source.matrix)

    def _sphere(self, source: scene.SphereLight) -> None:
        """The same; of a sphere, Blender takes the area to be that of the whole surface."""
        light = bpy.data.lights.new("Sphere", "POINT")
        light.shadow_soft_size = source.radius
        light.use_soft_falloff = False
        matrix = np.eye(4)
        matrix[:3, 3] = source.centre
        self._light(light, 4.0 * math.pi**2 * source.radius**2, source.radiance, matrix)

    def _light(
        self, light: Any, power: float, radiance: scene.Colour, matrix: scene.Matrix
    ) -> None:
        """Completes a light that has radiance 1 at `power`."""
        strongest = max(*radiance, 1e-30)
        light.energy = power * strongest
        light.color = [part / strongest for part in radiance]
        self._add("Light", light, matrix)

    def _world(self) -> None:
        world = bpy.data.worlds.new("World")
        bpy.context.scene.world = world
        nodes, links = world.node_tree.nodes, world.node_tree.links
        nodes.clear()
        if len(self._source.domes) > 1:
            raise ValueError("Cycles has one sky at most")
        shader = nodes.new("ShaderNodeBackground")
        shader.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
        for dome in self._source.domes:
            shader.inputs["Color"].default_value = (*dome.radiance, 1.0)
            if dome.texture is not None:
                if dome.radiance != (1.0, 1.0, 1.0):
                    raise ValueError("a sky image with a colour is not translated")
                self._sky_image(dome.texture, dome.matrix[:3, :3], nodes, links, shader)
        output = nodes.new("ShaderNodeOutputWorld")
        links.new(shader.outputs["Background"], output.inputs["Surface"])

    def _sky_image(
        self, texture: int, rotation: scene.Matrix, nodes: Any, links: Any, shader: Any
    ) -> None:
        image = nodes.new("ShaderNodeTexEnvironment")
        image.image = self._images[texture]
        image.interpolation, image.projection = "Linear", "EQUIRECTANGULAR"
        # Blender's image has its top at +z, its centre at +x, and its left half holds +y.
        to_blender = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        turn = mathutils.Matrix((to_blender @ rotation.T).tolist())
        mapping = nodes.new("ShaderNodeMapping")
        mapping.vector_type = "POINT"
        mapping.inputs["Rotation"].default_value = turn.to_euler("XYZ")
        coordinates = nodes.new("ShaderNodeTexCoord")
        links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
        links.new(mapping.outputs["Vector"], image.inputs["Vector"])
        links.new(image.outputs["Color"], shader.inputs["Color"])
