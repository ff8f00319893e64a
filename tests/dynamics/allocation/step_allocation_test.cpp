#include "../bodies.h"
#include "counted_allocations.h"

#include <gtest/gtest.h>

namespace splitcubes::meshless {
namespace {

using fixtures::Specimen;

// Returns the allocations in twenty steps, after ten warm-up steps.
std::size_t allocations_of(Specimen& body, const Parallel& parallel) {
    for (int k = 0; k < 10; ++k) body.step(parallel);
    const std::size_t before = allocations;
    for (int k = 0; k < 20; ++k) body.step(parallel);
    return allocations - before;
}

struct StepKind {
    const char* name;
    SolverKind kind;
    bool moves, cut, on_ground;
};

TEST(Step, DoesNotAllocateOnceItIsWarm) {
    const std::array<StepKind, 6> kinds{{{"idle", SolverKind::implicit_steps, false, false, false},
                                         {"implicit", SolverKind::implicit_steps, true, false, false},
                                         {"implicit, cut", SolverKind::implicit_steps, true, true, false},
                                         {"implicit, ground", SolverKind::implicit_steps, true, false, true},
                                         {"explicit", SolverKind::explicit_steps, true, false, false},
                                         {"explicit, cut", SolverKind::explicit_steps, true, true, false}}};
    for (const int threads : {1, 2}) {
        const Parallel parallel(threads);
        for (const StepKind& step_kind : kinds) {
            Specimen body = fixtures::block(12, 8, 8, 0.05, Material{}, parallel);
            if (step_kind.cut) fixtures::cut_randomly(body, 20, 0.15, 3, parallel);
            body.options.kind = step_kind.kind;
            if (step_kind.on_ground) {
                body.input.gravity = Vec3(0, 0, -9.81);
                body.ground = fixtures::Ground{Vec3::UnitZ(), -0.205, 0.4};
            }
            if (step_kind.moves)
                body.move([](const Vec3& x) -> Vec3 { return x; },
                          [](const Vec3& x) -> Vec3 { return Vec3(1, 2, 3).cross(x) + 0.5 * x; });
            EXPECT_EQ(allocations_of(body, parallel), 0U) << step_kind.name << ", threads: " << threads;
        }
    }
}

TEST(Step, TheCounterCounts) {
    const std::size_t before = allocations;
    const std::vector<int> some(100);
    EXPECT_EQ(allocations, before + 1) << some.size();
}

TEST(Update, AfterACutDoesNotAllocateOnceItIsWarm) {
    for (const int threads : {1, 2}) {
        const Parallel parallel(threads);
        Specimen body = fixtures::block(12, 8, 8, 0.05, Material{}, parallel);
        const std::vector<std::uint32_t> changed = fixtures::cut_by_plane(body, Vec3::Zero(), Vec3::UnitX());
        body.neighbourhoods.update(body.phyxels, body.pairs, changed, body.material, parallel);
        const std::size_t before = allocations;
        for (const std::uint32_t p : changed) body.pairs.visibility[p] = 1;
        body.neighbourhoods.update(body.phyxels, body.pairs, changed, body.material, parallel);
        EXPECT_EQ(allocations, before) << "threads: " << threads;
    }
}

}  // namespace
}  // namespace splitcubes::meshless
