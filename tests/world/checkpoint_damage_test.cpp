// Damaged checkpoints with a valid checksum are rejected with a one-line message, or are states from which
// the world can continue.
#include <splitcubes/body/body.h>
#include <splitcubes/core/error.h>
#include <splitcubes/world/checkpoint.h>

#include "busy_world.h"
#include "checkpoint_damage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace splitcubes::body::damage {
namespace {

const char* const identity = "a scene";

std::string checkpoint_after(int steps, meshless::SolverKind kind) {
    const auto world = busy::make(kind, busy::Size::small);
    for (int step = 0; step < steps; ++step) world->step();
    return encode_checkpoint(*world, identity, "page");
}

// Restores a checkpoint and returns the error message; empty: it was accepted, and the world has made two
// steps.
std::string restore_message(const std::string& checkpoint, meshless::SolverKind kind) {
    const auto world = busy::make(kind, busy::Size::small);
    try {
        restore_checkpoint(*world, checkpoint, identity, "x.bin");
    } catch (const InputError& error) {
        return error.what();
    }
    try {
        for (int step = 0; step < 2; ++step) world->step();
    } catch (const JobError&) {
        // Explicit steps may need too many substeps.
    }
    return "";
}

class DamagedCheckpoint : public testing::TestWithParam<meshless::SolverKind> {};

TEST_P(DamagedCheckpoint, IsRejectedWithOneLineOrContinues) {
    const std::string good = checkpoint_after(20, GetParam());
    ASSERT_EQ(restore_message(good, GetParam()), "");
    int rejected = 0;
    constexpr int trials = 150;
    for (int trial = 0; trial < trials; ++trial) {
        Random random(static_cast<std::uint64_t>(trial));
        std::string damaged = good;
        for (std::uint32_t k = 0; k <= random.below(2); ++k) damage(damaged, random);
        reseal(damaged);
        const std::string message = restore_message(damaged, GetParam());
        rejected += !message.empty();
        if (message.empty()) continue;
        EXPECT_THAT(message, testing::StartsWith("x.bin: is damaged: it holds ")) << trial;
        EXPECT_THAT(message, testing::Not(testing::HasSubstr("\n"))) << trial;
    }
    // Some damage is rejected, some accepted.
    EXPECT_GT(rejected, trials / 4);
    EXPECT_LT(rejected, trials);
}

TEST_P(DamagedCheckpoint, TruncatedAnywhereItIsRejected) {
    const std::string good = checkpoint_after(20, GetParam());
    const std::size_t begin = payload_begin(good);
    for (std::size_t part = 0; part < 40; ++part) {
        std::string damaged = good.substr(0, begin + (good.size() - begin) * part / 40);
        reseal(damaged);
        EXPECT_THAT(restore_message(damaged, GetParam()), testing::HasSubstr("x.bin: is damaged: it holds "))
            << part;
    }
    std::string longer = good + "1234";
    reseal(longer);
    EXPECT_THAT(restore_message(longer, GetParam()), testing::HasSubstr("more than belongs to it"));
}

INSTANTIATE_TEST_SUITE_P(Solvers, DamagedCheckpoint,
                         testing::Values(meshless::SolverKind::implicit_steps,
                                         meshless::SolverKind::explicit_steps));

TEST(BusyWorld, HasAllStateThatACheckpointStores) {
    const auto world = busy::make(meshless::SolverKind::implicit_steps, busy::Size::small);
    std::size_t torn = 0, contacts = 0;
    for (int step = 0; step < 20; ++step) {
        const StepReport report = world->step();
        torn += report.counts.torn_edges;
        contacts += report.counts.contacts;
    }
    const Body& block = *world->bodies()[0];
    EXPECT_GT(block.pieces().count(), 3U);
    EXPECT_GT(block.phyxels().rigid.bodies.size(), 0U);
    EXPECT_GT(torn, 0U);
    EXPECT_GT(contacts, 0U);
    EXPECT_GT(world->active_contacts().size(), 0U);
    EXPECT_TRUE(world->bodies()[3]->is_lattice_driven());
    EXPECT_GT(world->bodies()[3]->cut_edge_count(), 0U);
    double strain = 0;
    for (const Mat3& plastic : world->bodies()[1]->phyxels().plastic_strain) strain += plastic.norm();
    EXPECT_GT(strain, 0);
}

}  // namespace
}  // namespace splitcubes::body::damage
