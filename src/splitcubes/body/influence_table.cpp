#include <splitcubes/body/influence_kernels.h>
#include <splitcubes/body/influence_table.h>

#include <algorithm>
#include <array>

namespace splitcubes::body {

void InfluenceTable::make_room(std::size_t count) {
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
    make_room(count);
    if (count > size_) std::fill(field(square) + size_, field(square) + count, -1.0F);
    size_ = count;
}

void InfluenceTable::set(std::size_t i, const Vec3& at, double square_of_reach, const State& now,
                         const State& before) {
    float* entry = numbers_.data() + i;
    const auto put = [&](double number) {
        *entry = static_cast<float>(number);
        entry += stride_;
    };
    for (int k = 0; k < 3; ++k) put(at[k]);
    put(square_of_reach);
    // What single precision cannot hold is too large for any use, but stays finite.
    constexpr double most = 1e30;
    for (const State* state : {&now, &before}) {
        for (int k = 0; k < 3; ++k) put(std::clamp(state->off[k], -most, most));
        for (int k = 0; k < 9; ++k) put(std::clamp(state->matrix.data()[k], -most, most));
    }
}

void InfluenceTable::append_from(const InfluenceTable& from, std::size_t begin, std::size_t end,
                                 const Cube& cube) {
    make_room(size_ + (end - begin));
    size_ += choose_influences({from.numbers_.data(), from.stride_, begin, end}, cube, true,
                               numbers_.data() + size_, stride_);
}

void InfluenceTable::assign_from(const InfluenceTable& from, const Cube& cube) {
    make_room(from.size());
    size_ = choose_influences({from.numbers_.data(), from.stride_, 0, from.size()}, cube, false,
                              numbers_.data(), stride_);
}

Mat3 InfluenceTable::take_out_mean() {
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
