#version 330 core
// Edges of triangles; translucent, so that small triangles are no black area.
out vec4 color;

void main() { color = vec4(0.015, 0.02, 0.03, 0.4); }
