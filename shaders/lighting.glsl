// Light at a point, shared by the meshes and the ground. View space throughout.
uniform sampler2D visibility_map;  // visibility_blur.frag, half the picture's size
uniform vec3 light_in_view;        // unit, towards the key light
uniform vec3 up_in_view;           // unit, towards the sky
uniform vec3 background_color;     // linear
uniform vec2 picture_size;         // pixels
uniform float plane_tolerance;     // m
uniform vec2 tan_half_fov;

const vec3 KEY_COLOR = vec3(1.00, 0.955, 0.89) * 1.04;
const vec3 FILL_COLOR = vec3(0.80, 0.90, 1.00) * 0.16;
const vec3 SKY_COLOR = vec3(0.93, 0.97, 1.00) * 0.42;
const vec3 BOUNCE_COLOR = vec3(1.00, 0.97, 0.94) * 0.20;

#ifdef ALL_LIT
// Nothing keeps light from anything.
vec2 visibility_at(vec3 point, vec3 normal) { return vec2(1.0); }
#else
// Sky and light seen from a point, from the four half-size pixels around that
// lie on its plane.
vec2 visibility_at(vec3 point, vec3 normal) {
    ivec2 last = textureSize(visibility_map, 0) - 1;
    vec2 at = gl_FragCoord.xy * vec2(last + 1) / picture_size - 0.5;
    ivec2 base = ivec2(floor(at));
    vec2 blend = at - vec2(base);
    vec2 scale = 2.0 * tan_half_fov / vec2(last + 1);
    float plane = dot(normal, point);
    vec3 sum = vec3(0.0);
    vec3 nearest = vec3(1.0, 1.0, 1.0e30);
    for (int i = 0; i < 4; ++i) {
        ivec2 corner = ivec2(i & 1, i >> 1);
        ivec2 texel = clamp(base + corner, ivec2(0), last);
        vec3 tap = texelFetch(visibility_map, texel, 0).xyz;
        vec2 ray = (vec2(texel) + 0.5) * scale - tan_half_fov;
        float off = abs(dot(normal, vec3(ray, -1.0) * tap.z) - plane);
        vec2 share = mix(1.0 - blend, blend, vec2(corner));
        sum += share.x * share.y * max(1.0 - off / plane_tolerance, 0.0) * vec3(tap.xy, 1.0);
        if (off < nearest.z) nearest = vec3(tap.xy, off);
    }
    return sum.z > 0.02 ? sum.xy / sum.z : nearest.xy;
}
#endif

vec3 hemisphere(vec3 normal) {
    return mix(BOUNCE_COLOR, SKY_COLOR, 0.5 + 0.5 * dot(normal, up_in_view));
}

// Occlusion seen through light bounced between surfaces of this colour
// (Jimenez, Wu, Pesce, Jarabo 2016, eq. 12).
vec3 bounced(float sky, vec3 albedo) {
    vec3 a = 2.0404 * albedo - 0.3324;
    vec3 b = -4.7951 * albedo + 0.6417;
    vec3 c = 2.7552 * albedo + 0.6903;
    return max(vec3(sky), ((sky * a + b) * sky + c) * sky);
}

// Straight up to 0.7, then bent so as to end below 1.
vec3 tone(vec3 light) {
    vec3 over = max(light - 0.7, 0.0);
    return min(light, 0.7) + 0.3 * (1.0 - exp(-over / 0.3));
}

vec3 background() {
    vec2 at = gl_FragCoord.xy / picture_size - vec2(0.5, 0.55);
    return background_color * (1.0 - 0.22 * dot(at, at));
}

// Half a step of the 8-bit output, so that soft gradients show no bands.
vec3 dithered(vec3 color) {
    float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)))) - 0.5;
    return color * (1.0 + noise * 0.006);
}
