// A snapshot as bytes: the same functions write and read it.
#pragma once

#include <splitcubes/api/internal/session.h>
#include <splitcubes/core/state_stream.h>

#include <type_traits>

namespace splitcubes::api {

struct SavingArchive {
    static constexpr bool loads = false;
    StateWriter writer;

    template <StateNumber T>
    void number(T& value) {
        writer.add(value);
    }
    void text(std::string& value) { writer.add_text(value); }
    /// Reads a count of elements that have at least so many bytes each.
    std::size_t count(std::size_t size, std::size_t) {
        writer.add(std::uint64_t{size});
        return size;
    }
};

struct LoadingArchive {
    static constexpr bool loads = true;
    StateReader reader;

    template <StateNumber T>
    void number(T& value) {
        value = reader.number<T>();
    }
    void text(std::string& value) { value = reader.text(); }
    std::size_t count(std::size_t, std::size_t bytes_each) { return reader.count(bytes_each); }
};

/// Throws InputError for a region that cannot be written; DamagedState and InputError for bytes that are
/// none.
void archive_snapshot(SavingArchive& archive, Snapshot& snapshot);
void archive_snapshot(LoadingArchive& archive, Snapshot& snapshot);
/// Makes what follows from what was read, and checks what no number alone shows. Throws as the other.
void finish_loaded(Snapshot& snapshot, const Parallel& parallel);

}  // namespace splitcubes::api
