// Serialisation of vectors and matrices.
#pragma once

#include <splitcubes/core/state_stream.h>
#include <splitcubes/math/types.h>

#include <cmath>
#include <span>
#include <vector>

namespace splitcubes {

/// Largest number in double precision (m, m/s, J and so on) that a state may hold: far more than any world
/// needs, and small enough that squares and products stay finite.
inline constexpr double largest_state_number = 1e75;

/// Returns the doubles that the elements consist of, in sequence. T must hold nothing but doubles.
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

/// Reads `count` elements that hold nothing but doubles, each finite and at most largest_state_number in
/// magnitude.
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

/// Returns whether a matrix is a rotation, within `tolerance` in each entry of R R^T.
inline bool is_rotation(const Mat3& matrix, double tolerance) {
    return ((matrix * matrix.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() <= tolerance) &&
           matrix.determinant() > 0;
}

}  // namespace splitcubes
