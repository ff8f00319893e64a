#version 330 core
#include "lighting.glsl"
out vec4 color;

void main() { color = vec4(dithered(background()), 1.0); }
