// Where in rest space a body's surface has changed, and when last.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/geometry/rest_grid.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace splitcubes::body {

/// Tells those who keep what they have seen between two places whether to look again. Rest space
/// is cut into cubes of a cell (of more where there were too many), each with the number of its last change.
/// Errs to "changed". The numbers count changes since this was made; they mean nothing to another body or
/// run.
class SurfaceChanges {
  public:
    explicit SurfaceChanges(const geometry::RestGrid& rest);

    /// The number of the last change.
    std::uint32_t now() const { return now_; }
    /// All marks that follow belong to one more change.
    void begin() {
        ++now_;
        recent_[now_ % recent_.size()] = {count_, -Vec3i::Ones()};
    }
    /// box: m, rest space, holds all that was there before and is there now; an empty one marks nothing.
    void mark(const geometry::Box& box);
    /// What was seen before now may be different everywhere.
    void mark_all();
    /// The number of the last mark_all, 0 where there was none.
    std::uint32_t last_full_change() const { return last_full_change_; }

    /// Whether something within the box (m, rest space) may have changed after the change `when`.
    bool since(const geometry::Box& box, std::uint32_t when) const;

  private:
    struct Range {
        Vec3i low, high;

        bool meets(const Range& other) const {
            return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
        }
    };
    bool may_have_changed(const Range& range, std::uint32_t when) const;
    Range cubes_of(const geometry::Box& box) const;
    std::size_t index_of(int x, int y, int z) const {
        return (static_cast<std::size_t>(z) * static_cast<std::size_t>(count_.y()) +
                static_cast<std::size_t>(y)) *
                   static_cast<std::size_t>(count_.x()) +
               static_cast<std::size_t>(x);
    }

    Vec3 origin_;                      // m, low corner
    double side_;                      // m, of a cube
    Vec3i count_;                      // cubes
    std::vector<std::uint32_t> last_;  // per cube
    // Of the last changes, by their numbers, the cubes from the lowest to the highest: most changes are where
    // a blade is.
    std::array<Range, 8> recent_;
    std::uint32_t now_ = 0, last_full_change_ = 0;
};

}  // namespace splitcubes::body
