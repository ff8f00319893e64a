#include <splitcubes/node_motion/influence_kernels.h>
#include <splitcubes/node_motion/influence_table.h>

#include <algorithm>
#include <array>

namespace splitcubes::body {

void InfluenceTable::reserve(std::size_t count) {
    const std::size_t needed = count + 2 * width;
    if (needed <= stride_) return;
    const std::size_t stride = std::max(needed, 2 * stride_);
    std::vector<float> numbers(fields * stride, 0.0F);
    for (std::size_t f = 0; f < fields; ++f)
        std::copy_n(field(f), size_, numbers.begin() + static_cast<std::ptrdiff_t>(f * stride));
    numbers_ = std::move(numbers);
    stride_ = stride;
}

void InfluenceTable::resize(std::size_t count) {
    reserve(count);
    if (count > size_) std::fill(field(square) + size_, field(square) + count, -1.0F);
    size_ = count;
}

void InfluenceTable::set(std::size_t i, const Vec3& position, double squared_reach, const State& now,
                         const State& before) {
    float* entry = numbers_.data() + i;
    const auto put = [&](double number) {
        *entry = static_cast<float>(number);
        entry += stride_;
    };
    for (int k = 0; k < 3; ++k) put(position[k]);
    put(squared_reach);
    // Values beyond single precision are useless, but must stay finite.
    constexpr double max_value = 1e30;
    for (const State* state : {&now, &before}) {
        for (int k = 0; k < 3; ++k) put(std::clamp(state->off[k], -max_value, max_value));
        for (int k = 0; k < 9; ++k) put(std::clamp(state->matrix.data()[k], -max_value, max_value));
    }
}

void InfluenceTable::append_from(const InfluenceTable& from, std::size_t begin, std::size_t end,
                                 const Cube& cube) {
    reserve(size_ + (end - begin));
    size_ += choose_influences({from.numbers_.data(), from.stride_, begin, end}, cube, true,
                               numbers_.data() + size_, stride_);
}

void InfluenceTable::assign_from(const InfluenceTable& from, const Cube& cube) {
    reserve(from.size());
    size_ = choose_influences({from.numbers_.data(), from.stride_, 0, from.size()}, cube, false,
                              numbers_.data(), stride_);
}

Mat3 InfluenceTable::subtract_mean() {
    if (size_ == 0) return Mat3::Zero();
    constexpr std::size_t matrix = first_state + 3;
    std::array<float, 9> mean;
    sum_lists(field(matrix), stride_, size_, mean);
    for (std::size_t k = 0; k < 9; ++k) {
        mean[k] /= static_cast<float>(size_);
        for (float* list : {field(matrix + k), field(matrix + state_size + k)})
            for (std::size_t i = 0; i < size_; ++i) list[i] -= mean[k];
    }
    return Eigen::Map<const Eigen::Matrix3f>(mean.data()).cast<double>();
}

geometry::Box InfluenceTable::box_of(const Cube& cube) const {
    std::array<float, 3> low, high;
    bound_influences({numbers_.data(), stride_, 0, size_}, cube, low, high);
    if (low[0] > high[0]) return {};
    return {Eigen::Map<const Vec3f>(low.data()).cast<double>(),
            Eigen::Map<const Vec3f>(high.data()).cast<double>()};
}

}  // namespace splitcubes::body
