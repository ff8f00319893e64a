#version 330 core
// Writes the normal and the depth of each pixel for the screen-space passes.
in vec3 view_position;
in vec3 view_normal;
out vec4 surface;  // normal in view space, distance along the view axis

void main() {
    vec3 normal = normalize(view_normal);
    surface = vec4(gl_FrontFacing ? normal : -normal, -view_position.z);
}
