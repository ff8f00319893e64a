#version 330 core
// A live surface by material, piece or field.
#include "surface_light.glsl"
#include "finish.glsl"
uniform float roughness;
uniform int finish_of[16];         // of a material; -1: the palette
uniform isamplerBuffer materials;  // a triangle
uniform vec3 palette[16];          // linear
uniform int colouring;             // 0: material, 1: piece, 2: field
uniform vec2 field_range;

in vec3 view_position;
in vec3 view_normal;
in float field_value;
flat in int piece_number;
in vec4 rest_and_depth;
in float region_mark;
out vec4 color;

vec3 linear_of(vec3 srgb) { return pow(srgb, vec3(2.2)); }

vec3 colour_scale(float share) {
    vec3 stops[5] = vec3[5](vec3(0.19, 0.29, 0.64), vec3(0.13, 0.63, 0.71), vec3(0.45, 0.78, 0.38),
                            vec3(0.96, 0.82, 0.25), vec3(0.80, 0.15, 0.15));
    float at = 4.0 * clamp(share, 0.0, 1.0);
    int k = int(min(3.0, floor(at)));
    return linear_of(mix(stops[k], stops[k + 1], at - float(k)));
}

// Hues apart by the golden ratio.
vec3 piece_colour(int piece) {
    float hue = 6.0 * fract(0.05 + 0.61803399 * float(piece));
    vec3 wave = clamp(abs(mod(hue + vec3(0.0, 4.0, 2.0), 6.0) - 3.0) - 1.0, 0.0, 1.0);
    return linear_of(0.85 - 0.55 * (1.0 - wave));
}

Look look() {
    if (colouring == 1) return Look(piece_colour(piece_number), roughness, 0.0);
    float share = (field_value - field_range.x) / max(field_range.y - field_range.x, 1e-20);
    if (colouring == 2) return Look(colour_scale(share), roughness, 0.0);
    int material = texelFetch(materials, gl_PrimitiveID).r & 15;
    if (finish_of[material] < 0) return Look(palette[material], roughness, 0.0);
    return look_of(finish_of[material], rest_and_depth.xyz, rest_and_depth.w);
}

void main() {
    vec3 flat_normal = normalize(cross(dFdx(view_position), dFdy(view_position)));
    if (dot(flat_normal, view_position) > 0.0) flat_normal = -flat_normal;
    vec3 n = normalize(gl_FrontFacing ? view_normal : -view_normal);
    // Vertices at the rim of a cut have one normal for both faces.
    if (dot(n, flat_normal) < 0.82) n = flat_normal;
    // Behind a clip plane the inside of the surface is seen.
    Look surface = look();
    vec3 marked = hatched(surface.colour, rest_and_depth.xyz, region_mark);
    vec3 base = gl_FrontFacing ? marked : 0.35 * marked + vec3(0.02);
    color = vec4(dithered(tone(lit(view_position, n, base, surface.roughness, surface.metalness))), 1.0);
}
