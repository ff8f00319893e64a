// Deformation models of the nodes of a body's grid (Splitting Cubes, section 7: the surface needs only the
// nodes' frames).
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

/// A grid edge between two inside nodes.
struct NodeEdge {
    std::uint32_t lower = 0, upper = 0;  // node indices; upper is one cell further along the axis
    int axis = 0;
};

/// The inside nodes of a grid.
struct NodeSet {
    geometry::RestGrid rest;
    std::vector<Vec3i> coordinates;        // per node, in the rest grid
    std::vector<NodeEdge> uncut_edges;     // all of them, in any fixed order
    double mass = 0;                       // kg, of the body
    Vec3 velocity = Vec3::Zero();          // m/s, of the centre, at time 0
    Vec3 angular_velocity = Vec3::Zero();  // rad/s, about the centre, at time 0

    Vec3 rest_position(std::size_t node) const { return rest.node_position(coordinates[node]); }
};

/// Input of a time step.
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
    bool finite = true;        // false: values that were not finite have been reset
};

class Deformation {
  public:
    virtual ~Deformation() = default;
    /// Reports edges that were cut: the nodes that they connected may separate.
    virtual void edges_cut(std::span<const NodeEdge> edges) = 0;
    virtual MotionReport advance(const Motion& motion) = 0;
    /// Writes the present frames of all nodes. out: one per node.
    virtual void node_frames(std::span<geometry::Frame> out, const Parallel& parallel) const = 0;
    /// Returns the state for checkpoints: all that changes with time and does not follow from the cut edges.
    virtual std::vector<double> state() const = 0;
    /// Restores what state() returned. All edges cut until then must have been reported.
    virtual void set_state(std::span<const double> state) = 0;
};

/// Makes a deformation for the nodes of a body, at time 0 and at rest.
using MakeDeformation = std::function<std::unique_ptr<Deformation>(NodeSet nodes)>;

}  // namespace splitcubes::deformation
