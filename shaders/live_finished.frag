#version 330 core
#define WITH_FINISHES
#include "live_colours.glsl"
