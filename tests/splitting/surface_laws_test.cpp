// Properties of an updated surface, on random nodes and cuts: it equals a rebuilt one, it has one part for
// each region of each sheet, and both sides of a cut have the same positions.
#include "laws/solids.h"
#include "splitting/shrink.h"

#include <gtest/gtest.h>
#include <splitcubes/core/disjoint_sets.h>
#include <splitcubes/geometry/shapes.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/solidify.h>
#include <splitcubes/splitting/validate.h>

#include <cstring>
#include <map>
#include <set>

namespace splitcubes::splitting::cases {
namespace {

CutCase any_case(Random& random) {
    const int side = 1 + static_cast<int>(random.below(5));
    const double fill = random.below(3) == 0 ? 1 : random.uniform(0.3, 1);
    return random_case(random, side, fill, random.unit());
}

bool same_pieces(const NodeGrid& grid, const Pieces& a, const Pieces& b) {
    std::map<std::int32_t, std::int32_t> of_a, of_b;
    const Vec3i n = grid.rest().node_count;
    for (int k = 0; k < n.prod(); ++k) {
        const Vec3i node(k % n[0], k / n[0] % n[1], k / (n[0] * n[1]));
        const std::int32_t p = a.piece_of(grid, node), q = b.piece_of(grid, node);
        if (of_a.emplace(p, q).first->second != q || of_b.emplace(q, p).first->second != p) return false;
    }
    return a.count() == b.count();
}

// Applies the case's cuts in this order, in batches of 1 .. largest, starting from the uncut body; returns
// the first fault.
std::string incremental_trouble(const CutCase& c, std::uint32_t largest) {
    NodeGrid grid = uncut_grid(c);
    Surface surface(grid);
    Pieces pieces(grid);
    Random random(c.cuts.size());
    for (std::size_t i = 0; i < c.cuts.size();) {
        const std::size_t batch = std::min<std::size_t>(1 + random.below(largest), c.cuts.size() - i);
        surface.retessellate(grid, apply_all(grid, std::span(c.cuts).subspan(i, batch)));
        pieces.update(grid);
        i += batch;
        if (canonical_quads(surface) != canonical_quads(Surface(grid)))
            return "after " + std::to_string(i) + " cuts another surface than one from nothing";
        if (!same_pieces(grid, pieces, Pieces(grid)))
            return "after " + std::to_string(i) + " cuts other pieces than from nothing";
    }
    return "";
}

TEST(SurfaceLaws, KeptUpToDateIsMadeFromNothing) {
    Random random(51);
    for (int trial = 0; trial < 100; ++trial) {
        CutCase c = any_case(random);
        shuffle(c.cuts, random);
        const std::uint32_t largest = 1 + random.below(40);
        const auto trouble = [&](const CutCase& some) { return incremental_trouble(some, largest); };
        ASSERT_EQ(trouble(c), "") << shrunk_report(c, trouble);
    }
}

// Returns an empty text if the case's cuts, shuffled and in batches, make the same surface as all at once.
std::string order_trouble(const CutCase& c, std::uint64_t seed) {
    const auto at_once = canonical_quads(Surface(grid_of(c)));
    Random random(seed);
    CutCase shuffled = c;
    shuffle(shuffled.cuts, random);
    NodeGrid grid = uncut_grid(c);
    Surface surface(grid);
    for (std::size_t i = 0; i < c.cuts.size();) {
        const std::size_t batch = std::min<std::size_t>(1 + random.below(9), c.cuts.size() - i);
        surface.retessellate(grid, apply_all(grid, std::span(shuffled.cuts).subspan(i, batch)));
        i += batch;
    }
    if (!same_pieces(grid, Pieces(grid), Pieces(grid_of(c)))) return "other pieces in another order";
    return canonical_quads(surface) == at_once ? "" : "another surface in another order";
}

TEST(SurfaceLaws, OrderAndBatchesDoNotMatter) {
    Random random(52);
    for (int trial = 0; trial < 200; ++trial) {
        const CutCase c = any_case(random);
        for (int order = 0; order < 3; ++order) {
            const std::uint64_t seed = random.bits();
            const auto trouble = [&](const CutCase& some) { return order_trouble(some, seed); };
            ASSERT_EQ(trouble(c), "") << shrunk_report(c, trouble);
        }
    }
}

// Returns the positions of all vertices by name after a different random motion of each node; fans of a cell
// are distinguished by the first quad that names them.
std::map<std::array<int, 6>, Vec3> moved_vertices(const NodeGrid& grid, const Surface& surface) {
    std::vector<geometry::Frame> frames;
    for (const Vec3i& node : surface.nodes()) {
        Random random(edge_id({node, 0}));
        geometry::Frame& frame = frames.emplace_back();
        frame.position = grid.rest().node_position(node) + 0.05 * random_normal(random);
        for (int k = 0; k < 3; ++k) frame.jacobian.col(k) += 0.3 * random_normal(random);
    }
    std::vector<Vec3> positions, normals;
    deform(surface, grid.rest(), frames, positions, normals, Parallel(1));
    std::map<std::array<int, 6>, Vec3> out;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const SurfaceVertex& v = surface.vertices()[i];
        if (v.alive())
            out[{static_cast<int>(v.kind), v.lowest_node[0], v.lowest_node[1], v.lowest_node[2], v.axis,
                 v.instance}] = positions[i];
    }
    return out;
}

// The cells on either side of a face may be processed in another order, and a vertex of the face uses the
// weights of one of them: equal except for rounding.
TEST(SurfaceLaws, OrderDoesNotMatterToMotion) {
    Random random(57);
    double largest = 0;
    for (int trial = 0; trial < 100; ++trial) {
        CutCase c = any_case(random);
        const NodeGrid grid = grid_of(c);
        const auto at_once = moved_vertices(grid, Surface(grid));
        shuffle(c.cuts, random);
        NodeGrid slowly = uncut_grid(c);
        Surface surface(slowly);
        for (const EdgeCut& cut : c.cuts) surface.retessellate(slowly, apply_all(slowly, std::span(&cut, 1)));
        const auto one_by_one = moved_vertices(slowly, surface);
        ASSERT_EQ(at_once.size(), one_by_one.size());
        for (const auto& [name, position] : at_once) {
            const auto found = one_by_one.find(name);
            ASSERT_TRUE(found != one_by_one.end());
            largest = std::max(largest, (found->second - position).norm());
            ASSERT_LE((found->second - position).norm(), 1e-14) << as_code(c);
        }
    }
    std::ostringstream text;
    text << largest;
    RecordProperty("largest_distance", text.str());
}

// Pieces and parts. Crossed edges are linked if a cell's fans link them; linked edges form a sheet. One sheet
// alone divides the nodes of the grid into regions, and the surface has, for each sheet, one connected part
// for each of its regions with material next to it: the side of the sheet that faces the region. (A sheet is
// connected, so each region that it leaves has one connected boundary.)
struct Sheets {
    std::vector<std::uint32_t> of_slot;  // root slot of each crossing's sheet
};

Sheets sheets_of(const NodeGrid& grid) {
    DisjointSets sets(grid.crossings().size());
    const Vec3i n = grid.rest().node_count;
    for (int k = 0; k < n.prod(); ++k) {
        const Vec3i cell(k % n[0], k / n[0] % n[1], k / (n[0] * n[1]));
        if (!grid.has_cell(cell)) continue;
        const CellMask mask = grid.cell_mask(cell);
        const CellConfiguration& configuration = Table::get().cell(mask);
        std::map<int, std::uint32_t> first;
        for (int e = 0; e < edge_count; ++e) {
            if (!(mask >> e & 1)) continue;
            const auto slot = static_cast<std::uint32_t>(grid.slot(cell_edge(cell, e)));
            sets.join(
                slot,
                first.emplace(configuration.edge_group[static_cast<std::size_t>(e)], slot).first->second);
        }
    }
    Sheets out;
    for (std::uint32_t slot = 0; slot < grid.crossings().size(); ++slot)
        out.of_slot.push_back(sets.find(slot));
    return out;
}

std::size_t regions_with_material(const NodeGrid& grid, const Sheets& sheets, std::uint32_t sheet) {
    const Vec3i n = grid.rest().node_count;
    const auto index = [&](const Vec3i& v) {
        return static_cast<std::uint32_t>(v[0] + n[0] * (v[1] + n[1] * v[2]));
    };
    DisjointSets regions(static_cast<std::size_t>(n.prod()));
    std::vector<GridEdge> edges;
    for_each_edge(grid, [&](const GridEdge& edge) {
        const std::int32_t slot = grid.slot(edge);
        if (slot < 0 || sheets.of_slot[static_cast<std::size_t>(slot)] != sheet)
            regions.join(index(edge.node), index(edge.upper()));
        else
            edges.push_back(edge);
    });
    std::set<std::uint32_t> beside;
    for (const GridEdge& edge : edges)
        for (const Vec3i& node : {edge.node, edge.upper()})
            if (grid.inside(node)) beside.insert(regions.find(index(node)));
    return beside.size();
}

std::string parts_trouble(const CutCase& c) {
    const NodeGrid grid = grid_of(c);
    const Surface surface(grid);
    const Pieces pieces(grid);
    const auto& vertices = surface.vertices();
    DisjointSets parts(vertices.size());
    for (const SurfaceCell& cell : surface.cells())
        for (const SurfaceQuad& q : surface.quads(cell))
            for (std::size_t k = 1; k < 4; ++k) parts.join(q.vertices[0], q.vertices[k]);
    std::map<std::uint32_t, std::int32_t> piece_of_part;
    std::set<std::int32_t> with_surface;
    for (std::uint32_t v = 0; v < vertices.size(); ++v) {
        if (!vertices[v].alive()) continue;
        const Influences influences = surface.influences(grid.rest(), vertices[v]);
        for (std::size_t k = 0; k < influences.count; ++k) {
            const std::int32_t piece = pieces.piece_of(grid, surface.nodes()[influences.nodes[k]]);
            if (piece < 0) return "a vertex is carried by a node outside";
            if (piece_of_part.emplace(parts.find(v), piece).first->second != piece)
                return "a part of the surface is carried by two pieces";
            with_surface.insert(piece);
        }
    }
    if (with_surface.size() != pieces.count()) return "a piece has no surface";
    const Sheets sheets = sheets_of(grid);
    std::size_t expected = 0;
    for (std::uint32_t slot = 0; slot < sheets.of_slot.size(); ++slot)
        if (sheets.of_slot[slot] == slot) expected += regions_with_material(grid, sheets, slot);
    if (piece_of_part.size() != expected)
        return std::to_string(piece_of_part.size()) + " parts of the surface, but " +
               std::to_string(expected) + " regions beside sheets";
    return "";
}

TEST(SurfaceLaws, APartForEachRegionBesideEachSheet) {
    Random random(53);
    for (int trial = 0; trial < 1500; ++trial) {
        const CutCase c = any_case(random);
        ASSERT_EQ(parts_trouble(c), "") << shrunk_report(c, parts_trouble);
    }
}

// Without inner cuts the number of parts of the boundary is one less than the number of regions of space,
// where pieces are connected along edges and the outside also across faces.
TEST(SurfaceLaws, TheBoundaryHasOnePartLessThanThereAreRegions) {
    Random random(54);
    for (int trial = 0; trial < 500; ++trial) {
        const int side = 1 + static_cast<int>(random.below(5));
        const CutCase c = random_case(random, side, random.unit(), 0);
        if (c.inside.empty()) continue;
        const NodeGrid grid = grid_of(c);
        const Vec3i n = grid.rest().node_count;
        const auto index = [&](const Vec3i& v) {
            return static_cast<std::uint32_t>(v[0] + n[0] * (v[1] + n[1] * v[2]));
        };
        DisjointSets regions(static_cast<std::size_t>(n.prod()));
        for (int k = 0; k < n.prod(); ++k) {
            const Vec3i node(k % n[0], k / n[0] % n[1], k / (n[0] * n[1]));
            for (int s = 0; s < 27; ++s) {
                const Vec3i other = node + Vec3i(s % 3 - 1, s / 3 % 3 - 1, s / 9 - 1);
                const int steps = (other - node).cwiseAbs().sum();
                if (!grid.rest().contains(other) || grid.inside(other) != grid.inside(node)) continue;
                if (steps == 1 || (steps == 2 && !grid.inside(node))) regions.join(index(node), index(other));
            }
        }
        std::set<std::uint32_t> roots;
        for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(n.prod()); ++k)
            roots.insert(regions.find(k));
        const Surface surface(grid);
        DisjointSets parts(surface.vertices().size());
        std::set<std::uint32_t> found;
        for (const SurfaceCell& cell : surface.cells())
            for (const SurfaceQuad& q : surface.quads(cell))
                for (std::size_t k = 1; k < 4; ++k) parts.join(q.vertices[0], q.vertices[k]);
        for (std::uint32_t v = 0; v < surface.vertices().size(); ++v)
            if (surface.vertices()[v].alive()) found.insert(parts.find(v));
        ASSERT_EQ(found.size() + 1, roots.size()) << as_code(c);
    }
}

bool same_bits(const Vec3& a, const Vec3& b) {
    return std::memcmp(a.data(), b.data(), sizeof(double) * 3) == 0;
}

// Checks that vertices of the same crossing, face, or group of a cell's crossings have the same position, to
// the last bit.
std::string sides_trouble(const CutCase& c) {
    NodeGrid grid = uncut_grid(c);
    Surface surface(grid);
    for (const EdgeCut& cut : c.cuts) surface.retessellate(grid, apply_all(grid, std::span(&cut, 1)));
    const auto& vertices = surface.vertices();
    std::map<std::array<int, 5>, const Vec3*> position;
    for (const SurfaceVertex& v : vertices) {
        if (!v.alive() || v.kind == VertexKind::centre) continue;
        const std::array<int, 5> name{static_cast<int>(v.kind), v.axis, v.lowest_node[0], v.lowest_node[1],
                                      v.lowest_node[2]};
        if (!same_bits(*position.emplace(name, &v.rest).first->second, v.rest))
            return v.kind == VertexKind::edge ? "the ends of an edge lie apart"
                                              : "instances of a face lie apart";
    }
    for (const SurfaceCell& cell : surface.cells()) {
        const CellConfiguration& configuration = Table::get().cell(cell.mask);
        std::array<const Vec3*, 8> of_group{};
        for (std::size_t fan = 0; fan < configuration.fan_count; ++fan) {
            if (cell.centre[fan] < 0) continue;
            const Vec3& at = vertices[static_cast<std::size_t>(cell.centre[fan])].rest;
            const Vec3*& first = of_group[configuration.fan_group[fan]];
            if (first == nullptr) first = &at;
            if (!same_bits(*first, at)) return "fans of a group lie apart";
        }
    }
    return "";
}

TEST(SurfaceLaws, BothSidesOfACutCoincideToTheLastBit) {
    Random random(55);
    for (int trial = 0; trial < 500; ++trial) {
        CutCase c = any_case(random);
        shuffle(c.cuts, random);
        ASSERT_EQ(sides_trouble(c), "") << shrunk_report(c, sides_trouble);
    }
}

// Complete state of a grid, a surface and its pieces.
struct State {
    std::vector<Crossing> crossings;
    std::vector<SurfaceVertex> vertices;
    std::vector<SurfaceQuad> quads;
    std::vector<std::size_t> piece_sizes;
    std::vector<std::uint64_t> words;

    State(const NodeGrid& grid, const Surface& surface, const Pieces& pieces)
        : crossings(grid.crossings()), vertices(surface.vertices()), piece_sizes(pieces.node_counts()) {
        for (const SurfaceCell& cell : surface.cells())
            quads.insert(quads.end(), surface.quads(cell).begin(), surface.quads(cell).end());
        for (std::size_t brick = 0; brick < grid.bricks().total(); ++brick) {
            words.push_back(grid.inside_word(brick));
            for (int axis = 0; axis < 3; ++axis) words.push_back(grid.cut_word(brick, axis));
        }
    }
};

void expect_same_bits(const State& a, const State& b) {
    ASSERT_EQ(a.words, b.words);
    ASSERT_EQ(a.piece_sizes, b.piece_sizes);
    ASSERT_EQ(a.crossings.size(), b.crossings.size());
    for (std::size_t i = 0; i < a.crossings.size(); ++i) {
        const Crossing &p = a.crossings[i], &q = b.crossings[i];
        ASSERT_TRUE(p.edge == q.edge && p.parameter == q.parameter && p.hit == q.hit && p.cut == q.cut &&
                    p.origin == q.origin && same_bits(p.normal, q.normal));
    }
    ASSERT_EQ(a.vertices.size(), b.vertices.size());
    for (std::size_t i = 0; i < a.vertices.size(); ++i) {
        const SurfaceVertex &p = a.vertices[i], &q = b.vertices[i];
        ASSERT_TRUE(p.corners == q.corners && p.cell == q.cell && p.kind == q.kind &&
                    p.instance == q.instance && p.lowest_node == q.lowest_node);
        if (!p.alive()) continue;
        ASSERT_TRUE(same_bits(p.rest, q.rest) && p.normal == q.normal);
    }
    ASSERT_EQ(a.quads.size(), b.quads.size());
    for (std::size_t i = 0; i < a.quads.size(); ++i)
        ASSERT_TRUE(a.quads[i].vertices == b.quads[i].vertices && a.quads[i].crossing == b.quads[i].crossing);
}

TEST(SurfaceLaws, CuttingAgainAlongTheSameSheetsChangesNoBit) {
    using namespace laws;
    const Parallel parallel(2);
    Random random(56);
    for (int trial = 0; trial < 8; ++trial) {
        const geometry::TriangleMesh body =
            trial % 2 ? geometry::make_torus(0.35, 0.14, 48, 24)
                      : turned(geometry::make_box(Vec3(1, 0.7, 0.5)), random_rotation(random));
        SolidifyReport report;
        NodeGrid grid = solidify(body, geometry::grid_around(body.bounds(), 0.05), report, parallel);
        Surface surface(grid);
        Pieces pieces(grid);
        std::vector<geometry::TriangleMesh> sheets;
        for (int k = 0; k < 4; ++k) {
            const Vec3 center = random_vector(random, 0.2), normal = random_direction(random);
            sheets.push_back(k % 2 ? geometry::make_plane_sheet(center, normal, 1, 3)
                                   : geometry::make_wavy_sheet(center, normal, 1, 40, 0.04, 0.3));
            surface.retessellate(grid, cut_with_sheet(grid, sheets.back(), k));
            pieces.update(grid);
        }
        const State before(grid, surface, pieces);
        for (const geometry::TriangleMesh& sheet : sheets)
            for (const geometry::TriangleMesh& again : {sheet, reversed(sheet)}) {
                const auto slots = cut_with_sheet(grid, again, 9);
                ASSERT_TRUE(slots.empty());
                ASSERT_TRUE(surface.retessellate(grid, slots).empty());
                ASSERT_TRUE(pieces.update(grid).empty());
            }
        expect_same_bits(before, State(grid, surface, pieces));
    }
}

}  // namespace
}  // namespace splitcubes::splitting::cases
