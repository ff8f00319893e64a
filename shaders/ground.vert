#version 330 core
// A square of the ground.
uniform vec3 ground_center;  // world, relative to the scene's origin
uniform vec3 ground_u;       // world, half a side
uniform vec3 ground_v;
uniform mat4 view_from_world;
uniform mat4 clip_from_view;

out vec3 view_position;
out vec3 view_normal;
out vec2 on_ground;  // -1..1

void main() {
    on_ground = vec2((gl_VertexID & 1) == 0 ? -1.0 : 1.0, gl_VertexID < 2 ? -1.0 : 1.0);
    vec3 position = ground_center + on_ground.x * ground_u + on_ground.y * ground_v;
    vec4 view = view_from_world * vec4(position, 1.0);
    view_position = view.xyz;
    view_normal = mat3(view_from_world) * normalize(cross(ground_u, ground_v));
    gl_Position = clip_from_view * view;
}
