#include <splitcubes/body/node_hulls.h>

#include <cmath>
#include <limits>

namespace splitcubes::body {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

}  // namespace

bool NodeHulls::start(double cell, double largest) {
    carriers_.clear();
    known_.fill(false);
    cell_ = static_cast<float>(cell);
    // Seven roundings of terms that together are no larger than this.
    slack_ = 1e-6 * largest;
    return largest < 1e30;
}

void NodeHulls::add(const Vec3& from_centre, double reach, const State& now, const State& before) {
    Carrier carrier;
    // A little more, so that rounding leaves none out.
    carrier.square = static_cast<float>(reach * reach * (1 + 1e-5) + 1e-6 * from_centre.squaredNorm());
    carrier.from_centre << from_centre.cast<float>(), 0.0F;
    const std::array<const State*, 2> states{&now, &before};
    for (std::size_t k = 0; k < 2; ++k) {
        carrier.made[k].row(3).setZero();
        carrier.made[k].topLeftCorner<3, 3>() = states[k]->matrix.cast<float>();
        carrier.made[k].block<3, 1>(0, 3) = states[k]->off.cast<float>();
    }
    carriers_.push_back(carrier);
}

geometry::Box NodeHulls::widened(const Vec4f& low, const Vec4f& high) const {
    if (low[0] > high[0]) return {};
    return geometry::Box{low.head<3>().cast<double>(), high.head<3>().cast<double>()}.grown(slack_);
}

void NodeHulls::choose_block(int block) {
    const Vec4f at(static_cast<float>(block & 1), static_cast<float>(block >> 1 & 1),
                   static_cast<float>(block >> 2), 0.5F);
    block_ = (2 * at - Vec4f::Ones()) * cell_;
    near_.resize(carriers_.size());
    std::size_t count = 0;
    for (std::uint32_t k = 0; k < carriers_.size(); ++k) {
        const Vec4f outside =
            ((carriers_[k].from_centre - block_).cwiseAbs() - Vec4f::Constant(cell_)).cwiseMax(0.0F);
        near_[count] = k;
        count += outside.squaredNorm() <= carriers_[k].square;
    }
    near_.resize(count);
    for (std::vector<float>* list : {&x_, &y_, &z_, &square_, &room_}) list->resize(count);
    reaching_.resize(count);
    for (std::size_t n = 0; n < count; ++n) {
        const Carrier& carrier = carriers_[near_[n]];
        x_[n] = carrier.from_centre[0];
        y_[n] = carrier.from_centre[1];
        z_[n] = carrier.from_centre[2];
        square_[n] = carrier.square;
    }
}

// Writes the carriers of the block that reach a point to reaching_; their count.
std::size_t NodeHulls::list_reaching(const Vec4f& at) {
    const std::size_t count = near_.size();
    const float x = at[0], y = at[1], z = at[2];
    for (std::size_t n = 0; n < count; ++n) {
        const float dx = x_[n] - x, dy = y_[n] - y, dz = z_[n] - z;
        room_[n] = square_[n] - (dx * dx + dy * dy + dz * dz);
    }
    std::size_t reaching = 0;
    for (std::size_t n = 0; n < count; ++n) {
        reaching_[reaching] = near_[n];
        reaching += room_[n] >= 0;
    }
    return reaching;
}

geometry::Box NodeHulls::box_of_block() const {
    Vec4f low = Vec4f::Constant(infinity), high = -low;
    for (const std::uint32_t k : near_)
        for (const Eigen::Matrix4f& made : carriers_[k].made) {
            const Vec4f at =
                made.col(3) + made.col(0) * block_[0] + made.col(1) * block_[1] + made.col(2) * block_[2];
            const Vec4f spread =
                cell_ * (made.col(0).cwiseAbs() + made.col(1).cwiseAbs() + made.col(2).cwiseAbs());
            low = low.cwiseMin(at - spread);
            high = high.cwiseMax(at + spread);
        }
    return widened(low, high);
}

const geometry::Box& NodeHulls::box_of(const Vec3i& node) {
    const auto index =
        static_cast<std::size_t>(node.x() + nodes_a_side * (node.y() + nodes_a_side * node.z()));
    if (known_[index]) return box_[index];
    known_[index] = true;
    Vec4f at;
    at << (node.cast<float>() - Vec3f::Constant(0.5F * side)) * cell_, 0.0F;
    Vec4f low = Vec4f::Constant(infinity), high = -low;
    const std::size_t count = list_reaching(at);
    for (std::size_t n = 0; n < count; ++n)
        for (const Eigen::Matrix4f& made : carriers_[reaching_[n]].made) {
            const Vec4f there = made.col(3) + made.col(0) * at[0] + made.col(1) * at[1] + made.col(2) * at[2];
            low = low.cwiseMin(there);
            high = high.cwiseMax(there);
        }
    box_[index] = widened(low, high);
    return box_[index];
}

}  // namespace splitcubes::body
