// Cached contacts are found in any order of queries, and contact springs create no energy when the stiffness
// of the touched phyxels changes, and holds do not stiffen them.
#include <splitcubes/contact/response/contact_forces.h>
#include <splitcubes/contact/response/tuning.h>
#include <splitcubes/core/random.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

namespace splitcubes::meshless {
namespace {

std::vector<CachedContact> cached_contacts(std::span<const std::uint64_t> keys) {
    std::vector<CachedContact> cached;
    for (const std::uint64_t key : keys) cached.emplace_back().key = key;
    return cached;
}

TEST(CachedContactFinder, FindsExactlyTheCachedKeys) {
    const std::vector<std::uint64_t> keys = {0, 3, 4, 9, 1ULL << 48, ~0ULL};
    const std::vector<CachedContact> cached = cached_contacts(keys);
    std::vector<std::uint64_t> queries = keys;
    for (const std::uint64_t key : {1ULL, 5ULL, 8ULL, 10ULL, (1ULL << 48) + 1, ~0ULL - 1})
        queries.push_back(key);
    queries.push_back(4);
    std::mt19937 random(7);
    for (int pass = 0; pass < 20; ++pass) {
        // Sorted, with repetitions, and shuffled.
        if (pass == 0) std::sort(queries.begin(), queries.end());
        CachedContactFinder finder(&cached);
        for (const std::uint64_t key : queries) {
            const CachedContact* const found = finder.find(key);
            const bool is_cached = std::find(keys.begin(), keys.end(), key) != keys.end();
            ASSERT_EQ(found != nullptr, is_cached) << key;
            if (found) {
                EXPECT_EQ(found->key, key);
            }
        }
        std::shuffle(queries.begin(), queries.end(), random);
    }
    CachedContactFinder nothing(nullptr);
    EXPECT_EQ(nothing.find(3), nullptr);
}

// An approach counts as an impact only for a new contact whose gap closes within the step.
TEST(FindImpacts, NewContactsThatCloseTheirGapAreImpacts) {
    std::vector<Contact> contacts(4);
    for (std::uint32_t c = 0; c < contacts.size(); ++c) {
        contacts[c].key = c;
        contacts[c].upper.count = 1;
        contacts[c].upper.phyxel[0] = c;
        contacts[c].upper.weight[0] = 1;
        contacts[c].gap = 0.01;
        contacts[c].max_depenetration = 1e-3;
    }
    contacts[2].gap = 0.03;
    const std::vector<Vec3> velocity = {{0, 0, -1}, {0, 0, -1}, {0, 0, -1}, {0, 0, 1}};
    const std::vector<std::uint64_t> keys = {1};
    std::vector<CachedContact> cached = cached_contacts(keys);
    ContactInput input;
    input.contacts = contacts;
    input.cached = &cached;
    const std::vector<std::span<const Vec3>> field = {velocity};
    std::vector<std::uint8_t> known, impact;
    for (const int threads : {1, 3}) {
        find_impacts(input, field, 0.02, Parallel(threads), known, impact);
        EXPECT_EQ(known, (std::vector<std::uint8_t>{0, 1, 0, 0}));
        EXPECT_EQ(impact, (std::vector<std::uint8_t>{1, 0, 0, 0}));
    }
}

// Two phyxels in contact, and the cached contact.
struct Pressed {
    std::vector<Contact> contacts{1};
    std::vector<CachedContact> cached;
    std::vector<Vec3> position = {{0, 0, 0.01}, {0, 0, 0}}, velocity = {Vec3::Zero(), Vec3::Zero()};
    std::vector<std::int32_t> piece;  // per phyxel; or empty
    std::vector<double> piece_mass;   // kg
    ContactForces forces;
    double energy = 0;  // J, after a step

    Pressed() {
        Contact& contact = contacts[0];
        contact.upper.count = contact.lower.count = 1;
        contact.upper.phyxel[0] = 0;
        contact.lower.phyxel[0] = 1;
        contact.upper.weight[0] = contact.lower.weight[0] = 1;
        contact.gap = 1e-4;
        contact.friction = 0.5;
        contact.max_depenetration = 1e-12;  // effectively no overlap is removed
    }
    // Takes a step that displaces the upper phyxel; returns the force on it at the start of the solve.
    Vec3 step(double mobility, const Vec3& displacement) {
        const std::vector<double> mobilities(2, mobility);
        std::vector<Vec3> after = position, force(2, Vec3::Zero());
        after[0] += displacement;
        velocity[0] = displacement / 0.02;
        ContactInput input;
        input.contacts = contacts;
        input.cached = &cached;
        const std::vector<ContactForces::Part> parts = {
            {position, velocity, 0.02, mobilities, {}, piece, piece_mass}};
        const std::vector<std::span<const Vec3>> before = {position}, moved = {after};
        const std::vector<std::span<Vec3>> out = {force};
        std::vector<std::uint8_t> touching(2, 0);
        const std::vector<std::span<std::uint8_t>> touched = {touching};
        const Parallel parallel(1);
        forces.begin(input, parts);
        forces.make_springs(moved, 0, parallel);
        forces.add_forces(before, out, parallel);
        forces.finish(moved, touched, parallel);
        energy = forces.energy();
        contacts[0].gap += contacts[0].normal.dot(displacement);
        position = after;
        return force[0];
    }
};

// If the touched phyxels become much stiffer, a spring keeps its force; if they become much softer, the force
// drops. Neither creates energy.
TEST(ContactForces, StiffnessChangesUnderLoadAddNoEnergy) {
    for (const double factor : {0.01, 0.1, 0.5, 1.0, 2.0, 10.0, 100.0}) {
        Pressed pressed;
        pressed.step(1e-3, Vec3(1e-4, 0, -6e-4));
        ASSERT_EQ(pressed.cached.size(), 1U);
        const Vec3 force_before = pressed.cached[0].force;
        const double energy = pressed.energy;
        ASSERT_GT(force_before.z(), 0);
        const Vec3 force_after = pressed.step(1e-3 * factor, Vec3::Zero());
        EXPECT_LT(pressed.energy, (1 + 1e-9) * energy) << factor;
        if (factor <= 1)
            EXPECT_NEAR((force_after - force_before).norm(), 0, 1e-6 * force_before.norm()) << factor;
        else
            EXPECT_LT(force_after.z(), (1 + 1e-9) * force_before.z()) << factor;
    }
}

// Two stiff pieces of random mass meet, in every other case one of them held: the spring is at most a fixed
// multiple of the inertia, which is that of the lighter one where the other is much heavier. Two sides of one
// piece have a spring as stiff as their phyxels, since its mass says nothing about what bends.
TEST(ContactForces, SpringsAreNotMuchStifferThanWhatTheyMove) {
    Random random(5);
    for (int trial = 0; trial < 200; ++trial) {
        Pressed pressed;
        pressed.piece = {0, trial % 4 == 3 ? 0 : 1};
        const double a = std::pow(10, random.uniform(-4, 1)), b = std::pow(10, random.uniform(-4, 1));
        pressed.piece_mass = {a, trial % 2 == 0 ? std::numeric_limits<double>::infinity() : b};
        const double mobility = std::pow(10, random.uniform(-7, -2));
        pressed.step(mobility, Vec3(0, 0, -2e-4));
        ASSERT_EQ(pressed.cached.size(), 1U);
        const double hardest = tuning::contact::stiffness_ratio / (2 * mobility);
        const double inertia = (trial % 2 == 0 ? a : a * b / (a + b)) / (0.02 * 0.02);
        const double wanted =
            trial % 4 == 3 ? hardest : std::min(hardest, tuning::contact::inertia_ratio * inertia);
        EXPECT_NEAR(pressed.cached[0].stiffness, wanted, 1e-9 * wanted) << trial;
    }
}

// A load that is far larger than the weight of a light piece presses it in: the spring is stiffened from step
// to step, which adds no energy, until it is deep no more or as stiff as its phyxels.
TEST(ContactForces, SpringsStiffenUnderLoads) {
    constexpr double mobility = 1e-7, depenetration = 3e-4;
    constexpr double hardest = tuning::contact::stiffness_ratio / (2 * mobility);
    constexpr double deep = tuning::contact::stiffening_overlap * depenetration;
    int stiffened = 0;
    for (const double depth : {1e-5, 2e-4, 4e-4, 1e-3, 1e-2, 0.1}) {
        Pressed pressed;
        pressed.piece = {0, 1};
        pressed.piece_mass = {0.01, std::numeric_limits<double>::infinity()};
        pressed.contacts[0].max_depenetration = depenetration;
        pressed.step(mobility, Vec3(1e-4, 0, -1e-4 - depth));
        ASSERT_EQ(pressed.cached.size(), 1U);
        const double first = pressed.cached[0].stiffness;
        EXPECT_LT(first, 0.1 * hardest);
        for (int step = 0; step < 8; ++step) {
            const double energy = pressed.energy, stiffness = pressed.cached[0].stiffness;
            pressed.step(mobility, Vec3::Zero());
            ASSERT_EQ(pressed.cached.size(), 1U);
            EXPECT_LE(pressed.energy, (1 + 1e-9) * energy) << depth << " m, step " << step;
            EXPECT_GE(pressed.cached[0].stiffness, stiffness);
        }
        const double last = pressed.cached[0].stiffness;
        EXPECT_TRUE(last >= 0.999 * hardest ||
                    pressed.cached[0].rest_gap - pressed.cached[0].gap < 1.001 * deep);
        EXPECT_EQ(last > first, depth > deep) << depth;
        stiffened += last > first;
    }
    EXPECT_GE(stiffened, 3);
}

// Holds prescribe the motion of most of a contact's phyxels, at random: its spring is at most ten times as
// stiff as if all were free. Otherwise the few free ones would be thrown when the prescribed ones overlap.
TEST(ContactForces, HoldsDoNotStiffenContacts) {
    Random random(17);
    int pressed = 0;
    for (int trial = 0; trial < 400; ++trial) {
        std::vector<Contact> contacts(1);
        std::vector<CachedContact> cached;
        std::vector<Vec3> position(8, Vec3::Zero()), velocity(8, Vec3::Zero());
        std::vector<double> mobility(8);
        std::vector<std::uint8_t> fixed(8), touching(8, 0);
        for (double& m : mobility) m = random.uniform(1e-4, 1e-3);
        for (std::uint8_t& f : fixed) f = random.uniform(0, 1) < 0.8;
        Contact& contact = contacts[0];
        double free_mobility = 0;
        for (ContactSide* side : {&contact.upper, &contact.lower}) {
            side->count = 4;
            double sum = 0;
            for (std::uint32_t k = 0; k < 4; ++k) {
                side->phyxel[k] = k + (side == &contact.lower ? 4 : 0);
                side->weight[k] = std::pow(10, random.uniform(-4, 0));
                sum += side->weight[k];
            }
            for (std::uint32_t k = 0; k < 4; ++k) {
                side->weight[k] /= sum;
                free_mobility += side->weight[k] * side->weight[k] * mobility[side->phyxel[k]];
            }
        }
        contact.gap = 1e-5;
        contact.max_depenetration = 1e-4;
        const double closing = 0.02;  // m/s
        for (std::size_t i = 0; i < 4; ++i) velocity[i].z() = -closing;
        std::vector<Vec3> after = position;
        for (std::size_t i = 0; i < 4; ++i) after[i].z() -= 0.01 * closing;
        ContactInput input;
        input.contacts = contacts;
        input.cached = &cached;
        const std::vector<ContactForces::Part> parts = {{position, velocity, 0.01, mobility, fixed, {}, {}}};
        const std::vector<std::span<const Vec3>> moved = {after};
        const std::vector<std::span<std::uint8_t>> touched = {touching};
        const Parallel parallel(1);
        ContactForces forces;
        forces.begin(input, parts);
        forces.make_springs(moved, 0, parallel);
        forces.finish(moved, touched, parallel);
        if (cached.empty()) continue;
        ++pressed;
        EXPECT_LT(cached[0].stiffness * free_mobility,
                  1.001 * tuning::contact::stiffness_ratio / tuning::contact::least_mobility);
    }
    EXPECT_GT(pressed, 40);
}

}  // namespace
}  // namespace splitcubes::meshless
