# Shows a scene with the lightmaps that luxel baked for Godot 4: texels hold E/π.
#
# Import scene.glb and the maps (as Texture2D, lossless, no mipmaps), attach this script to the imported scene's root.
# The maps hold all light: leave lights and environment out.
extends Node3D

const SHADER := "
shader_type spatial;
render_mode unshaded;
uniform sampler2D map : filter_linear, repeat_disable;
uniform sampler2D albedo_map : source_color, hint_default_white;
uniform vec4 albedo : source_color;
uniform float scale = 1.0;
void fragment() {
	vec4 texel = texture(map, UV2);
	vec3 light = texel.rgb * {multiplier};
	ALBEDO = albedo.rgb * texture(albedo_map, UV).rgb * light * EXPOSURE_FACTOR;
}"

## `exposure` of manifest.json.
@export var exposure := {exposure}

## `encoding.scale` of each page.
const SCALES: Array[float] = [{scales}]

func _ready() -> void:
	var shader := Shader.new()
	shader.code = SHADER.replace("EXPOSURE_FACTOR", str(exposure))
	_visit(self, shader, null)

func _visit(node: Node, shader: Shader, said) -> void:
	var extras = node.get_meta("extras", {})
	if extras.has("luxel_lightmap"):
		said = extras["luxel_lightmap"]
	if node is MeshInstance3D and said != null:
		for surface in node.mesh.get_surface_count():
			var old = node.mesh.surface_get_material(surface)
			var material := ShaderMaterial.new()
			material.shader = shader
			material.set_shader_parameter("map", load("res://baked/" + said["file"]))
			material.set_shader_parameter("scale", SCALES[int(said["page"])])
			if old is BaseMaterial3D:
				material.set_shader_parameter("albedo", old.albedo_color)
				if old.albedo_texture != null:
					material.set_shader_parameter("albedo_map", old.albedo_texture)
			node.set_surface_override_material(surface, material)
	for child in node.get_children():
		_visit(child, shader, said)
