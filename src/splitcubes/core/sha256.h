// Content of files as a number that two different ones do not share.
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
    /// 64 hexadecimal digits of all that was added; at most once.
    std::string text();

  private:
    struct Context;  // of libmd
    std::unique_ptr<Context> context_;
};

/// Of a whole file, read in parts. Throws InputError where it cannot be read.
std::string sha256_of_file(const std::filesystem::path& file);

/// Whether a text is a hash as text() writes it.
bool is_sha256(std::string_view text);

}  // namespace splitcubes
