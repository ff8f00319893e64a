// Content of files as a number that two different ones do not share.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace splitcubes {

/// SHA-256 (FIPS 180-4), as the program sha256sum prints it.
class Sha256 {
  public:
    void add(std::string_view bytes);
    /// 64 hexadecimal digits of all that was added; at most once.
    std::string text();

  private:
    void add_block(const unsigned char* block);

    std::array<std::uint32_t, 8> state_ = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                           0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
    std::array<unsigned char, 64> rest_{};  // what does not fill a block yet
    std::uint64_t length_ = 0;              // bytes
};

/// Of a whole file, read in parts. Throws InputError where it cannot be read.
std::string sha256_of_file(const std::filesystem::path& file);

/// Whether a text is a hash as text() writes it.
bool is_sha256(std::string_view text);

}  // namespace splitcubes
