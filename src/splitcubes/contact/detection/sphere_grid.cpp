#include <splitcubes/contact/detection/sphere_grid.h>
#include <splitcubes/contact/detection/tuning.h>

#include <algorithm>

namespace splitcubes::body {

void SphereGrid::lay_out(std::span<const Ball> balls) {
    box_ = {};
    double sum = 0, largest = 0;
    for (const Ball& ball : balls) {
        box_.add(ball.centre - Vec3::Constant(ball.radius));
        box_.add(ball.centre + Vec3::Constant(ball.radius));
        sum += ball.radius;
        largest = std::max(largest, ball.radius);
    }
    // A ball meets at most nine cells along each axis.
    size_ = balls.empty() ? 0 : std::max(sum / static_cast<double>(balls.size()), largest / 4);
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

std::size_t SphereGrid::cell_index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(count_.y()) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(count_.x()) +
           static_cast<std::size_t>(x);
}

template <class Visit>
void SphereGrid::visit_cells(const Cover& cover, const Visit& visit) const {
    for (int z = cover.low.z(); z <= cover.high.z(); ++z)
        for (int y = cover.low.y(); y <= cover.high.y(); ++y)
            for (int x = cover.low.x(); x <= cover.high.x(); ++x) visit(Vec3i(x, y, z));
}

void SphereGrid::build(std::span<const Ball> balls) {
    lay_out(balls);
    const std::size_t cells = count_.cast<std::size_t>().prod();
    begin_.assign(cells + 1, 0);
    covers_.clear();
    for (const Ball& ball : balls) {
        covers_.push_back({cell_coordinates(ball.centre - Vec3::Constant(ball.radius)),
                           cell_coordinates(ball.centre + Vec3::Constant(ball.radius))});
        visit_cells(covers_.back(),
                    [&](const Vec3i& at) { ++begin_[cell_index(at.x(), at.y(), at.z()) + 1]; });
    }
    for (std::size_t c = 0; c < cells; ++c) begin_[c + 1] += begin_[c];
    next_.assign(begin_.begin(), begin_.end() - 1);
    entries_.resize(begin_.back());
    balls_.clear();
    const double slack = tuning::fragments::ball_rounding * (box_.empty() ? 0 : box_.size().maxCoeff());
    for (std::uint32_t k = 0; k < balls.size(); ++k) {
        balls_.push_back(
            {(balls[k].centre - box_.min).cast<float>(), static_cast<float>(balls[k].radius + slack), k});
        visit_cells(covers_[k], [&](const Vec3i& at) {
            entries_[next_[cell_index(at.x(), at.y(), at.z())]++] = balls_.back();
        });
    }
}

void SphereGrid::containing(const Vec3& point, std::vector<std::uint32_t>& out) const {
    out.clear();
    if (!box_.contains(point)) return;
    const Vec3i at = cell_coordinates(point);
    const Vec3f place = (point - box_.min).cast<float>();
    const std::size_t cell = cell_index(at.x(), at.y(), at.z());
    for (std::size_t n = begin_[cell]; n < begin_[cell + 1]; ++n) {
        const Entry& ball = entries_[n];
        if (!((ball.centre - place).squaredNorm() > ball.radius * ball.radius)) out.push_back(ball.ball);
    }
}

void SphereGrid::meeting_after(std::uint32_t k, std::vector<std::uint32_t>& out) const {
    out.clear();
    visit_cells(covers_[k], [&](const Vec3i& at) {
        const std::size_t cell = cell_index(at.x(), at.y(), at.z());
        for (std::size_t n = begin_[cell]; n < begin_[cell + 1]; ++n) {
            const Entry& other = entries_[n];
            const float reach = other.radius + balls_[k].radius;
            if (other.ball <= k || (other.centre - balls_[k].centre).squaredNorm() > reach * reach) continue;
            // Two balls are listed once: in the first of the cells that both meet.
            if (covers_[k].low.cwiseMax(covers_[other.ball].low) == at) out.push_back(other.ball);
        }
    });
    std::sort(out.begin(), out.end());
}

}  // namespace splitcubes::body
