#include <splitcubes/core/error.h>
#include <splitcubes/core/sha256.h>

#include <sha256.h>

#include <array>
#include <cstdint>
#include <fstream>
#include <system_error>
#include <vector>

namespace splitcubes {

struct Sha256::Context : SHA256_CTX {};

Sha256::Sha256() : context_(std::make_unique<Context>()) {
    SHA256Init(context_.get());
}
Sha256::~Sha256() = default;

void Sha256::add(std::string_view bytes) {
    SHA256Update(context_.get(), reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
}

std::string Sha256::text() {
    std::array<char, SHA256_DIGEST_STRING_LENGTH> digits{};
    SHA256End(context_.get(), digits.data());
    return digits.data();
}

std::string sha256_of_file(const std::filesystem::path& file) {
    std::error_code ignored;
    // A pipe or a device may never end.
    if (!std::filesystem::is_regular_file(file, ignored))
        throw InputError(file.string(), "is not a file", "give the path of a file");
    std::ifstream stream(file, std::ios::binary);
    std::vector<char> part(std::size_t{1} << 20);
    Sha256 hash;
    while (stream) {
        stream.read(part.data(), static_cast<std::streamsize>(part.size()));
        hash.add({part.data(), static_cast<std::size_t>(stream.gcount())});
    }
    if (!stream.eof()) throw InputError(file.string(), "cannot be read", "check who may read it");
    return hash.text();
}

bool is_sha256(std::string_view text) {
    return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == text.npos;
}

}  // namespace splitcubes
