// Segments from one point, all at once: each as OccluderGrid tells it on its own.
#include <splitcubes/core/random.h>
#include <splitcubes/geometry/sight_fan.h>

#include <gtest/gtest.h>

#include <vector>

namespace splitcubes::geometry {
namespace {

constexpr double cell = 0.1;
constexpr int across = 20;

Vec3 place(Random& random) {
    return cell * across * Vec3(random.unit(), random.unit(), random.unit());
}

// Cells of a wavy sheet, some triangles anywhere, and some that are long.
OccluderGrid make_surface(Random& random, const Vec3& origin) {
    OccluderGrid grid(origin, cell, Vec3i::Constant(across));
    for (int y = 0; y < across; ++y)
        for (int x = 0; x < across; ++x) {
            const auto at = [&](int u, int v) {
                const Vec3 p(x + u, y + v, 10 + 2 * std::sin(0.7 * (x + u)) + std::cos(0.5 * (y + v)));
                return Vec3(origin + cell * p);
            };
            std::vector<OccluderTriangle> triangles{{{at(0, 0), at(1, 0), at(0, 1)}, false},
                                                    {{at(1, 0), at(1, 1), at(0, 1)}, true}};
            if ((x + y) % 5 == 0) {
                const Vec3 p = origin + place(random);
                const double size = x == 0 ? 10 * cell : cell;
                const auto off = [&] { return Vec3(p + size * Vec3(random.unit(), random.unit(), 0.3)); };
                triangles.push_back({{off(), off(), off()}, false});
            }
            grid.set_cell({x, y, static_cast<int>((at(0, 0) - origin).z() / cell)}, triangles);
        }
    return grid;
}

TEST(SightFan, TellsOfEachSegmentWhatItTellsOnItsOwn) {
    Random random(5);
    std::size_t blocked = 0, open = 0;
    for (const Vec3& origin : {Vec3(0, 0, 0), Vec3(-3, 50, 7)}) {
        const OccluderGrid grid = make_surface(random, origin);
        for (int trial = 0; trial < 3000; ++trial) {
            const Vec3 from = origin + place(random);
            const double reach = (trial % 3 + 1) * 2 * cell;
            std::vector<Vec3> to;
            for (std::size_t k = 0; k < static_cast<std::size_t>(trial) % (most_fan_segments + 1); ++k)
                to.emplace_back(
                    from + reach * Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)));
            std::vector<std::uint32_t> by(to.size(), OccluderGrid::no_triangle);
            const std::uint32_t told = blocked_segments(grid, from, to, by.data());
            ASSERT_EQ(blocked_segments(grid, from, to), told);
            for (std::size_t k = 0; k < to.size(); ++k) {
                ASSERT_EQ((told >> k & 1) != 0, grid.segment_blocked(from, to[k]));
                ASSERT_EQ((told >> k & 1) != 0, grid.blocks(by[k], from, to[k]));
                ((told >> k & 1) != 0 ? blocked : open) += 1;
            }
        }
    }
    EXPECT_GT(blocked, 5000U);
    EXPECT_GT(open, 5000U);
}

// Where single precision cannot tell: segments that end on a triangle, run along its edges or lie in its
// plane.
TEST(SightFan, DecidesWhatTouchesAsOnItsOwn) {
    Random random(6);
    const OccluderGrid grid = make_surface(random, Vec3::Zero());
    std::vector<OccluderTriangle> all;
    grid.gather({Vec3::Zero(), Vec3::Constant(across * cell)}, all);
    std::size_t blocked = 0, open = 0;
    for (std::size_t t = 0; t < all.size(); ++t) {
        const auto& corner = all[t].corner;
        const Vec3 middle = (corner[0] + corner[1] + corner[2]) / 3;
        const Vec3 normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
        const Vec3 from = middle + 0.7 * cell * normal;
        std::vector<Vec3> to{corner[0], corner[1], corner[2], middle, 0.5 * (corner[0] + corner[1])};
        for (const double share : {1e-15, 1e-12, 1e-9, 1e-6})
            for (const double sign : {-1.0, 1.0})
                to.emplace_back(middle + sign * share * normal + 0.2 * cell * (corner[1] - corner[0]));
        const std::uint32_t told = blocked_segments(grid, from, to);
        for (std::size_t k = 0; k < to.size(); ++k) {
            ASSERT_EQ((told >> k & 1) != 0, grid.segment_blocked(from, to[k])) << t << ", " << k;
            ((told >> k & 1) != 0 ? blocked : open) += 1;
        }
        const std::vector<Vec3> along{corner[1], corner[2], middle, from};
        const std::uint32_t met = blocked_segments(grid, corner[0], along);
        for (std::size_t k = 0; k < along.size(); ++k)
            ASSERT_EQ((met >> k & 1) != 0, grid.segment_blocked(corner[0], along[k]));
    }
    EXPECT_GT(blocked, 1000U);
    EXPECT_GT(open, 300U);
}

TEST(SightFan, BearsNothing) {
    const OccluderGrid grid(Vec3::Zero(), cell, Vec3i::Constant(across));
    const std::vector<Vec3> to{Vec3::Ones(), Vec3::Zero()};
    EXPECT_EQ(blocked_segments(grid, Vec3::Zero(), to), 0U);
    EXPECT_EQ(blocked_segments(grid, Vec3::Zero(), {}), 0U);
}

}  // namespace
}  // namespace splitcubes::geometry
