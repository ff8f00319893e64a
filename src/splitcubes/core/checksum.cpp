#include <splitcubes/core/checksum.h>
#include <splitcubes/core/state_hash.h>

#include <cstring>

namespace splitcubes {

std::uint64_t checksum(std::string_view bytes) {
    StateHash hash;
    for (; bytes.size() >= 8; bytes.remove_prefix(8)) {
        std::uint64_t word = 0;
        std::memcpy(&word, bytes.data(), sizeof word);
        hash.add_word(word);
    }
    for (const char c : bytes) hash.add_word(static_cast<unsigned char>(c));
    return hash.value();
}

}  // namespace splitcubes
