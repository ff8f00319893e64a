// SurfaceChanges reports changes where they were, and none elsewhere.
#include <splitcubes/contact/detection/surface_changes.h>
#include <splitcubes/core/random.h>

#include <gtest/gtest.h>

#include <vector>

namespace splitcubes::body {
namespace {

constexpr double cell = 0.1;

Vec3 random_point(Random& random) {
    return {random.unit(), random.unit(), random.unit()};
}

TEST(SurfaceChanges, AreReportedByRegionAndSinceAChange) {
    SurfaceChanges changes({Vec3::Zero(), cell, Vec3i::Constant(11)});
    const geometry::Box here{Vec3::Constant(0.1), Vec3::Constant(0.2)},
        there{Vec3::Constant(0.7), Vec3::Constant(0.8)};
    const std::uint32_t start = changes.now();
    EXPECT_FALSE(changes.since(here, start));
    changes.begin();
    changes.mark(here);
    EXPECT_TRUE(changes.since(here, start));
    EXPECT_TRUE(changes.since({Vec3::Zero(), Vec3::Constant(0.1)}, start)) << "boxes are closed";
    EXPECT_FALSE(changes.since(there, start));
    EXPECT_FALSE(changes.since(here, changes.now()));
    const std::uint32_t marked = changes.now();
    changes.begin();
    changes.mark({});
    EXPECT_FALSE(changes.since(here, marked));
    // Boxes outside the grid belong to the cubes at its boundary.
    changes.mark({Vec3::Constant(-5), Vec3::Constant(-4)});
    EXPECT_TRUE(changes.since({Vec3::Constant(-9), Vec3::Constant(-8)}, marked));
    changes.mark_all();
    EXPECT_TRUE(changes.since(there, marked));
}

// Recent and old changes, in many regions: every change is reported, and none more than a cube away.
TEST(SurfaceChanges, AreReportedHoweverOldTheyAre) {
    SurfaceChanges changes({Vec3::Zero(), cell, Vec3i::Constant(11)});
    Random random{7};
    const auto random_box = [&] {
        const Vec3 corner = random_point(random);
        return geometry::Box{corner, corner + 0.15 * random_point(random)};
    };
    struct Mark {
        std::uint32_t change;
        geometry::Box box;
    };
    std::vector<Mark> marks;
    std::size_t reported = 0, unreported = 0;
    for (int step = 0; step < 40; ++step) {
        changes.begin();
        for (int k = step % 4; k > 0; --k) {
            marks.push_back({changes.now(), random_box()});
            changes.mark(marks.back().box);
        }
        for (int k = 0; k < 50; ++k) {
            const geometry::Box queried = random_box();
            const auto change_id = static_cast<std::uint32_t>(random.unit() * (changes.now() + 1));
            bool has_changed = false, is_near = false;
            for (const Mark& mark : marks) {
                if (mark.change <= change_id) continue;
                has_changed = has_changed || mark.box.meets(queried);
                is_near = is_near || mark.box.grown(1.001 * cell).meets(queried);
            }
            const bool is_reported = changes.since(queried, change_id);
            EXPECT_TRUE(is_reported || !has_changed);
            EXPECT_TRUE(!is_reported || is_near);
            reported += is_reported;
            unreported += !is_reported;
        }
    }
    EXPECT_GT(reported, 100U);
    EXPECT_GT(unreported, 100U);
}

}  // namespace
}  // namespace splitcubes::body
