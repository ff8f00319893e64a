// What moves the nodes of a body's grid, whatever it is (Splitting Cubes, section 7:
// the surface asks for nothing but the nodes' frames).
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/frame.h>
#include <splitcubes/geometry/rest_grid.h>

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace splitcubes::deformation {

/// An edge of the grid between two inside nodes.
struct NodeEdge {
    std::uint32_t lower = 0, upper = 0;  // node numbers; upper is one cell further along the axis
    int axis = 0;
};

/// The inside nodes of a grid.
struct NodeSet {
    geometry::RestGrid rest;
    std::vector<Vec3i> place;              // per node: grid coordinates
    std::vector<NodeEdge> uncut_edges;     // all, in any fixed order
    double mass = 0;                       // kg, of the body
    Vec3 velocity = Vec3::Zero();          // m/s, of the centre, at time 0
    Vec3 angular_velocity = Vec3::Zero();  // rad/s, about the centre, at time 0

    Vec3 rest_position(std::size_t node) const { return rest.node_position(place[node]); }
};

/// What a time step is given.
struct Motion {
    struct Ground {
        Vec3 normal = Vec3::UnitZ();  // unit, world; the half-space normal . x >= offset is free
        double offset = 0;            // m
        double friction = 0;          // Coulomb coefficient
    };
    double time = 0;              // s, at the start of the step
    double dt = 0;                // s, > 0
    Vec3 gravity = Vec3::Zero();  // m/s^2
    std::optional<Ground> ground;
    std::span<const std::uint8_t> held;   // per node, 1: its position is prescribed
    std::span<const Vec3> held_position;  // per node, m, world, at the end of the step
    const Parallel& parallel;
};

/// State after a step.
struct MotionReport {
    double kinetic_energy = 0;             // J
    double elastic_energy = 0;             // J
    Vec3 momentum = Vec3::Zero();          // kg m/s
    Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s, about the world's origin
    double top_speed = 0;                  // m/s
    int substeps = 1;
    std::size_t contacts = 0;  // nodes on the ground
    bool finite = true;        // false: something was not, and was put back
};

class Deformation {
  public:
    virtual ~Deformation() = default;
    /// These edges were cut: what they held together may part.
    virtual void edges_cut(std::span<const NodeEdge> edges) = 0;
    virtual MotionReport advance(const Motion& motion) = 0;
    /// Frames of all nodes, now. out: one a node.
    virtual void node_frames(std::span<geometry::Frame> out, const Parallel& parallel) const = 0;
    /// For checkpoints: what changes with time and the edges that were cut do not tell.
    virtual std::vector<double> state() const = 0;
    /// Takes back what state() gave; the edges that were cut until then have been told.
    virtual void set_state(std::span<const double> state) = 0;
};

/// Makes one for the nodes of a body, at time 0 and at rest.
using MakeDeformation = std::function<std::unique_ptr<Deformation>(NodeSet nodes)>;

}  // namespace splitcubes::deformation
