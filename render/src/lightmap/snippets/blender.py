# Shows a scene with the lightmaps that luxel baked for Blender: texels hold E/π.
#
#   blender --python blender.py -- /path/to/baked
#
# Every material becomes an emission of albedo · texel; lights are hidden.
import json
import pathlib
import sys

import bpy

folder = pathlib.Path(sys.argv[sys.argv.index("--") + 1])
manifest = json.loads((folder / "manifest.json").read_text())
bpy.ops.import_scene.gltf(filepath=str(folder / "scene.glb"))
pages = [bpy.data.images.load(str(folder / page["file"])) for page in manifest["lightmap"]["pages"]]
for image in pages:
    image.colorspace_settings.name = "Linear Rec.709"

for thing in bpy.data.objects:
    if thing.type == "LIGHT":
        thing.hide_render = True
    said = thing.get("luxel_lightmap")
    if thing.type != "MESH" or said is None:
        continue
    for slot in thing.material_slots:
        slot.material = slot.material.copy()
        tree = slot.material.node_tree
        nodes, link = tree.nodes, tree.links.new
        shader = next(n for n in nodes if n.type == "BSDF_PRINCIPLED")
        base = shader.inputs["Base Color"]
        uv = nodes.new("ShaderNodeUVMap")
        uv.uv_map = thing.data.uv_layers[said["texCoord"]].name
        texture = nodes.new("ShaderNodeTexImage")
        texture.image = pages[said["page"]]
        texture.extension = "EXTEND"
        lit = nodes.new("ShaderNodeMix")
        lit.data_type, lit.blend_type = "RGBA", "MULTIPLY"
        lit.inputs["Factor"].default_value = 1.0
        emission = nodes.new("ShaderNodeEmission")
        link(uv.outputs["UV"], texture.inputs["Vector"])
        link(texture.outputs["Color"], lit.inputs["A"])
        if base.links:
            link(base.links[0].from_socket, lit.inputs["B"])
        else:
            lit.inputs["B"].default_value = base.default_value
        link(lit.outputs["Result"], emission.inputs["Color"])
        output = next(n for n in nodes if n.type == "OUTPUT_MATERIAL")
        link(emission.outputs["Emission"], output.inputs["Surface"])
