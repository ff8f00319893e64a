#include <splitcubes/core/error.h>
#include <splitcubes/core/random.h>
#include <splitcubes/core/sha256.h>

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

namespace splitcubes {
namespace {

std::string of(const std::string& text) {
    Sha256 hash;
    hash.add(text);
    return hash.text();
}

// FIPS 180-4 and NIST's examples.
TEST(Sha256, ExamplesOfTheStandard) {
    EXPECT_EQ(of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    EXPECT_EQ(of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
              "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    EXPECT_EQ(of(std::string(1000000, 'a')),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PartsMakeTheSameAsTheWhole) {
    Random random(3);
    std::string text;
    for (int k = 0; k < 700; ++k) text += static_cast<char>(random.below(256));
    for (std::size_t length = 0; length <= text.size(); length += 7) {
        Sha256 parts;
        for (std::size_t at = 0; at < length;) {
            const std::size_t count = std::min<std::size_t>(random.below(150), length - at);
            parts.add(text.substr(at, count));
            at += count;
        }
        EXPECT_EQ(parts.text(), of(text.substr(0, length))) << length;
    }
}

TEST(Sha256, OfAFile) {
    std::string folder = (std::filesystem::temp_directory_path() / "splitcubes-core-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    const std::filesystem::path file = std::filesystem::path(folder) / "a";
    const std::string text(3000000, 'x');
    std::ofstream(file, std::ios::binary) << text;
    EXPECT_EQ(sha256_of_file(file), of(text));
    std::ofstream(file, std::ios::binary | std::ios::trunc);
    EXPECT_EQ(sha256_of_file(file), of(""));
    EXPECT_THROW(sha256_of_file(folder), InputError);
    EXPECT_THROW(sha256_of_file(file.string() + "b"), InputError);
    EXPECT_THROW(sha256_of_file("/dev/zero"), InputError);
    std::filesystem::remove_all(folder);
}

TEST(Sha256, TellsAHashFromOtherText) {
    EXPECT_TRUE(is_sha256(of("a")));
    EXPECT_FALSE(is_sha256(""));
    EXPECT_FALSE(is_sha256(of("a").substr(1)));
    EXPECT_FALSE(is_sha256(of("a").substr(1) + "G"));
    EXPECT_FALSE(is_sha256(of("a") + "0"));
}

}  // namespace
}  // namespace splitcubes
