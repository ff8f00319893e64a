#include "fields.h"

#include <gtest/gtest.h>
#include <tetrahedra/cases.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>

namespace {

using namespace splitcubes;
using namespace splitcubes::tetrahedra;
using fixtures::box_of;

constexpr Material unit{.youngs_modulus = 1, .poisson_ratio = 0, .density = 1};

double volume_of(const Mesh& mesh) {
    return mass_matrix(mesh, unit).sum() / 3;
}

// Faces that only one element has; two elements at most share a face.
std::size_t surface_faces(const Mesh& mesh) {
    std::map<std::set<int>, int> faces;
    for (const std::array<int, 10>& element : mesh.elements)
        for (std::size_t k = 0; k < 4; ++k) {
            std::set<int> face(element.begin(), element.begin() + 4);
            face.erase(element[k]);
            ++faces[face];
        }
    std::size_t single = 0;
    for (const auto& [face, count] : faces) {
        EXPECT_LE(count, 2);
        single += count == 1;
    }
    return single;
}

TEST(TetrahedraMesh, DivideEvensOutTheCells) {
    const std::vector<double> ends = divide({0, 1, 4}, 8);
    ASSERT_EQ(ends.size(), 9U);
    for (std::size_t k = 0; k < ends.size(); ++k) EXPECT_NEAR(ends[k], 0.5 * static_cast<double>(k), 1e-15);
    EXPECT_EQ(divide({0, 1, 4}, 1).size(), 3U);  // a cell each, however few are wanted
}

TEST(TetrahedraMesh, BoxesAndBallsFillTheirVolumeFaceToFace) {
    for (const Order order : {Order::linear, Order::quadratic}) {
        const Mesh box = box_of({1, 2, 3}, {2, 3, 4}, order);
        EXPECT_EQ(box.elements.size(), 6U * 2 * 3 * 4);
        EXPECT_NEAR(volume_of(box), 6, 1e-12);
        EXPECT_EQ(surface_faces(box), 2U * 2 * (2 * 3 + 3 * 4 + 4 * 2));
        for (const Vec3i& cells : {Vec3i(4, 4, 4), Vec3i(5, 4, 5)}) {
            const Mesh ball = make_ball(1, cells, order);
            EXPECT_EQ(surface_faces(ball),
                      static_cast<std::size_t>(
                          4 * (cells[0] * cells[1] + cells[1] * cells[2] + cells[2] * cells[0])));
            const double missing = 1 - volume_of(ball) / (4 * std::numbers::pi / 3);
            EXPECT_GT(missing, 0);
            EXPECT_LT(missing, order == Order::linear ? 0.2 : 0.01);
        }
    }
}

TEST(TetrahedraMesh, ASlitDoublesTheNodesOfItsFaces) {
    for (const Order order : {Order::linear, Order::quadratic}) {
        Mesh mesh = box_of({2, 1, 1}, {4, 2, 2}, order);
        const std::size_t nodes = mesh.nodes.size(), faces = surface_faces(mesh);
        open_slit(mesh, 1, [](const Vec3& p) { return p.z() > 0.5 + 1e-9; });
        // The upper half of the plane has 2 x 1 cells above the edge, of two triangles on two sides.
        EXPECT_EQ(mesh.nodes.size() - nodes, order == Order::linear ? 3U : 10U);
        EXPECT_EQ(surface_faces(mesh) - faces, 8U);
        EXPECT_NEAR(volume_of(mesh), 2, 1e-12);
    }
}

TEST(TetrahedraMesh, AsManyNodesAsWanted) {
    for (const Order order : {Order::linear, Order::quadratic})
        for (const int wanted : {40, 135, 320, 1080, 2560}) {
            const Vec3i cells = choose_cells(
                {.lengths = {0.25, 0.05, 0.05}, .held_planes = 1, .square = true}, order, wanted);
            const Vec3i nodes = static_cast<int>(order) * cells + Vec3i::Ones();
            EXPECT_NEAR((nodes[0] - 1) * nodes[1] * nodes[2], wanted, 0.1 * wanted);
            const double aspect = 5.0 * cells[1] / cells[0];
            EXPECT_LT(std::abs(std::log(aspect)), std::log(2.6));
        }
}

}  // namespace
