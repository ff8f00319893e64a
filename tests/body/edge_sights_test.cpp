// What is kept of sights equals what looking anew tells, while a surface grows.
#include <splitcubes/body/edge_sights.h>
#include <splitcubes/core/parallel.h>
#include <splitcubes/core/random.h>

#include <gtest/gtest.h>

namespace splitcubes::body {
namespace {

constexpr double reach = 0.35, cell = 0.1;
constexpr int across = 10;

// A unit cube of phyxels whose cells get triangles, and others in their place, step by step.
class GrowingSurface {
  public:
    GrowingSurface()
        : rest_{Vec3::Zero(), cell, Vec3i::Constant(across + 1)},
          occluders_(Vec3::Zero(), cell, Vec3i::Constant(across)),
          changes_(rest_) {
        for (int z = 0; z < 8; ++z)
            for (int y = 0; y < 8; ++y)
                for (int x = 0; x < 8; ++x) {
                    phyxels_.rest_position.emplace_back((Vec3(x, y, z) + Vec3::Constant(0.5)) / 8);
                    phyxels_.support_radius.push_back(reach);
                    phyxels_.piece.push_back(x < 4 ? 0 : 1);
                }
        locator_ = meshless::PhyxelLocator(phyxels_.rest_position, reach);
    }
    void change_cells(int count) {
        changes_.begin();
        for (int k = 0; k < count; ++k) {
            const Vec3i place(index(), index(), index());
            std::vector<geometry::OccluderTriangle> triangles;
            geometry::Box& box =
                boxes_[static_cast<std::size_t>((place.z() * across + place.y()) * across + place.x())];
            geometry::Box changed = box;
            box = {};
            for (int t = 0; t < 2; ++t) {
                std::array<Vec3, 3> corner;
                for (Vec3& c : corner) {
                    c = cell * (place.cast<double>() + Vec3(random_.unit(), random_.unit(), random_.unit()));
                    box.add(c);
                }
                triangles.push_back({corner, false});
            }
            changed.add(box);
            changes_.mark(changed);
            occluders_.set_cell(place, triangles);
        }
    }
    void add_phyxels(int count) {
        for (int k = 0; k < count; ++k) {
            phyxels_.rest_position.push_back(place());
            phyxels_.support_radius.push_back((1 + 0.2 * random_.unit()) * reach);
            phyxels_.piece.push_back(phyxels_.rest_position.back().x() < 0.5 ? 0 : 1);
        }
        locator_ = meshless::PhyxelLocator(phyxels_.rest_position, reach);
    }
    // The same triangles in occluders that count anew, and fewer of them.
    void start_anew() {
        geometry::OccluderGrid fresh(Vec3::Zero(), cell, Vec3i::Constant(across));
        std::swap(occluders_, fresh);
        boxes_.assign(boxes_.size(), {});
        changes_.mark_all();
        change_cells(40);
    }
    SightContext context() const { return {occluders_, changes_, phyxels_, locator_, reach}; }
    Vec3 place() { return {random_.unit(), random_.unit(), random_.unit()}; }
    int index() { return static_cast<int>(random_.unit() * across); }
    meshless::Phyxels& phyxels() { return phyxels_; }
    SurfaceChanges& changes() { return changes_; }

  private:
    geometry::RestGrid rest_;
    geometry::OccluderGrid occluders_;
    SurfaceChanges changes_;
    meshless::Phyxels phyxels_;
    meshless::PhyxelLocator locator_;
    std::vector<geometry::Box> boxes_ = std::vector<geometry::Box>(across * across * across);
    Random random_{7};
};

// Each edge's sights of one of the two pieces, and how many there are.
std::size_t expect_true(EdgeSights& sights, std::span<const std::uint32_t> numbers,
                        std::span<const Vec3> places, std::int32_t piece, const SightContext& context) {
    std::size_t count = 0;
    for (std::size_t k = 0; k < numbers.size(); ++k)
        for (const EdgeSights::Link& link : sights.near(numbers[k], context)) {
            if (context.phyxels.piece[link.phyxel] != piece) continue;
            const Vec3& rest = context.phyxels.rest_position[link.phyxel];
            if (!((rest - places[k]).norm() < 0.999 * reach)) continue;
            EXPECT_EQ(link.sight == EdgeSights::Link::seen,
                      !context.occluders.segment_blocked(places[k], rest));
            EXPECT_NE(link.sight, EdgeSights::Link::unknown);
            ++count;
        }
    return count;
}

// Of edges that are known and of such that have just been asked for the first time.
void expect_same_links(EdgeSights& sights, std::span<const std::uint32_t> numbers,
                       std::span<const Vec3> places, const SightContext& context) {
    EdgeSights fresh;
    fresh.begin(context.phyxels.size());
    for (std::size_t k = 0; k < numbers.size(); ++k) {
        const auto known = sights.near(numbers[k], context);
        const auto anew = fresh.near(fresh.number_of(k, places[k]), context);
        ASSERT_EQ(known.size(), anew.size());
        for (std::size_t l = 0; l < known.size(); ++l) {
            EXPECT_EQ(known[l].phyxel, anew[l].phyxel);
            EXPECT_EQ(known[l].weight, anew[l].weight);
        }
    }
}

TEST(EdgeSights, TellWhatLookingAnewTells) {
    for (const int threads : {1, 4}) {
        const Parallel parallel(threads);
        GrowingSurface surface;
        EdgeSights sights;
        std::vector<Vec3> places;
        for (int k = 0; k < 300; ++k) places.push_back(surface.place());
        std::size_t checked = 0;
        for (int step = 0; step < 12; ++step) {
            if (step == 7) surface.start_anew();
            surface.change_cells(step % 3 == 0 ? 30 : 3);
            if (step % 4 == 2) surface.add_phyxels(20);
            sights.begin(surface.phyxels().rest_position.size());
            // Each step others of them, half of which it has asked for before.
            std::vector<std::uint32_t> numbers;
            std::vector<Vec3> asked;
            for (std::size_t k = static_cast<std::size_t>(step) % 3; k < places.size(); k += 2) {
                numbers.push_back(sights.number_of(k, places[k]));
                asked.push_back(places[k]);
            }
            const std::int32_t piece = step % 2;
            const SightContext context = surface.context();
            parallel.for_each(numbers.size(), 4, [&](std::size_t k) {
                sights.near(numbers[k], context);
                sights.look(numbers[k], piece, context);
            });
            checked += expect_true(sights, numbers, asked, piece, context);
            expect_same_links(sights, numbers, asked, context);
        }
        EXPECT_GT(checked, 10000U);
    }
}

TEST(EdgeSights, AnEdgeHasOneNumberAStepAndAllAreForgottenWithFewerPhyxels) {
    GrowingSurface surface;
    EdgeSights sights;
    sights.begin(surface.phyxels().rest_position.size());
    for (std::uint64_t edge = 0; edge < 1000; ++edge) {
        const std::uint32_t number = sights.number_of(edge * 977, surface.place());
        EXPECT_EQ(sights.number_of(edge * 977, Vec3::Zero()), number);
    }
    EXPECT_EQ(sights.size(), 1000U);
    sights.begin(surface.phyxels().rest_position.size());
    EXPECT_EQ(sights.size(), 1000U);
    sights.begin(surface.phyxels().rest_position.size() + 1);
    EXPECT_EQ(sights.size(), 1000U);
    sights.begin(surface.phyxels().rest_position.size());
    EXPECT_EQ(sights.size(), 0U);
}

TEST(EdgeSights, WhatNoStepAsksForIsForgotten) {
    GrowingSurface surface;
    EdgeSights sights;
    for (std::uint64_t step = 0; step < 50; ++step) {
        sights.begin(1);
        for (std::uint64_t edge = 0; edge < 500; ++edge) sights.number_of(500 * step + edge, surface.place());
    }
    EXPECT_LT(sights.size(), 10000U);
}

TEST(SurfaceChanges, AreToldWhereAndOnlySince) {
    GrowingSurface surface;
    SurfaceChanges& changes = surface.changes();
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
    // What is beyond the grid belongs to its rim.
    changes.mark({Vec3::Constant(-5), Vec3::Constant(-4)});
    EXPECT_TRUE(changes.since({Vec3::Constant(-9), Vec3::Constant(-8)}, marked));
    changes.mark_all();
    EXPECT_TRUE(changes.since(there, marked));
}

// Long ago as well as lately, in many places at once: what was changed is told, what is a cube away is not.
TEST(SurfaceChanges, AreRememberedHoweverLongAgo) {
    GrowingSurface surface;
    SurfaceChanges& changes = surface.changes();
    const auto random_box = [&] {
        const Vec3 corner = surface.place();
        return geometry::Box{corner, corner + 0.15 * surface.place()};
    };
    struct Mark {
        std::uint32_t number;
        geometry::Box box;
    };
    std::vector<Mark> marks;
    std::size_t told = 0, quiet = 0;
    for (int step = 0; step < 40; ++step) {
        changes.begin();
        for (int k = step % 4; k > 0; --k) {
            marks.push_back({changes.now(), random_box()});
            changes.mark(marks.back().box);
        }
        for (int k = 0; k < 50; ++k) {
            const geometry::Box asked = random_box();
            const auto when = static_cast<std::uint32_t>(surface.place().x() * (changes.now() + 1));
            bool touched = false, is_near = false;
            for (const Mark& mark : marks) {
                if (mark.number <= when) continue;
                touched = touched || mark.box.meets(asked);
                is_near = is_near || mark.box.grown(1.001 * cell).meets(asked);
            }
            const bool is_told = changes.since(asked, when);
            EXPECT_TRUE(is_told || !touched);
            EXPECT_TRUE(!is_told || is_near);
            told += is_told;
            quiet += !is_told;
        }
    }
    EXPECT_GT(told, 100U);
    EXPECT_GT(quiet, 100U);
}

}  // namespace
}  // namespace splitcubes::body
