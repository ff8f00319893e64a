#include <splitcubes/node_motion/node_hulls.h>

#include <algorithm>

namespace splitcubes::body {

void NodeHulls::start(double cell, double position_error) {
    influences_.resize(0);
    known_.fill(false);
    cell_ = static_cast<float>(cell);
    position_error_ = position_error;
}

void NodeHulls::add(const Vec3& from_centre, double reach, const State& now, const State& before) {
    const std::size_t i = influences_.size();
    influences_.resize(i + 1);
    // Enlarged so that rounding excludes none.
    influences_.set(i, from_centre, reach * reach * (1 + 1e-5) + 1e-6 * from_centre.squaredNorm(), now,
                    before);
}

void NodeHulls::add_from(const InfluenceTable& table, std::size_t begin, std::size_t end,
                         const Vec3f& centre) {
    influences_.append_from(table, begin, end, {centre, 0.5F * side * cell_});
}

bool NodeHulls::finish() {
    mean_ = influences_.subtract_mean();
    const float half = 0.5F * side * cell_;
    cube_box_ = influences_.box_of({Vec3f::Zero(), half});
    const double largest = std::max(cube_box_.max.cwiseAbs().maxCoeff(), cube_box_.min.cwiseAbs().maxCoeff());
    // Bounds seven rounding errors of terms whose sum, and each matrix row's part over the cube, is at most
    // the largest.
    const double rows = largest / static_cast<double>(half) + mean_.cwiseAbs().rowwise().sum().maxCoeff();
    slack_ = 1e-6 * largest + 2 * position_error_ * rows;
    cube_box_ = widened(cube_box_);
    return largest < 1e25;
}

void NodeHulls::choose_block(int block) {
    const Vec3f at(static_cast<float>(block & 1), static_cast<float>(block >> 1 & 1),
                   static_cast<float>(block >> 2));
    block_ = {(2 * at - Vec3f::Ones()) * cell_, cell_};
    is_near_known_ = false;
}

geometry::Box NodeHulls::box_of_block() const {
    return widened(influences_.box_of(block_));
}

const geometry::Box& NodeHulls::box_of(const Vec3i& node) {
    const auto index =
        static_cast<std::size_t>(node.x() + nodes_per_side * (node.y() + nodes_per_side * node.z()));
    if (known_[index]) return box_[index];
    known_[index] = true;
    if (!is_near_known_) near_.assign_from(influences_, block_);
    is_near_known_ = true;
    box_[index] = widened(near_.box_of({(node.cast<float>() - Vec3f::Constant(0.5F * side)) * cell_, 0}));
    return box_[index];
}

}  // namespace splitcubes::body
