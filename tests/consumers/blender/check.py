"""Proves that Blender shows a bake as luxel means it: see README.md."""

import json
import os
import pathlib
import runpy
import subprocess
import sys
import tempfile

import bpy

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
LUXEL = os.environ.get("LUXEL", str(ROOT / "target/release/luxel"))

# Bounds of the formats (luxel's `lightmap/encoding.rs`), of a texel's largest channel.
BOUNDS = {"exr": 2**-24, "hdr": 2**-8, "rgbm": 1 / 255}


def bake(scene, form, folder):
    file = ROOT / "scenes/data" / scene / f"{scene}.toml"
    arguments = ["bake", file, "-o", folder, "--for", "blender", "--format", form, "--size", "128", "--error", "5%", "-q"]
    subprocess.run([LUXEL, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)
    return json.loads((folder / "manifest.json").read_text())


def load(folder):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    sys.argv = ["blender", "--", str(folder)]
    runpy.run_path(str(folder / "blender.py"))
    return [thing for thing in bpy.data.objects if thing.type == "MESH"]


def check_coordinates(thing):
    said = thing["luxel_lightmap"]
    layer = thing.data.uv_layers[said["texCoord"]]
    low, high = said["rect"]["min"], said["rect"]["max"]
    for corner in layer.data:
        # Blender counts v from the last row.
        place = (corner.uv[0], 1 - corner.uv[1])
        for axis in range(2):
            assert low[axis] - 1e-5 <= place[axis] <= high[axis] + 1e-5, (thing.name, place)
    return layer.name, said


def source(socket):
    assert socket.links, f"{socket.node.name}: nothing at {socket.name}"
    return socket.links[0].from_node


def check_material(material, layer, said, encoding):
    output = next(node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL")
    both = source(output.inputs["Surface"])
    assert both.type == "ADD_SHADER"
    lit = source(source(both.inputs[0]).inputs["Color"])
    assert lit.type == "MIX" and lit.blend_type == "MULTIPLY"
    light = source(lit.inputs["A"])
    if encoding["format"] == "rgbm":
        assert light.type == "VECT_MATH" and light.operation == "SCALE"
        light = source(light.inputs["Vector"])
    assert light.type == "TEX_IMAGE"
    assert pathlib.Path(light.image.filepath).name == said["file"]
    assert source(light.inputs["Vector"]).uv_map == layer


def render(width, height):
    """Pixels of what the camera sees, linear, rows from the last."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 16
    scene.cycles.use_denoising = False
    # Surfaces are emissions: nothing is to be reflected.
    scene.cycles.max_bounces = 0
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(pathlib.Path(folder) / "seen.exr")
        bpy.ops.render.render(write_still=True)
        return pixels(scene.render.filepath)


def pixels(path):
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Linear Rec.709"
    values = list(image.pixels)
    bpy.data.images.remove(image)
    return [values[i : i + 3] for i in range(0, len(values), 4)]


def check_furnace(meshes, form):
    """Every pixel is ρ · 2 and what the surface sends out itself, all of one material."""
    material = meshes[0].material_slots[0].material
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    albedo = shader.inputs["Base Color"].default_value
    strength = shader.inputs["Emission Strength"].default_value
    glow = [strength * channel for channel in shader.inputs["Emission Color"].default_value]
    bpy.context.scene.camera = bpy.data.objects.new("eye", bpy.data.cameras.new("eye"))
    bpy.context.collection.objects.link(bpy.context.scene.camera)
    corners = [thing.matrix_world @ vertex.co for thing in meshes for vertex in thing.data.vertices]
    middle = [sum(corner[axis] for corner in corners) / len(corners) for axis in range(3)]
    bpy.context.scene.camera.location = middle
    bpy.context.scene.camera.data.clip_start = 1e-3
    bound = 1e-3 + BOUNDS[form]
    for pixel in render(16, 16):
        for channel in range(3):
            expected = albedo[channel] * 2 + glow[channel]
            assert abs(pixel[channel] / expected - 1) <= bound, (pixel, expected)


def main():
    for scene, form in [("furnace", "exr"), ("furnace", "hdr"), ("furnace", "rgbm"), ("cornell", "exr"), ("cornell", "rgbm")]:
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name) / "baked"
            manifest = bake(scene, form, folder)
            meshes = load(folder)
            assert len(meshes) == len(manifest["objects"]), [thing.name for thing in meshes]
            for thing in meshes:
                layer, said = check_coordinates(thing)
                encoding = manifest["lightmap"]["pages"][said["page"]]["encoding"]
                for slot in thing.material_slots:
                    check_material(slot.material, layer, said, encoding)
            if scene == "furnace":
                check_furnace(meshes, form)
            print(f"{scene} as {form}: {len(meshes)} meshes are as stated, Blender {bpy.app.version_string}")


main()
