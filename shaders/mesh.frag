#version 330 core
#include "surface_light.glsl"
#include "finish.glsl"
uniform float roughness;
uniform int finish;  // -1: the vertices' colours
uniform int has_picture;
uniform sampler2D picture_map;  // sRGB

in vec3 view_position;
in vec3 view_normal;
flat in vec3 albedo;
in vec4 rest_and_depth;
in vec3 uv_and_mark;
out vec4 color;

void main() {
    vec3 n = normalize(gl_FrontFacing ? view_normal : -view_normal);
    Look look = Look(albedo, roughness, 0.0);
    if (finish >= 0) look = look_of(finish, rest_and_depth.xyz, rest_and_depth.w);
    if (has_picture != 0) look.colour *= texture(picture_map, uv_and_mark.xy).rgb;
    look.colour = hatched(look.colour, rest_and_depth.xyz, uv_and_mark.z);
    color = vec4(dithered(tone(lit(view_position, n, look.colour, look.roughness, look.metalness))), 1.0);
}
