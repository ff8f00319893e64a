#version 330 core
#include "surface_light.glsl"

in vec3 view_position;
in vec3 view_normal;
flat in vec3 albedo;
out vec4 color;

void main() {
    vec3 n = normalize(gl_FrontFacing ? view_normal : -view_normal);
    color = vec4(dithered(tone(lit(view_position, n, albedo))), 1.0);
}
