#version 330 core
// What the screen-space passes need to know of each pixel: where its surface
// faces and how far away it is.
in vec3 view_position;
in vec3 view_normal;
out vec4 surface;  // normal in view space, distance along the view axis

void main() {
    vec3 normal = normalize(view_normal);
    surface = vec4(gl_FrontFacing ? normal : -normal, -view_position.z);
}
