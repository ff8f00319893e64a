#include <splitcubes/core/nearest_word.h>

#include <gtest/gtest.h>

namespace splitcubes {
namespace {

TEST(NearestWord, CountsWhatTheFingersDo) {
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

}  // namespace
}  // namespace splitcubes
