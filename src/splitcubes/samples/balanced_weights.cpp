#include <splitcubes/samples/balanced_weights.h>
#include <splitcubes/samples/tuning.h>

#include <Eigen/Cholesky>

#include <array>
#include <cassert>

namespace splitcubes::meshless {

namespace {

constexpr int cubes = 10, squares = 6;
using Terms = Eigen::Matrix<double, cubes + squares, 1>;
using TermMatrix = Eigen::Matrix<double, cubes + squares, cubes + squares>;

// Returns the products of three components of x, then those of two. Each stands once, so the ridge is weaker
// on those of one component: rotated bodies come out stiffer, and nearer to theory, than with an isotropic
// ridge.
Terms terms_of(const Vec3& x) {
    const Vec3 square = x.cwiseAbs2();
    Terms out;
    out << square.x() * x, square.y() * x, square.z() * x, x.prod(), square, x.x() * x.y(), x.x() * x.z(),
        x.y() * x.z();
    return out;
}

// Relative changes of the weights. A link whose weight would fall below the floor stays there, and the others
// are fitted again.
class Balance {
  public:
    Balance(std::span<const Vec3> edge, std::span<const double> weight, double spacing) : weight_(weight) {
        for (std::size_t j = 0; j < edge.size(); ++j) {
            terms_[j] = terms_of(edge[j] / spacing);
            moments_.head<cubes>() += weight[j] * terms_[j].head<cubes>();
            total_ += weight[j];
        }
    }

    bool is_needed() const {
        return moments_.cwiseAbs().maxCoeff() > tuning::balance::min_third_moment * total_;
    }

    void fit() {
        bool any_fixed = true;
        for (int round = 0; any_fixed && round < tuning::balance::rounds; ++round) {
            const Terms coefficients = solve();
            any_fixed = false;
            for (std::size_t j = 0; j < weight_.size(); ++j) {
                if (is_fixed_[j]) continue;
                change_[j] = -terms_[j].dot(coefficients);
                if (!(change_[j] < tuning::balance::floor - 1)) continue;
                change_[j] = tuning::balance::floor - 1;
                is_fixed_[j] = any_fixed = true;
            }
        }
    }

    double change(std::size_t j) const { return change_[j]; }

  private:
    Terms solve() const {
        TermMatrix matrix = TermMatrix::Zero();
        Terms right = moments_;
        for (std::size_t j = 0; j < weight_.size(); ++j) {
            if (is_fixed_[j])
                right += weight_[j] * change_[j] * terms_[j];
            else
                matrix += weight_[j] * terms_[j] * terms_[j].transpose();
        }
        matrix.diagonal().head<cubes>().array() += tuning::balance::third_moment_ridge * total_;
        matrix.diagonal().tail<squares>().array() += tuning::balance::second_moment_ridge * total_;
        return matrix.ldlt().solve(right);
    }

    std::span<const double> weight_;
    double total_ = 0;
    Terms moments_ = Terms::Zero();  // to be cancelled
    std::array<Terms, max_balanced_links> terms_;
    std::array<double, max_balanced_links> change_{};
    std::array<bool, max_balanced_links> is_fixed_{};
};

}  // namespace

void balance_weights(std::span<const Vec3> edge, std::span<double> weight, double spacing) {
    assert(edge.size() == weight.size() && edge.size() <= max_balanced_links);
    Balance balance(edge, weight, spacing);
    if (!balance.is_needed()) return;
    balance.fit();
    for (std::size_t j = 0; j < weight.size(); ++j) weight[j] *= 1 + balance.change(j);
}

}  // namespace splitcubes::meshless
