#version 330 core
// Computes the visible share of the sky and of the key light per pixel, with noise of a 4 x 4
// period that visibility_blur.frag averages out.
// Sky: scalable ambient obscurance (McGuire, Mara, Luebke 2012, section 2).
// Light: percentage-closer soft shadows (Fernando 2005) from a parallel light,
// with the receiver's plane followed across the filter.
uniform sampler2D surface_map;   // surface.frag
uniform sampler2D shadow_map;    // depth in 0..1
uniform mat4 light_from_view;    // to 0..1 on all axes
uniform vec3 light_in_view;      // unit, towards the light
uniform vec2 tan_half_fov;       // of the view, horizontal and vertical
uniform float ao_radius;         // m; 0 switches the sky's part off
uniform float shadow_extent;     // m, side of the shadow map; 0 switches the shadow off
uniform float shadow_depth;      // m, depth range of the shadow map
uniform float shadow_bias;       // m
uniform float light_softness;    // penumbra's half width per distance to the blocker
uniform float search_radius;     // m, the widest penumbra's half width

out vec4 visibility;  // sky, light, distance along the view axis, 1

const float PI = 3.14159265;
const int AO_TAPS = 12;
const int SEARCH_TAPS = 8;
const int SHADOW_TAPS = 14;
const float GOLDEN_ANGLE = 2.39996323;

vec3 view_point(vec2 pixel, float distance_) {
    vec2 ndc = 2.0 * pixel / vec2(textureSize(surface_map, 0)) - 1.0;
    return vec3(ndc * tan_half_fov * distance_, -distance_);
}

float noise(ivec2 pixel) {
    // Bayer's 4 x 4 order: neighbours differ much, 16 of them cover all turns.
    int x = pixel.x & 3, y = pixel.y & 3, q = x ^ y;
    int rank = ((q & 1) << 3) | ((y & 1) << 2) | (q & 2) | ((y & 2) >> 1);
    return (float(rank) + 0.5) / 16.0;
}

float sky_visibility(vec3 point, vec3 normal, float turn) {
    ivec2 last = textureSize(surface_map, 0) - 1;
    float pixels = 0.5 * float(last.y + 1) * ao_radius / (tan_half_fov.y * -point.z);
    pixels = min(pixels, 0.5 * float(last.y + 1));
    float radius2 = ao_radius * ao_radius;
    float bias = 0.015 * ao_radius;
    float sum = 0.0;
    for (int i = 0; i < AO_TAPS; ++i) {
        float alpha = (float(i) + turn) / float(AO_TAPS);
        float angle = float(i) * GOLDEN_ANGLE + turn * 2.0 * PI;
        // Denser towards the pixel, where thin slits are.
        vec2 at = gl_FragCoord.xy + max(alpha * sqrt(alpha) * pixels, 1.0) * vec2(cos(angle), sin(angle));
        ivec2 texel = clamp(ivec2(at), ivec2(0), last);
        float distance_ = texelFetch(surface_map, texel, 0).w;
        vec3 v = view_point(vec2(texel) + 0.5, distance_) - point;
        float vv = dot(v, v);
        float f = max(radius2 - vv, 0.0) / radius2;
        sum += f * f * f * max((dot(v, normal) - bias) / (vv + 0.0002 * radius2), 0.0);
    }
    return clamp(1.0 - 2.4 * ao_radius * sum / float(AO_TAPS), 0.0, 1.0);
}

float light_visibility(vec3 point, vec3 normal, float turn) {
    float facing = dot(normal, light_in_view);
    if (facing <= 0.0) return 0.0;
    vec3 receiver = (light_from_view * vec4(point + normal * shadow_bias, 1.0)).xyz;
    vec3 n = mat3(light_from_view) * normal * vec3(shadow_extent, shadow_extent, shadow_depth);
    // Depth (0..1) a shadow map unit along x and y, on the receiver's plane.
    vec2 slope = clamp(-n.xy / min(n.z, -0.15), -6.0, 6.0) * shadow_extent / shadow_depth;
    float bias = shadow_bias / shadow_depth;
    float spread = search_radius / shadow_extent;
    float blocker_sum = 0.0;
    float blocker_count = 0.0;
    for (int i = 0; i < SEARCH_TAPS; ++i) {
        float angle = float(i) * GOLDEN_ANGLE + turn * 2.0 * PI;
        vec2 offset = spread * sqrt((float(i) + turn) / float(SEARCH_TAPS)) * vec2(cos(angle), sin(angle));
        float depth = texture(shadow_map, receiver.xy + offset).r;
        float blocks = step(depth + bias, receiver.z + dot(slope, offset)) * step(depth, 0.99999);
        blocker_sum += blocks * depth;
        blocker_count += blocks;
    }
    float gap = blocker_count > 0.0 ? receiver.z - blocker_sum / blocker_count : 0.0;
    float texel = 1.0 / float(textureSize(shadow_map, 0).x);
    float width = clamp(light_softness * gap * shadow_depth / shadow_extent, 1.5 * texel, spread);
    float lit = 0.0;
    for (int i = 0; i < SHADOW_TAPS; ++i) {
        float angle = float(i) * GOLDEN_ANGLE + turn * 2.0 * PI;
        vec2 offset = width * sqrt((float(i) + turn) / float(SHADOW_TAPS)) * vec2(cos(angle), sin(angle));
        float depth = texture(shadow_map, receiver.xy + offset).r;
        lit += 1.0 - step(depth + bias, receiver.z + dot(slope, offset)) * step(depth, 0.99999);
    }
    return lit / float(SHADOW_TAPS);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 surface = texelFetch(surface_map, pixel, 0);
    vec3 point = view_point(gl_FragCoord.xy, surface.w);
    float turn = noise(pixel);
    float sky = ao_radius > 0.0 ? sky_visibility(point, surface.xyz, turn) : 1.0;
    float light = shadow_extent > 0.0 ? light_visibility(point, surface.xyz, turn) : 1.0;
    visibility = vec4(sky, light, surface.w, 1.0);
}
