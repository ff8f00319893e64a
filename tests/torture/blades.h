// Tools of random scenes.
#pragma once

#include "solids.h"

namespace splitcubes::torture {

/// A body that blades are aimed at.
struct Target {
    Vec3 center = Vec3::Zero();  // m, at time 0
    double radius = 0;           // m, of the ball around it
    double cell_size = 0;        // m
    Vec3 velocity = Vec3::Zero();
    Vec3 gravity = Vec3::Zero();
    double longest_fall = 0;  // s, after which it lies still
    std::string name;

    Vec3 at(double time) const;
};

/// Draws that many tools, within the first four fifths of the duration.
Json draw_tools(Draw& draw, const std::vector<Target>& targets, int count, double duration, double time_step);

}  // namespace splitcubes::torture
