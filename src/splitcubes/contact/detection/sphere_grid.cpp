#include <splitcubes/contact/detection/sphere_grid.h>

#include <algorithm>

namespace splitcubes::body {

void SphereGrid::lay_out(std::span<const Ball> balls) {
    box_ = {};
    size_ = 0;
    for (const Ball& ball : balls) {
        box_.add(ball.centre - Vec3::Constant(ball.radius));
        box_.add(ball.centre + Vec3::Constant(ball.radius));
        size_ = std::max(size_, ball.radius);
    }
    count_ = Vec3i::Ones();
    if (box_.empty()) return;
    const Vec3 extent = box_.size();
    if (!(size_ > 0)) size_ = 1;
    // Limits memory to a few cells per ball, however far apart they are.
    const double max_cells = 64.0 + 8.0 * static_cast<double>(balls.size());
    while (((extent / size_).array().floor() + 1).prod() > max_cells) size_ *= 1.5;
    count_ = (extent / size_).array().floor().cast<int>() + 1;
}

Vec3i SphereGrid::cell_coordinates(const Vec3& point) const {
    Vec3i out;
    for (int axis = 0; axis < 3; ++axis) {
        const double at = (point[axis] - box_.min[axis]) / size_;
        out[axis] = at > 0 ? static_cast<int>(std::min<double>(at, count_[axis] - 1)) : 0;
    }
    return out;
}

std::size_t SphereGrid::cell_at(const Vec3& point) const {
    const Eigen::Matrix<std::size_t, 3, 1> at = cell_coordinates(point).cast<std::size_t>(),
                                           count = count_.cast<std::size_t>();
    return (at.z() * count.y() + at.y()) * count.x() + at.x();
}

template <class Visit>
void SphereGrid::visit_cells(const Ball& ball, const Visit& visit) const {
    const Vec3i low = cell_coordinates(ball.centre - Vec3::Constant(ball.radius)),
                high = cell_coordinates(ball.centre + Vec3::Constant(ball.radius));
    for (int z = low.z(); z <= high.z(); ++z)
        for (int y = low.y(); y <= high.y(); ++y) {
            const std::size_t row = (static_cast<std::size_t>(z) * static_cast<std::size_t>(count_.y()) +
                                     static_cast<std::size_t>(y)) *
                                    static_cast<std::size_t>(count_.x());
            for (int x = low.x(); x <= high.x(); ++x) visit(row + static_cast<std::size_t>(x));
        }
}

void SphereGrid::build(std::span<const Ball> balls) {
    lay_out(balls);
    const std::size_t cells = count_.cast<std::size_t>().prod();
    begin_.assign(cells + 1, 0);
    for (const Ball& ball : balls) visit_cells(ball, [&](std::size_t cell) { ++begin_[cell + 1]; });
    for (std::size_t c = 0; c < cells; ++c) begin_[c + 1] += begin_[c];
    next_.assign(begin_.begin(), begin_.end() - 1);
    ball_.resize(begin_.back());
    for (std::uint32_t k = 0; k < balls.size(); ++k)
        visit_cells(balls[k], [&](std::size_t cell) { ball_[next_[cell]++] = k; });
}

std::span<const std::uint32_t> SphereGrid::near(const Vec3& point) const {
    if (!box_.contains(point)) return {};
    const std::size_t cell = cell_at(point);
    return {ball_.data() + begin_[cell], begin_[cell + 1] - begin_[cell]};
}

}  // namespace splitcubes::body
