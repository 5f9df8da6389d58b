# Shows a scene with the lightmaps that luxel baked for Blender: texels hold E/π.
#
#   blender --python blender.py -- /path/to/baked
#
# Every material becomes an emission of albedo · texel and of what it emits itself; lights are hidden. Made for Blender 4.2 and 5.0.
import json
import pathlib
import sys

import bpy

folder = pathlib.Path(sys.argv[sys.argv.index("--") + 1])
manifest = json.loads((folder / "manifest.json").read_text())
bpy.ops.import_scene.gltf(filepath=str(folder / "scene.glb"))
encodings = [page["encoding"] for page in manifest["lightmap"]["pages"]]
pages = [bpy.data.images.load(str(folder / page["file"])) for page in manifest["lightmap"]["pages"]]
for image, encoding in zip(pages, encodings):
    is_rgbm = encoding["format"] == "rgbm"
    image.colorspace_settings.name = "Non-Color" if is_rgbm else "Linear Rec.709"
    image.alpha_mode = "CHANNEL_PACKED" if is_rgbm else "NONE"

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
        light = texture.outputs["Color"]
        encoding = encodings[said["page"]]
        if encoding["format"] == "rgbm":
            # texel = rgb * a * scale
            multiplier = nodes.new("ShaderNodeMath")
            multiplier.operation = "MULTIPLY"
            multiplier.inputs[1].default_value = encoding["scale"]
            decoded = nodes.new("ShaderNodeVectorMath")
            decoded.operation = "SCALE"
            link(texture.outputs["Alpha"], multiplier.inputs[0])
            link(light, decoded.inputs["Vector"])
            link(multiplier.outputs["Value"], decoded.inputs["Scale"])
            light = decoded.outputs["Vector"]
        lit = nodes.new("ShaderNodeMix")
        lit.data_type, lit.blend_type = "RGBA", "MULTIPLY"
        lit.inputs["Factor"].default_value = 1.0
        emission = nodes.new("ShaderNodeEmission")
        link(uv.outputs["UV"], texture.inputs["Vector"])
        link(light, lit.inputs["A"])
        if base.links:
            link(base.links[0].from_socket, lit.inputs["B"])
        else:
            lit.inputs["B"].default_value = base.default_value
        link(lit.outputs["Result"], emission.inputs["Color"])
        # What lamps send out themselves.
        own = nodes.new("ShaderNodeEmission")
        own.inputs["Strength"].default_value = shader.inputs["Emission Strength"].default_value
        glow = shader.inputs["Emission Color"]
        if glow.links:
            link(glow.links[0].from_socket, own.inputs["Color"])
        else:
            own.inputs["Color"].default_value = glow.default_value
        both = nodes.new("ShaderNodeAddShader")
        link(emission.outputs["Emission"], both.inputs[0])
        link(own.outputs["Emission"], both.inputs[1])
        output = next(n for n in nodes if n.type == "OUTPUT_MATERIAL")
        link(both.outputs["Shader"], output.inputs["Surface"])
