#version 330 core
// A corner in a pair's local coordinates, seen from the first phyxel (instance 0)
// or the second, at depth 2 of the first.
layout(location = 0) in vec3 corner;  // disk radii
uniform vec2 depth_map;               // clip z from depth
void main() {
    float depth = gl_InstanceID == 0 ? corner.z : 2.0 - corner.z;
    gl_Position = vec4(corner.xy, depth_map.x * depth + depth_map.y, depth);
}
