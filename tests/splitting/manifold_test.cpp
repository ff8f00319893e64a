// For any cut the surface is a closed, oriented 2-manifold: all pairs of cells that share a face, and many
// small grids.
#include "splitting/fan_check.h"
#include "splitting/shrink.h"

#include <gtest/gtest.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/splitting/table.h>
#include <splitcubes/splitting/validate.h>

#include <bit>
#include <string>

namespace splitcubes::splitting::cases {
namespace {

// Returns the role of a quad on a face: 1 if the face is its first, 2 if it is its second, 0 if the quad does
// not touch the face; times 4, plus the instance.
int part_on(int face, const TableQuad& q) {
    if (q.first_face == face) return 4 + q.first_instance;
    if (q.second_face == face) return 8 + q.second_instance;
    return 0;
}

// Checks all masks of two adjacent cells along the axis that agree on the shared face: each half edge of the
// face has one quad on either side; both end at the same instance of the face's vertex and traverse the
// common side (from the edge vertex to the face vertex) in opposite directions.
std::size_t check_pairs(int axis) {
    const int above = 2 * axis + 1,
              below = 2 * axis;  // the shared face as seen by the lower and the upper cell
    // Per mask: the quad roles at each half edge of the face, in ring order.
    using Parts = std::array<std::int8_t, 8>;
    const auto parts_of = [](CellMask mask, int face) {
        Parts parts{};
        for (const TableQuad& q : Table::get().quads(mask)) {
            const int part = part_on(face, q);
            if (part == 0) continue;
            for (int k = 0; k < 4; ++k)
                if (face_edge(face, k) == q.edge)
                    parts[static_cast<std::size_t>(2 * k + (face_corner(face, k) == q.corner ? 0 : 1))] =
                        static_cast<std::int8_t>(part);
        }
        return parts;
    };
    std::array<std::vector<Parts>, 16> lower, upper;
    for (int m = 0; m < mask_count; ++m) {
        const auto mask = static_cast<CellMask>(m);
        lower[face_mask(mask, above)].push_back(parts_of(mask, above));
        upper[face_mask(mask, below)].push_back(parts_of(mask, below));
    }
    std::size_t pairs = 0;
    for (std::size_t ring = 0; ring < 16; ++ring)
        for (const Parts& a : lower[ring])
            for (const Parts& b : upper[ring]) {
                ++pairs;
                for (std::size_t half = 0; half < 8; ++half) {
                    const bool cut = ring >> (half / 2) & 1U;
                    if (!cut && a[half] == 0 && b[half] == 0) continue;
                    // Parts 1 and 2 in either order, and the same instance.
                    if (!cut || a[half] / 4 + b[half] / 4 != 3 || a[half] / 4 == 0 || b[half] / 4 == 0 ||
                        a[half] % 4 != b[half] % 4) {
                        ADD_FAILURE() << "ring " << ring << ", half edge " << half;
                        return pairs;
                    }
                }
            }
    return pairs;
}

TEST(AnyCut, AllPairsOfCellsFitAtTheFaceTheyShare) {
    std::size_t pairs = 0;
    for (int axis = 0; axis < 3; ++axis) pairs += check_pairs(axis);
    EXPECT_EQ(pairs, 3U * 4096U * 256U);
    RecordProperty("cell_pairs", std::to_string(pairs));
}

// A random grid of side^3 cells and its quads directly from the table, without a NodeGrid or a Surface;
// side-1 nodes per axis may be inside.
class TableGrid {
  public:
    explicit TableGrid(int side) : side_(side), n_(side + 1), nodes_(static_cast<std::size_t>(n_ * n_ * n_)) {
        for (auto& axis : cut_) axis.resize(nodes_.size());
        for (int z = 0; z <= side; ++z)
            for (int y = 0; y <= side; ++y)
                for (int x = 0; x <= side; ++x)
                    if (std::min({x, y, z}) > 0 && std::max({x, y, z}) < side)
                        inner_.push_back(index(x, y, z));
        for (int c = 0; c < corner_count; ++c) corner_[at(c)] = node_step(c);
        for (int e = 0; e < edge_count; ++e) edge_[at(e)] = node_step(edge_corner(e, 0));
        for (int f = 0; f < face_count; ++f) face_[at(f)] = f & 1 ? stride(face_axis(f)) : 0;
    }
    // Probabilities as numbers out of 256.
    void randomise(Random& random, unsigned fill, unsigned density) {
        std::fill(nodes_.begin(), nodes_.end(), std::uint8_t{0});
        for (auto& axis : cut_) std::fill(axis.begin(), axis.end(), std::uint8_t{0});
        for (const std::size_t node : inner_) nodes_[node] = (random.bits() >> 56) < fill;
        for (std::size_t axis = 0; axis < 3; ++axis)
            for (std::size_t node = 0; node + stride(static_cast<int>(axis)) < nodes_.size(); ++node) {
                const bool lower = nodes_[node], upper = nodes_[node + stride(static_cast<int>(axis))];
                cut_[axis][node] = lower != upper || (lower && (random.bits() >> 56) < density);
            }
    }
    // Vertices are (edge, end), (face, instance) and (cell, fan).
    std::size_t vertex_count() const { return nodes_.size() * (3 * 2 + 3 * 4 + 8); }
    template <class Visit>
    void quads(const Visit& visit) const {
        const Table& table = Table::get();
        for (int z = 0; z < side_; ++z)
            for (int y = 0; y < side_; ++y)
                for (int x = 0; x < side_; ++x) {
                    const std::size_t cell = index(x, y, z);
                    const CellMask mask = mask_of(cell);
                    if (mask == 0) continue;
                    for (const TableQuad& q : table.quads(mask)) {
                        if (!nodes_[cell + corner_[q.corner]]) continue;
                        visit(std::array{edge_vertex(cell, q),
                                         face_vertex(cell, q.first_face, q.first_instance),
                                         static_cast<std::uint32_t>(18 * nodes_.size() + 8 * cell + q.fan),
                                         face_vertex(cell, q.second_face, q.second_instance)});
                    }
                }
    }
    std::size_t cell_count() const { return static_cast<std::size_t>(side_ * side_ * side_); }
    // Returns the same grid as a case for the library.
    CutCase as_case() const {
        CutCase out;
        out.node_count = Vec3i::Constant(n_);
        for (int z = 0; z < n_; ++z)
            for (int y = 0; y < n_; ++y)
                for (int x = 0; x < n_; ++x) {
                    if (nodes_[index(x, y, z)]) out.inside.emplace_back(x, y, z);
                    for (int axis = 0; axis < 3; ++axis)
                        if (cut_[at(axis)][index(x, y, z)]) out.cuts.push_back({{{x, y, z}, axis}});
                }
        return out;
    }

  private:
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }
    std::size_t index(int x, int y, int z) const { return at(x + n_ * (y + n_ * z)); }
    std::size_t stride(int axis) const { return axis == 0 ? 1 : axis == 1 ? at(n_) : at(n_ * n_); }
    std::size_t node_step(int corner) const {
        return index(corner_bit(corner, 0), corner_bit(corner, 1), corner_bit(corner, 2));
    }
    CellMask mask_of(std::size_t cell) const {
        unsigned mask = 0;
        for (unsigned e = 0; e < edge_count; ++e)
            mask |= static_cast<unsigned>(cut_[e / 4][cell + edge_[e]]) << e;
        return static_cast<CellMask>(mask);
    }
    std::uint32_t edge_vertex(std::size_t cell, const TableQuad& q) const {
        const std::size_t end = edge_corner(q.edge, 0) == q.corner ? 0 : 1;
        return static_cast<std::uint32_t>(2 * ((q.edge / 4U) * nodes_.size() + cell + edge_[q.edge]) + end);
    }
    std::uint32_t face_vertex(std::size_t cell, std::size_t face, std::size_t instance) const {
        return static_cast<std::uint32_t>(6 * nodes_.size() +
                                          4 * ((face / 2) * nodes_.size() + cell + face_[face]) + instance);
    }

    int side_, n_;
    std::vector<std::uint8_t> nodes_;
    std::array<std::vector<std::uint8_t>, 3> cut_;  // at the lower node
    std::vector<std::size_t> inner_;
    std::array<std::size_t, 8> corner_{};
    std::array<std::size_t, 12> edge_{};
    std::array<std::size_t, 6> face_{};
};

std::string surface_trouble(const CutCase& c) {
    const NodeGrid grid = grid_of(c);
    const Surface surface(grid);
    FanCheck check;
    check.reset(surface.vertices().size());
    for (const SurfaceCell& cell : surface.cells())
        for (const SurfaceQuad& q : surface.quads(cell)) check.add_quad(q.vertices);
    return check.closed_oriented_manifold() ? "" : "not a closed oriented manifold";
}

// Checks random nodes with cuts at densities from none to all; mostly small grids.
void check_grids(int grids, std::uint64_t seed) {
    std::vector<TableGrid> sides;
    for (int side = 2; side <= 5; ++side) sides.emplace_back(side);
    Random random(seed);
    FanCheck check;
    std::size_t cells = 0, quads = 0;
    for (int trial = 0; trial < grids; ++trial) {
        const std::uint32_t dice = random.below(100);
        TableGrid& grid = sides[dice < 5 ? 0 : dice < 80 ? 1 : dice < 95 ? 2 : 3];
        const std::uint32_t fill = random.below(4) == 0 ? 256 : random.below(257);
        grid.randomise(random, fill, random.below(257));
        check.reset(grid.vertex_count());
        grid.quads([&](const std::array<std::uint32_t, 4>& q) {
            check.add_quad(q);
            ++quads;
        });
        ASSERT_TRUE(check.closed_oriented_manifold()) << shrunk_report(grid.as_case(), surface_trouble);
        cells += grid.cell_count();
    }
    testing::Test::RecordProperty("grids", grids);
    testing::Test::RecordProperty("cells", std::to_string(cells));
    testing::Test::RecordProperty("quads", std::to_string(quads));
}

TEST(AnyCut, MillionsOfCellsAreClosedOrientedManifolds) {
    check_grids(1000000, 41);
}

TEST(AnyCut, ThousandsOfGridsAreClosedOrientedManifolds) {
    check_grids(4000, 42);
}

// The Surface itself on fewer grids, checked by both tests; its quads must be the table's.
TEST(AnyCut, TheSurfaceMatchesTheTable) {
    Random random(43);
    for (int trial = 0; trial < 800; ++trial) {
        TableGrid table(2 + static_cast<int>(random.below(4)));
        const std::uint32_t fill = 64 + random.below(193);
        table.randomise(random, fill, random.below(257));
        const CutCase c = table.as_case();
        const NodeGrid grid = grid_of(c);
        ASSERT_TRUE(validate(grid).empty());
        const Surface surface(grid);
        std::size_t quads = 0;
        table.quads([&](const auto&) { ++quads; });
        ASSERT_EQ(surface.quad_count(), quads);
        ASSERT_EQ(surface_trouble(c), "") << shrunk_report(c, surface_trouble);
        ASSERT_TRUE(validate(grid, surface, Pieces(grid)).empty());
    }
}

// Returns quads as a mesh; the check ignores positions.
geometry::MeshCheck slow_check(const std::vector<std::array<std::uint32_t, 4>>& quads, std::size_t vertices) {
    geometry::TriangleMesh mesh;
    mesh.positions.assign(vertices, Vec3::Zero());
    for (const auto& q : quads) {
        mesh.triangles.push_back({q[0], q[1], q[2]});
        mesh.triangles.push_back({q[0], q[2], q[3]});
    }
    return geometry::check_mesh(mesh);
}

// Adds one random fault.
void damage(std::vector<std::array<std::uint32_t, 4>>& quads, Random& random) {
    const auto any = [&]() -> std::array<std::uint32_t, 4>& {
        return quads[random.below(static_cast<std::uint32_t>(quads.size()))];
    };
    const std::uint32_t a = any()[random.below(4)], b = any()[random.below(4)];
    switch (random.below(6)) {
        case 0:
            any() = quads.back(), quads.pop_back();
            break;  // a missing quad
        case 1:
            std::swap(any()[1], any()[3]);
            break;  // two swapped vertices, or one reversed quad
        case 2:
            quads.push_back(any());
            break;  // a duplicate
        case 3:
            any()[random.below(4)] = a;
            break;  // a wrong vertex
        case 4:
            std::reverse(any().begin() + 1, any().end());
            break;
        default:  // two vertices become one: a pinch, or a fold
            for (auto& q : quads) std::replace(q.begin(), q.end(), a, b);
    }
}

TEST(AnyCut, TheFastCheckAgreesWithTheSlowOne) {
    Random random(44);
    FanCheck check;
    int sound = 0, faulty = 0;
    for (int trial = 0; trial < 4000; ++trial) {
        TableGrid grid(2 + static_cast<int>(random.below(3)));
        const std::uint32_t fill = 128 + random.below(129);
        grid.randomise(random, fill, random.below(200));
        std::vector<std::array<std::uint32_t, 4>> quads;
        grid.quads([&](const auto& q) { quads.push_back(q); });
        if (quads.empty()) continue;
        if (random.below(4) > 0) damage(quads, random);
        check.reset(grid.vertex_count());
        for (const auto& q : quads) check.add_quad(q);
        const bool slow = slow_check(quads, grid.vertex_count()).valid();
        ASSERT_EQ(check.closed_oriented_manifold(), slow) << "trial " << trial;
        ++(slow ? sound : faulty);
    }
    EXPECT_GT(sound, 900);
    EXPECT_GT(faulty, 2000);
}

}  // namespace
}  // namespace splitcubes::splitting::cases
