#include <splitcubes/splitting/chosen_pieces.h>

#include <gtest/gtest.h>

namespace splitcubes::splitting {
namespace {

using Flags = std::vector<std::uint8_t>;

const std::vector<double> volumes{3, -1, 5, 0.5, 5, 0};

TEST(ChosenPieces, KeepsAllByDefault) {
    EXPECT_EQ(pieces_to_drop(volumes, {}, {}), Flags(6, 0));
    EXPECT_EQ(pieces_to_drop({}, {}, {1, 1}), Flags());
}

TEST(ChosenPieces, DropsSmallPieces) {
    EXPECT_EQ(pieces_to_drop(volumes, {}, {0.5, 0}), (Flags{0, 1, 0, 0, 0, 1})) << "the bound itself stays";
    EXPECT_EQ(pieces_to_drop(volumes, {}, {100, 0}), Flags(6, 1));
    EXPECT_EQ(pieces_to_drop(volumes, {}, {1e-300, 0}), (Flags{0, 1, 0, 0, 0, 1}));
}

TEST(ChosenPieces, KeepsTheLargest) {
    EXPECT_EQ(pieces_to_drop(volumes, {}, {0, 1}), (Flags{1, 1, 0, 1, 1, 1})) << "of equals the first";
    EXPECT_EQ(pieces_to_drop(volumes, {}, {0, 3}), (Flags{0, 1, 0, 1, 0, 1}));
    EXPECT_EQ(pieces_to_drop(volumes, {}, {0, 6}), Flags(6, 0));
    EXPECT_EQ(pieces_to_drop(volumes, {}, {4, 5}), (Flags{1, 1, 0, 1, 0, 1})) << "both hold";
}

TEST(ChosenPieces, IgnoresLeftOutPieces) {
    const Flags left_out{0, 0, 1, 0, 0, 0};
    EXPECT_EQ(pieces_to_drop(volumes, left_out, {0, 1}), (Flags{1, 1, 0, 1, 0, 1}));
    EXPECT_EQ(pieces_to_drop(volumes, left_out, {4, 0}), (Flags{1, 1, 0, 1, 0, 1}));
}

}  // namespace
}  // namespace splitcubes::splitting
