#version 330 core
// Only the stencil buffer is written.
void main() {}
