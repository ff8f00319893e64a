// A state as bytes, and what reads it back without trusting them: every length is checked
// against the bytes that are left before anything is allocated.
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

/// Bytes that are no state. what() says what is wrong with them, as a part of a sentence:
/// "a phyxel that belongs to no piece".
class DamagedState : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// Throws DamagedState where a condition does not hold.
inline void require_state(bool holds, const char* problem) {
    if (!holds) throw DamagedState(problem);
}

/// Numbers that any bytes are one of.
template <class T>
concept StateNumber = (std::integral<T> || std::floating_point<T>)&&!std::same_as<T, bool>;

class StateWriter {
  public:
    template <StateNumber T>
    void add(T value) {
        bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    /// The numbers alone: who reads them knows how many there are.
    template <class T, std::size_t Extent>
    requires StateNumber<std::remove_const_t<T>>
    void add(std::span<T, Extent> values) {
        if (!values.empty()) bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
    }
    void add_text(std::string_view text) {
        add(std::uint64_t{text.size()});
        bytes_.append(text);
    }
    /// What has been added; nothing is left.
    std::string take() { return std::move(bytes_); }

  private:
    std::string bytes_;
};

class StateReader {
  public:
    /// bytes: for as long as this lives.
    explicit StateReader(std::string_view bytes) : rest_(bytes) {}

    template <StateNumber T>
    T number() {
        T value;
        fill(std::span(&value, 1));
        return value;
    }
    /// Within [least, most].
    template <StateNumber T>
    T number(T least, T most, const char* problem) {
        const T value = number<T>();
        require_state(value >= least && value <= most, problem);
        return value;
    }
    /// A number of things of which each takes at least so many of the bytes that follow.
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
    /// Throws unless there are so many bytes for each of `count`: to be asked before room is made for them.
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
    /// Each within [least, most].
    template <StateNumber T>
    std::vector<T> numbers(std::size_t count, T least, T most, const char* problem) {
        std::vector<T> out = numbers<T>(count);
        bool holds = true;
        for (const T value : out) holds = holds && value >= least && value <= most;
        require_state(holds, problem);
        return out;
    }
    std::string text() {
        const std::string_view found = rest_.substr(0, count(1));
        rest_.remove_prefix(found.size());
        return std::string(found);
    }
    /// Nothing may be left over.
    void finish() const { require_state(rest_.empty(), "more than belongs to it"); }

  private:
    std::string_view rest_;
};

}  // namespace splitcubes
