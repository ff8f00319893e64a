#version 330 core
// Passes the texels of a tile whose centres lie outside the disk.
uniform float tile_size;  // texels
void main() {
    vec2 texel = mod(floor(gl_FragCoord.xy), tile_size);
    vec2 centre = (2.0 * texel + 1.0) / tile_size - 1.0;
    if (dot(centre, centre) <= 1.0) discard;
}
