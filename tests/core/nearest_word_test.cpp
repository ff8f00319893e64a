#include <splitcubes/core/nearest_word.h>
#include <splitcubes/core/random.h>

#include <gtest/gtest.h>

#include <algorithm>

namespace splitcubes {
namespace {

TEST(NearestWord, TypingDistanceCountsEdits) {
    EXPECT_EQ(typing_distance("", ""), 0U);
    EXPECT_EQ(typing_distance("", "abc"), 3U);
    EXPECT_EQ(typing_distance("cells", "cells"), 0U);
    EXPECT_EQ(typing_distance("cels", "cells"), 1U);
    EXPECT_EQ(typing_distance("celsl", "cells"), 1U);  // swapped
    EXPECT_EQ(typing_distance("clesl", "cells"), 2U);
    EXPECT_EQ(typing_distance("kitten", "sitting"), 3U);
    for (const char* a : {"", "a", "ab", "ba", "abcd", "acbd"})
        for (const char* b : {"", "b", "ab", "xyz", "bacd"})
            EXPECT_EQ(typing_distance(a, b), typing_distance(b, a)) << a << ' ' << b;
}

TEST(NearestWord, IsNearOrNone) {
    const std::vector<std::string> known{"surface", "cut", "run", "replay", "render"};
    EXPECT_EQ(nearest_word("surfcae", known), "surface");
    EXPECT_EQ(nearest_word("surf", known), "surface") << "begun";
    EXPECT_EQ(nearest_word("rum", known), "run");
    EXPECT_EQ(nearest_word("redner", known), "render");
    EXPECT_EQ(nearest_word("slice", known), "");
    EXPECT_EQ(nearest_word("", known), "");
    EXPECT_EQ(nearest_word("run", {}), "");
    EXPECT_EQ(nearest_word(std::string(100000, 'r'), known), "");
}

// A match changes at most a third of the letters of the shorter word, rounded.
TEST(NearestWord, TheChangesAreFewForTheLength) {
    const std::vector<std::string> known{"to",     "eye",       "name",          "cells",
                                         "bodies", "time_step", "youngs_modulus"};
    Random random(3);
    int near_count = 0;
    for (int trial = 0; trial < 20000; ++trial) {
        std::string word;
        for (std::uint64_t n = 3 + random.below(10); n > 0; --n)
            word += static_cast<char>('a' + static_cast<char>(random.below(26)));
        const std::string near = nearest_word(word, known);
        if (near.empty()) continue;
        ++near_count;
        const std::size_t shorter = std::min(word.size(), near.size());
        EXPECT_TRUE(near.starts_with(word) || typing_distance(word, near) <= (shorter + 1) / 3)
            << word << ' ' << near;
    }
    EXPECT_LT(near_count, 200) << "random words are near none";
    // One change in any word of three letters or more still matches.
    for (const std::string& word : known)
        for (std::size_t at = 0; at < word.size(); ++at) {
            std::string changed = word;
            changed[at] = 'q';
            EXPECT_EQ(nearest_word(changed, known), word);
            if (word.size() > 3) EXPECT_EQ(nearest_word(changed.erase(at, 1), known), word);
        }
    EXPECT_EQ(nearest_word("bodys", known), "bodies");
    for (const char* other : {"title", "version", "comment", "author", "size", "speed", "units", "foo"})
        EXPECT_EQ(nearest_word(other, known), "") << other;
}

}  // namespace
}  // namespace splitcubes
