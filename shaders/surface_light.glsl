// A matt surface with a soft gloss.
#include "lighting.glsl"
uniform float roughness;

// Microfacet gloss (Walter et al. 2007, GGX) with the visibility term of
// Lazarov 2011 and Schlick's Fresnel term for a skin-like 4 % at normal incidence.
float gloss(vec3 n, vec3 v, vec3 l) {
    vec3 h = normalize(v + l);
    float nh = max(dot(n, h), 0.0), lh = max(dot(l, h), 0.0);
    float a2 = roughness * roughness * roughness * roughness;
    float d = nh * nh * (a2 - 1.0) + 1.0;
    float fresnel = 0.04 + 0.96 * pow(1.0 - lh, 5.0);
    return fresnel * a2 / (4.0 * d * d * max(lh * lh, 0.1) * (roughness + 0.5));
}

// Light from a point of this colour towards the eye; n: unit, towards the viewer.
vec3 lit(vec3 position, vec3 n, vec3 albedo) {
    vec3 v = normalize(-position);
    vec2 seen = visibility_at(position, n);
    float facing = max(dot(n, light_in_view), 0.0);
    vec3 fill_direction = normalize(vec3(0.75, 0.15, 0.65));
    float fill = 0.5 + 0.5 * dot(n, fill_direction);
    vec3 ambient = (hemisphere(n) + fill * fill * FILL_COLOR) * bounced(seen.x, albedo);
    vec3 key = KEY_COLOR * facing * seen.y * mix(1.0, seen.x, 0.25);
    float rim = pow(1.0 - max(dot(n, v), 0.0), 4.0);
    return albedo * (ambient + key) + KEY_COLOR * facing * seen.y * gloss(n, v, light_in_view) +
           SKY_COLOR * seen.x * 0.22 * rim * (1.0 - 0.6 * roughness);
}
