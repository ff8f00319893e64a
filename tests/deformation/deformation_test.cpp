// Deformations of nodes without phyxels.
#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/deformation/free_form.h>
#include <splitcubes/deformation/mass_spring.h>

#include <cmath>

namespace splitcubes::deformation {
namespace {

// Returns all nodes of a box of `count` nodes, with no edge cut.
NodeSet box_of(const Vec3i& count, double cell_size = 0.01) {
    NodeSet nodes;
    nodes.rest.cell_size = cell_size;
    nodes.rest.node_count = count + Vec3i::Constant(2);
    nodes.mass = 1000 * std::pow(cell_size, 3) * count.prod();
    const auto number = [&](const Vec3i& p) {
        return static_cast<std::uint32_t>((p[2] * count[1] + p[1]) * count[0] + p[0]);
    };
    for (int z = 0; z < count[2]; ++z)
        for (int y = 0; y < count[1]; ++y)
            for (int x = 0; x < count[0]; ++x) {
                nodes.coordinates.emplace_back(x + 1, y + 1, z + 1);
                for (int axis = 0; axis < 3; ++axis) {
                    Vec3i upper(x, y, z);
                    if (++upper[axis] < count[axis])
                        nodes.uncut_edges.push_back({number({x, y, z}), number(upper), axis});
                }
            }
    return nodes;
}

geometry::Box bounds_of(const NodeSet& nodes) {
    geometry::Box box;
    for (std::size_t n = 0; n < nodes.coordinates.size(); ++n) box.add(nodes.rest_position(n));
    return box;
}

Motion step_of(double dt, const Parallel& parallel, std::span<const std::uint8_t> held = {},
               std::span<const Vec3> held_position = {}) {
    return {0, dt, Vec3::Zero(), std::nullopt, held, held_position, parallel};
}

FreeFormSettings twisted(const Vec3i& degree) {
    FreeFormSettings settings;
    settings.degree = degree;
    const auto count = static_cast<std::size_t>((degree + Vec3i::Ones()).prod());
    settings.keyframes = {{0, std::vector<Vec3>(count, Vec3::Zero())}, {2, {}}};
    for (std::size_t k = 0; k < count; ++k)
        settings.keyframes[1].displacement.push_back(0.01 * Vec3(std::sin(1.3 * static_cast<double>(k)),
                                                                 std::cos(2.1 * static_cast<double>(k)),
                                                                 std::sin(0.7 + static_cast<double>(k))));
    return settings;
}

TEST(FreeForm, IsStillBeforeItsFirstKeyframeAndAffineWhereItsPointsAre) {
    const NodeSet nodes = box_of({4, 3, 5});
    const geometry::Box box = bounds_of(nodes);
    FreeFormSettings settings = twisted({2, 3, 1});
    Mat3 map;
    map << 1.1, 0.2, 0, -0.1, 0.9, 0.3, 0, 0.1, 1.3;
    std::size_t point = 0;
    for (int k = 0; k <= 1; ++k)
        for (int j = 0; j <= 3; ++j)
            for (int i = 0; i <= 2; ++i) {
                const Vec3 at = box.min + Vec3(i / 2.0, j / 3.0, k).cwiseProduct(box.size());
                settings.keyframes[1].displacement[point++] = map * at - at;
            }
    const FreeForm form(nodes, settings, box);
    for (std::size_t n = 0; n < nodes.coordinates.size(); ++n) {
        const Vec3 rest = nodes.rest_position(n);
        EXPECT_EQ(form.frame_at(rest, 0).position, rest);
        EXPECT_LT((form.frame_at(rest, 5).position - map * rest).norm(), 1e-15);
        EXPECT_LT((form.frame_at(rest, 5).jacobian - map).norm(), 1e-13);
    }
}

TEST(FreeForm, JacobianIsTheDerivative) {
    const NodeSet nodes = box_of({4, 4, 4});
    const FreeForm form(nodes, twisted({3, 2, 4}), bounds_of(nodes));
    const Vec3 rest(0.023, 0.017, 0.031);
    const double step = 1e-6;
    const geometry::Frame frame = form.frame_at(rest, 1.3);
    for (int k = 0; k < 3; ++k) {
        const Vec3 slope = (form.frame_at(rest + step * Vec3::Unit(k), 1.3).position -
                            form.frame_at(rest - step * Vec3::Unit(k), 1.3).position) /
                           (2 * step);
        EXPECT_LT((slope - frame.jacobian.col(k)).norm(), 1e-8);
    }
}

TEST(FreeForm, RefusesInvalidLattices) {
    FreeFormSettings settings = twisted({1, 1, 1});
    settings.keyframes[1].displacement.pop_back();
    EXPECT_THROW(check_free_form(settings), InputError);
    settings = twisted({1, 1, 1});
    settings.keyframes[1].time = 0;
    EXPECT_THROW(check_free_form(settings), InputError);
    settings = twisted({13, 1, 1});
    EXPECT_THROW(check_free_form(settings), InputError);
    EXPECT_THROW(check_free_form({}), InputError);
}

TEST(MassSpring, KeepsItsMomentaAndItsEnergyInFreeFlight) {
    const Parallel parallel(2);
    NodeSet nodes = box_of({6, 4, 4});
    nodes.velocity = Vec3(1, -2, 0.5);
    nodes.angular_velocity = Vec3(3, 1, -4);
    MassSpring body(nodes, {});
    for (std::size_t n = 0; n < nodes.coordinates.size(); ++n)
        body.velocities()[n] +=
            0.1 * Vec3(std::sin(static_cast<double>(n)), std::cos(3.0 * static_cast<double>(n)), 0);
    const MotionReport first = body.advance(step_of(1e-9, parallel));
    MotionReport last;
    for (int k = 0; k < 60; ++k) last = body.advance(step_of(1.0 / 60, parallel));
    EXPECT_LT((last.momentum - first.momentum).norm(), 1e-12 * first.momentum.norm());
    EXPECT_LT((last.angular_momentum - first.angular_momentum).norm(), 1e-10 * first.angular_momentum.norm());
    const double before = first.kinetic_energy + first.elastic_energy;
    EXPECT_NEAR(last.kinetic_energy + last.elastic_energy, before, 0.02 * before);
}

TEST(MassSpring, HasTheModulusItIsGiven) {
    // A long bar stretched by 1 % bears a force of E A 0.01; the springs on the sides of the lattice add half
    // a cell.
    const Parallel parallel(2);
    const Vec3i count(16, 9, 9);
    NodeSet nodes = box_of(count);
    MassSpring body(nodes, {.youngs_modulus = 1e5, .mass_damping = 20, .stiffness_damping = 0});
    std::vector<std::uint8_t> held(nodes.coordinates.size(), 0);
    std::vector<Vec3> at(nodes.coordinates.size(), Vec3::Zero());
    for (std::size_t n = 0; n < held.size(); ++n) {
        const int x = nodes.coordinates[n][0] - 1;
        held[n] = x == 0 || x == count[0] - 1;
        at[n] = nodes.rest_position(n) + Vec3(x == 0 ? 0 : 0.0015, 0, 0);
    }
    MotionReport report;
    for (int k = 0; k < 40; ++k) report = body.advance(step_of(1.0 / 60, parallel, held, at));
    // The energy density of a uniform strain is 1/2 E 0.01^2.
    const double volume = 0.15 * 0.09 * 0.09;
    EXPECT_NEAR(report.elastic_energy / (0.5 * 1e5 * 1e-4 * volume), 1, 0.12);
}

TEST(MassSpring, PartsSeparateWhereTheyAreCut) {
    const Parallel parallel(2);
    NodeSet nodes = box_of({6, 4, 4});
    MassSpring body(nodes, {});
    const std::size_t before = body.spring_count();
    std::vector<NodeEdge> cut;
    for (const NodeEdge& edge : nodes.uncut_edges)
        if (edge.axis == 0 && nodes.coordinates[edge.lower][0] == 3) cut.push_back(edge);
    ASSERT_EQ(cut.size(), 16U);
    body.edges_cut(cut);
    // Sixteen along the edges; two diagonals on each of the 24 crossed faces.
    EXPECT_EQ(before - body.spring_count(), 16U + 48U);
    for (std::size_t n = 0; n < nodes.coordinates.size(); ++n)
        body.velocities()[n] = Vec3(nodes.coordinates[n][0] > 3 ? 1 : -1, 0, 0);
    for (int k = 0; k < 30; ++k) body.advance(step_of(1.0 / 60, parallel));
    for (std::size_t n = 0; n < nodes.coordinates.size(); ++n) {
        const double moved = body.positions()[n][0] - nodes.rest_position(n)[0];
        EXPECT_NEAR(moved, nodes.coordinates[n][0] > 3 ? 0.5 : -0.5, 1e-9);
    }
}

TEST(MassSpring, ARigidTurnGivesRotationsAsFramesDownToOneNode) {
    const Parallel parallel(1);
    for (const Vec3i& count : {Vec3i(4, 3, 3), Vec3i(3, 3, 1), Vec3i(3, 1, 1), Vec3i(1, 1, 1)}) {
        NodeSet nodes = box_of(count);
        MassSpring body(nodes, {});
        std::vector<std::uint8_t> held(nodes.coordinates.size(), 1);
        std::vector<Vec3> at;
        const Mat3 turn = Eigen::AngleAxisd(0.9, Vec3(1, 2, -1).normalized()).toRotationMatrix();
        for (std::size_t n = 0; n < held.size(); ++n) at.push_back(turn * nodes.rest_position(n));
        body.advance(step_of(1.0 / 60, parallel, held, at));
        std::vector<geometry::Frame> frames(nodes.coordinates.size());
        body.node_frames(frames, parallel);
        for (std::size_t n = 0; n < frames.size(); ++n) {
            EXPECT_LT((frames[n].position - at[n]).norm(), 1e-15);
            EXPECT_LT((frames[n].jacobian.transpose() * frames[n].jacobian - Mat3::Identity()).norm(), 1e-9);
            EXPECT_GT(frames[n].jacobian.determinant(), 0.99);
            if (count.minCoeff() > 1) {
                EXPECT_LT((frames[n].jacobian - turn).norm(), 1e-9);
            }
        }
    }
}

TEST(MassSpring, RefusesInvalidMaterials) {
    EXPECT_THROW(MassSpring(box_of({2, 2, 2}), {.youngs_modulus = 0}), InputError);
    EXPECT_THROW(MassSpring(box_of({2, 2, 2}), {.mass_damping = -1}), InputError);
}

}  // namespace
}  // namespace splitcubes::deformation
