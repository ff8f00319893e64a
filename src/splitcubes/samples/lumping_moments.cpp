#include <splitcubes/samples/lumping_moments.h>
#include <splitcubes/samples/tuning.h>

#include <Eigen/Cholesky>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

namespace splitcubes::meshless {

namespace {

using Moments = Eigen::Matrix<double, 9, 1>;
using Products = Eigen::Matrix<double, 9, 9>;

// Returns the linear and quadratic monomials at an offset in units of the support radius.
Moments monomials(const Vec3& d) {
    Moments out;
    out << d, tuning::lumping::square_scale * d.cwiseProduct(d), tuning::lumping::square_scale * d[0] * d[1],
        tuning::lumping::square_scale * d[1] * d[2], tuning::lumping::square_scale * d[2] * d[0];
    return out;
}

class Row {
  public:
    Row(const Vec3& node, const Phyxels& phyxels, std::span<const std::uint32_t> phyxel,
        std::span<double> share)
        : node_(node), phyxels_(phyxels), phyxel_(phyxel), share_(share) {
        for (std::size_t k = 0; k < share.size(); ++k) scale_ += share[k] * phyxels.support_radius[phyxel[k]];
    }

    void keep_moments() {
        Moments mean = Moments::Zero();
        Products product = Products::Zero();
        for (std::size_t k = 0; k < share_.size(); ++k) {
            const Moments q = at(k);
            mean += share_[k] * q;
            product.triangularView<Eigen::Lower>() += (share_[k] * q) * q.transpose();
        }
        product.triangularView<Eigen::Lower>() -= mean * mean.transpose();
        product.triangularView<Eigen::StrictlyUpper>() = product.transpose();
        const Eigen::LDLT<Products> damped(product + tuning::lumping::moments_damping * Products::Identity());
        Moments change = Moments::Zero();
        for (int pass = 0; pass <= tuning::lumping::moments_refinements; ++pass)
            change -= damped.solve(mean + product * change);
        if (change.allFinite()) apply(mean, change);
    }

  private:
    Moments at(std::size_t k) const {
        return monomials((phyxels_.rest_position[phyxel_[k]] - node_) / scale_);
    }

    void apply(const Moments& mean, const Moments& change) {
        double all = 0;
        for (std::size_t k = 0; k < share_.size(); ++k) all += share_[k] * std::abs(change.dot(at(k) - mean));
        const double part =
            all > tuning::lumping::max_share_change ? tuning::lumping::max_share_change / all : 1;
        double sum = 0;
        for (std::size_t k = 0; k < share_.size(); ++k) {
            share_[k] *= 1 + part * change.dot(at(k) - mean);
            sum += share_[k];
        }
        for (double& share : share_) share /= sum;
    }

    const Vec3& node_;
    const Phyxels& phyxels_;
    std::span<const std::uint32_t> phyxel_;
    std::span<double> share_;
    double scale_ = 0;  // m
};

// Copies the shares of a row from `last` if it has the same phyxels; returns whether it did.
bool copy_known_shares(const MassLumping& last, std::size_t node, std::span<const std::uint32_t> phyxel,
                       std::span<double> share) {
    if (node >= last.node_count() || last.whole[node] == 0) return false;
    const std::uint32_t begin = last.offsets[node], count = last.offsets[node + 1] - begin;
    const auto known = std::span(last.phyxel).subspan(begin, count);
    if (!std::equal(known.begin(), known.end(), phyxel.begin(), phyxel.end())) return false;
    const auto shares = std::span(last.share).subspan(begin, count);
    std::copy(shares.begin(), shares.end(), share.begin());
    return true;
}

// Scales back the changes of each piece such that its phyxels keep at least min_volume_share
// of their volume.
void keep_volumes(const MaterialNodes& nodes, const Phyxels& phyxels, std::span<const std::uint8_t> chosen,
                  std::span<const double> plain, MassLumping& lumping) {
    std::vector<double> volume(phyxels.size(), 0), before(phyxels.size(), 0);
    for (std::size_t b = 0; b < chosen.size(); ++b)
        for (std::uint32_t e = lumping.offsets[b]; chosen[b] != 0 && e < lumping.offsets[b + 1]; ++e) {
            volume[lumping.phyxel[e]] += lumping.share[e] * nodes.volume[b];
            before[lumping.phyxel[e]] += plain[e] * nodes.volume[b];
        }
    std::vector<double> part;  // per piece
    for (std::size_t i = 0; i < phyxels.size(); ++i) {
        if (phyxels.piece[i] < 0) continue;
        const auto piece = static_cast<std::size_t>(phyxels.piece[i]);
        if (piece >= part.size()) part.resize(piece + 1, 1);
        if (volume[i] < tuning::lumping::min_volume_share * before[i])
            part[piece] = std::min(
                part[piece], (1 - tuning::lumping::min_volume_share) * before[i] / (before[i] - volume[i]));
    }
    for (std::size_t b = 0; b < chosen.size(); ++b) {
        if (chosen[b] == 0 || lumping.offsets[b] == lumping.offsets[b + 1]) continue;
        const double kept = part[static_cast<std::size_t>(nodes.piece[b])];
        lumping.whole[b] = kept == 1;
        for (std::uint32_t e = lumping.offsets[b]; kept < 1 && e < lumping.offsets[b + 1]; ++e)
            lumping.share[e] = plain[e] + kept * (lumping.share[e] - plain[e]);
    }
}

}  // namespace

void keep_moments(const MaterialNodes& nodes, const Phyxels& phyxels, std::span<const std::uint8_t> chosen,
                  const MassLumping& last, MassLumping& lumping, const Parallel& parallel) {
    assert(chosen.size() == lumping.node_count());
    const std::vector<double> plain = lumping.share;
    lumping.whole.assign(chosen.size(), 1);
    for (std::size_t b = 0; b < last.node_count(); ++b)
        if (chosen[b] == 0) lumping.whole[b] = last.whole[b];
    parallel.for_each(chosen.size(), tuning::grains::lumping_moments, [&](std::size_t b) {
        const std::uint32_t begin = lumping.offsets[b], count = lumping.offsets[b + 1] - begin;
        if (chosen[b] == 0 || count < 2) return;
        const auto phyxel = std::span(lumping.phyxel).subspan(begin, count);
        const auto share = std::span(lumping.share).subspan(begin, count);
        if (!copy_known_shares(last, b, phyxel, share))
            Row(nodes.rest_position[b], phyxels, phyxel, share).keep_moments();
    });
    keep_volumes(nodes, phyxels, chosen, plain, lumping);
}

}  // namespace splitcubes::meshless
