// Damages checkpoints but keeps their checksum valid.
#pragma once

#include <splitcubes/core/checksum.h>
#include <splitcubes/core/random.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace splitcubes::body::damage {

// The header is a line of text and three numbers: identity, length and checksum of the payload.
inline std::size_t payload_begin(std::string_view checkpoint) {
    return checkpoint.find('\n') + 1 + 3 * sizeof(std::uint64_t);
}

/// Updates length and checksum to the payload.
inline void reseal(std::string& checkpoint) {
    const std::size_t begin = payload_begin(checkpoint);
    const std::string_view payload = std::string_view(checkpoint).substr(begin);
    const std::uint64_t words[] = {payload.size(), checksum(payload)};
    std::memcpy(checkpoint.data() + begin - sizeof words, words, sizeof words);
}

/// Makes one random change of the payload: a bit, a byte, a word of 4 or 8 bytes, or its length.
inline void damage(std::string& checkpoint, Random& random) {
    const std::size_t begin = payload_begin(checkpoint);
    const auto length = static_cast<std::uint32_t>(checkpoint.size() - begin);
    if (length < 16) return;
    std::size_t at = begin + random.below(length - 8);
    const auto put = [&](auto value) { std::memcpy(checkpoint.data() + at, &value, sizeof value); };
    static constexpr double numbers[] = {0, -1, 1e-300, 1e300, -1e30, 1e10, 0.5, 2};
    static constexpr std::uint64_t words[] = {
        0,          1,          0xffffffffULL,         0x7fffffffULL,        ~0ULL,
        1ULL << 40, 1ULL << 63, 0x7ff0000000000000ULL, 0x7ff8000000000000ULL};
    // Most values of a state start at multiples of 4 bytes.
    if (random.below(4) != 0) at = begin + (at - begin) / 4 * 4;
    switch (random.below(8)) {
        case 0:
            checkpoint[at] = static_cast<char>(checkpoint[at] ^ (1 << random.below(8)));
            break;
        case 1:
            checkpoint[at] = static_cast<char>(random.below(256));
            break;
        case 2:
            put(static_cast<std::uint32_t>(words[random.below(9)]));
            break;
        case 3:
            put(words[random.below(9)]);
            break;
        case 4:
            put(numbers[random.below(8)]);
            break;
        case 5:
            put(random.below(1000));
            break;
        case 6: {  // bytes from elsewhere in the payload
            const std::size_t from = begin + random.below(length - 8) / 4 * 4;
            std::memmove(checkpoint.data() + at, checkpoint.data() + from, random.below(2) == 0 ? 4 : 8);
            break;
        }
        default:
            if (random.below(2) == 0)
                checkpoint.erase(at, 1 + random.below(16));
            else
                checkpoint.insert(at, 1 + random.below(16), static_cast<char>(random.below(256)));
    }
}

}  // namespace splitcubes::body::damage
