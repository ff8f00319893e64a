#include <splitcubes/core/error.h>
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/occluder_grid.h>
#include <splitcubes/geometry/segment_fan.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace splitcubes::geometry {
namespace {

constexpr double cell_size = 0.3;
constexpr int cells = 12;
const Vec3 origin(-1.7, -1.9, -1.8);

using Content = std::map<std::array<int, 3>, std::vector<OccluderTriangle>>;  // by z, y, x

Vec3 vector_within(Random& random, double half) {
    const double x = random.uniform(-half, half), y = random.uniform(-half, half);
    return {x, y, random.uniform(-half, half)};
}

Vec3i random_coordinates(Random& random) {
    return {static_cast<int>(random.below(cells)), static_cast<int>(random.below(cells)),
            static_cast<int>(random.below(cells))};
}

std::vector<OccluderTriangle> random_cell(Random& random, const Vec3i& cell, double overhang) {
    std::vector<OccluderTriangle> out(random.below(4));
    for (auto& t : out) {
        const Vec3 centre = origin + cell_size * (cell.cast<double>() + Vec3::Constant(0.5));
        for (Vec3& p : t.corner) p = centre + vector_within(random, (0.5 + overhang) * cell_size);
        t.boundary = random.below(2) == 1;
    }
    return out;
}

// Fills a grid in many steps; some cells are set again or emptied.
OccluderGrid random_grid(Random& random, int steps, double overhang, Content& content) {
    OccluderGrid grid(origin, cell_size, Vec3i::Constant(cells));
    for (int k = 0; k < steps; ++k) {
        const Vec3i cell = random_coordinates(random);
        const auto triangles = random_cell(random, cell, k % 20 ? overhang : 6 * overhang);
        grid.set_cell(cell, triangles);
        content[{cell[2], cell[1], cell[0]}] = triangles;
    }
    return grid;
}

std::array<double, 10> numbers(const OccluderTriangle& t) {
    std::array<double, 10> out{};
    for (std::size_t k = 0; k < 9; ++k) out[k] = t.corner[k / 3][static_cast<int>(k % 3)];
    out[9] = t.boundary;
    return out;
}

std::vector<std::array<double, 10>> numbers(const std::vector<OccluderTriangle>& triangles) {
    std::vector<std::array<double, 10>> out;
    for (const auto& t : triangles) out.push_back(numbers(t));
    return out;
}

// Reference for segment_meets_triangle: intersection with the plane in barycentric
// coordinates (Moeller and Trumbore 1997), in long double.
bool meets(const Vec3& a, const Vec3& b, const OccluderTriangle& t) {
    using Real = Eigen::Matrix<long double, 3, 1>;
    const Real e1 = (t.corner[1] - t.corner[0]).cast<long double>();
    const Real e2 = (t.corner[2] - t.corner[0]).cast<long double>();
    const Real d = (b - a).cast<long double>(), from = (a - t.corner[0]).cast<long double>();
    const Real p = d.cross(e2), q = from.cross(e1);
    const long double determinant = e1.dot(p);
    if (determinant == 0) return false;
    const long double u = from.dot(p) / determinant, v = d.dot(q) / determinant;
    const long double s = e2.dot(q) / determinant;
    return u >= 0 && v >= 0 && u + v <= 1 && s >= 0 && s <= 1;
}

TEST(OccluderGrid, GatherFindsTrianglesThatMeetTheBox) {
    Random random(1);
    for (int round = 0; round < 60; ++round) {
        Content content;
        const OccluderGrid grid = random_grid(random, 400, random.uniform(0, 1), content);
        std::size_t total = 0;
        for (const auto& [cell, triangles] : content) total += triangles.size();
        ASSERT_EQ(grid.triangle_count(), total);
        for (int query = 0; query < 30; ++query) {
            const Vec3 centre = vector_within(random, 2.2);
            Box box;
            box.add(centre);
            box.add(centre + vector_within(random, query % 3 ? 0.7 : 4));
            std::vector<OccluderTriangle> expected, found;
            for (const auto& [cell, triangles] : content)
                for (const auto& t : triangles)
                    if (t.bounds().meets(box)) expected.push_back(t);
            grid.gather(box, found);
            auto e = numbers(expected), f = numbers(found);
            std::sort(e.begin(), e.end());
            std::sort(f.begin(), f.end());
            ASSERT_EQ(e, f);
        }
    }
}

// Packs hold each triangle once, in single precision; box queries miss none.
TEST(OccluderGrid, PacksHoldTheTrianglesOfABox) {
    Random random(7);
    for (int round = 0; round < 60; ++round) {
        Content content;
        const OccluderGrid grid = random_grid(random, 400, random.uniform(0, round % 3 ? 1 : 5), content);
        for (int query = 0; query < 30; ++query) {
            const Vec3 centre = vector_within(random, 2.2);
            Box box;
            box.add(centre);
            box.add(centre + vector_within(random, query % 3 ? 0.7 : 4));
            std::vector<OccluderTriangle> expected, found;
            std::vector<std::uint32_t> ids;
            grid.gather(box, expected);
            grid.visit_packs(
                box,
                [&](const OccluderPack& pack, const PackedTriangles& home) {
                    for (std::size_t lane = 0; lane < OccluderPack::width; ++lane) {
                        const bool used = (pack.used >> lane & 1) != 0;
                        for (std::size_t k = 0; k < 9; ++k) {
                            const float at = pack.corner[k / 3][k % 3][lane];
                            if (!used) {
                                ASSERT_TRUE(std::isnan(at));
                                continue;
                            }
                            const auto axis = static_cast<Eigen::Index>(k % 3);
                            const double exact =
                                grid.triangle(pack.id[lane]).corner[k / 3][axis] - home.centre()[axis];
                            ASSERT_EQ(at, static_cast<float>(exact));
                            ASSERT_LE(std::abs(at), home.extent());
                        }
                        if (!used) continue;
                        ASSERT_EQ((pack.boundary >> lane & 1) != 0, grid.triangle(pack.id[lane]).boundary);
                        ids.push_back(pack.id[lane]);
                    }
                },
                [&](std::uint32_t id) { ids.push_back(id); });
            std::sort(ids.begin(), ids.end());
            ASSERT_TRUE(std::adjacent_find(ids.begin(), ids.end()) == ids.end());
            for (const std::uint32_t id : ids)
                if (grid.triangle(id).bounds().meets(box)) found.push_back(grid.triangle(id));
            auto e = numbers(expected), f = numbers(found);
            std::sort(e.begin(), e.end());
            std::sort(f.begin(), f.end());
            ASSERT_EQ(e, f);
        }
    }
}

TEST(OccluderGrid, OrderDoesNotDependOnTheHistory) {
    Random random(2);
    for (int round = 0; round < 40; ++round) {
        Content content;
        const OccluderGrid grown = random_grid(random, 500, 0.5, content);
        // The same content, set once, last cell first.
        OccluderGrid fresh(origin, cell_size, Vec3i::Constant(cells));
        for (auto it = content.rbegin(); it != content.rend(); ++it)
            fresh.set_cell({it->first[2], it->first[1], it->first[0]}, it->second);
        for (int query = 0; query < 30; ++query) {
            const Vec3 centre = vector_within(random, 2);
            const Box box = Box{centre, centre}.grown(random.uniform(0, query % 5 ? 0.6 : 3));
            std::vector<OccluderTriangle> one, other;
            grown.gather(box, one);
            fresh.gather(box, other);
            ASSERT_EQ(numbers(one), numbers(other));
        }
    }
}

TEST(OccluderGrid, SegmentBlockedEqualsBruteForce) {
    Random random(3);
    int hits = 0, count = 0;
    for (int round = 0; round < 60; ++round) {
        Content content;
        const OccluderGrid grid = random_grid(random, 250, random.uniform(0, 1), content);
        for (int query = 0; query < 400; ++query) {
            const Vec3 a = vector_within(random, 2.3);
            const Vec3 b = a + vector_within(random, query % 4 ? 0.8 : 4);
            bool expected = false;
            for (const auto& [cell, triangles] : content)
                for (const auto& t : triangles) expected = expected || meets(a, b, t);
            ASSERT_EQ(grid.segment_blocked(a, b), expected) << round << ' ' << query;
            ASSERT_EQ(grid.segment_blocked(b, a), expected) << round << ' ' << query;
            hits += expected;
            ++count;
        }
    }
    EXPECT_GT(hits, count / 10);
    EXPECT_LT(hits, count * 9 / 10);
}

// A blocker either existed before and remained, or was set since.
TEST(OccluderGrid, DistinguishesNewFromOldTriangles) {
    Random random(12);
    Content content;
    OccluderGrid grid = random_grid(random, 300, 0.5, content);
    int old_and_new = 0, only_new = 0;
    for (int round = 0; round < 60; ++round) {
        const std::uint32_t before = grid.changes();
        OccluderGrid kept = grid;  // without the replaced cells
        for (int k = 0; k < 5; ++k) {
            const Vec3i cell = random_coordinates(random);
            kept.set_cell(cell, {});
            grid.set_cell(cell, random_cell(random, cell, k == 0 ? 12 : 0.5));
        }
        for (int query = 0; query < 100; ++query) {
            const Vec3 a = vector_within(random, 2.2), b = a + vector_within(random, 0.7);
            const bool by_new = grid.segment_blocked(a, b, before), by_old = kept.segment_blocked(a, b);
            ASSERT_EQ(grid.segment_blocked(a, b), by_new || by_old);
            ASSERT_FALSE(grid.segment_blocked(a, b, grid.changes()));
            old_and_new += by_new && by_old;
            only_new += by_new && !by_old;
        }
    }
    EXPECT_GT(old_and_new, 5);
    EXPECT_GT(only_new, 50);
}

// A cached blocker is recognised as long as it blocks the segment.
TEST(OccluderGrid, CachedBlockersCanBeTestedAgain) {
    Random random(13);
    Content content;
    OccluderGrid grid = random_grid(random, 300, 0.5, content);
    int still = 0, other = 0;
    for (int round = 0; round < 60; ++round) {
        std::vector<std::pair<Vec3, Vec3>> segments;
        std::vector<std::uint32_t> by;
        for (int query = 0; query < 100; ++query) {
            const Vec3 a = vector_within(random, 2.2), b = a + vector_within(random, 0.7);
            segments.emplace_back(a, b);
            by.push_back(grid.blocker(a, b));
            ASSERT_EQ(by.back() != OccluderGrid::no_triangle, grid.segment_blocked(a, b));
            ASSERT_EQ(grid.blocks(by.back(), a, b), grid.segment_blocked(a, b));
        }
        for (int k = 0; k < 40; ++k) {
            const Vec3i cell = random_coordinates(random);
            grid.set_cell(cell,
                          k % 2 == 0 ? std::vector<OccluderTriangle>{} : random_cell(random, cell, 0.5));
        }
        for (std::size_t k = 0; k < segments.size(); ++k) {
            const auto& [a, b] = segments[k];
            if (grid.blocks(by[k], a, b)) {
                ASSERT_TRUE(grid.segment_blocked(a, b));
                ++still;
            } else {
                other += by[k] != OccluderGrid::no_triangle;
            }
        }
    }
    EXPECT_GT(still, 100);
    EXPECT_GT(other, 10);
}

// Sets many cells at once; some are emptied, some set again.
TEST(OccluderGrid, SettingManyCellsEqualsSettingSingleCells) {
    Random random(11);
    OccluderGrid single(origin, cell_size, Vec3i::Constant(cells));
    OccluderGrid batch = single;
    for (int round = 0; round < 30; ++round) {
        Content content;
        for (int k = 0; k < 40; ++k) {
            const Vec3i cell = random_coordinates(random);
            content[{cell[2], cell[1], cell[0]}] = random_cell(random, cell, k % 10 ? 0.5 : 4);
        }
        std::vector<OccluderGrid::CellTriangles> changed;
        for (const auto& [key, triangles] : content) {
            const Vec3i cell(key[2], key[1], key[0]);
            single.set_cell(cell, triangles);
            changed.insert(random.below(2) ? changed.begin() : changed.end(), {cell, triangles});
        }
        batch.set_cells(changed, Parallel(2));
        ASSERT_EQ(batch.triangle_count(), single.triangle_count());
        for (int query = 0; query < 20; ++query) {
            const Vec3 a = vector_within(random, 2.2), b = vector_within(random, 2.2);
            ASSERT_EQ(batch.segment_blocked(a, b), single.segment_blocked(a, b));
            std::vector<OccluderTriangle> there, expected;
            const Box box{a.cwiseMin(b), a.cwiseMax(b)};
            batch.gather(box, there);
            single.gather(box, expected);
            ASSERT_EQ(numbers(there), numbers(expected));
        }
    }
}

TEST(OccluderGrid, NoSegmentIsBlockedInAClearBox) {
    Random random(12);
    int clear = 0, occupied = 0;
    for (int round = 0; round < 20; ++round) {
        Content content;
        const OccluderGrid grid = random_grid(random, 30, 0.3, content);
        for (int query = 0; query < 100; ++query) {
            const Vec3 centre = vector_within(random, 2.5);
            const Box box = Box{centre, centre}.grown(random.uniform(0.05, 0.8));
            if (!grid.is_clear(box)) {
                ++occupied;
                continue;
            }
            ++clear;
            std::vector<OccluderTriangle> there;
            grid.gather(box, there);
            ASSERT_TRUE(there.empty());
        }
    }
    EXPECT_GT(clear, 200);
    EXPECT_GT(occupied, 200);
}

TEST(SegmentFan, EqualSegmentBlocked) {
    Random random(13);
    int blocked = 0, seen = 0;
    for (int round = 0; round < 20; ++round) {
        Content content;
        const OccluderGrid grid = random_grid(random, round < 10 ? 40 : 400, round % 3 ? 0.4 : 4, content);
        for (int from = 0; from < 20; ++from) {
            const Vec3 a = vector_within(random, 2.2);
            SegmentFan fan(grid, a, 1.1);
            for (int to = 0; to < 20; ++to) {
                Vec3 b = a + vector_within(random, 1.1);
                if (to % 4 == 0) b[to / 4 % 3] = a[to / 4 % 3];
                const bool expected = grid.segment_blocked(a, b);
                ASSERT_EQ(fan.blocked(b), expected);
                ++(expected ? blocked : seen);
            }
        }
    }
    EXPECT_GT(blocked, 500);
    EXPECT_GT(seen, 500);
}

// Segments along the grid's planes and lines, triangles in those planes.
TEST(OccluderGrid, SegmentsAlongCellFaces) {
    Random random(4);
    for (int round = 0; round < 3000; ++round) {
        OccluderGrid grid(Vec3::Zero(), 1, Vec3i::Constant(8));
        const auto lattice = [&] {
            const auto x = static_cast<double>(random.below(9)), y = static_cast<double>(random.below(9));
            return Vec3(x, y, static_cast<double>(random.below(9)));
        };
        const Vec3 a = lattice(), b = lattice();
        const Vec3 middle = 0.5 * (a + b);
        // A triangle at the middle across the segment, listed by a cell that contains it.
        const Vec3 d = b - a;
        if (d.isZero()) continue;
        const Vec3 u = d.unitOrthogonal(), v = d.cross(u).normalized();
        const std::array<OccluderTriangle, 1> across{
            {{{middle + 0.3 * u, middle - 0.2 * u + 0.2 * v, middle - 0.2 * u - 0.2 * v}, false}}};
        grid.set_cell(middle.cast<int>().cwiseMin(7), across);
        ASSERT_TRUE(grid.segment_blocked(a, b)) << a.transpose() << " to " << b.transpose();
        // A segment that ends on the triangle meets it: both are closed.
        ASSERT_TRUE(grid.segment_blocked(a, middle));
        ASSERT_TRUE(grid.segment_blocked(middle, b));
        ASSERT_TRUE(grid.segment_blocked(middle, middle));
        ASSERT_FALSE(grid.segment_blocked(a, a + 0.4 * d));
        ASSERT_FALSE(grid.segment_blocked(b, b - 0.4 * d));
    }
}

// A closed fan with a wavy rim around a point: no segment slips between its triangles,
// through the middle vertex or along the shared edges.
TEST(SegmentMeetsTriangle, NothingSlipsBetweenTriangles) {
    Random random(5);
    for (int round = 0; round < 20000; ++round) {
        const int n = 3 + static_cast<int>(random.below(6));
        const Quat turn =
            Quat(Eigen::AngleAxisd(random.uniform(0, 6), vector_within(random, 1).normalized()));
        const Vec3 shift = vector_within(random, 3);
        std::vector<Vec3> rim;
        for (int k = 0; k < n; ++k) {
            const double angle = 2 * M_PI * (k + random.uniform(-0.3, 0.3)) / n;
            rim.push_back(turn * Vec3(std::cos(angle), std::sin(angle), random.uniform(-0.3, 0.3)) + shift);
        }
        const Vec3 hub = shift;
        const std::size_t k = random.below(static_cast<std::uint32_t>(n));
        const Vec3 on_edge = hub + random.below(3) * 0.3 * (rim[k] - hub);
        const Vec3 direction = turn * Vec3(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 1);
        const Vec3 a = on_edge - random.uniform(0.5, 2) * direction;
        const Vec3 b = on_edge + random.uniform(0.5, 2) * direction;
        bool met = false;
        for (std::size_t t = 0; t < rim.size(); ++t)
            met = met || segment_meets_triangle(a, b, {hub, rim[t], rim[(t + 1) % rim.size()]});
        ASSERT_TRUE(met) << round;
    }
}

TEST(SegmentMeetsTriangle, InThePlaneOfTheTriangle) {
    const std::array<Vec3, 3> triangle{Vec3(0, 0, 1), Vec3(2, 0, 1), Vec3(0, 2, 1)};
    EXPECT_TRUE(segment_meets_triangle({-1, 0.5, 1}, {3, 0.5, 1}, triangle));     // through it
    EXPECT_TRUE(segment_meets_triangle({0.2, 0.2, 1}, {0.3, 0.4, 1}, triangle));  // within it
    EXPECT_TRUE(segment_meets_triangle({-1, 0, 1}, {0, 0, 1}, triangle));         // to a corner
    EXPECT_FALSE(segment_meets_triangle({-2, 0.5, 1}, {-1, 0.5, 1}, triangle));   // ends before it
    EXPECT_FALSE(segment_meets_triangle({3, 0, 1}, {0, 3, 1}, triangle));         // beside it
    EXPECT_FALSE(segment_meets_triangle({-1, 0.5, 1.001}, {3, 0.5, 1.001}, triangle));
    EXPECT_TRUE(segment_meets_triangle({0.5, 0.5, 1}, {0.5, 0.5, 1}, triangle));
    EXPECT_FALSE(segment_meets_triangle({1.5, 1.5, 1}, {1.5, 1.5, 1}, triangle));
    // Degenerate triangles.
    EXPECT_FALSE(
        segment_meets_triangle({-1, 0.5, 1}, {3, 0.5, 1}, {Vec3(0, 0, 1), Vec3(0, 1, 1), Vec3(0, 2, 1)}));
}

TEST(OccluderGrid, EmptyingACellRemovesItsTriangles) {
    Random random(6);
    Content content;
    OccluderGrid grid = random_grid(random, 300, 0.5, content);
    for (const auto& [cell, triangles] : content) grid.set_cell({cell[2], cell[1], cell[0]}, {});
    EXPECT_EQ(grid.triangle_count(), 0U);
    std::vector<OccluderTriangle> found;
    grid.gather(Box{Vec3::Constant(-100), Vec3::Constant(100)}, found);
    EXPECT_TRUE(found.empty());
    EXPECT_FALSE(grid.segment_blocked({-2, -2, -2}, {2, 2, 2}));
}

TEST(OccluderGrid, EmptyRegionsOfLargeGridsCostNothing) {
    OccluderGrid grid(Vec3::Zero(), 0.001, Vec3i::Constant(1 << 20));
    const Vec3 p(700.0001, 1.0, 30.0);
    const std::array<OccluderTriangle, 1> one{{{{p, p + Vec3(0, 0.001, 0), p + Vec3(0, 0, 0.001)}, false}}};
    grid.set_cell((p / 0.001).cast<int>(), one);
    EXPECT_TRUE(grid.segment_blocked(p + Vec3(-0.001, 0.0002, 0.0002), p + Vec3(0.001, 0.0002, 0.0002)));
    std::vector<OccluderTriangle> found;
    grid.gather(Box{Vec3::Zero(), Vec3::Constant(1000)}, found);
    EXPECT_EQ(found.size(), 1U);
}

TEST(OccluderGrid, OptionsOutOfRangeAreRefused) {
    EXPECT_THROW(OccluderGrid(Vec3::Zero(), 0, Vec3i::Ones()), InputError);
    EXPECT_THROW(OccluderGrid(Vec3::Zero(), std::nan(""), Vec3i::Ones()), InputError);
    EXPECT_THROW(OccluderGrid(Vec3::Zero(), 1, Vec3i(1, 0, 1)), InputError);
    EXPECT_THROW(OccluderGrid(Vec3::Zero(), 1, Vec3i(1, 1, (1 << 20) + 1)), InputError);
}

}  // namespace
}  // namespace splitcubes::geometry
