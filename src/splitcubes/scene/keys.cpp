// The keys of the scene format, by kind of object; described in scenes/schema.json, and for path files in
// scenes/paths/schema.json.
#include <splitcubes/scene/parse.h>

namespace splitcubes::scene {

const std::vector<ObjectKeys>& scene_keys() {
    static const std::vector<ObjectKeys> keys = {
        {"scene",
         {"$schema", "name", "time_step", "frames", "duration", "threads", "gravity", "ground", "colliders",
          "contact", "bodies", "constraints", "handles", "tools", "solver", "occlusion", "output", "camera",
          "display"}},
        {"body",
         {"name", "shape", "placement", "cells", "cell_size", "phyxel_count", "phyxel_spacing", "material",
          "deformation", "velocity", "angular_velocity", "appearance", "repeat"}},
        {"appearance", {"surface", "cut"}},
        {"finish", {"kind", "colour", "roughness", "metalness", "layers", "stripes", "speckles"}},
        {"finish_layer", {"depth", "colour"}},
        {"finish_stripes", {"axis", "bands"}},
        {"finish_band", {"from", "colour"}},
        {"finish_speckles", {"size", "share", "colour"}},
        {"repetition", {"count", "position", "rotation", "pivot", "time"}},
        {"condition", {"body", "at_least", "ended", "time"}},
        {"carrier", {"tool", "collider", "body", "region"}},
        {"instrument", {"knife", "scalpel", "scissors", "wire", "spoon", "mesh"}},
        {"blade_instrument", {"height", "thickness", "handle", "grip", "back"}},
        {"wire_instrument", {"radius", "grips"}},
        {"spoon_instrument", {"depth", "thickness", "handle", "back"}},
        {"mesh_instrument", {"file", "sha256", "placement"}},
        {"solid", {"friction"}},
        {"display", {"tools", "handles", "held"}},
        {"shape", {"mesh", "box", "sphere", "cylinder", "torus", "capsule", "pear", "implicit"}},
        {"mesh_shape", {"file", "sha256"}},
        {"box_shape", {"size"}},
        {"sphere_shape", {"radius"}},
        {"cylinder_shape", {"radius", "height"}},
        {"torus_shape", {"ring_radius", "tube_radius"}},
        {"capsule_shape", {"radius", "straight_height"}},
        {"pear_shape", {"height", "foot"}},
        {"implicit_shape", {"smoothness", "cells", "parts"}},
        {"implicit_part", {"ball", "cone"}},
        {"ball_part", {"center", "radii", "colour"}},
        {"cone_part", {"from", "to", "from_radius", "to_radius", "colour"}},
        {"deformation", {"free_form", "mass_spring"}},
        {"free_form", {"degree", "keyframes"}},
        {"lattice_keyframe", {"time", "points"}},
        {"lattice_point", {"index", "displacement"}},
        {"mass_spring", {}},
        {"placement", {"position", "rotation", "scale"}},
        {"rotation", {"axis", "angle_degrees"}},
        {"material",
         {"model", "density", "youngs_modulus", "poisson_ratio", "volume_stiffness", "mass_damping",
          "stiffness_damping", "zero_energy", "plasticity", "tearing", "cutting_resistance"}},
        {"plasticity", {"yield", "creep", "maximum"}},
        {"tearing",
         {"strength", "propagation_ratio", "crack_speed", "strength_map"},
         {{"toughness", "propagation_ratio", "0.4"}}},
        {"strength_layer", {"patch", "paint"}},
        {"strength_patch", {"region", "factor"}},
        {"strength_paint", {"picture", "picture_sha256", "dark", "light"}},
        {"ground", {"height", "friction"}},
        {"collider",
         {"name", "shape", "half_space", "placement", "rounding", "keyframes", "pivot", "friction",
          "relative_to", "start_when", "end_when", "finish"}},
        {"half_space_shape", {"point", "normal"}},
        {"contact", {"pieces", "friction", "restitution"}},
        {"handle",
         {"name", "body", "region", "keyframes", "pivot", "stiffness", "force_limit", "from_time",
          "until_time", "start_when", "release_when", "relative_to"}},
        {"constraint",
         {"body", "region", "kind", "keyframes", "pivot", "from_time", "until_time", "start_when",
          "release_when", "relative_to"}},
        {"region", {"box", "sphere", "half_space", "cylinder", "slab"}},
        {"box_region", {"min", "max"}},
        {"sphere_region", {"center", "radius"}},
        {"half_space_region", {"point", "normal"}},
        {"cylinder_region", {"from", "to", "radius"}},
        {"slab_region", {"point", "normal", "thickness"}},
        {"keyframe", {"time", "position", "rotation"}},
        {"tool",
         {"name", "blades", "motion", "bodies", "active_from", "active_until", "side", "friction",
          "instrument", "finish", "grip_finish", "solid", "relative_to", "start_when", "end_when",
          "shown_from", "shown_until", "repeat"}},
        {"blade", {"polyline", "straight", "arc"}},
        {"polyline_blade", {"points"}},
        {"straight_blade", {"from", "to"}},
        {"arc_blade", {"center", "radius", "axis", "start_angle_degrees", "end_angle_degrees", "segments"}},
        {"motion", {"path", "circular", "helix", "composed"}},
        {"composed_motion", {"parts"}},
        {"helix_motion",
         {"center", "axis", "radius", "start_angle_degrees", "turns", "from_time", "until_time",
          "turn_with_path", "rise", "end_radius"}},
        {"path_motion", {"keyframes", "interpolation"}},
        {"circular_motion",
         {"center", "axis", "radius", "start_angle_degrees", "turns", "from_time", "until_time",
          "turn_with_path"}},
        {"solver", {"kind", "integrator", "tolerance", "max_iterations"}},
        {"occlusion", {"backend", "criterion", "disk_size"}},
        {"output", {"every_nth_frame", "format", "pictures", "links"}},
        {"camera", {"eye", "target", "direction", "up", "vertical_fov_degrees", "width", "height"}},
    };
    return keys;
}

const std::vector<ObjectKeys>& path_keys() {
    static const std::vector<ObjectKeys> keys = {{"path_file", {"$schema", "name", "tools"}}};
    return keys;
}

const std::vector<ObjectKeys>& recording_keys() {
    static const std::vector<ObjectKeys> keys = {
        {"recording", {"format", "program", "scene", "frames", "first_state", "last_state", "tracks"}},
        {"track", {"tool", "constraint", "handle", "collider", "times", "places"}},
    };
    return keys;
}

}  // namespace splitcubes::scene
