#version 330 core
// The ground: its own colour near the scene, the background further out, and
// darker by as much light as is kept from it.
#include "lighting.glsl"
uniform vec3 ground_color;  // linear

in vec3 view_position;
in vec3 view_normal;
in vec2 on_ground;
out vec4 color;

void main() {
    vec3 n = normalize(view_normal);
    vec2 seen = visibility_at(view_position, n);
    float near = 1.0 - smoothstep(0.25, 0.95, length(on_ground));
    vec3 key = KEY_COLOR * max(dot(n, light_in_view), 0.0);
    vec3 sky = hemisphere(n);
    // Some of the sky's part stays even in full occlusion: the ground is pale.
    vec3 kept = (key * seen.y + sky * mix(0.25, 1.0, seen.x)) / (key + sky);
    vec3 behind = background();
    color = vec4(dithered(mix(behind, ground_color, near) * mix(vec3(1.0), kept, near)), 1.0);
}
