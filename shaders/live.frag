#version 330 core
#include "live_colours.glsl"
