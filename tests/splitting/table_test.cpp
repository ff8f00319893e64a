#include <gtest/gtest.h>
#include <splitcubes/splitting/table.h>

#include <algorithm>
#include <bit>
#include <map>
#include <set>

namespace {

using namespace splitcubes::splitting;

TEST(Cube, NumberingIsConsistent) {
    for (int e = 0; e < edge_count; ++e) {
        const int a = edge_corner(e, 0), b = edge_corner(e, 1);
        EXPECT_EQ(b - a, 1 << edge_axis(e));
        int faces = 0;
        for (int f = 0; f < face_count; ++f)
            for (int k = 0; k < 4; ++k) faces += face_edge(f, k) == e;
        EXPECT_EQ(faces, 2) << "every edge lies on two faces";
    }
    for (int f = 0; f < face_count; ++f)
        for (int k = 0; k < 4; ++k) {
            EXPECT_EQ(corner_bit(face_corner(f, k), face_axis(f)), f & 1);
            EXPECT_GE(face_edge(f, k), 0);
        }
}

TEST(Table, FaceKinds) {
    std::map<FaceKind, int> kinds;
    for (unsigned m = 0; m < 16; ++m) ++kinds[Table::get().face(m).kind];
    EXPECT_EQ(kinds, (std::map<FaceKind, int>{{FaceKind::A, 1},
                                              {FaceKind::B, 4},
                                              {FaceKind::C, 4},
                                              {FaceKind::D, 2},
                                              {FaceKind::E, 4},
                                              {FaceKind::F, 1}}));
}

TEST(Table, ComponentCounts) {
    std::array<int, 9> counts{};
    for (int m = 0; m < mask_count; ++m)
        ++counts[Table::get().cell(static_cast<CellMask>(m)).component_count];
    EXPECT_EQ(counts, (std::array<int, 9>{0, 1083, 1231, 940, 537, 226, 66, 12, 1}));
}

TEST(Table, EveryFaceCentreSegmentHasTwoQuadsThatRunOppositeWays) {
    for (int m = 0; m < mask_count; ++m) {
        // (face, instance, fan) -> uses as first and as second face of a quad: the quad runs first -> centre
        // -> second, so one of each gives opposite directions.
        std::map<std::array<int, 3>, std::array<int, 2>> uses;
        for (const TableQuad& q : Table::get().quads(static_cast<CellMask>(m))) {
            ++uses[{q.first_face, q.first_instance, q.fan}][0];
            ++uses[{q.second_face, q.second_instance, q.fan}][1];
        }
        for (const auto& [segment, count] : uses)
            ASSERT_EQ(count, (std::array<int, 2>{1, 1})) << "mask " << m;
    }
}

TEST(Table, QuadsOfACornerAreAtMostThreeAndTwoACutEdge) {
    for (int m = 0; m < mask_count; ++m) {
        const auto mask = static_cast<CellMask>(m);
        ASSERT_EQ(Table::get().quads(mask).size(), 2U * static_cast<unsigned>(std::popcount(mask)));
        for (int c = 0; c < corner_count; ++c) {
            ASSERT_LE(Table::get().quads(mask, c).size(), 3U);
            for (const TableQuad& q : Table::get().quads(mask, c)) ASSERT_EQ(q.corner, c);
        }
    }
}

TEST(Table, FansOfACentreInstance) {
    std::map<int, int> masks_by_fans;
    std::size_t max_vertices = 0;
    for (int m = 0; m < mask_count; ++m) {
        const auto mask = static_cast<CellMask>(m);
        const CellConfiguration& cell = Table::get().cell(mask);
        std::map<int, std::set<int>> fans_of_component;
        std::set<std::array<int, 3>> vertices;
        for (const TableQuad& q : Table::get().quads(mask)) {
            fans_of_component[cell.component[q.corner]].insert(q.fan);
            ASSERT_EQ(cell.component[cell.fan_corner[q.fan]], cell.component[q.corner])
                << "a fan lies in one component";
            vertices.insert({0, q.edge, q.corner});
            vertices.insert({1, q.first_face, q.first_instance});
            vertices.insert({2, q.fan, 0});
        }
        std::size_t max_fans = 0;
        for (const auto& [component, fans] : fans_of_component) max_fans = std::max(max_fans, fans.size());
        if (max_fans > 1) ++masks_by_fans[static_cast<int>(max_fans)];
        max_vertices = std::max(max_vertices, vertices.size());
    }
    EXPECT_EQ(masks_by_fans, (std::map<int, int>{{2, 388}, {3, 8}}));
    EXPECT_EQ(max_vertices, 56U);
}

TEST(Table, AComponentHasOneFanOfEachSheetThatItTouches) {
    // The sheets of a cell draw separate connected figures on its surface; a component sees each of them from
    // one side.
    for (int m = 0; m < mask_count; ++m) {
        const auto mask = static_cast<CellMask>(m);
        const CellConfiguration& cell = Table::get().cell(mask);
        std::set<std::array<int, 2>> known;
        for (std::size_t fan = 0; fan < cell.fan_count; ++fan)
            ASSERT_TRUE(known.insert({cell.component[cell.fan_corner[fan]], cell.fan_group[fan]}).second)
                << "mask " << m;
    }
}

TEST(Table, FaceInstancesDependOnTheFaceAlone) {
    // Two cells that share a face have the same ring mask and so the same instances; connections through the
    // cell would give other instances for 3100 masks.
    int differ = 0;
    for (int m = 0; m < mask_count; ++m) {
        const auto mask = static_cast<CellMask>(m);
        const CellConfiguration& cell = Table::get().cell(mask);
        bool other = false;
        for (int f = 0; f < face_count; ++f) {
            const FaceConfiguration& face = Table::get().face(face_mask(mask, f));
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 4; ++j) {
                    const bool by_ring = face.instance[static_cast<std::size_t>(i)] ==
                                         face.instance[static_cast<std::size_t>(j)];
                    const bool by_cell = cell.component[static_cast<std::size_t>(face_corner(f, i))] ==
                                         cell.component[static_cast<std::size_t>(face_corner(f, j))];
                    ASSERT_TRUE(!by_ring || by_cell);
                    other = other || by_ring != by_cell;
                }
        }
        differ += other;
    }
    EXPECT_EQ(differ, 3100);
}

TEST(Table, PlanarSheetsAreOriented) {
    // Masks of planes: every edge between the two sides of a linear function.
    int tried = 0;
    for (int a = -3; a <= 3; ++a)
        for (int b = -3; b <= 3; ++b)
            for (int c = -3; c <= 3; ++c)
                for (int d = -8; d <= 8; ++d) {
                    const auto side = [&](int corner) {
                        return 2 * (a * corner_bit(corner, 0) + b * corner_bit(corner, 1) +
                                    c * corner_bit(corner, 2)) +
                                   1 >
                               d;
                    };
                    CellMask mask = 0;
                    for (int e = 0; e < edge_count; ++e)
                        if (side(edge_corner(e, 0)) != side(edge_corner(e, 1)))
                            mask = static_cast<CellMask>(mask | 1 << e);
                    if (!mask) continue;
                    ++tried;
                    const CellConfiguration& cell = Table::get().cell(mask);
                    ASSERT_EQ(cell.group_count, 1);
                    ASSERT_TRUE(cell.group_oriented[0]);
                    int sign = 0;
                    for (int e = 0; e < edge_count; ++e) {
                        if (!(mask >> e & 1)) continue;
                        const int s =
                            cell.edge_side[static_cast<std::size_t>(e)] * (side(edge_corner(e, 0)) ? 1 : -1);
                        ASSERT_TRUE(sign == 0 || sign == s);
                        sign = s;
                    }
                }
    EXPECT_GT(tried, 1000);
}

}  // namespace
