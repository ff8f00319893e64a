// Looks of surfaces: colour, gloss and solid textures as functions of the rest position.
uniform samplerBuffer finishes;  // as packed_finishes.h
uniform float hatch_period;      // m, of marked regions

const int FINISH_TEXELS = 20;

struct Look {
    vec3 colour;  // linear
    float roughness;
    float metalness;
};

// Random numbers of a cell (pcg3d; Jarzynski, Olano 2020).
uvec3 random_of(uvec3 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> 16u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

vec3 unit_random(uvec3 v) { return vec3(v >> 8u) / 16777216.0; }

// Share of a pixel that balls of diameters from a half to one cover. at: in diameters; blur: half a pixel, above zero.
float speckles_at(vec3 at, float share, float blur, uint seed) {
    // The mean volume of a ball is 0.245; balls may overlap.
    float balls = -log(1.0 - min(share, 0.6)) / 0.245;
    int slots = balls > 2.0 ? 4 : balls > 1.0 ? 2 : 1;
    ivec3 first = ivec3(floor(at - 0.5));
    float cover = 0.0;
    for (int k = 0; k < 8; ++k) {
        ivec3 cell = first + ivec3(k & 1, (k >> 1) & 1, k >> 2);
        for (int slot = 0; slot < slots; ++slot) {
            uvec3 bits = random_of(uvec3(cell) + uvec3(0u, seed, uint(slot) * 977u));
            vec3 centre = vec3(cell) + unit_random(bits);
            vec3 more = unit_random(random_of(bits));
            if (more.x * float(slots) > balls) continue;
            float radius = 0.25 + 0.25 * more.y;
            cover = max(cover, 1.0 - smoothstep(radius - blur, radius + blur, distance(at, centre)));
        }
    }
    return mix(cover, share, smoothstep(0.25, 0.6, blur));
}

Look look_of(int finish, vec3 rest, float depth) {
    int base = finish * FINISH_TEXELS;
    vec4 head = texelFetch(finishes, base);
    vec4 counts = texelFetch(finishes, base + 1);
    vec4 axis = texelFetch(finishes, base + 2);
    Look look = Look(head.rgb, head.a, counts.x);
    float height = dot(axis.xyz, rest);
    float height_blur = 0.5 * fwidth(height) + 1.0e-9, depth_blur = 0.5 * fwidth(depth) + 1.0e-9;
    float width = length(fwidth(rest)) + 1.0e-9;
    for (int k = 0; k < int(counts.z); ++k) {
        vec4 stripe = texelFetch(finishes, base + 7 + k);
        look.colour = mix(look.colour, stripe.rgb, smoothstep(-height_blur, height_blur, height - stripe.a));
    }
    for (int k = int(counts.y) - 1; k >= 0; --k) {
        vec4 layer = texelFetch(finishes, base + 3 + k);
        look.colour = mix(layer.rgb, look.colour, smoothstep(-depth_blur, depth_blur, depth - layer.a));
    }
    for (int k = 0; k < int(counts.w); ++k) {
        vec4 ink = texelFetch(finishes, base + 15 + 2 * k);
        float share = texelFetch(finishes, base + 16 + 2 * k).x;
        look.colour = mix(look.colour, ink.rgb, speckles_at(rest / ink.a, share, 0.5 * width / ink.a, uint(k)));
    }
    return look;
}

// Hatches regions that are held (mark 1) or pulled (-1).
vec3 hatched(vec3 colour, vec3 rest, float mark) {
    if (abs(mark) < 0.5 || hatch_period <= 0.0) return colour;
    float at = (rest.x + rest.y + rest.z) / hatch_period;
    float blur = 0.5 * fwidth(at) + 1.0e-6;
    float line = 1.0 - smoothstep(0.16 - blur, 0.16 + blur, abs(fract(at) - 0.5));
    vec3 ink = mark > 0.0 ? vec3(0.03, 0.10, 0.32) : vec3(0.75, 0.22, 0.01);
    return mix(colour, ink, 0.8 * line);
}
