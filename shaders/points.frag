#version 330 core
flat in vec3 ball_color;
out vec4 color;

void main() {
    vec2 at = 2.0 * gl_PointCoord - 1.0;
    float square = dot(at, at);
    if (square > 1.0) discard;
    float facing = sqrt(1.0 - square);
    color = vec4(ball_color * (0.45 + 0.55 * facing * (0.75 - 0.35 * at.y - 0.2 * at.x)), 1.0);
}
