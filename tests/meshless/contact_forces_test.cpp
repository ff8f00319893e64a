// What contacts remember is found in whatever order it is asked for.
#include <splitcubes/meshless/contact_forces.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace splitcubes::meshless {
namespace {

std::vector<ContactMemory> remember(std::span<const std::uint64_t> keys) {
    std::vector<ContactMemory> memory;
    for (const std::uint64_t key : keys) memory.emplace_back().key = key;
    return memory;
}

TEST(MemoryFinder, FindsWhatIsThereAndNothingElse) {
    const std::vector<std::uint64_t> keys = {0, 3, 4, 9, 1ULL << 48, ~0ULL};
    const std::vector<ContactMemory> memory = remember(keys);
    std::vector<std::uint64_t> asked = keys;
    for (const std::uint64_t key : {1ULL, 5ULL, 8ULL, 10ULL, (1ULL << 48) + 1, ~0ULL - 1})
        asked.push_back(key);
    asked.push_back(4);
    std::mt19937 random(7);
    for (int round = 0; round < 20; ++round) {
        // In order, each some times over, and shuffled.
        if (round == 0) std::sort(asked.begin(), asked.end());
        MemoryFinder finder(&memory);
        for (const std::uint64_t key : asked) {
            const ContactMemory* const found = finder.find(key);
            const bool is_there = std::find(keys.begin(), keys.end(), key) != keys.end();
            ASSERT_EQ(found != nullptr, is_there) << key;
            if (found) {
                EXPECT_EQ(found->key, key);
            }
        }
        std::shuffle(asked.begin(), asked.end(), random);
    }
    MemoryFinder nothing(nullptr);
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
        contacts[c].lift = 1e-3;
    }
    contacts[2].gap = 0.03;
    const std::vector<Vec3> velocity = {{0, 0, -1}, {0, 0, -1}, {0, 0, -1}, {0, 0, 1}};
    const std::vector<std::uint64_t> keys = {1};
    std::vector<ContactMemory> memory = remember(keys);
    ContactInput input;
    input.contacts = contacts;
    input.memory = &memory;
    const std::vector<std::span<const Vec3>> field = {velocity};
    std::vector<std::uint8_t> known, impact;
    for (const int threads : {1, 3}) {
        find_impacts(input, field, 0.02, Parallel(threads), known, impact);
        EXPECT_EQ(known, (std::vector<std::uint8_t>{0, 1, 0, 0}));
        EXPECT_EQ(impact, (std::vector<std::uint8_t>{1, 0, 0, 0}));
    }
}

}  // namespace
}  // namespace splitcubes::meshless
