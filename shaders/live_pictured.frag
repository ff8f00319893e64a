#version 330 core
#define WITH_FINISHES
#define WITH_PICTURES
#include "live_colours.glsl"
