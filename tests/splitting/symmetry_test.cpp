// Table and placement have no preferred direction: the configuration of a rotated or mirrored cell is the
// rotated or mirrored configuration.
#include "splitting/symmetries.h"

#include "splitting/shrink.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>

namespace splitcubes::splitting::cases {
namespace {

TEST(Symmetries, AreTheGroupOfTheCube) {
    const std::vector<Symmetry> all = all_symmetries();
    ASSERT_EQ(all.size(), 48U);
    std::set<std::array<int, 8>> different;
    int mirrors = 0;
    for (const Symmetry& g : all) {
        std::array<int, 8> corners{};
        for (int c = 0; c < corner_count; ++c) corners[static_cast<std::size_t>(c)] = g.corner(c);
        different.insert(corners);
        mirrors += g.mirrors();
        Mat3 matrix;
        for (int a = 0; a < 3; ++a) matrix.col(a) = g.direction(Vec3::Unit(a));
        ASSERT_EQ(matrix.determinant(), g.mirrors() ? -1 : 1);
        for (int f = 0; f < face_count; ++f)
            for (int k = 0; k < 4; ++k) {
                const int corner = g.corner(face_corner(f, k));
                ASSERT_EQ(corner_bit(corner, face_axis(g.face(f))), g.face(f) & 1);
            }
    }
    EXPECT_EQ(different.size(), 48U);
    EXPECT_EQ(mirrors, 24);
}

// Returns the corners of the face vertex instance, as bits.
unsigned instance_corners(CellMask mask, int face, int instance) {
    const FaceConfiguration& configuration = Table::get().face(face_mask(mask, face));
    unsigned out = 0;
    for (int k = 0; k < 4; ++k)
        if (configuration.instance[static_cast<std::size_t>(k)] == instance)
            out |= 1U << face_corner(face, k);
    return out;
}

unsigned mapped_corners(const Symmetry& g, unsigned corners) {
    unsigned out = 0;
    for (int c = 0; c < corner_count; ++c)
        if (corners >> c & 1U) out |= 1U << g.corner(c);
    return out;
}

// A quad without the table's arbitrary indices: corner, edge, then face and corners of the instance of its
// first and second face vertex.
using PlainQuad = std::array<unsigned, 6>;

PlainQuad plain(CellMask mask, const TableQuad& q) {
    return {q.corner,      q.edge,
            q.first_face,  instance_corners(mask, q.first_face, q.first_instance),
            q.second_face, instance_corners(mask, q.second_face, q.second_instance)};
}

PlainQuad mapped(const Symmetry& g, const PlainQuad& q) {
    PlainQuad out{static_cast<unsigned>(g.corner(static_cast<int>(q[0]))),
                  static_cast<unsigned>(g.edge(static_cast<int>(q[1]))),
                  static_cast<unsigned>(g.face(static_cast<int>(q[2]))),
                  mapped_corners(g, q[3]),
                  static_cast<unsigned>(g.face(static_cast<int>(q[4]))),
                  mapped_corners(g, q[5])};
    if (g.mirrors()) {
        std::swap(out[2], out[4]);
        std::swap(out[3], out[5]);
    }
    return out;
}

// The table's entry of a mask, named by its parts instead of indices. Each `mapped_` function applies a
// symmetry to its type.
struct PlainCell {
    std::set<unsigned> components;            // corners of each
    std::set<std::set<PlainQuad>> fans;       // quads of each
    std::map<unsigned, bool> groups;          // edges of each: oriented?
    std::set<std::array<unsigned, 2>> fan;    // per fan: bits of its edges, bits of its group's edges
    std::set<std::array<unsigned, 3>> sides;  // oriented groups: edges, those of one side and of the other

    bool operator==(const PlainCell&) const = default;
};

// Returns one of the two ends of each edge: bit 2e + end.
unsigned half_edges_of_side(const CellConfiguration& cell, unsigned edges, int side) {
    unsigned out = 0;
    for (int e = 0; e < edge_count; ++e)
        if (edges >> e & 1U)
            out |= 1U << (2 * e + (cell.edge_side[static_cast<std::size_t>(e)] * side > 0 ? 0 : 1));
    return out;
}

unsigned mapped_edges(const Symmetry& g, unsigned edges) {
    return g.mask(static_cast<CellMask>(edges));
}

unsigned mapped_half_edges(const Symmetry& g, unsigned halves) {
    unsigned out = 0;
    for (int e = 0; e < edge_count; ++e)
        for (int end = 0; end < 2; ++end)
            if (halves >> (2 * e + end) & 1U)
                out |= 1U << (2 * g.edge(e) +
                              (edge_corner(g.edge(e), 0) == g.corner(edge_corner(e, end)) ? 0 : 1));
    return out;
}

std::array<unsigned, 3> sorted_sides(unsigned edges, unsigned one, unsigned other) {
    return {edges, std::min(one, other), std::max(one, other)};
}

PlainCell plain(CellMask mask) {
    const CellConfiguration& cell = Table::get().cell(mask);
    PlainCell out;
    std::map<int, unsigned> components;
    for (int c = 0; c < corner_count; ++c) components[cell.component[static_cast<std::size_t>(c)]] |= 1U << c;
    for (const auto& [name, corners] : components) out.components.insert(corners);
    std::map<int, unsigned> groups;
    for (int e = 0; e < edge_count; ++e)
        if (mask >> e & 1) groups[cell.edge_group[static_cast<std::size_t>(e)]] |= 1U << e;
    for (const auto& [name, edges] : groups) {
        const bool oriented = cell.group_oriented[static_cast<std::size_t>(name)];
        out.groups[edges] = oriented;
        if (oriented)
            out.sides.insert(
                sorted_sides(edges, half_edges_of_side(cell, edges, 1), half_edges_of_side(cell, edges, -1)));
    }
    std::map<int, std::set<PlainQuad>> fans;
    std::map<int, unsigned> fan_edges;
    for (const TableQuad& q : Table::get().quads(mask)) {
        fans[q.fan].insert(plain(mask, q));
        fan_edges[q.fan] |= 1U << q.edge;
    }
    for (const auto& [name, quads] : fans) {
        out.fans.insert(quads);
        out.fan.insert({fan_edges[name], groups[cell.fan_group[static_cast<std::size_t>(name)]]});
    }
    return out;
}

PlainCell mapped(const Symmetry& g, const PlainCell& cell) {
    PlainCell out;
    for (const unsigned corners : cell.components) out.components.insert(mapped_corners(g, corners));
    for (const auto& fan : cell.fans) {
        std::set<PlainQuad> quads;
        for (const PlainQuad& q : fan) quads.insert(mapped(g, q));
        out.fans.insert(quads);
    }
    for (const auto& [edges, oriented] : cell.groups) out.groups[mapped_edges(g, edges)] = oriented;
    for (const auto& f : cell.fan) out.fan.insert({mapped_edges(g, f[0]), mapped_edges(g, f[1])});
    for (const auto& s : cell.sides)
        out.sides.insert(
            sorted_sides(mapped_edges(g, s[0]), mapped_half_edges(g, s[1]), mapped_half_edges(g, s[2])));
    return out;
}

void expect_symmetric_table(int step) {
    std::vector<PlainCell> cells(mask_count);
    for (int m = 0; m < mask_count; ++m) cells[static_cast<std::size_t>(m)] = plain(static_cast<CellMask>(m));
    for (const Symmetry& g : all_symmetries())
        for (int m = 0; m < mask_count; m += step) {
            const CellMask image = g.mask(static_cast<CellMask>(m));
            const CellConfiguration &a = Table::get().cell(static_cast<CellMask>(m)),
                                    &b = Table::get().cell(image);
            ASSERT_EQ(a.component_count, b.component_count) << m;
            ASSERT_EQ(a.fan_count, b.fan_count) << m;
            ASSERT_EQ(a.group_count, b.group_count) << m;
            ASSERT_TRUE(mapped(g, cells[static_cast<std::size_t>(m)]) == cells[image])
                << "masks " << m << " and " << image;
        }
}

TEST(TableSymmetry, AThirteenthOfTheMasks) {
    expect_symmetric_table(13);
}

TEST(TableSymmetry, AllMasks) {
    expect_symmetric_table(1);
}

// Returns the positions of all vertices of one cell with all corners inside, by name: edge vertices by half
// edge, face vertices by face and corners of the instance, centre vertices by the bits of their fan's half
// edges.
std::map<std::array<unsigned, 3>, Vec3> vertex_positions(const std::vector<EdgeCut>& cuts) {
    RestGrid rest;
    rest.node_count = Vec3i::Constant(2);
    NodeGrid grid(rest);
    for (int row = 0; row < 4; ++row) grid.set_inside_row(row & 1, row >> 1, 0, 2);
    for (const EdgeCut& c : cuts) grid.cut(c.edge, c.parameter, c.normal, Origin::cut, c.cut);
    const Surface surface(grid);
    std::map<std::array<unsigned, 3>, Vec3> out;
    if (surface.cells().empty()) return out;
    const SurfaceCell& cell = surface.cells()[0];
    const auto table = Table::get().quads(cell.mask);
    const auto quads = surface.quads(cell);
    std::map<int, unsigned> halves;
    for (const TableQuad& q : table)
        halves[q.fan] |= 1U << (2 * q.edge + (edge_corner(q.edge, 0) == q.corner ? 0 : 1));
    for (std::size_t i = 0; i < table.size(); ++i) {
        const TableQuad& q = table[i];
        const auto at = [&](std::size_t k) -> const Vec3& {
            return surface.vertices()[quads[i].vertices[k]].rest;
        };
        out[{0, 1U << (2 * q.edge + (edge_corner(q.edge, 0) == q.corner ? 0 : 1)), 0}] = at(0);
        out[{1, q.first_face, instance_corners(cell.mask, q.first_face, q.first_instance)}] = at(1);
        out[{2, halves[q.fan], 0}] = at(2);
        out[{1, q.second_face, instance_corners(cell.mask, q.second_face, q.second_instance)}] = at(3);
    }
    return out;
}

std::array<unsigned, 3> mapped_name(const Symmetry& g, const std::array<unsigned, 3>& name) {
    if (name[0] == 1)
        return {1, static_cast<unsigned>(g.face(static_cast<int>(name[1]))), mapped_corners(g, name[2])};
    return {name[0], mapped_half_edges(g, name[1]), 0};
}

// Returns an empty text if the surface of the mapped crossings is the mapped surface, to 1e-12 of a cell.
std::string placement_trouble(const Symmetry& g, const std::vector<EdgeCut>& cuts) {
    std::vector<EdgeCut> images;
    for (const EdgeCut& c : cuts) images.push_back(g.crossing(c));
    const auto positions = vertex_positions(cuts), image_positions = vertex_positions(images);
    if (positions.size() != image_positions.size()) return "another number of vertices";
    for (const auto& [name, position] : positions) {
        const auto image = image_positions.find(mapped_name(g, name));
        if (image == image_positions.end()) return "a vertex has no image";
        const double apart = (image->second - g.position(position)).norm();
        if (!(apart <= 1e-12))
            return std::array{"an edge", "a face", "a centre"}[name[0]] + std::string(" vertex is ") +
                   std::to_string(apart) + " cells off";
    }
    return "";
}

// Checks crossings made by `make`, `repeats` times for every mask.
void expect_equivariant_placement(int repeats, std::uint64_t seed,
                                  const std::function<std::vector<EdgeCut>(CellMask, Random&)>& make) {
    const std::vector<Symmetry> all = all_symmetries();
    Random random(seed);
    for (int trial = 0; trial < repeats * mask_count; ++trial) {
        const auto mask = static_cast<CellMask>(trial % mask_count);
        const std::vector<EdgeCut> cuts = make(mask, random);
        const Symmetry& g = all[random.below(48)];
        if (placement_trouble(g, cuts).empty()) continue;
        const auto trouble = [&](const CutCase& c) { return placement_trouble(g, c.cuts); };
        FAIL() << "axes to " << g.to[0] << g.to[1] << g.to[2] << " flipped " << g.flip[0] << g.flip[1]
               << g.flip[2] << ": " << shrunk_report({Vec3i::Constant(2), {}, cuts}, trouble);
    }
    testing::Test::RecordProperty("configurations", repeats * mask_count);
}

std::vector<EdgeCut> anywhere(CellMask mask, Random& random) {
    std::vector<EdgeCut> cuts;
    for (int e = 0; e < edge_count; ++e)
        if (mask >> e & 1)
            cuts.push_back({cell_edge(Vec3i::Zero(), e), random.unit(), random_normal(random),
                            static_cast<std::int32_t>(random.below(3)) - 1});
    return cuts;
}

// Returns crossings of up to three smooth sheets: normals of a sheet are within 6 degrees of one of three
// directions that are within 30 degrees of perpendicular to each other.
std::vector<EdgeCut> of_three_sheets(CellMask mask, Random& random) {
    const Vec3 about = random_normal(random).normalized();
    const Quat turn(Eigen::AngleAxisd(random.uniform(0, 3), about));
    std::vector<EdgeCut> cuts = anywhere(mask, random);
    for (EdgeCut& c : cuts) {
        const Vec3 sheet = turn * Vec3::Unit(static_cast<int>(random.below(3)));
        const double sign = random.below(2) ? 1 : -1;
        c.normal = sign * (sheet + 0.1 / std::sqrt(3.0) * random_normal(random));
    }
    return cuts;
}

TEST(PlacementSymmetry, OfUpToThreeSmoothSheets) {
    expect_equivariant_placement(5, 31, of_three_sheets);
}

TEST(PlacementSymmetry, OfAFewCrossings) {
    // Up to two crossings per face and no sheets to separate: any normals.
    expect_equivariant_placement(5, 32, [](CellMask mask, Random& random) {
        while (std::popcount(mask) > 2)
            mask = static_cast<CellMask>(mask & (1U << random.below(12) ^ 0xfffU));
        return anywhere(mask, random);
    });
}

TEST(PlacementSymmetry, OfAnyCrossings) {
    expect_equivariant_placement(5, 33, anywhere);
}

// Returns each quad of a grid by its cell and half edge, with the positions of its corners in cells.
std::map<std::array<int, 8>, std::array<Vec3, 4>> quad_positions(const CutCase& c) {
    const NodeGrid grid = grid_of(c);
    const Surface surface(grid);
    std::map<std::array<int, 8>, std::array<Vec3, 4>> out;
    for (const SurfaceCell& cell : surface.cells())
        for (const SurfaceQuad& q : surface.quads(cell)) {
            const SurfaceVertex& edge = surface.vertices()[q.vertices[0]];
            std::array<Vec3, 4>& at =
                out[{cell.lowest_node[0], cell.lowest_node[1], cell.lowest_node[2], edge.lowest_node[0],
                     edge.lowest_node[1], edge.lowest_node[2], edge.axis, edge.instance}];
            for (std::size_t k = 0; k < 4; ++k)
                at[k] = grid.rest().to_grid(surface.vertices()[q.vertices[k]].rest);
        }
    return out;
}

std::string grid_trouble(const Symmetry& g, const CutCase& c) {
    const int side = c.node_count[0];
    CutCase image{c.node_count, {}, {}};
    for (const Vec3i& n : c.inside) image.inside.push_back(g.node(n, side));
    for (const EdgeCut& cut : c.cuts) image.cuts.push_back(g.crossing(cut, side));
    const auto quads = quad_positions(c), images = quad_positions(image);
    if (quads.size() != images.size()) return "another number of quads";
    for (const auto& [name, positions] : quads) {
        const Vec3i cell = g.node({name[0], name[1], name[2]}, side - 1);
        const GridEdge edge{{name[3], name[4], name[5]}, name[6]}, to = g.edge(edge, side);
        const int end = g.node(name[7] == 0 ? edge.node : edge.upper(), side) == to.node ? 0 : 1;
        const auto found =
            images.find({cell[0], cell[1], cell[2], to.node[0], to.node[1], to.node[2], to.axis, end});
        if (found == images.end()) return "a quad has no image";
        for (std::size_t k = 0; k < 4; ++k) {
            Vec3 expected;
            for (int a = 0; a < 3; ++a)
                expected[g.axis(a)] = g.flips(a) ? side - 1 - positions[k][a] : positions[k][a];
            const Vec3& at = found->second[g.mirrors() && k % 2 == 1 ? 4 - k : k];
            const double apart = (at - expected).norm();
            if (!(apart <= 1e-11))
                return std::array{"an edge", "a face", "a centre", "a face"}[k] + std::string(" vertex is ") +
                       std::to_string(apart) + " cells off";
        }
    }
    return "";
}

// Cells that share faces, inside and at the boundary: a face also depends on both its cells. Crossings of up
// to three smooth sheets, as above.
TEST(PlacementSymmetry, OfWholeGrids) {
    const std::vector<Symmetry> all = all_symmetries();
    Random random(34);
    for (int trial = 0; trial < 700; ++trial) {
        const int side = 1 + static_cast<int>(random.below(4));
        const double fill = random.uniform(0.6, 1);
        CutCase c = random_case(random, side, fill, random.unit());
        const Vec3 about = random_normal(random).normalized();
        const Quat turn(Eigen::AngleAxisd(random.uniform(0, 3), about));
        for (EdgeCut& cut : c.cuts) {
            const Vec3 sheet = turn * Vec3::Unit(static_cast<int>(random.below(3)));
            cut.normal = sheet + 0.1 / std::sqrt(3.0) * random_normal(random);
        }
        const Symmetry& g = all[random.below(48)];
        const auto trouble = [&](const CutCase& some) { return grid_trouble(g, some); };
        ASSERT_EQ(trouble(c), "") << "axes to " << g.to[0] << g.to[1] << g.to[2] << " flipped " << g.flip[0]
                                  << g.flip[1] << g.flip[2] << ": " << shrunk_report(c, trouble);
    }
}

}  // namespace
}  // namespace splitcubes::splitting::cases
