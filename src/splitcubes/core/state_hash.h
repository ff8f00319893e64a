// Hash of simulation state, to show that two runs are equal bit for bit.
#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>

namespace splitcubes {

/// FNV-1a over 64-bit words (Fowler, Noll, Vo). The order matters, so callers add arrays in a fixed order.
/// Not cryptographic.
class StateHash {
  public:
    void add_word(std::uint64_t word) {
        value_ ^= word;
        value_ *= 0x100000001b3ULL;
        value_ ^= value_ >> 29;
    }
    void add(double value) {
        std::uint64_t word = 0;
        std::memcpy(&word, &value, sizeof word);
        add_word(word);
    }
    template <class Integer>
    requires std::is_integral_v<Integer>
    void add(Integer value) { add_word(static_cast<std::uint64_t>(value)); }
    void add(std::span<const double> values) {
        for (const double value : values) add(value);
    }
    std::uint64_t value() const { return value_; }
    /// Returns 16 hexadecimal digits.
    std::string text() const;

  private:
    std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

}  // namespace splitcubes
