#version 330 core
// Balls of a radius, drawn as discs that face the eye.
layout(location = 0) in vec3 position;  // world
layout(location = 1) in vec3 color;     // linear

uniform mat4 view_from_world;
uniform mat4 clip_from_view;
uniform vec3 origin;
uniform vec4 clip_plane;
uniform float radius;        // m
uniform float picture_height;  // pixels

flat out vec3 ball_color;

void main() {
    vec4 view = view_from_world * vec4(position - origin, 1.0);
    gl_Position = clip_from_view * view;
    gl_PointSize = max(2.0, clip_from_view[1][1] * picture_height * radius / max(-view.z, 1e-9));
    ball_color = color;
    gl_ClipDistance[0] = clip_plane.w - dot(clip_plane.xyz, position);
}
