// Random draws by integer arithmetic alone, so that a seed gives the same scene on every machine.
#pragma once

#include <splitcubes/core/random.h>

#include <Eigen/Core>

#include <cmath>
#include <cstdint>

namespace splitcubes::torture {

using Vec3 = Eigen::Vector3d;

/// Rounds to millionths, which JSON and OBJ files hold exactly.
inline double rounded(double value) {
    const double out = std::floor(value * 1e6 + 0.5) / 1e6;
    return out == 0 ? 0 : out;  // never -0
}
inline Vec3 rounded(const Vec3& v) {
    return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

/// Numbers from a seed.
class Draw {
  public:
    explicit Draw(std::uint64_t seed) : random_(seed * 0x632be59bd9b4e019ULL + 0x1d8e4e27c47d124fULL) {}

    /// Uniform in [low, high].
    std::int64_t between(std::int64_t low, std::int64_t high) {
        const auto count = static_cast<std::uint64_t>(high - low) + 1;
        return low + static_cast<std::int64_t>(random_.bits() % count);
    }
    bool chance(int of, int among) { return between(1, among) <= of; }
    /// Uniform in millionths of the interval.
    double real(double low, double high) {
        return low + (high - low) * static_cast<double>(between(0, 1000000)) / 1e6;
    }
    /// 1 to 9.999 times a power of ten: uniform in the exponent from `low` to below `high`.
    double decades(int low, int high) {
        const auto exponent = between(low, high - 1);
        double value = static_cast<double>(between(1000, 9999)) / 1e3;
        for (std::int64_t k = 0; k < exponent; ++k) value *= 10;
        for (std::int64_t k = exponent; k < 0; ++k) value /= 10;
        return value;
    }
    Vec3 direction() {
        for (;;) {
            const Vec3 v = in_cube(1);
            if (const double square = v.squaredNorm(); square > 0.01 && square <= 1)
                return v / std::sqrt(square);
        }
    }
    Vec3 in_cube(double half) {
        const double x = real(-half, half), y = real(-half, half);
        return {x, y, real(-half, half)};
    }
    Vec3 across(const Vec3& axis) {
        for (;;) {
            const Vec3 v = axis.cross(direction());
            if (const double square = v.squaredNorm(); square > 0.01) return v / std::sqrt(square);
        }
    }

  private:
    Random random_;
};

}  // namespace splitcubes::torture
