#version 330 core
// Vertices of a live surface, for all passes.
layout(location = 0) in vec3 position;  // world
layout(location = 1) in vec3 normal;    // world, unit
layout(location = 2) in float field;
layout(location = 3) in int piece;
layout(location = 4) in vec4 rest;      // m, rest space; depth below the uncut surface, m
layout(location = 5) in float mark;

uniform mat4 view_from_world;  // world: relative to the scene's origin
uniform mat4 clip_from_view;
uniform vec3 origin;
uniform vec4 clip_plane;       // world; what is behind it is hidden

out vec3 world_position;
out vec3 view_position;
out vec3 view_normal;
out float field_value;
flat out int piece_number;
out vec4 rest_and_depth;
out float region_mark;

void main() {
    vec4 view = view_from_world * vec4(position - origin, 1.0);
    world_position = position;
    view_position = view.xyz;
    view_normal = mat3(view_from_world) * normal;
    field_value = field;
    piece_number = piece;
    rest_and_depth = rest;
    region_mark = mark;
    gl_Position = clip_from_view * view;
    gl_ClipDistance[0] = clip_plane.w - dot(clip_plane.xyz, position);
}
