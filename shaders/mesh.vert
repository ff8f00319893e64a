#version 330 core
// Triangles with a normal and a colour at each corner, for all passes.
layout(location = 0) in vec3 position;  // world, relative to the scene's origin
layout(location = 1) in vec3 normal;    // world, unit
layout(location = 2) in vec3 color;     // linear
layout(location = 3) in vec4 rest;      // m, rest space; depth below the uncut surface, m
layout(location = 4) in vec3 extra;     // texture coordinates; mark

uniform mat4 view_from_world;
uniform mat4 clip_from_view;

out vec3 view_position;
out vec3 view_normal;
flat out vec3 albedo;
out vec4 rest_and_depth;
out vec3 uv_and_mark;

void main() {
    vec4 view = view_from_world * vec4(position, 1.0);
    view_position = view.xyz;
    view_normal = mat3(view_from_world) * normal;
    albedo = color;
    rest_and_depth = rest;
    uv_and_mark = extra;
    gl_Position = clip_from_view * view;
}
