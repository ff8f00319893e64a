// Vectors and matrices as the numbers that a state is made of.
#pragma once

#include <splitcubes/core/state_stream.h>
#include <splitcubes/math/types.h>

#include <cmath>
#include <span>
#include <vector>

namespace splitcubes {

/// m, m/s, J and whatever else a state says in double precision: far more than any world holds, and small
/// enough that squares and products of it stay finite.
inline constexpr double largest_state_number = 1e75;

/// The numbers of things that are nothing but doubles, one after the other.
template <class T>
std::span<double> numbers_of(std::vector<T>& values) {
    static_assert(sizeof(T) % sizeof(double) == 0 && alignof(T) == alignof(double));
    return {reinterpret_cast<double*>(values.data()), values.size() * (sizeof(T) / sizeof(double))};
}
template <class T>
std::span<const double> numbers_of(const std::vector<T>& values) {
    static_assert(sizeof(T) % sizeof(double) == 0 && alignof(T) == alignof(double));
    return {reinterpret_cast<const double*>(values.data()), values.size() * (sizeof(T) / sizeof(double))};
}

inline bool are_state_numbers(std::span<const double> values) {
    bool hold = true;
    for (const double value : values) hold = hold && std::abs(value) <= largest_state_number;
    return hold;
}

/// Reads `count` things that are nothing but doubles; each number is finite and below the largest.
template <class T>
void read_numbers(StateReader& reader, std::size_t count, std::vector<T>& out, const char* problem) {
    reader.require_room(count, sizeof(T));
    out.resize(count);
    reader.fill(numbers_of(out));
    require_state(are_state_numbers(numbers_of(out)), problem);
}
template <int Rows, int Columns>
void read_numbers(StateReader& reader, Eigen::Matrix<double, Rows, Columns>& out, const char* problem) {
    const std::span<double> numbers(out.data(), static_cast<std::size_t>(Rows * Columns));
    reader.fill(numbers);
    require_state(are_state_numbers(numbers), problem);
}
template <int Rows, int Columns>
void write_numbers(StateWriter& writer, const Eigen::Matrix<double, Rows, Columns>& value) {
    writer.add(std::span<const double>(value.data(), static_cast<std::size_t>(Rows * Columns)));
}

/// Whether a matrix is a rotation, within `tolerance` in each entry of R R^T.
inline bool is_rotation(const Mat3& matrix, double tolerance) {
    return ((matrix * matrix.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() <= tolerance) &&
           matrix.determinant() > 0;
}

}  // namespace splitcubes
