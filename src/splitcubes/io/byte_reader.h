// Bounded reading of binary files of either byte order. Internal to the module.
#pragma once

#include <splitcubes/core/error.h>
#include <splitcubes/io/mesh_readers.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <string>
#include <utility>

namespace splitcubes::io {

/// The number at `from`, stored in the given order, aligned or not.
template <class Number>
Number load_number(const std::byte* from, std::endian order) {
    std::array<std::byte, sizeof(Number)> bytes;
    std::memcpy(bytes.data(), from, sizeof(Number));
    if (order != std::endian::native) std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<Number>(bytes);
}

/// Walks through bytes and never past their end.
class ByteReader {
  public:
    ByteReader(Bytes bytes, std::string name, std::endian order, std::size_t offset = 0)
        : bytes_(bytes), name_(std::move(name)), order_(order), offset_(offset) {}

    std::size_t offset() const { return offset_; }
    std::size_t bytes_left() const { return bytes_.size() - offset_; }

    template <class Number>
    Number read(const char* what) {
        need(sizeof(Number), what);
        const Number value = load_number<Number>(bytes_.data() + offset_, order_);
        offset_ += sizeof(Number);
        return value;
    }
    Bytes take(std::size_t count, const char* what) {
        need(count, what);
        const Bytes taken = bytes_.subspan(offset_, count);
        offset_ += count;
        return taken;
    }
    [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const {
        throw InputError(at_byte(name_, offset_), problem, remedy);
    }

  private:
    void need(std::size_t count, const char* what) const {
        if (count > bytes_left())
            fail("the file ends within " + std::string(what) + " (" + std::to_string(count) +
                     " bytes needed, " + std::to_string(bytes_left()) + " left)",
                 "the file was cut off; get it again");
    }

    Bytes bytes_;
    std::string name_;
    std::endian order_;
    std::size_t offset_ = 0;
};

}  // namespace splitcubes::io
