"""Writes pavilion.gltf, pavilion.bin and tile.png: a hall open at one side, with what glTF files of engines have.

One column mesh stands at five nodes, one of them mirrored and one scaled; materials use both sets of texture coordinates,
one through KHR_texture_transform; one image is a file, one a data URI; lights are a panel that emits to both sides, a point, a spot
and a sun. Run it with Python 3 in this folder; it needs nothing else, and the files are the same each time.
"""
import base64
import json
import math
import struct
import zlib


def png(width, height, pixel):
    rows = b"".join(b"\0" + b"".join(bytes(pixel(x, y)) for x in range(width)) for y in range(height))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


document = {
    "asset": {"version": "2.0", "copyright": "The luxel authors", "extras": {"made": "by make.py"}},
    "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_texture_transform"],
    "bufferViews": [], "accessors": [], "meshes": [], "nodes": [],
}
binary = b""


def accessor(values, kind, indices=False):
    global binary
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[kind]
    flat = [x for value in values for x in (value if width > 1 else [value])]
    data = struct.pack(f"<{len(flat)}{'H' if indices else 'f'}", *flat)
    document["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data),
                                    "target": 34963 if indices else 34962})
    binary += data + b"\0" * (-len(data) % 4)
    entry = {"bufferView": len(document["bufferViews"]) - 1, "componentType": 5123 if indices else 5126,
             "count": len(values), "type": kind}
    if kind == "VEC3":
        entry["min"] = [min(v[i] for v in values) for i in range(3)]
        entry["max"] = [max(v[i] for v in values) for i in range(3)]
    document["accessors"].append(entry)
    return len(document["accessors"]) - 1


def primitive(quads, material):
    """Quads (corner, side, other side), counter-clockwise from the front; set 0 in metres, set 1 each quad in its cell."""
    positions, normals, uv0, uv1, indices = [], [], [], [], []
    cells = math.ceil(math.sqrt(len(quads)))
    for number, (corner, a, b) in enumerate(quads):
        cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        length = math.hypot(*cross)
        first = len(positions)
        for s, t in [(0, 0), (1, 0), (1, 1), (0, 1)]:
            positions.append([corner[i] + s * a[i] + t * b[i] for i in range(3)])
            normals.append([x / length for x in cross])
            uv0.append([s * math.hypot(*a), t * math.hypot(*b)])
            uv1.append([(number % cells + s) / cells, (number // cells + t) / cells])
        indices += [first, first + 1, first + 2, first, first + 2, first + 3]
    return {"attributes": {"POSITION": accessor(positions, "VEC3"), "NORMAL": accessor(normals, "VEC3"),
                           "TEXCOORD_0": accessor(uv0, "VEC2"), "TEXCOORD_1": accessor(uv1, "VEC2")},
            "indices": accessor(indices, "SCALAR", True), "material": material}


def box(x, y, z, w, h, d):
    """The sides of a box, outwards, without its bottom."""
    return [((x, y, z + d), (w, 0, 0), (0, h, 0)), ((x + w, y, z), (-w, 0, 0), (0, h, 0)),
            ((x + w, y, z + d), (0, 0, -d), (0, h, 0)), ((x, y, z), (0, 0, d), (0, h, 0)),
            ((x, y + h, z + d), (w, 0, 0), (0, 0, -d))]


def mesh(name, *primitives):
    document["meshes"].append({"name": name, "primitives": list(primitives)})
    return len(document["meshes"]) - 1


def node(name, **members):
    document["nodes"].append({"name": name, **members})
    return len(document["nodes"]) - 1


TILES, PLASTER, STONE, WOOD, GLOW = range(5)
hall = mesh("hall",
            primitive([((-3, 0, 2), (6, 0, 0), (0, 0, -4))], TILES),
            primitive([((-3, 3, -2), (6, 0, 0), (0, 0, 4)), ((-3, 0, -2), (6, 0, 0), (0, 3, 0)),
                       ((-3, 0, 2), (0, 0, -4), (0, 3, 0)), ((3, 0, -2), (0, 0, 4), (0, 3, 0))], PLASTER))
column = mesh("column", primitive(box(-0.125, 0, -0.125, 0.25, 2.5, 0.25) + box(0.125, 1.75, -0.0625, 0.25, 0.125, 0.125), STONE))
bench = mesh("bench", primitive(box(-0.75, 0, -0.25, 1.5, 0.5, 0.5), WOOD))
panel = mesh("panel", primitive([((-0.5, 0, -0.25), (1, 0, 0), (0, 0, 0.5))], GLOW))

half = math.sqrt(0.5)
columns = [node("column", mesh=column, translation=[-2, 0, -1], extras={"kept": True}),
           node("column", mesh=column, translation=[2, 0, -1], scale=[-1, 1, 1]),
           node("column", mesh=column, translation=[-2, 0, 1], rotation=[0, half, 0, half]),
           node("column", mesh=column, translation=[2, 0, 1], rotation=[0, -half, 0, half])]
roots = [node("hall", mesh=hall),
         node("columns", children=columns),
         node("stub", mesh=column, matrix=[1, 0, 0, 0, 0, 0.25, 0, 0, 0, 0, 1, 0, 0.5, 0, 1.25, 1]),
         node("bench", mesh=bench, translation=[0, 0, -1]),
         node("panel", mesh=panel, translation=[0, 2.75, 0]),
         node("bulb", translation=[-1.5, 2.25, 0], extensions={"KHR_lights_punctual": {"light": 0}}),
         node("spot", translation=[1.5, 2.75, 0], rotation=[-half, 0, 0, half], extensions={"KHR_lights_punctual": {"light": 1}}),
         node("sun", rotation=[-0.5, 0, 0, math.sqrt(0.75)], extensions={"KHR_lights_punctual": {"light": 2}}),
         node("main", camera=0, translation=[0, 1.5, 5])]

checks = base64.b64encode(png(4, 4, lambda x, y: (190, 140, 90) if x % 2 else (150, 100, 60))).decode()
grey = lambda r, g, b: {"baseColorFactor": [r, g, b, 1], "metallicFactor": 0}
document.update({
    "scene": 0, "scenes": [{"name": "pavilion", "nodes": roots}],
    "buffers": [{"uri": "pavilion.bin", "byteLength": len(binary)}],
    "images": [{"uri": "tile.png"}, {"name": "grain", "uri": "data:image/png;base64," + checks}],
    "samplers": [{"wrapS": 10497, "wrapT": 10497}],
    "textures": [{"sampler": 0, "source": 0}, {"sampler": 0, "source": 1}],
    "materials": [
        {"name": "tiles", "pbrMetallicRoughness": {**grey(0.9, 0.9, 0.9), "baseColorTexture": {"index": 0}}},
        {"name": "plaster", "pbrMetallicRoughness": grey(0.75, 0.75, 0.7), "occlusionTexture": {"index": 1, "texCoord": 1}},
        {"name": "stone", "pbrMetallicRoughness": grey(0.5, 0.45, 0.4)},
        {"name": "wood", "pbrMetallicRoughness": {**grey(0.8, 0.8, 0.8), "baseColorTexture": {
            "index": 1, "texCoord": 0, "extensions": {"KHR_texture_transform": {"texCoord": 1, "scale": [2, 2]}}}}},
        {"name": "glow", "pbrMetallicRoughness": grey(0, 0, 0), "emissiveFactor": [1, 0.9, 0.75], "doubleSided": True,
         "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2000}}}],
    "cameras": [{"name": "main", "type": "perspective", "perspective": {"yfov": 0.8, "aspectRatio": 1.5, "znear": 0.01}}],
    "extensions": {"KHR_lights_punctual": {"lights": [
        {"name": "bulb", "type": "point", "color": [1, 0.9, 0.8], "intensity": 60},
        {"name": "spot", "type": "spot", "intensity": 400, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.6}},
        {"name": "sun", "type": "directional", "intensity": 5000}]}},
})
open("pavilion.gltf", "w").write(json.dumps(document, indent=1, sort_keys=True) + "\n")
open("pavilion.bin", "wb").write(binary)
open("tile.png", "wb").write(png(8, 8, lambda x, y: (200, 200, 195) if (x // 4 + y // 4) % 2 else (120, 60, 50)))
