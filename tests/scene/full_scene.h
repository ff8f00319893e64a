// A scene that uses every kind of object and every key except duration. Its mesh file is any file of the
// folder SPLITCUBES_SCENES: parsing tests its existence only.
#pragma once

namespace splitcubes::scene {

inline constexpr const char* full_scene = R"json({
  "$schema": "schema.json", "name": "Everything", "time_step": 0.01, "frames": 7, "threads": 2,
  "gravity": [0.5, 0, -3.71], "ground": {"height": -0.25, "friction": 0.7},
  "colliders": [
    {"name": "c1", "shape": {"box": {"size": [1, 2, 1]}}, "placement": {"position": [0, 1, 0]}, "rounding": 0.1,
     "keyframes": [{"time": 0.5, "position": [0, 0, 1]}], "pivot": [0, 1, 1], "friction": 0.3,
     "finish": {"kind": "wood", "colour": [0.5, 0.25, 0.125], "roughness": 0.75, "metalness": 0.25}},
    {"name": "c2", "half_space": {"point": [0, 0, -1], "normal": [0, 0.1, 1]},
     "relative_to": {"region": {"sphere": {"center": [0, 0, 0], "radius": 0.4}}, "body": "b"},
     "start_when": {"time": 0.25}, "end_when": {"body": "b", "ended": "t5"}}
  ],
  "contact": {"pieces": true, "friction": 0.2, "restitution": 0.7},
  "handles": [
    {"name": "h1", "body": "a", "region": {"sphere": {"center": [0, 0, 0], "radius": 0.2}},
     "keyframes": [{"time": 0.5, "position": [0, 0, 1]}], "pivot": [0, 0, 1], "stiffness": 500, "force_limit": 3,
     "from_time": 0.5, "until_time": 2, "start_when": {"ended": "t5"}, "release_when": {"body": "a", "at_least": 3}, "relative_to": {"tool": "t1"}}
  ],
  "bodies": [
    {"name": "a", "shape": {"box": {"size": [1, 2, 3]}},
     "placement": {"position": [1, 2, 3], "rotation": {"axis": [1, 1, 0], "angle_degrees": 33.3}, "scale": 0.1},
     "cells": 20, "phyxel_count": 99,
     "material": {"model": "st-venant-kirchhoff", "volume_stiffness": 1e3, "plasticity": {"yield": 0.1, "creep": 2,
                  "maximum": 0.3}, "density": 900, "youngs_modulus": 1.25e4, "poisson_ratio": 0.45, "mass_damping": 0.1,
                  "stiffness_damping": 0.2, "zero_energy": 0.05, "cutting_resistance": 150,
                  "tearing": {"strength": 2e4, "propagation_ratio": 0.5, "crack_speed": 1.5, "strength_map": [
                    {"patch": {"region": {"slab": {"point": [1, 2, 3], "normal": [1, 0, 0], "thickness": 0.1}},
                               "factor": 0.5}},
                    {"patch": {"region": {"cylinder": {"from": [1, 2, 2], "to": [1, 2, 4], "radius": 0.1}},
                               "factor": 2}}]}},
     "appearance": {"surface": {"colour": [1, 0.5, 0]}, "cut": {"layers": [{"depth": 0.01, "colour": [0, 0.5, 1]},
       {"depth": 0.02, "colour": [1, 1, 1]}], "stripes": {"axis": [1, 0, 0], "bands": [{"from": -1, "colour": [0, 0, 1]},
       {"from": 0.5, "colour": [1, 0, 0]}]}, "speckles": [{"size": 0.004, "share": 0.5, "colour": [0.1, 0.2, 0.3]}]}},
     "velocity": [1, 0, 0.1], "angular_velocity": [0, 2, 0]},
    {"name": "b", "shape": {"sphere": {"radius": 0.5}}, "cell_size": 0.05, "phyxel_spacing": 0.1},
    {"name": "c", "shape": {"cylinder": {"radius": 0.5, "height": 2}}},
    {"name": "d", "shape": {"torus": {"ring_radius": 0.5, "tube_radius": 0.125}}},
    {"name": "e", "shape": {"capsule": {"radius": 0.5, "straight_height": 2}}},
    {"name": "f", "shape": {"pear": {"height": 0.7, "foot": 0.05}}},
    {"name": "g", "shape": {"mesh": {"file": "schema.json",
     "sha256": "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"}},
     "material": {"tearing": {"strength": 100, "strength_map": [{"paint": {"dark": 0.5, "light": 2}}, {"paint": {"picture": "schema.json",
       "picture_sha256": "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"}}]}}},
    {"name": "h", "shape": {"implicit": {"smoothness": 0.02, "cells": 50, "parts": [
        {"ball": {"center": [0, 0, 1], "radii": [1, 2, 3], "colour": [1, 0, 0.5]}},
        {"cone": {"from": [0, 0, 0], "to": [0, 0, 2], "from_radius": 1, "to_radius": 0.5, "colour": [0.2, 0.4, 0.6]}}]}},
     "deformation": {"free_form": {"degree": [1, 2, 3], "keyframes": [
        {"time": 0.1}, {"time": 2, "points": [{"index": [1, 2, 3], "displacement": [0.1, 0, 0]}]}]}}},
    {"name": "i", "shape": {"box": {"size": [1, 1, 1]}}, "deformation": {"mass_spring": {}}},
    {"name": "j", "shape": {"box": {"size": [1, 1, 1]}}, "repeat": {"count": 3, "position": [2, 0, 0],
     "rotation": {"axis": [0, 0, 1], "angle_degrees": 30}, "pivot": [0, 1, 0]}}
  ],
  "constraints": [
    {"body": "a", "region": {"box": {"min": [0, 0, 0], "max": [1, 1, 2]}}, "kind": "hold", "pivot": [0.1, 0.2, 0.3],
     "from_time": 0.1, "until_time": 2.5, "start_when": {"body": "a", "at_least": 4}, "release_when": {"body": "b"},
     "relative_to": {"collider": "c2"}},
    {"body": "b", "region": {"sphere": {"center": [0, 1, 0], "radius": 0.3}}, "kind": "move",
     "keyframes": [{"time": 0.25, "position": [1, 0, 0], "rotation": {"axis": [0, 1, 0], "angle_degrees": 12}},
                   {"time": 0.5}]},
    {"body": "b", "region": {"half_space": {"point": [0, 0, 1], "normal": [0, 0, 2]}}, "kind": "hold"}
  ],
  "tools": [
    {"name": "t1", "blades": [
        {"polyline": {"points": [[0, 0, 0], [1, 0, 0], [1, 1, 0.1]]}},
        {"straight": {"from": [0, 0, -1], "to": [0, 0, 1]}},
        {"arc": {"center": [1, 0, 0], "radius": 2, "axis": [0, 1, 0], "start_angle_degrees": -10,
                 "end_angle_degrees": 50, "segments": 9}}],
     "motion": {"path": {"keyframes": [{"time": 1, "position": [0, 0, 1]}, {"time": 2}], "interpolation": "smooth"}},
     "bodies": ["a", "c"], "active_from": 0.5, "active_until": 3, "side": 0.02,
     "instrument": {"knife": {"height": 0.1, "thickness": 0.01, "handle": 0.5, "grip": "start", "back": [0, 0, 1]}},
     "finish": {"kind": "steel"}, "grip_finish": {"colour": [0.1, 0.1, 0.1]}, "solid": {"friction": 0.2},
     "friction": 0.4},
    {"name": "t2", "blades": [{"straight": {"from": [0, 0, 0], "to": [0, 1, 0]}}],
     "motion": {"circular": {"center": [0, 0, 1], "axis": [0, 0, -1], "radius": 0.4, "start_angle_degrees": 90,
                             "turns": -1.5, "from_time": 0.2, "until_time": 1.2, "turn_with_path": false}},
     "relative_to": {"collider": "c2"}, "start_when": {"time": 0.5}, "end_when": {"ended": "t3"}, "shown_from": 0.25, "shown_until": 3,
     "instrument": {"wire": {"radius": 0.01, "grips": false}}},
    {"name": "t3", "blades": [{"arc": {"radius": 0.2, "start_angle_degrees": 0, "end_angle_degrees": 180}}],
     "motion": {"helix": {"center": [0, 0, 1], "axis": [0, 0, -1], "radius": 0.4, "start_angle_degrees": 90, "turns": 2,
                "from_time": 0.2, "until_time": 1.2, "turn_with_path": false, "rise": 0.5, "end_radius": 0.2}},
     "instrument": {"spoon": {"depth": 0.1, "thickness": 0.01, "handle": 0.3, "back": [0, 1, 0]}}},
    {"name": "t4", "blades": [{"straight": {"from": [0, 0, 0], "to": [0, 1, 0]}}],
     "motion": {"composed": {"parts": [{"circular": {"radius": 0, "turns": 3, "until_time": 2}},
       {"path": {"keyframes": [{"time": 0, "position": [0, 0, 1]}, {"time": 2}]}}]}},
     "instrument": {"scalpel": {}}},
    {"name": "t5", "blades": [{"straight": {"from": [0, 0, 0], "to": [0, 1, 0]}}],
     "motion": {"path": {"keyframes": [{"time": 0, "position": [0, 0, 1]}, {"time": 2}]}},
     "instrument": {"mesh": {"file": "schema.json",
     "sha256": "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef",
     "placement": {"position": [0, 0, 0.1], "scale": 2}}}},
    {"name": "t6", "blades": [{"straight": {"from": [0, 0, 0], "to": [0, 1, 0]}}], "relative_to": "t4",
     "motion": {"path": {"keyframes": [{"time": 0, "position": [0, 0, 1]}, {"time": 2}]}},
     "instrument": {"scissors": {}},
     "repeat": {"count": 2, "position": [0, 0.1, 0], "rotation": {"axis": [1, 0, 0], "angle_degrees": 10},
                "pivot": [0, 0, 1], "time": 0.5}}
  ],
  "solver": {"kind": "explicit", "integrator": "backward_euler", "tolerance": 1e-4, "max_iterations": 50},
  "occlusion": {"backend": "cpu", "criterion": "transparency", "disk_size": 32},
  "output": {"every_nth_frame": 3, "format": "glb", "pictures": true, "links": true},
  "camera": {"eye": [1, -4, 2], "target": [0, 0, 1], "direction": [0, 1, 0.5], "up": [0, 1, 1],
             "vertical_fov_degrees": 50, "width": 640, "height": 480},
  "display": {"tools": false, "handles": false, "held": false}
})json";

}  // namespace splitcubes::scene
