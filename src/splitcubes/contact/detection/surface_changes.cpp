#include <splitcubes/contact/detection/surface_changes.h>
#include <splitcubes/contact/detection/tuning.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::body {

SurfaceChanges::SurfaceChanges(const geometry::RestGrid& rest)
    : origin_(rest.origin), cube_size_(tuning::set_up::cells_per_change_cube * rest.cell_size) {
    const Vec3 extent = rest.cell_size * rest.node_count.cast<double>();
    while (((extent / cube_size_).array().floor() + 1).prod() > tuning::set_up::max_change_cubes)
        cube_size_ *= 2;
    count_ = (extent / cube_size_).array().floor().cast<int>() + 1;
    recent_.fill({count_, -Vec3i::Ones()});
    last_.assign(index_of(0, 0, count_.z()), 0);
}

// Boxes outside the grid belong to the cubes at its boundary. Clamps before the conversion, so that nothing
// overflows.
SurfaceChanges::Range SurfaceChanges::cubes_of(const geometry::Box& box) const {
    Range out;
    for (int axis = 0; axis < 3; ++axis) {
        const double max_index = count_[axis] - 1;
        const double low = (box.min[axis] - origin_[axis]) / cube_size_ - tuning::set_up::change_cube_margin;
        const double high = (box.max[axis] - origin_[axis]) / cube_size_ + tuning::set_up::change_cube_margin;
        out.low[axis] = static_cast<int>(std::clamp(low, 0.0, max_index));
        out.high[axis] = static_cast<int>(std::clamp(high, 0.0, max_index));
    }
    return out;
}

void SurfaceChanges::mark(const geometry::Box& box) {
    if (box.empty()) return;
    const Range range = cubes_of(box);
    Range& recent = recent_[now_ % recent_.size()];
    recent = {recent.low.cwiseMin(range.low), recent.high.cwiseMax(range.high)};
    for (int z = range.low.z(); z <= range.high.z(); ++z)
        for (int y = range.low.y(); y <= range.high.y(); ++y)
            for (int x = range.low.x(); x <= range.high.x(); ++x) last_[index_of(x, y, z)] = now_;
}

void SurfaceChanges::mark_all() {
    begin();
    recent_[now_ % recent_.size()] = {Vec3i::Zero(), count_};
    std::fill(last_.begin(), last_.end(), now_);
    last_full_change_ = now_;
}

// Coarse test against the bounds of each change after `change_id`; true if that many are no longer stored.
bool SurfaceChanges::may_have_changed(const Range& range, std::uint32_t change_id) const {
    if (now_ - change_id > recent_.size()) return true;
    for (std::uint32_t change = change_id + 1; change <= now_; ++change)
        if (range.meets(recent_[change % recent_.size()])) return true;
    return false;
}

bool SurfaceChanges::since(const geometry::Box& box, std::uint32_t change_id) const {
    if (change_id == now_) return false;
    const Range range = cubes_of(box);
    if (!may_have_changed(range, change_id)) return false;
    for (int z = range.low.z(); z <= range.high.z(); ++z)
        for (int y = range.low.y(); y <= range.high.y(); ++y)
            for (int x = range.low.x(); x <= range.high.x(); ++x)
                if (last_[index_of(x, y, z)] > change_id) return true;
    return false;
}

}  // namespace splitcubes::body
