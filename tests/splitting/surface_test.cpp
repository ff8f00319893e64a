#include <gtest/gtest.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/validate.h>

#include <algorithm>
#include <map>
#include <set>
#include <sstream>

namespace {

using namespace splitcubes;
using namespace splitcubes::splitting;

struct EdgeCut {
    GridEdge edge;
    double parameter;
    Vec3 normal;
};

NodeGrid solid_block(int nodes) {
    RestGrid rest;
    rest.cell_size = 0.1;
    rest.origin = Vec3(-0.3, 0.2, 0.7);
    rest.node_count = Vec3i::Constant(nodes + 2);
    NodeGrid grid(rest);
    for (int z = 1; z <= nodes; ++z)
        for (int y = 1; y <= nodes; ++y) grid.set_inside_row(y, z, 1, nodes + 1);
    for (int z = 0; z < nodes + 2; ++z)
        for (int y = 0; y < nodes + 2; ++y)
            for (int x = 0; x < nodes + 2; ++x)
                for (int axis = 0; axis < 3; ++axis) {
                    const GridEdge edge{{x, y, z}, axis};
                    if (grid.has_edge(edge) && grid.inside(edge.node) != grid.inside(edge.upper()))
                        grid.cut(edge, 0.5, Vec3::Unit(axis), Origin::boundary, -1);
                }
    return grid;
}

std::vector<GridEdge> inner_edges(const NodeGrid& grid) {
    std::vector<GridEdge> edges;
    const Vec3i n = grid.rest().node_count;
    for (int z = 0; z < n[2]; ++z)
        for (int y = 0; y < n[1]; ++y)
            for (int x = 0; x < n[0]; ++x)
                for (int axis = 0; axis < 3; ++axis) {
                    const GridEdge edge{{x, y, z}, axis};
                    if (grid.has_edge(edge) && grid.inside(edge.node) && grid.inside(edge.upper()))
                        edges.push_back(edge);
                }
    return edges;
}

EdgeCut random_cut(const GridEdge& edge, Random& random) {
    return {edge, random.unit(), Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1))};
}

std::vector<std::int32_t> cut_all(NodeGrid& grid, const std::vector<EdgeCut>& cuts) {
    std::vector<std::int32_t> slots;
    for (const EdgeCut& c : cuts) {
        const std::int32_t slot = grid.cut(c.edge, c.parameter, c.normal, Origin::cut, 0);
        if (slot >= 0) slots.push_back(slot);
    }
    return slots;
}

// Returns an empty text if the cuts, applied to the block, leave a valid surface.
std::string trouble_with_cuts(int nodes, const std::vector<EdgeCut>& cuts) {
    NodeGrid grid = solid_block(nodes);
    Surface surface(grid);
    for (const EdgeCut& c : cuts) surface.retessellate(grid, cut_all(grid, {c}));
    const Pieces pieces(grid);
    for (const std::string& line : validate(grid)) return line;
    for (const std::string& line : validate(grid, surface, pieces)) return line;
    return "";
}

// Removes cuts one at a time while the fault remains.
std::string shrunk(int nodes, std::vector<EdgeCut> cuts) {
    for (std::size_t i = 0; i < cuts.size();) {
        std::vector<EdgeCut> fewer = cuts;
        fewer.erase(fewer.begin() + static_cast<long>(i));
        if (trouble_with_cuts(nodes, fewer).empty()) {
            ++i;
        } else {
            cuts = fewer;
        }
    }
    std::ostringstream out;
    out << trouble_with_cuts(nodes, cuts) << " with " << cuts.size() << " cuts:";
    for (const EdgeCut& c : cuts)
        out << " (" << c.edge.node.transpose() << " axis " << c.edge.axis << " at " << c.parameter << ")";
    return out.str();
}

class Unwanted : public Monitor {
  public:
    void begin(const std::string&) override {}
    void advance(std::size_t, std::size_t) override {}
    bool cancelled() const override { return true; }
};

TEST(Surface, EndsWhereNobodyWantsIt) {
    const NodeGrid grid = solid_block(40);
    Parallel parallel(1);
    EXPECT_EQ(Surface(grid, parallel).quad_count(), Surface(grid).quad_count());
    Unwanted monitor;
    parallel.watch(&monitor);
    EXPECT_THROW(Surface(grid, parallel), Cancelled);
}

TEST(Surface, AnySetOfCutEdgesGivesAClosedOrientedManifold) {
    Random random(11);
    for (int trial = 0; trial < 400; ++trial) {
        const int nodes = 1 + static_cast<int>(random.below(4));
        const double density = random.unit();
        std::vector<EdgeCut> cuts;
        for (const GridEdge& edge : inner_edges(solid_block(nodes)))
            if (random.unit() < density) cuts.push_back(random_cut(edge, random));
        const std::string found = trouble_with_cuts(nodes, cuts);
        ASSERT_TRUE(found.empty()) << shrunk(nodes, cuts);
    }
}

TEST(Surface, AllMasksOfOneInnerCell) {
    // A cell with all eight corners inside, cut with every mask.
    const NodeGrid block = solid_block(2);
    const Vec3i cell(1, 1, 1);
    Random random(5);
    for (int mask = 0; mask < mask_count; mask += 1) {
        NodeGrid grid = block;
        for (int e = 0; e < edge_count; ++e)
            if (mask >> e & 1) {
                const EdgeCut c = random_cut(cell_edge(cell, e), random);
                grid.cut(c.edge, c.parameter, c.normal, Origin::cut, 0);
            }
        const Surface surface(grid);
        const Pieces pieces(grid);
        const geometry::SurfaceMesh mesh = extract(grid, surface, pieces);
        const geometry::MeshCheck check = geometry::check_mesh(mesh.mesh);
        ASSERT_TRUE(check.valid()) << "mask " << mask;
        ASSERT_EQ(pieces.count(), Table::get().cell(static_cast<CellMask>(mask)).component_count);
        // Each piece has at least one closed part of the surface; the volumes sum to the total.
        double volume = 0;
        for (const PieceMeasure& p : measure_pieces(mesh, pieces.count())) volume += p.volume;
        ASSERT_NEAR(volume, mesh.mesh.volume(), 1e-12 * std::abs(volume));
    }
}

TEST(Surface, OrderOfCutsDoesNotMatter) {
    Random random(2);
    for (int trial = 0; trial < 40; ++trial) {
        std::vector<EdgeCut> cuts;
        for (const GridEdge& edge : inner_edges(solid_block(5)))
            if (random.unit() < 0.3) cuts.push_back(random_cut(edge, random));
        const auto build = [&](const std::vector<EdgeCut>& order, std::size_t batch) {
            NodeGrid grid = solid_block(5);
            Surface surface(grid);
            for (std::size_t i = 0; i < order.size(); i += batch)
                surface.retessellate(
                    grid,
                    cut_all(grid, {order.begin() + static_cast<long>(i),
                                   order.begin() + static_cast<long>(std::min(order.size(), i + batch))}));
            return canonical_quads(surface);
        };
        const auto first = build(cuts, cuts.size());
        std::vector<EdgeCut> shuffled = cuts;
        for (std::size_t i = shuffled.size(); i > 1; --i)
            std::swap(shuffled[i - 1], shuffled[random.below(static_cast<std::uint32_t>(i))]);
        ASSERT_EQ(first, build(shuffled, 1 + random.below(7)));
    }
}

// Checks that all triangles around every vertex of the given cells form one closed fan. The triangles at a
// vertex are in the cells that touch its edge, face or cell.
void expect_local_manifold(const NodeGrid& grid, const Surface& surface,
                           const std::vector<std::uint32_t>& cells,
                           const std::map<std::array<int, 3>, std::uint32_t>& cell_of) {
    (void)grid;
    std::set<std::uint32_t> watched, around;
    for (const std::uint32_t c : cells) {
        for (const SurfaceQuad& q : surface.quads(surface.cells()[c]))
            watched.insert(q.vertices.begin(), q.vertices.end());
        const Vec3i p = surface.cells()[c].lowest_node;
        for (int k = 0; k < 27; ++k) {
            const auto it = cell_of.find({p[0] + k % 3 - 1, p[1] + k / 3 % 3 - 1, p[2] + k / 9 - 1});
            if (it != cell_of.end()) around.insert(it->second);
        }
    }
    // Per watched vertex: the directed links from one neighbour to the next.
    std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> next;
    for (const std::uint32_t c : around)
        for (const SurfaceQuad& q : surface.quads(surface.cells()[c]))
            for (const auto& t : {std::array{q.vertices[0], q.vertices[1], q.vertices[2]},
                                  std::array{q.vertices[0], q.vertices[2], q.vertices[3]}})
                for (std::size_t k = 0; k < 3; ++k) {
                    if (!watched.contains(t[k])) continue;
                    const bool fresh = next[t[k]].emplace(t[(k + 1) % 3], t[(k + 2) % 3]).second;
                    ASSERT_TRUE(fresh) << "an edge used twice the same way";
                }
    for (const auto& [vertex, links] : next) {
        std::uint32_t at = links.begin()->first;
        std::size_t steps = 0;
        do {
            const auto it = links.find(at);
            ASSERT_TRUE(it != links.end()) << "an open edge";
            at = it->second;
            ++steps;
        } while (at != links.begin()->first && steps <= links.size());
        ASSERT_EQ(steps, links.size()) << "more than one fan at a vertex";
    }
}

TEST(Surface, TenThousandRandomSheetsInOneGrid) {
    NodeGrid grid = solid_block(32);
    Surface surface(grid);
    Random random(99);
    std::map<std::array<int, 3>, std::uint32_t> cell_of;
    std::size_t known = 0;
    std::vector<EdgeCut> all;
    for (int sheet = 0; sheet < 10000; ++sheet) {
        // A square patch in a random plane: every edge that it crosses.
        const Vec3 centre(random.uniform(1, 33), random.uniform(1, 33), random.uniform(1, 33));
        const Vec3 normal =
            Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)).normalized();
        const double radius = random.uniform(0.5, sheet % 100 == 0 ? 40 : 4);
        std::vector<EdgeCut> cuts;
        const Vec3i low = (centre.array() - radius).floor().cast<int>().max(1);
        const Vec3i high = (centre.array() + radius).ceil().cast<int>().min(32);
        for (int z = low[2]; z <= high[2]; ++z)
            for (int y = low[1]; y <= high[1]; ++y)
                for (int x = low[0]; x <= high[0]; ++x)
                    for (int axis = 0; axis < 3; ++axis) {
                        const GridEdge edge{{x, y, z}, axis};
                        if (!grid.inside(edge.upper()) || grid.is_cut(edge)) continue;
                        const double slope = normal[axis];
                        if (slope == 0) continue;
                        const double t = normal.dot(centre - edge.node.cast<double>()) / slope;
                        if (t < 0 || t > 1) continue;
                        const Vec3 hit = edge.node.cast<double>() + t * Vec3::Unit(axis);
                        if ((hit - centre).norm() > radius) continue;
                        cuts.push_back({edge, t, normal});
                    }
        const std::vector<std::uint32_t> changed = surface.retessellate(grid, cut_all(grid, cuts));
        all.insert(all.end(), cuts.begin(), cuts.end());
        for (; known < surface.cells().size(); ++known) {
            const Vec3i p = surface.cells()[known].lowest_node;
            cell_of[{p[0], p[1], p[2]}] = static_cast<std::uint32_t>(known);
        }
        expect_local_manifold(grid, surface, changed, cell_of);
        if (::testing::Test::HasFatalFailure()) FAIL() << "after sheet " << sheet;
        if (sheet % 2500 == 2499) {
            const Pieces pieces(grid);
            ASSERT_EQ(validate(grid, surface, pieces), std::vector<std::string>{}) << "after sheet " << sheet;
        }
    }
    // The same edges in another order.
    for (std::size_t i = all.size(); i > 1; --i)
        std::swap(all[i - 1], all[random.below(static_cast<std::uint32_t>(i))]);
    NodeGrid again = solid_block(32);
    Surface other(again);
    other.retessellate(again, cut_all(again, all));
    EXPECT_EQ(canonical_quads(surface), canonical_quads(other));
}

TEST(Surface, BothSidesOfACutCoincideAtRest) {
    NodeGrid grid = solid_block(8);
    Surface surface(grid);
    Random random(4);
    std::vector<EdgeCut> cuts;
    for (const GridEdge& edge : inner_edges(grid))
        if (random.unit() < 0.2) cuts.push_back(random_cut(edge, random));
    surface.retessellate(grid, cut_all(grid, cuts));
    // Each triangle of a cut edge has a partner of opposite orientation at the same positions.
    std::map<std::array<std::array<double, 3>, 3>, int> balance;
    for (const SurfaceCell& cell : surface.cells())
        for (const SurfaceQuad& q : surface.quads(cell)) {
            if (grid.crossing(q.crossing).origin != Origin::cut) continue;
            for (const auto& t : {std::array{q.vertices[0], q.vertices[1], q.vertices[2]},
                                  std::array{q.vertices[0], q.vertices[2], q.vertices[3]}}) {
                std::array<std::array<double, 3>, 3> p;
                for (std::size_t k = 0; k < 3; ++k)
                    for (std::size_t axis = 0; axis < 3; ++axis)
                        p[k][axis] = surface.vertices()[t[k]].rest[static_cast<int>(axis)];
                // A triangle with two coincident corners has no orientation to balance.
                if (p[0] == p[1] || p[1] == p[2] || p[2] == p[0]) continue;
                const int lowest = static_cast<int>(std::min_element(p.begin(), p.end()) - p.begin());
                std::rotate(p.begin(), p.begin() + lowest, p.end());
                int sign = 1;
                if (p[2] < p[1]) {
                    std::swap(p[1], p[2]);
                    sign = -1;
                }
                balance[p] += sign;
            }
        }
    ASSERT_GT(balance.size(), 1000U);
    for (const auto& [triangle, count] : balance) ASSERT_EQ(count, 0);
}

TEST(Surface, RigidMotionCarriesEveryVertex) {
    NodeGrid grid = solid_block(4);
    Random random(8);
    std::vector<EdgeCut> cuts;
    for (const GridEdge& edge : inner_edges(grid))
        if (random.unit() < 0.3) cuts.push_back(random_cut(edge, random));
    cut_all(grid, cuts);
    const Surface surface(grid);
    const Mat3 turn = Eigen::AngleAxisd(2.2, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    const Vec3 shift(3, -2, 1);
    std::vector<geometry::Frame> frames;
    for (const Vec3i& node : surface.nodes())
        frames.push_back({turn * grid.rest().node_position(node) + shift, turn});
    std::vector<Vec3> positions, normals;
    deform(surface, grid.rest(), frames, positions, normals, Parallel(2));
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const SurfaceVertex& v = surface.vertices()[i];
        if (!v.alive()) continue;
        ASSERT_LT((positions[i] - (turn * v.rest + shift)).norm(), 1e-12);
        // Normals are stored in single precision.
        ASSERT_LT((normals[i] - turn * v.normal.cast<double>()).norm(), 1e-6);
    }
}

TEST(Pieces, AgreeWithAFloodFillAndKeepTheirIds) {
    Random random(21);
    NodeGrid grid = solid_block(9);
    Pieces pieces(grid);
    ASSERT_EQ(pieces.count(), 1U);
    std::vector<GridEdge> edges = inner_edges(grid);
    for (std::size_t i = edges.size(); i > 1; --i)
        std::swap(edges[i - 1], edges[random.below(static_cast<std::uint32_t>(i))]);
    std::size_t next = 0;
    while (next < edges.size()) {
        std::map<std::array<int, 3>, std::int32_t> before;
        const auto for_nodes = [&](const auto& visit) {
            for (int z = 1; z <= 9; ++z)
                for (int y = 1; y <= 9; ++y)
                    for (int x = 1; x <= 9; ++x) visit(Vec3i(x, y, z));
        };
        for_nodes([&](const Vec3i& n) { before[{n[0], n[1], n[2]}] = pieces.piece_of(grid, n); });
        std::vector<std::int32_t> slots;
        for (std::size_t k = 0; k < 60 && next < edges.size(); ++k)
            slots.push_back(grid.cut(edges[next++], 0.5, Vec3::UnitX(), Origin::cut, 0));
        Pieces all_bricks = pieces;
        const std::vector<PieceSplit> splits = pieces.update(grid, slots);
        ASSERT_EQ(splits, all_bricks.update(grid));
        ASSERT_EQ(pieces.node_counts(), all_bricks.node_counts());
        // Slow flood fill from every node.
        std::map<std::array<int, 3>, int> label;
        int labels = 0;
        for_nodes([&](const Vec3i& seed) {
            if (label.contains({seed[0], seed[1], seed[2]})) return;
            std::vector<Vec3i> stack{seed};
            label[{seed[0], seed[1], seed[2]}] = labels;
            while (!stack.empty()) {
                const Vec3i n = stack.back();
                stack.pop_back();
                for (int axis = 0; axis < 3; ++axis)
                    for (const int step : {-1, 1}) {
                        Vec3i m = n;
                        m[axis] += step;
                        const GridEdge edge{step > 0 ? n : m, axis};
                        if (!grid.inside(m) || grid.is_cut(edge)) continue;
                        if (label.emplace(std::array<int, 3>{m[0], m[1], m[2]}, labels).second)
                            stack.push_back(m);
                    }
            }
            ++labels;
        });
        ASSERT_EQ(pieces.count(), static_cast<std::size_t>(labels));
        std::map<int, std::int32_t> piece_of_label;
        std::size_t kept = 0;
        for_nodes([&](const Vec3i& n) {
            const std::int32_t piece = pieces.piece_of(grid, n);
            const auto [it, fresh] = piece_of_label.emplace(label[{n[0], n[1], n[2]}], piece);
            ASSERT_EQ(it->second, piece);
            ASSERT_EQ(all_bricks.piece_of(grid, n), piece);
            kept += before[{n[0], n[1], n[2]}] == piece;
        });
        for (const PieceSplit& s : splits)
            ASSERT_GE(pieces.node_counts()[static_cast<std::size_t>(s.parent)],
                      pieces.node_counts()[static_cast<std::size_t>(s.piece)]);
        ASSERT_GT(kept, 0U);
    }
    EXPECT_EQ(pieces.count(), 729U);
}

}  // namespace
