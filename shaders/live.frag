#version 330 core
// A live surface. Software rasterisers go through all branches of a shader: COLOURING says what colours it (0
// material, 1 piece, 2 field, 3 label, 4 age of the label); finishes (WITH_FINISHES) and pictures
// (WITH_PICTURES) are left out where a surface has none.
#include "surface_light.glsl"
#include "finish.glsl"
uniform float roughness;
uniform int finish_of[16];         // of a material; -1: the palette
uniform isamplerBuffer materials;  // a triangle: material in the lowest 4 bits, above them a label
uniform vec3 palette[16];          // linear
uniform float opacity;
uniform float now_ms, age_range_ms;
uniform samplerBuffer corner_uv;        // a corner of a triangle
uniform usamplerBuffer corner_index;    // a corner of a triangle: its vertex
uniform samplerBuffer corner_position;  // a coordinate of a vertex, world
uniform sampler2D picture_0, picture_1, picture_2, picture_3;
uniform int picture_of[16];             // of a material; -1: none
uniform vec2 field_range;

in vec3 world_position;
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

#ifdef WITH_PICTURES
// Coordinates of the picture at the fragment (third column) and their changes by a pixel to the right and
// up: a vertex can lie on a seam, so that coordinates are those of the triangle's corners.
mat3x2 picture_coordinates(vec3 right, vec3 up) {
    vec3 p[3];
    vec2 uv[3];
    for (int k = 0; k < 3; ++k) {
        int corner = 3 * gl_PrimitiveID + k;
        int at = 3 * int(texelFetch(corner_index, corner).r);
        p[k] = vec3(texelFetch(corner_position, at).r, texelFetch(corner_position, at + 1).r,
                    texelFetch(corner_position, at + 2).r);
        uv[k] = texelFetch(corner_uv, corner).rg;
    }
    vec3 a = p[1] - p[0], b = p[2] - p[0];
    float aa = dot(a, a), ab = dot(a, b), bb = dot(b, b);
    float scale = 1.0 / max(aa * bb - ab * ab, 1e-30);
    vec2 along_a = uv[1] - uv[0], along_b = uv[2] - uv[0];
    vec3 of_a = scale * (bb * a - ab * b), of_b = scale * (aa * b - ab * a);
    vec3 here = world_position - p[0];
    return mat3x2(dot(right, of_a) * along_a + dot(right, of_b) * along_b,
                  dot(up, of_a) * along_a + dot(up, of_b) * along_b,
                  uv[0] + dot(here, of_a) * along_a + dot(here, of_b) * along_b);
}

vec3 picture_colour(int number, mat3x2 at) {
    if (number == 0) return textureGrad(picture_0, at[2], at[0], at[1]).rgb;
    if (number == 1) return textureGrad(picture_1, at[2], at[0], at[1]).rgb;
    if (number == 2) return textureGrad(picture_2, at[2], at[0], at[1]).rgb;
    return textureGrad(picture_3, at[2], at[0], at[1]).rgb;
}
#endif

Look label_look(int label) {
    vec3 colour = linear_of(vec3(0.78, 0.77, 0.74));
    if (label > 0)
#if COLOURING == 3
        colour = piece_colour(label - 1);
#else
        colour = colour_scale(1.0 - (now_ms - float(label)) / max(age_range_ms, 1.0));
#endif
    return Look(colour, roughness, 0.0);
}

Look look(vec3 right, vec3 up) {
#if COLOURING == 1
    return Look(piece_colour(piece_number), roughness, 0.0);
#elif COLOURING == 2
    float share = (field_value - field_range.x) / max(field_range.y - field_range.x, 1e-20);
    return Look(colour_scale(share), roughness, 0.0);
#elif COLOURING >= 3
    return label_look(texelFetch(materials, gl_PrimitiveID).r >> 4);
#else
    int material = texelFetch(materials, gl_PrimitiveID).r & 15;
#ifdef WITH_PICTURES
    if (picture_of[material] >= 0)
        return Look(palette[material] * picture_colour(picture_of[material], picture_coordinates(right, up)),
                    roughness, 0.0);
#endif
#ifdef WITH_FINISHES
    if (finish_of[material] >= 0)
        return look_of(finish_of[material], rest_and_depth.xyz, rest_and_depth.w);
#endif
    return Look(palette[material], roughness, 0.0);
#endif
}

#ifdef WITH_SECTION
uniform int inside;       // material of what a clip plane lays open; -1: the inner side of the surface is seen
uniform vec3 eye;         // world
uniform vec4 clip_plane;  // world
uniform mat4 view_from_world;
uniform vec3 origin;

mat3 axes_of(vec3 right, vec3 up) {
    vec3 x = normalize(right), z = normalize(cross(right, up));
    return mat3(x, cross(z, x), z);
}

// Where the ray to a back face passes the clip plane it enters the solid: the plane is seen there. Its place at
// rest follows from that of the back face by the rotation of the triangle.
bool section(out vec4 shade) {
    vec3 along = world_position - eye, normal = clip_plane.xyz;
    mat3 turned = axes_of(dFdx(world_position), dFdy(world_position));
    mat3 at_rest = axes_of(dFdx(rest_and_depth.xyz), dFdy(rest_and_depth.xyz));
    float share = (clip_plane.w - dot(normal, eye)) / dot(normal, along);
    if (gl_FrontFacing || inside < 0 || !(share > 0.0 && share < 1.0)) return false;
    vec3 at = eye + share * along;
    Look look = Look(palette[inside], roughness, 0.0);
#ifdef WITH_FINISHES
    vec3 from = at - world_position;
    if (finish_of[inside] >= 0)
        look = look_of(finish_of[inside], rest_and_depth.xyz + at_rest * (transpose(turned) * from),
                       abs(dot(from, turned[2])));
#endif
    vec3 view = (view_from_world * vec4(at - origin, 1.0)).xyz, n = mat3(view_from_world) * normal;
    if (dot(n, view) > 0.0) n = -n;
    shade = vec4(dithered(tone(lit_by(vec2(1.0), view, n, look.colour, look.roughness, look.metalness))), 1.0);
    return true;
}
#endif

void main() {
    vec3 flat_normal = normalize(cross(dFdx(view_position), dFdy(view_position)));
    if (dot(flat_normal, view_position) > 0.0) flat_normal = -flat_normal;
    vec3 n = normalize(gl_FrontFacing ? view_normal : -view_normal);
    // Vertices at the rim of a cut have one normal for both faces.
    if (dot(n, flat_normal) < 0.82) n = flat_normal;
#ifdef WITH_SECTION
    if (section(color)) return;
#endif
    // Behind a clip plane the inside of the surface is seen.
    Look surface = look(dFdx(world_position), dFdy(world_position));
    vec3 marked = hatched(surface.colour, rest_and_depth.xyz, region_mark);
    vec3 base = gl_FrontFacing ? marked : 0.35 * marked + vec3(0.02);
    color = vec4(dithered(tone(lit(view_position, n, base, surface.roughness, surface.metalness))), opacity);
}
