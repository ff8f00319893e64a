// What contacts remember is found in whatever order it is asked for, and springs make no energy by what they
// touch.
#include <splitcubes/meshless/contact_forces.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace splitcubes::meshless {
namespace {

std::vector<CachedContact> remember(std::span<const std::uint64_t> keys) {
    std::vector<CachedContact> cached;
    for (const std::uint64_t key : keys) cached.emplace_back().key = key;
    return cached;
}

TEST(CachedContactFinder, FindsWhatIsThereAndNothingElse) {
    const std::vector<std::uint64_t> keys = {0, 3, 4, 9, 1ULL << 48, ~0ULL};
    const std::vector<CachedContact> cached = remember(keys);
    std::vector<std::uint64_t> asked = keys;
    for (const std::uint64_t key : {1ULL, 5ULL, 8ULL, 10ULL, (1ULL << 48) + 1, ~0ULL - 1})
        asked.push_back(key);
    asked.push_back(4);
    std::mt19937 random(7);
    for (int round = 0; round < 20; ++round) {
        // In order, each some times over, and shuffled.
        if (round == 0) std::sort(asked.begin(), asked.end());
        CachedContactFinder finder(&cached);
        for (const std::uint64_t key : asked) {
            const CachedContact* const found = finder.find(key);
            const bool is_there = std::find(keys.begin(), keys.end(), key) != keys.end();
            ASSERT_EQ(found != nullptr, is_there) << key;
            if (found) {
                EXPECT_EQ(found->key, key);
            }
        }
        std::shuffle(asked.begin(), asked.end(), random);
    }
    CachedContactFinder nothing(nullptr);
    EXPECT_EQ(nothing.find(3), nullptr);
}

// A ball's approach counts as a hit only where nothing was there before, and only if it closes the gap.
TEST(FindImpacts, AreWhatClosesItsGapAndIsNotRemembered) {
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
    std::vector<CachedContact> cached = remember(keys);
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

// Two phyxels that a contact holds, and what it remembers.
struct Pressed {
    std::vector<Contact> contacts{1};
    std::vector<CachedContact> cached;
    std::vector<Vec3> place = {{0, 0, 0.01}, {0, 0, 0}}, velocity = {Vec3::Zero(), Vec3::Zero()};
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
        contact.max_depenetration = 1e-12;  // nothing of an overlap is undone
    }
    // A step that moves the upper phyxel so; returns the force on it where the solve begins.
    Vec3 step(double mobility, const Vec3& way) {
        const std::vector<double> mobilities(2, mobility);
        std::vector<Vec3> after = place, force(2, Vec3::Zero());
        after[0] += way;
        velocity[0] = way / 0.02;
        ContactInput input;
        input.contacts = contacts;
        input.cached = &cached;
        const std::vector<ContactForces::Part> parts = {{place, velocity, 0.02, mobilities, {}}};
        const std::vector<std::span<const Vec3>> before = {place}, moved = {after};
        const std::vector<std::span<Vec3>> out = {force};
        std::vector<std::uint8_t> touching(2, 0);
        const std::vector<std::span<std::uint8_t>> touched = {touching};
        const Parallel parallel(1);
        forces.begin(input, parts);
        forces.make_springs(moved, parallel);
        forces.add_forces(before, out, parallel);
        forces.finish(moved, touched, parallel);
        energy = forces.energy();
        contacts[0].gap += contacts[0].normal.dot(way);
        place = after;
        return force[0];
    }
};

// Where what it touches becomes much stiffer, a spring goes on with the force that it had; much softer, with
// less. Neither makes energy.
TEST(ContactForces, ASpringThatChangesItsStiffnessUnderLoadMakesNoEnergy) {
    for (const double factor : {0.01, 0.1, 0.5, 1.0, 2.0, 10.0, 100.0}) {
        Pressed pressed;
        pressed.step(1e-3, Vec3(1e-4, 0, -6e-4));
        ASSERT_EQ(pressed.cached.size(), 1U);
        const Vec3 held = pressed.cached[0].force;
        const double energy = pressed.energy;
        ASSERT_GT(held.z(), 0);
        const Vec3 now = pressed.step(1e-3 * factor, Vec3::Zero());
        EXPECT_LT(pressed.energy, (1 + 1e-9) * energy) << factor;
        if (factor <= 1)
            EXPECT_NEAR((now - held).norm(), 0, 1e-6 * held.norm()) << factor;
        else
            EXPECT_LT(now.z(), (1 + 1e-9) * held.z()) << factor;
    }
}

}  // namespace
}  // namespace splitcubes::meshless
