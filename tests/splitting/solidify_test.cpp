#include <splitcubes/splitting/solidify.h>

#include "laws/solids.h"

#include <gtest/gtest.h>

#include <splitcubes/core/error.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/geometry/winding_number.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/validate.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>

namespace splitcubes::splitting {
namespace {

using namespace laws;
using geometry::TriangleMesh;

const Parallel& two_threads() {
    static const Parallel parallel(2);
    return parallel;
}

RestGrid unit_grid(int nodes) {
    RestGrid rest;
    rest.cell_size = 1;
    rest.node_count = Vec3i::Constant(nodes);
    return rest;
}

NodeGrid solid(const TriangleMesh& mesh, const RestGrid& rest, SolidifyReport& report) {
    return solidify(mesh, rest, report, two_threads());
}

NodeGrid solid(const TriangleMesh& mesh, const RestGrid& rest) {
    SolidifyReport report;
    return solid(mesh, rest, report);
}

void for_each_node(const RestGrid& rest, const std::function<void(const Vec3i&)>& visit) {
    for (int z = 0; z < rest.node_count[2]; ++z)
        for (int y = 0; y < rest.node_count[1]; ++y)
            for (int x = 0; x < rest.node_count[0]; ++x) visit({x, y, z});
}

std::vector<bool> inside_of(const NodeGrid& grid) {
    std::vector<bool> out;
    for_each_node(grid.rest(), [&](const Vec3i& node) { out.push_back(grid.inside(node)); });
    return out;
}

std::vector<bool> cut_edges_of(const NodeGrid& grid) {
    std::vector<bool> out;
    for_each_node(grid.rest(), [&](const Vec3i& node) {
        for (int axis = 0; axis < 3; ++axis)
            out.push_back(grid.has_edge({node, axis}) && grid.is_cut({node, axis}));
    });
    return out;
}

// Returns the first violation of the invariants of a solid, empty if there is none.
std::string trouble(const NodeGrid& grid) {
    for (const std::string& line : validate(grid)) return line;
    const Surface surface(grid);
    const Pieces pieces(grid);
    for (const std::string& line : validate(grid, surface, pieces)) return line;
    return "";
}

// Returns the volume of the surface.
double surface_volume(const NodeGrid& grid) {
    return extract(grid, Surface(grid), Pieces(grid)).mesh.volume();
}

TEST(Solidify, ClassifiesNodesOfConvexSolids) {
    Random random(1);
    for (int trial = 0; trial < 60; ++trial) {
        const Vec3 half(random.uniform(0.6, 5), random.uniform(0.6, 5), random.uniform(0.6, 5));
        const Quat rotation = random_rotation(random);
        const Vec3 center = random_vector(random, 2);
        const TriangleMesh mesh = moved(turned(geometry::make_box(2 * half), rotation), center);
        const RestGrid rest = geometry::grid_around(mesh.bounds(), random.uniform(0.5, 1));
        SolidifyReport report;
        const NodeGrid grid = solid(mesh, rest, report);
        EXPECT_TRUE(report.exact);
        std::size_t count = 0;
        for_each_node(rest, [&](const Vec3i& node) {
            const Vec3 own = rotation.inverse() * (rest.node_position(node) - center);
            const double depth = (half - own.cwiseAbs()).minCoeff();
            count += grid.inside(node);
            // The mesh is snapped to 2^-20 of a cell.
            if (std::abs(depth) < 1e-5) return;
            ASSERT_EQ(grid.inside(node), depth > 0);
        });
        ASSERT_EQ(report.nodes_inside, count);
        ASSERT_EQ(trouble(grid), "") << "trial " << trial;
    }
}

TEST(Solidify, CrossingsAreWhereTheMeshIs) {
    const double radius = 6.3;
    const TriangleMesh mesh = geometry::make_sphere(radius, 5);
    const NodeGrid grid = solid(mesh, geometry::grid_around(mesh.bounds(), 1));
    for (const Crossing& c : grid.crossings()) {
        const Vec3 at = grid.rest().node_position(c.edge.node) + c.hit * Vec3::Unit(c.edge.axis);
        ASSERT_NEAR(at.norm(), radius, 0.002 * radius) << "its triangles lie a little inside";
        ASSERT_NEAR(std::abs(c.normal.dot(at.normalized())), 1, 0.01);
        ASSERT_EQ(c.origin, Origin::boundary);
        ASSERT_EQ(c.cut, -1);
        ASSERT_NEAR(c.parameter, c.hit, min_parameter * (1 + 1e-12));
    }
}

TEST(Solidify, CubesOfWholeCellsHaveAsManyNodes) {
    for (int size = 1; size <= 6; ++size) {
        SolidifyReport report;
        const NodeGrid grid =
            solid(box_between(Vec3::Ones(), Vec3::Constant(1 + size)), unit_grid(9), report);
        EXPECT_TRUE(report.exact);
        EXPECT_EQ(report.nodes_inside, static_cast<std::size_t>(size * size * size));
        EXPECT_EQ(report.lost_thin_edges, 0U);
        EXPECT_EQ(trouble(grid), "");
        // Crossings keep min_parameter from nodes, which bounds the error of the volume.
        EXPECT_NEAR(std::cbrt(surface_volume(grid)), size, 2 * min_parameter + 1e-9);
    }
}

TEST(Solidify, VerticesAndEdgesInNodes) {
    Random random(2);
    for (int radius = 1; radius <= 3; ++radius)
        EXPECT_EQ(trouble(solid(octahedron(Vec3::Constant(4), radius), unit_grid(9))), "");
    int solids = 0;
    for (int trial = 0; trial < 200; ++trial) {
        const auto corner = [&] {
            const auto part = [&] { return 1 + static_cast<double>(random.below(7)); };
            const double x = part(), y = part();
            return Vec3(x, y, part());
        };
        const Vec3 a = corner(), b = corner(), c = corner(), d = corner();
        const TriangleMesh mesh = tetrahedron(a, b, c, d);
        try {
            const NodeGrid grid = solid(mesh, unit_grid(9));
            ASSERT_EQ(trouble(grid), "") << "trial " << trial;
            ++solids;
        } catch (const InputError&) {
            // Too flat to contain a node.
            ASSERT_LT(mesh.volume(), 20) << "trial " << trial;
        }
    }
    EXPECT_GT(solids, 100);
}

TEST(Solidify, OverlappingPartsAreUnited) {
    Random random(3);
    for (int trial = 0; trial < 30; ++trial) {
        const TriangleMesh a =
            moved(geometry::make_sphere(random.uniform(1.5, 4), 2), random_vector(random, 2));
        const TriangleMesh b = moved(turned(geometry::make_box(Vec3(3, 4, 5)), random_rotation(random)),
                                     random_vector(random, 2));
        const TriangleMesh both = joined(a, b);
        const RestGrid rest = geometry::grid_around(both.bounds(), 0.5);
        SolidifyReport report;
        const NodeGrid grid = solid(both, rest, report);
        EXPECT_TRUE(report.exact);
        std::vector<bool> united = inside_of(solid(a, rest));
        const std::vector<bool> other = inside_of(solid(b, rest));
        for (std::size_t i = 0; i < united.size(); ++i) united[i] = united[i] || other[i];
        ASSERT_EQ(inside_of(grid), united);
        ASSERT_EQ(trouble(grid), "") << "trial " << trial;
    }
}

TEST(Solidify, AReversedInnerShellIsACavity) {
    const TriangleMesh outer = geometry::make_sphere(5.2, 3);
    const TriangleMesh inner = moved(geometry::make_sphere(2.7, 3), Vec3(0.3, 0.4, -0.2));
    const TriangleMesh hollow = joined(outer, reversed(inner));
    const RestGrid rest = geometry::grid_around(outer.bounds(), 0.5);
    SolidifyReport report;
    const NodeGrid grid = solid(hollow, rest, report);
    EXPECT_TRUE(report.exact);
    std::vector<bool> shell = inside_of(solid(outer, rest));
    const std::vector<bool> cavity = inside_of(solid(inner, rest));
    for (std::size_t i = 0; i < shell.size(); ++i) shell[i] = shell[i] && !cavity[i];
    EXPECT_EQ(inside_of(grid), shell);
    EXPECT_EQ(trouble(grid), "");
    EXPECT_NEAR(surface_volume(grid), hollow.volume(), 0.01 * hollow.volume());
    EXPECT_EQ(Pieces(grid).count(), 1U);
    // With the same orientation the inner shell is no cavity.
    EXPECT_EQ(inside_of(solid(joined(outer, inner), rest)), inside_of(solid(outer, rest)));
}

TEST(Solidify, AnInsideOutMeshIsASolid) {
    Random random(4);
    const TriangleMesh mesh = turned(geometry::make_torus(3, 1.1, 32, 16), random_rotation(random));
    const RestGrid rest = geometry::grid_around(mesh.bounds(), 0.3);
    const NodeGrid grid = solid(mesh, rest);
    const NodeGrid other = solid(reversed(mesh), rest);
    EXPECT_EQ(inside_of(grid), inside_of(other));
    EXPECT_EQ(cut_edges_of(grid), cut_edges_of(other));
    EXPECT_EQ(canonical_quads(Surface(grid)), canonical_quads(Surface(other)));
    EXPECT_GT(surface_volume(other), 0);
}

TEST(Solidify, AGapThinnerThanACellSeparates) {
    // Two blocks 0.3 cells apart, with the gap at various positions between two layers of nodes.
    for (int step = 0; step <= 20; ++step) {
        const double gap = 4.01 + step / 20.0;
        const TriangleMesh blocks = joined(box_between(Vec3(1.5, 1.5, 1.5), Vec3(gap - 0.15, 7.5, 7.5)),
                                           box_between(Vec3(gap + 0.15, 1.5, 1.5), Vec3(7.5, 7.5, 7.5)));
        SolidifyReport report;
        const NodeGrid grid = solid(blocks, unit_grid(10), report);
        const double fraction = gap - std::floor(gap);
        const bool between_nodes = fraction > 0.15 && fraction < 0.85;
        EXPECT_EQ(report.gap_edges, between_nodes ? 36U : 0U) << gap;
        EXPECT_EQ(Pieces(grid).count(), 2U) << gap;
        EXPECT_EQ(trouble(grid), "") << gap;
    }
}

TEST(Solidify, AThinPlateIsCountedLost) {
    const TriangleMesh plate = box_between(Vec3(1.5, 1.5, 4.3), Vec3(7.5, 7.5, 4.6));
    const TriangleMesh block = box_between(Vec3(1.5, 1.5, 1.5), Vec3(7.5, 7.5, 2.5));
    SolidifyReport report;
    const NodeGrid grid = solid(joined(block, plate), unit_grid(10), report);
    EXPECT_EQ(report.lost_thin_edges, 36U);
    EXPECT_EQ(report.nodes_inside, 36U);
    EXPECT_EQ(report.notes.size(), 1U);
    EXPECT_EQ(trouble(grid), "");
    EXPECT_THROW(solid(plate, unit_grid(10)), InputError) << "nothing is left of it";
    // The plate contains nodes if it reaches a layer of them.
    const TriangleMesh seen = moved(plate, Vec3(0, 0, 0.5));
    solid(seen, unit_grid(10), report);
    EXPECT_EQ(report.nodes_inside, 36U);
    EXPECT_EQ(report.lost_thin_edges, 0U);
}

TEST(Solidify, OfAPlateBesideABlockTheBlockIsKept) {
    // Both are on one grid edge: the material of the inside node ends at the block.
    for (const bool below : {true, false}) {
        const TriangleMesh block =
            box_between(Vec3(1.5, 1.5, below ? 4.7 : 2.5), Vec3(7.5, 7.5, below ? 6.5 : 4.3));
        const TriangleMesh plate =
            moved(box_between(Vec3(1.5, 1.5, 0), Vec3(7.5, 7.5, 0.2)), Vec3(0, 0, below ? 4.2 : 4.6));
        SolidifyReport report;
        const NodeGrid grid = solid(joined(block, plate), unit_grid(10), report);
        EXPECT_EQ(report.lost_thin_edges, 36U);
        EXPECT_EQ(report.gap_edges, 0U);
        const std::int32_t slot = grid.slot({Vec3i(4, 4, 4), 2});
        ASSERT_GE(slot, 0);
        EXPECT_NEAR(grid.crossing(slot).parameter, below ? 0.7 : 0.3, 1e-5);
        EXPECT_EQ(trouble(grid), "");
    }
}

TEST(Solidify, AnOpenMeshGoesByItsWindingNumber) {
    TriangleMesh mesh = geometry::make_sphere(5.3, 3);
    // Cut a hole at the top.
    std::erase_if(mesh.triangles, [&](const geometry::Triangle& t) { return mesh.positions[t[0]][2] > 4.6; });
    const RestGrid rest = geometry::grid_around(mesh.bounds(), 0.5);
    SolidifyReport report;
    const NodeGrid grid = solid(mesh, rest, report);
    EXPECT_FALSE(report.exact);
    EXPECT_FALSE(report.notes.empty());
    EXPECT_GT(report.bisected_edges, 0U);
    EXPECT_EQ(trouble(grid), "");
    const geometry::WindingNumber winding(mesh);
    for_each_node(rest, [&](const Vec3i& node) {
        const double w = winding.exact_at(rest.node_position(node));
        if (std::abs(w - 0.5) < 2e-3) return;
        ASSERT_EQ(grid.inside(node), w > 0.5);
    });
}

TEST(Solidify, WindingNumbersFollowedAlongRowsEqualThoseOfEveryNode) {
    // A ball with a hole, with reversed triangles, partly duplicated, and torn apart.
    Random random(5);
    for (int kind = 0; kind < 5; ++kind) {
        TriangleMesh mesh = moved(geometry::make_sphere(5.3, 3), Vec3(7.1, 7.2, 7.3));
        const std::size_t count = mesh.triangles.size();
        if (kind == 0) std::erase_if(mesh.triangles, [&](auto& t) { return mesh.positions[t[0]][2] > 11; });
        for (std::size_t t = 0; kind == 1 && t < count; t += 40)
            std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
        if (kind == 1) mesh.triangles.pop_back();  // otherwise the orientation could be repaired
        if (kind == 2) {
            TriangleMesh shell = mesh;
            for (Vec3& p : shell.positions) p = 1.01 * (p - Vec3(7.1, 7.2, 7.3)) + Vec3(7.1, 7.2, 7.3);
            shell.triangles.resize(count / 3);
            mesh.append(shell);
        }
        if (kind == 3) std::erase_if(mesh.triangles, [&](auto&) { return random.unit() < 0.1; });
        if (kind == 4) {  // a soup with gaps everywhere
            TriangleMesh soup;
            for (const geometry::Triangle& t : mesh.triangles) {
                const auto first = static_cast<std::uint32_t>(soup.positions.size());
                const Vec3 middle = (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3;
                for (const std::uint32_t v : t)
                    soup.positions.push_back(mesh.positions[v] + 0.02 * (middle - mesh.positions[v]));
                soup.triangles.push_back({first, first + 1, first + 2});
            }
            mesh = soup;
        }
        SolidifyReport report;
        const NodeGrid grid = solid(mesh, unit_grid(14), report);
        ASSERT_FALSE(report.exact) << kind;
        const geometry::WindingNumber winding(geometry::weld_equal_vertices(mesh));
        std::size_t sure = 0;
        for (int z = 1; z < 14; ++z)
            for (int y = 1; y < 14; ++y)
                for (int x = 1; x < 14; ++x) {
                    const double w = std::abs(winding.at(grid.rest().node_position({x, y, z})));
                    if (std::abs(w - 0.5) < 0.01) continue;
                    ++sure;
                    ASSERT_EQ(grid.inside({x, y, z}), w > 0.5) << kind << ": " << x << " " << y << " " << z;
                }
        EXPECT_GT(sure, 2100U) << kind;
        EXPECT_EQ(trouble(grid), "") << kind;
    }
}

TEST(Solidify, MixedOrientationsAreRepaired) {
    const TriangleMesh good = geometry::make_sphere(5.3, 3);
    const RestGrid rest = geometry::grid_around(good.bounds(), 0.5);
    const std::vector<bool> expected = inside_of(solid(good, rest));
    for (const std::size_t every : {1000, 10, 3}) {
        TriangleMesh mesh = good;
        for (std::size_t t = 0; t < mesh.triangles.size(); t += every)
            std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
        SolidifyReport report;
        const NodeGrid grid = solid(mesh, rest, report);
        EXPECT_TRUE(report.exact);
        EXPECT_EQ(report.notes.size(), 1U);
        EXPECT_EQ(trouble(grid), "");
        EXPECT_EQ(inside_of(grid), expected);
    }
}

TEST(Solidify, AMissingAndAReversedTriangleUseTheWindingNumber) {
    const TriangleMesh good = geometry::make_sphere(5.3, 3);
    TriangleMesh mesh = good;
    std::swap(mesh.triangles[10][0], mesh.triangles[10][1]);
    mesh.triangles.pop_back();
    const RestGrid rest = geometry::grid_around(mesh.bounds(), 0.5);
    SolidifyReport report;
    const NodeGrid grid = solid(mesh, rest, report);
    EXPECT_FALSE(report.exact);
    EXPECT_EQ(trouble(grid), "");
    const std::vector<bool> a = inside_of(grid), b = inside_of(solid(good, rest));
    std::size_t different = 0;
    for (std::size_t i = 0; i < a.size(); ++i) different += a[i] != b[i];
    EXPECT_LE(different, 12U) << "only beside the triangles";
}

TEST(Solidify, SheetsAreRefusedAndShellsAreNot) {
    for (const double height : {0.0, 0.05, 0.2, 0.3, 0.5}) {
        TriangleMesh hills = geometry::make_plane_sheet(Vec3(0, 0, 0), Vec3::UnitZ(), 1.5, 20);
        for (Vec3& p : hills.positions) p[2] += height * std::sin(3 * p[0]) * std::cos(4 * p[1]);
        EXPECT_THROW(solid(hills, geometry::grid_around(hills.bounds(), 0.06)), InputError) << height;
    }
    TriangleMesh half = geometry::make_sphere(1, 4);
    std::erase_if(half.triangles, [&](const geometry::Triangle& t) {
        return half.positions[t[0]][2] + half.positions[t[1]][2] + half.positions[t[2]][2] < 0;
    });
    SolidifyReport report;
    const NodeGrid grid = solid(half, geometry::grid_around(half.bounds(), 0.06), report);
    EXPECT_NEAR(static_cast<double>(report.nodes_inside) * std::pow(0.06, 3), 2.0 / 3 * std::numbers::pi,
                0.1);
    EXPECT_EQ(trouble(grid), "");
}

TEST(Solidify, ScaleAndPositionDoNotMatter) {
    Random random(5);
    TriangleMesh open = geometry::make_sphere(4.1, 3);
    open.triangles.resize(open.triangles.size() - 20);
    const TriangleMesh shapes[] = {
        turned(geometry::make_box(Vec3(5, 6, 7)), random_rotation(random)),
        turned(geometry::make_torus(3, 1.2, 32, 16), random_rotation(random)),
        open,
    };
    for (const TriangleMesh& shape : shapes) {
        const RestGrid rest = geometry::grid_around(shape.bounds(), 0.5);
        const NodeGrid grid = solid(shape, rest);
        for (const double scale : {1e-6, 1e-3, 1e3, 1e7}) {
            const TriangleMesh mesh = scaled(shape, scale);
            const NodeGrid other = solid(mesh, geometry::grid_around(mesh.bounds(), 0.5 * scale));
            ASSERT_EQ(inside_of(grid), inside_of(other)) << scale;
            ASSERT_EQ(cut_edges_of(grid), cut_edges_of(other)) << scale;
            EXPECT_EQ(trouble(other), "") << scale;
        }
        for (const Vec3& offset : {Vec3(1e5, 0, 0), Vec3(-1e5, 1e5, 3e4)}) {
            const TriangleMesh mesh = moved(shape, offset);
            const NodeGrid other = solid(mesh, geometry::grid_around(mesh.bounds(), 0.5));
            ASSERT_EQ(inside_of(grid), inside_of(other)) << offset.transpose();
            ASSERT_EQ(cut_edges_of(grid), cut_edges_of(other)) << offset.transpose();
            EXPECT_EQ(trouble(other), "") << offset.transpose();
        }
    }
}

TEST(Solidify, ThreadsDoNotMatter) {
    TriangleMesh mesh = geometry::make_sphere(4.1, 3);
    mesh.triangles.pop_back();
    const RestGrid rest = geometry::grid_around(mesh.bounds(), 0.4);
    SolidifyReport report;
    const NodeGrid one = solidify(mesh, rest, report, Parallel(1));
    const NodeGrid three = solidify(mesh, rest, report, Parallel(3));
    EXPECT_EQ(canonical_quads(Surface(one)), canonical_quads(Surface(three)));
}

TEST(Solidify, RefusesMeshesWithoutASolid) {
    const RestGrid rest = unit_grid(8);
    EXPECT_THROW(solid({}, rest), InputError);
    TriangleMesh mesh = box_between(Vec3::Constant(1.5), Vec3::Constant(5.5));
    mesh.triangles[3][1] = 8;
    EXPECT_THROW(solid(mesh, rest), InputError) << "a vertex that is not there";
    mesh = box_between(Vec3::Constant(1.5), Vec3::Constant(5.5));
    mesh.positions[4][2] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(solid(mesh, rest), InputError);
    EXPECT_THROW(solid(box_between(Vec3::Constant(2.2), Vec3::Constant(2.8)), rest), InputError)
        << "between the nodes";
    EXPECT_THROW(solid(geometry::make_plane_sheet(Vec3::Constant(3.3), Vec3::UnitZ(), 2), rest), InputError)
        << "a sheet encloses nothing";
}

}  // namespace
}  // namespace splitcubes::splitting
