// A matt surface with a soft gloss.
#include "lighting.glsl"

// Microfacet gloss (Walter et al. 2007, GGX) with the visibility term of
// Lazarov 2011 and Schlick's Fresnel term. head_on: reflectance at normal incidence.
vec3 gloss(vec3 n, vec3 v, vec3 l, vec3 head_on, float roughness) {
    vec3 h = normalize(v + l);
    float nh = max(dot(n, h), 0.0), lh = max(dot(l, h), 0.0);
    float a2 = roughness * roughness * roughness * roughness;
    float d = nh * nh * (a2 - 1.0) + 1.0;
    float away = (1.0 - lh) * (1.0 - lh);
    vec3 fresnel = head_on + (1.0 - head_on) * away * away * (1.0 - lh);
    return fresnel * a2 / (4.0 * d * d * max(lh * lh, 0.1) * (roughness + 0.5));
}

// A bright sky over a grey floor, as a surface of that roughness mirrors it.
vec3 mirrored(vec3 direction, float roughness) {
    float up = dot(direction, up_in_view);
    float soft = 0.12 + 0.8 * roughness;
    vec3 floor_light = 0.42 * background_color, sky_light = 0.95 * background_color;
    float lamp = pow(max(dot(direction, light_in_view), 0.0), mix(60.0, 4.0, roughness));
    return mix(floor_light, sky_light, smoothstep(-soft, soft, up)) + 0.5 * lamp * KEY_COLOR;
}

// Light from a point of this colour towards the eye; n: unit, towards the viewer; seen: shares of sky and key
// light. Skin-like surfaces reflect 4 % at normal incidence, metals their colour.
vec3 lit_by(vec2 seen, vec3 position, vec3 n, vec3 albedo, float roughness, float metalness) {
    vec3 v = normalize(-position);
    float facing = max(dot(n, light_in_view), 0.0);
    vec3 fill_direction = normalize(vec3(0.75, 0.15, 0.65));
    float fill = 0.5 + 0.5 * dot(n, fill_direction);
    vec3 ambient = (hemisphere(n) + fill * fill * FILL_COLOR) * bounced(seen.x, albedo);
    vec3 key = KEY_COLOR * facing * seen.y * mix(1.0, seen.x, 0.25);
    float slant = (1.0 - max(dot(n, v), 0.0)) * (1.0 - max(dot(n, v), 0.0)), grazing = slant * slant;
    vec3 light = (1.0 - metalness) * albedo * (ambient + key) +
                 KEY_COLOR * facing * seen.y *
                     gloss(n, v, light_in_view, mix(vec3(0.04), albedo, metalness), roughness) +
                 (1.0 - metalness) * SKY_COLOR * seen.x * 0.22 * grazing * (1.0 - 0.6 * roughness);
#ifdef MATT
    return light;
#else
    // Only what is smooth or metal shows its surroundings.
    float wet = (1.0 - metalness) * max(0.0, 1.0 - roughness / 0.3) * (0.06 + 0.6 * grazing);
    if (metalness + wet <= 0.0) return light;
    vec3 around = mirrored(reflect(-v, n), roughness) * mix(1.0, seen.x, 0.6);
    return light + (metalness * albedo + wet) * around;
#endif
}

vec3 lit(vec3 position, vec3 n, vec3 albedo, float roughness, float metalness) {
    return lit_by(visibility_at(position, n), position, n, albedo, roughness, metalness);
}
