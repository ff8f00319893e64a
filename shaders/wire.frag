#version 330 core
// Edges of triangles.
out vec4 color;

void main() { color = vec4(0.015, 0.02, 0.03, 1.0); }
