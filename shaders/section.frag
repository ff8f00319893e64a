#version 330 core
// Puts back faces that are seen through a clip plane into it: the solid begins there.
uniform vec3 eye;         // world
uniform vec4 clip_plane;  // world
uniform mat4 view_from_world;
uniform mat4 clip_from_view;
uniform vec3 origin;

in vec3 world_position;

void main() {
    vec3 along = world_position - eye;
    float share = (clip_plane.w - dot(clip_plane.xyz, eye)) / dot(clip_plane.xyz, along);
    if (!(share > 0.0 && share < 1.0)) discard;
    vec4 at = clip_from_view * (view_from_world * vec4(eye + share * along - origin, 1.0));
    gl_FragDepth = 0.5 + 0.5 * at.z / at.w;
}
