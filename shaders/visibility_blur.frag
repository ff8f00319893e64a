#version 330 core
// Mean of visibility.frag over its noise's period, without crossing to another
// surface: a neighbour counts as far as it lies on the pixel's own plane.
uniform sampler2D surface_map;
uniform sampler2D visibility_map;
uniform vec2 tan_half_fov;
uniform float plane_tolerance;  // m

out vec4 visibility;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    ivec2 last = textureSize(surface_map, 0) - 1;
    vec4 surface = texelFetch(surface_map, pixel, 0);
    vec2 scale = 2.0 * tan_half_fov / vec2(last + 1);
    vec2 ray = gl_FragCoord.xy * scale - tan_half_fov;
    float plane = dot(surface.xyz, vec3(ray, -1.0) * surface.w);
    vec2 own = texelFetch(visibility_map, pixel, 0).xy;
    vec3 sum = vec3(own, 1.0) * 0.01;
    for (int y = -2; y < 2; ++y) {
        for (int x = -2; x < 2; ++x) {
            ivec2 at = clamp(pixel + ivec2(x, y), ivec2(0), last);
            vec3 tap = texelFetch(visibility_map, at, 0).xyz;
            vec2 tap_ray = (vec2(at) + 0.5) * scale - tan_half_fov;
            float off = dot(surface.xyz, vec3(tap_ray, -1.0) * tap.z) - plane;
            sum += max(1.0 - abs(off) / plane_tolerance, 0.0) * vec3(tap.xy, 1.0);
        }
    }
    visibility = vec4(sum.xy / sum.z, surface.w, 1.0);
}
