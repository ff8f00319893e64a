#include <splitcubes/scene/scaled_tool.h>

namespace splitcubes::scene {

namespace {

void scale(PolylineBlade& blade, double factor) {
    for (Vec3& point : blade.points) point *= factor;
}
void scale(StraightBlade& blade, double factor) {
    blade.from *= factor;
    blade.to *= factor;
}
void scale(ArcBlade& blade, double factor) {
    blade.center *= factor;
    blade.radius *= factor;
}
void scale(KeyframeMotion& motion, double factor) {
    for (MotionKeyframe& key : motion.keyframes) key.position *= factor;
}
void scale(CircularMotion& motion, double factor) {
    motion.center *= factor;
    motion.radius *= factor;
}

void scale(HelixMotion& motion, double factor) {
    scale(motion.circle, factor);
    motion.rise *= factor;
    if (motion.end_radius) *motion.end_radius *= factor;
}
void scale(ComposedMotion& motion, double factor) {
    for (SimpleMotion& part : motion.parts) std::visit([factor](auto& m) { scale(m, factor); }, part);
}

}  // namespace

ToolDescription scaled(ToolDescription tool, double factor) {
    for (BladeDescription& blade : tool.blades) std::visit([factor](auto& b) { scale(b, factor); }, blade);
    std::visit([factor](auto& m) { scale(m, factor); }, tool.motion);
    tool.side *= factor;
    return tool;
}

}  // namespace splitcubes::scene
