// Serialisation of state to bytes, and a reader that does not trust them: every length is checked against the
// remaining bytes before anything is allocated.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace splitcubes {

/// Bytes that are not a valid state. what() describes the fault as a part of a sentence: "a phyxel that
/// belongs to no piece".
class DamagedState : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// Throws DamagedState if a condition does not hold.
inline void require_state(bool holds, const char* problem) {
    if (!holds) throw DamagedState(problem);
}

/// Number types for which any bytes are a value.
template <class T>
concept StateNumber = (std::integral<T> || std::floating_point<T>)&&!std::same_as<T, bool>;

class StateWriter {
  public:
    template <StateNumber T>
    void add(T value) {
        bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    /// Adds the numbers without their count, which the reader must know.
    template <class T, std::size_t Extent>
    requires StateNumber<std::remove_const_t<T>>
    void add(std::span<T, Extent> values) {
        if (!values.empty()) bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
    }
    void add_text(std::string_view text) {
        add(std::uint64_t{text.size()});
        bytes_.append(text);
    }
    /// Returns the added bytes and leaves the writer empty.
    std::string take() { return std::move(bytes_); }

  private:
    std::string bytes_;
};

class StateReader {
  public:
    /// bytes must outlive the reader.
    explicit StateReader(std::string_view bytes) : rest_(bytes) {}

    template <StateNumber T>
    T number() {
        T value;
        fill(std::span(&value, 1));
        return value;
    }
    /// Reads a number within [min, max].
    template <StateNumber T>
    T number(T min, T max, const char* problem) {
        const T value = number<T>();
        require_state(value >= min && value <= max, problem);
        return value;
    }
    /// Reads the number of elements of which each takes at least `bytes_each` of the bytes that follow.
    std::size_t count(std::size_t bytes_each) {
        const auto value = number<std::uint64_t>();
        require_state(value <= rest_.size() / bytes_each, "a length beyond its end");
        return static_cast<std::size_t>(value);
    }
    template <StateNumber T>
    void fill(std::span<T> out) {
        require_room(out.size_bytes(), 1);
        if (out.empty()) return;
        std::memcpy(out.data(), rest_.data(), out.size_bytes());
        rest_.remove_prefix(out.size_bytes());
    }
    /// Throws unless `count * bytes_each` bytes are left. Call it before allocating memory for them.
    void require_room(std::size_t count, std::size_t bytes_each) const {
        require_state(count <= rest_.size() / bytes_each, "a length beyond its end");
    }
    template <StateNumber T>
    std::vector<T> numbers(std::size_t count) {
        require_room(count, sizeof(T));
        std::vector<T> out(count);
        fill(std::span<T>(out));
        return out;
    }
    /// Reads numbers within [min, max].
    template <StateNumber T>
    std::vector<T> numbers(std::size_t count, T min, T max, const char* problem) {
        std::vector<T> out = numbers<T>(count);
        bool holds = true;
        for (const T value : out) holds = holds && value >= min && value <= max;
        require_state(holds, problem);
        return out;
    }
    std::string text() {
        const std::string_view found = rest_.substr(0, count(1));
        rest_.remove_prefix(found.size());
        return std::string(found);
    }
    /// Throws unless all bytes have been read.
    void finish() const { require_state(rest_.empty(), "more than belongs to it"); }

  private:
    std::string_view rest_;
};

}  // namespace splitcubes
