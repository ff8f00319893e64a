// Change counters of a body's surface by region of rest space.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/geometry/rest_grid.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace splitcubes::body {

/// Per-region change counters, by which caches of visibility between points find out what to update. Rest
/// space is divided into cubes of a cell (larger ones for large grids), each with the number of its last
/// change. May report changes where there were none, never the reverse. The numbers count changes since
/// construction; they cannot be compared between bodies or runs.
class SurfaceChanges {
  public:
    explicit SurfaceChanges(const geometry::RestGrid& rest);

    /// Returns the number of the last change.
    std::uint32_t now() const { return now_; }
    /// Starts a change: all following marks belong to it.
    void begin() {
        ++now_;
        recent_[now_ % recent_.size()] = {count_, -Vec3i::Ones()};
    }
    /// Marks a change of the surface. box: m, rest space, holds everything that was there before and is there
    /// now; an empty box marks nothing.
    void mark(const geometry::Box& box);
    /// Marks a change of the whole surface.
    void mark_all();
    /// Returns the number of the last mark_all; 0 if there was none.
    std::uint32_t last_full_change() const { return last_full_change_; }

    /// Returns whether anything within the box (m, rest space) may have changed after change `change_id`.
    bool since(const geometry::Box& box, std::uint32_t change_id) const;

  private:
    struct Range {
        Vec3i low, high;

        bool meets(const Range& other) const {
            return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
        }
    };
    bool may_have_changed(const Range& range, std::uint32_t change_id) const;
    Range cubes_of(const geometry::Box& box) const;
    std::size_t index_of(int x, int y, int z) const {
        return (static_cast<std::size_t>(z) * static_cast<std::size_t>(count_.y()) +
                static_cast<std::size_t>(y)) *
                   static_cast<std::size_t>(count_.x()) +
               static_cast<std::size_t>(x);
    }

    Vec3 origin_;                      // m, low corner
    double cube_size_;                 // m, of a cube
    Vec3i count_;                      // cubes
    std::vector<std::uint32_t> last_;  // per cube: its last change
    // Ring buffer with the bounding range of cubes of each of the last changes: most changes are local.
    std::array<Range, 8> recent_;
    std::uint32_t now_ = 0, last_full_change_ = 0;
};

}  // namespace splitcubes::body
