"""What test_blender.py lets Blender render, run by Blender's own Python: no module of ours is here.

    python blender_session.py ENGINE TEXTURE FOLDER

ENGINE is a script that registers MBFeat as a render engine, the one of the documentation. Every
render leaves FOLDER/NAME.exr and begins with its name on standard error; the scene is also left
there as USD.
"""

from __future__ import annotations

import os
import runpy
import sys
from pathlib import Path
from typing import Any

import bpy

RESOLUTION = (64, 32)


class Session:
    """The scene, the engine and where its pictures go."""

    def __init__(self, engine: str, texture: str, folder: str) -> None:
        self.folder = Path(folder)
        self.texture = texture
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.engine = runpy.run_path(engine)["MBFeatEngine"]
        self.scene = bpy.context.scene
        render = self.scene.render
        render.resolution_x, render.resolution_y = RESOLUTION
        render.image_settings.media_type = "MULTI_LAYER_IMAGE"
        render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
        render.image_settings.color_depth = "32"

    def render(self, name: str, **settings: Any) -> None:
        """Renders to NAME.exr; settings without their prefix, 16 samples and seed 1 by default.

        None leaves out a default.
        """
        values = {"samplesPerPixel": 16, "seed": 1, **settings}
        given = {key: value for key, value in values.items() if value is not None}
        self.engine.settings = {f"mbfeat:{key}": value for key, value in given.items()}
        self.scene.render.filepath = str(self.folder / f"{name}.exr")
        print(f"==== {name}", file=sys.stderr, flush=True)
        bpy.ops.render.render(write_still=True)

    def export(self, name: str, materialx: bool) -> None:
        """Writes the scene as Blender's own USD."""
        bpy.ops.wm.usd_export(
            filepath=str(self.folder / f"{name}.usda"), generate_materialx_network=materialx
        )


def material(name: str, color: tuple[float, float, float], **inputs: Any) -> Any:
    """A principled material, matte unless said otherwise."""
    made = bpy.data.materials.new(name)
    principled = made.node_tree.nodes["Principled BSDF"]
    values = {"Roughness": 1.0, "Specular IOR Level": 0.0, **inputs}
    for key, value in {"Base Color": (*color, 1.0), **values}.items():
        principled.inputs[key].default_value = value
    return made


def add(operator: Any, material: Any = None, **arguments: Any) -> Any:
    """The object that an operator adds."""
    operator(**arguments)
    made = bpy.context.object
    if material:
        made.data.materials.append(material)
    return made


def sky(session: Session, color: tuple[float, float, float]) -> None:
    """A uniform world."""
    session.scene.world = bpy.data.worlds.new("Sky")
    background = session.scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*color, 1.0)


def furnace(session: Session) -> None:
    """A grey ball under a white sky, and a black one that shines."""
    sky(session, (1.0, 1.0, 1.0))
    session.scene.camera = add(bpy.ops.object.camera_add, location=(0, 0, 10))
    ball = add(bpy.ops.mesh.primitive_ico_sphere_add, subdivisions=4)
    glow = {"Emission Color": (1.0, 0.5, 0.25, 1.0), "Emission Strength": 2.0}
    ball.data.materials.append(material("Grey", (0.5, 0.5, 0.5)))
    session.render("grey", samplesPerPixel=64)
    ball.data.materials[0] = material("Glow", (0.0, 0.0, 0.0), **glow)
    session.render("shining")
    for made in (ball, session.scene.camera):
        bpy.data.objects.remove(made)


def populate(session: Session) -> dict[str, Any]:
    """A textured floor with a metal ball, instances and a lamp on it, an area light, a sky."""
    sky(session, (0.2, 0.3, 0.4))
    matte = material("Floor", (0.8, 0.8, 0.8))
    nodes = matte.node_tree.nodes
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.load(session.texture)
    links = matte.node_tree.links
    links.new(texture.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    add(bpy.ops.mesh.primitive_plane_add, matte, size=20)

    metal = material("Metal", (0.9, 0.5, 0.1), Metallic=1.0, Roughness=0.3)
    ball = bpy.ops.mesh.primitive_ico_sphere_add
    moving = add(ball, metal, subdivisions=3, location=(0, 0, 1))
    glow = {"Emission Color": (1.0, 0.5, 0.25, 1.0), "Emission Strength": 2.0}
    lamp = material("Lamp", (0.0, 0.0, 0.0), **glow)
    add(bpy.ops.mesh.primitive_plane_add, lamp, location=(3, 0, 1), rotation=(1.5708, 0, 0))

    group = bpy.data.collections.new("Group")
    session.scene.collection.children.link(group)
    member = add(ball, material("Member", (0.2, 0.7, 0.3)), subdivisions=2)
    session.scene.collection.objects.unlink(member)
    group.objects.link(member)
    member.location = (0, 20, 1)  # far away, unlike its instances
    for i in range(3):
        instance = bpy.data.objects.new(f"Instance{i}", None)
        instance.instance_type, instance.instance_collection = "COLLECTION", group
        instance.location, instance.scale = (i - 4, -20 + i, i * 0.3), (1, 1, 1 - i * 0.2)
        session.scene.collection.objects.link(instance)

    light = add(bpy.ops.object.light_add, type="AREA", location=(0, -2, 5))
    light.data.energy, light.data.size = 200, 2
    where = {"location": (0, -8, 3), "rotation": (1.3, 0, 0)}
    session.scene.camera = add(bpy.ops.object.camera_add, **where)
    return {"ball": moving, "metal": metal, "light": light}


def pictures(session: Session) -> None:
    """The scene through both of Blender's ways to Hydra, and as USD."""
    session.scene.hydra.export_method = "USD"
    session.render("exported", samplesPerPixel=64)
    session.scene.hydra.export_method = "HYDRA"
    session.render("native", samplesPerPixel=64)
    session.export("preview_surface", False)
    session.export("materialx", True)


def settings(session: Session) -> None:
    """Each type of setting, and one that does not exist."""
    session.render("seed_1")
    session.render("seed_1_again")
    session.render("seed_2", seed=2)
    session.scene.frame_set(2)
    session.render("frame_2", seed=None)
    session.scene.frame_set(1)
    session.render("box_1", samplesPerPixel=1, pixelFilter="box")
    session.render("box_4", samplesPerPixel=4, pixelFilter="box")
    session.render("wide", pixelFilterWidth=6.0)
    session.render("not_robust", robust=False)
    session.render("emission", maxBounces=0)
    session.render("misspelt", samplePerPixel=1)


def edits(session: Session, ball: Any, metal: Any, light: Any) -> None:
    """Edits between renders of one delegate, which Blender keeps for persistent data."""
    session.scene.render.use_persistent_data = True
    session.render("still")
    ball.location.x = 2
    session.render("moved")
    ball.location.x = 0
    session.render("back")
    light.data.energy *= 2
    session.render("brighter", maxBounces=1)
    light.data.energy /= 2
    session.render("as_bright", maxBounces=1)
    principled = metal.node_tree.nodes["Principled BSDF"]
    principled.inputs["Base Color"].default_value = (0.1, 0.9, 0.1, 1.0)
    session.render("green")
    ball.hide_render = True
    session.render("hidden")
    bpy.data.objects.remove(ball)
    session.render("removed")


def frames(session: Session) -> None:
    """Another resolution, and a part of the picture."""
    render = session.scene.render
    render.resolution_x, render.resolution_y = 33, 17
    session.render("odd")
    render.resolution_x, render.resolution_y = RESOLUTION
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x = 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.0, 0.5
    session.render("part")


def main(engine: str, texture: str, folder: str) -> None:
    """All of it, in one process."""
    session = Session(engine, texture, folder)
    furnace(session)
    made = populate(session)
    pictures(session)
    settings(session)
    edits(session, **made)
    frames(session)


if __name__ == "__main__":
    # Blender's pxr modules, which the Blender application has on its path: OpenUSD warns of each
    # that it cannot import.
    pxr = Path("python", "lib", "python3.11", "site-packages")
    sys.path.append(os.fspath(Path(bpy.utils.resource_path("LOCAL"), pxr)))
    main(*sys.argv[1:])
