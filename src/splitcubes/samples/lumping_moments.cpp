#include <splitcubes/samples/lumping_moments.h>
#include <splitcubes/samples/tuning.h>

#include <cmath>
#include <type_traits>
#include <utility>

namespace splitcubes::meshless {

namespace {

// Calls body for each index up to count as a constant, so that inner loops have constant bounds.
template <std::size_t count, class Body>
void for_constants(const Body& body) {
    [&]<std::size_t... index>(std::index_sequence<index...>) {
        (body(std::integral_constant<std::size_t, index>{}), ...);
    }
    (std::make_index_sequence<count>{});
}

// Cholesky factor of a symmetric positive definite matrix, by rows and by columns, so that loops run over
// consecutive numbers and their steps do not wait for each other.
template <class Products, std::size_t size>
class LumpingFactor {
  public:
    /// a: upper triangle. Returns false if it is not positive definite.
    bool factorise(Products& a) {
        bool is_positive = true;
        for_constants<size>([&](auto c) {
            is_positive = is_positive && a[c][c] > 0;
            inverse_[c] = 1 / std::sqrt(a[c][c]);
            for (std::size_t k = c + 1; k < size; ++k) upper_[c][k] = a[c][k] * inverse_[c];
            for (std::size_t k = c + 1; k < size; ++k) lower_[k][c] = upper_[c][k];
            for (std::size_t r = c + 1; r < size; ++r)
                for (std::size_t k = r; k < size; ++k) a[r][k] -= upper_[c][r] * upper_[c][k];
        });
        return is_positive;
    }
    template <class Moments>
    void solve(Moments& x) const {
        for_constants<size>([&](auto r) {
            x[r] *= inverse_[r];
            for (std::size_t k = r + 1; k < size; ++k) x[k] -= upper_[r][k] * x[r];
        });
        for_constants<size>([&](auto index) {
            constexpr std::size_t r = size - 1 - index;
            x[r] *= inverse_[r];
            for (std::size_t k = 0; k < r; ++k) x[k] -= lower_[r][k] * x[r];
        });
    }

  private:
    Products upper_, lower_;
    std::array<double, size> inverse_;
};

}  // namespace

// Solves product change = -mean, damped, by iterative refinement: with D the damped matrix and d the damping,
// change - D^-1 (mean + product change) = D^-1 (d change - mean). product: upper triangle.
bool LumpingMoments::solve_damped(const Moments& mean, Products& product, Moments& change) {
    for (std::size_t r = 0; r < count; ++r) product[r][r] += tuning::lumping::moments_damping;
    LumpingFactor<Products, count> factor;
    if (!factor.factorise(product)) return false;
    change = {};
    for (int pass = 0; pass <= tuning::lumping::moments_refinements; ++pass) {
        for (std::size_t r = 0; r < count; ++r)
            change[r] = tuning::lumping::moments_damping * change[r] - mean[r];
        factor.solve(change);
    }
    for (const double value : change)
        if (!std::isfinite(value)) return false;
    return true;
}

void LumpingMoments::apply(const Moments& mean, const Moments& change, std::span<double> share) {
    factors_.resize(share.size());
    double all = 0;
    for (std::size_t k = 0; k < share.size(); ++k) {
        factors_[k] = 0;
        for (std::size_t r = 0; r < count; ++r) factors_[k] += change[r] * (at_[k][r] - mean[r]);
        all += share[k] * std::abs(factors_[k]);
    }
    const double part = all > tuning::lumping::max_share_change ? tuning::lumping::max_share_change / all : 1;
    double sum = 0;
    for (std::size_t k = 0; k < share.size(); ++k) {
        share[k] *= 1 + part * factors_[k];
        sum += share[k];
    }
    for (double& one : share) one /= sum;
}

void LumpingMoments::keep(const Vec3& node, const Phyxels& phyxels, std::span<const std::uint32_t> phyxel,
                          std::span<double> share) {
    if (share.size() < 2) return;
    double scale = 0;  // m
    for (std::size_t k = 0; k < share.size(); ++k) scale += share[k] * phyxels.support_radius[phyxel[k]];
    constexpr double square = tuning::lumping::square_scale;
    at_.resize(share.size());
    Moments mean{};
    Products product{};
    for (std::size_t k = 0; k < share.size(); ++k) {
        const Vec3 d = (phyxels.rest_position[phyxel[k]] - node) / scale;
        Moments& q = at_[k];
        q = {d[0],
             d[1],
             d[2],
             square * d[0] * d[0],
             square * d[1] * d[1],
             square * d[2] * d[2],
             square * d[0] * d[1],
             square * d[1] * d[2],
             square * d[2] * d[0],
             0};
        Moments weighted;
        for (std::size_t c = 0; c < q.size(); ++c) {
            weighted[c] = share[k] * q[c];
            mean[c] += weighted[c];
        }
        // The upper triangle, in pairs of columns.
        for_constants<count>([&](auto r) {
            for (std::size_t c = r / 2 * 2; c < q.size(); ++c) product[r][c] += weighted[r] * q[c];
        });
    }
    for (std::size_t r = 0; r < count; ++r)
        for (std::size_t c = r; c < count; ++c) product[r][c] -= mean[r] * mean[c];
    Moments change;
    if (solve_damped(mean, product, change)) apply(mean, change, share);
}

}  // namespace splitcubes::meshless
