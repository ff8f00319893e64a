#version 330 core
// A line of constant width on the picture with round ends, one instance a
// segment: 12 vertices of a strip, from the tip of one end to that of the other.
layout(location = 0) in vec3 from;    // world, relative to the scene's origin
layout(location = 1) in vec3 to;
layout(location = 2) in vec3 color;   // linear
layout(location = 3) in vec2 shape;   // half width in pixels, m towards the eye

uniform mat4 view_from_world;
uniform mat4 clip_from_view;
uniform vec2 picture_size;
uniform float near_distance;

flat out vec3 line_color;

vec3 nearer(vec3 view) { return view * (1.0 - min(shape.y / length(view), 0.5)); }

void main() {
    line_color = color;
    vec3 a = nearer((view_from_world * vec4(from, 1.0)).xyz);
    vec3 b = nearer((view_from_world * vec4(to, 1.0)).xyz);
    float limit = -1.001 * near_distance;
    if (a.z > limit && b.z > limit) {
        gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
        return;
    }
    if (a.z > limit) a = mix(b, a, (limit - b.z) / (a.z - b.z));
    if (b.z > limit) b = mix(a, b, (limit - a.z) / (b.z - a.z));
    vec4 clip_a = clip_from_view * vec4(a, 1.0);
    vec4 clip_b = clip_from_view * vec4(b, 1.0);
    vec3 ndc_a = clip_a.xyz / clip_a.w;
    vec3 ndc_b = clip_b.xyz / clip_b.w;
    vec2 run = 0.5 * (ndc_b.xy - ndc_a.xy) * picture_size;
    vec2 along = length(run) > 1.0e-4 ? normalize(run) : vec2(1.0, 0.0);
    int column = gl_VertexID / 2;
    float side = (gl_VertexID & 1) == 0 ? 1.0 : -1.0;
    float quarter = column < 3 ? float(2 - column) : float(column - 3);  // 0 flank .. 2 tip
    float angle = quarter * 0.78539816;
    vec2 across = vec2(-along.y, along.x);
    vec2 offset = (column < 3 ? -1.0 : 1.0) * sin(angle) * along + side * cos(angle) * across;
    vec3 end = column < 3 ? ndc_a : ndc_b;
    gl_Position = vec4(end.xy + 2.0 * shape.x * offset / picture_size, end.z, 1.0);
}
