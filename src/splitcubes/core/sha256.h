// SHA-256 of file contents.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace splitcubes {

/// SHA-256 (FIPS 180-4), as the program sha256sum prints it.
class Sha256 {
  public:
    Sha256();
    ~Sha256();
    void add(std::string_view bytes);
    /// Returns the hash of all added bytes as 64 hexadecimal digits; at most once.
    std::string text();

  private:
    void add_block(const unsigned char* block);

    std::array<std::uint32_t, 8> state_ = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                           0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
    std::array<unsigned char, 64> rest_{};  // bytes that do not fill a block yet
    std::uint64_t length_ = 0;              // bytes
};

/// Returns the hash of a whole file, which is read in parts. Throws InputError if it cannot be read.
std::string sha256_of_file(const std::filesystem::path& file);

/// Returns whether a text is a hash as text() writes it.
bool is_sha256(std::string_view text);

}  // namespace splitcubes
