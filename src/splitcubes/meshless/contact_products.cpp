#include <splitcubes/meshless/contact_products.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace splitcubes::meshless {

namespace {

// Springs, or phyxels that they hold, a chunk.
constexpr std::size_t product_grain = 256;
// The preconditioner's polynomial: least and largest eigenvalue that it is made for, of D^-1 (E + C), and its
// steps.
constexpr double least_eigenvalue = 0.2, largest_eigenvalue = 1;
constexpr int steps = 2;
// Chebyshev's recurrence: a step is `again` times the last and `fresh` times D^-1 of what is left.
struct Recurrence {
    std::array<float, steps> again{}, fresh{};
};
constexpr Recurrence make_recurrence() {
    constexpr double middle = 0.5 * (largest_eigenvalue + least_eigenvalue),
                     half = 0.5 * (largest_eigenvalue - least_eigenvalue);
    Recurrence out;
    out.fresh[0] = static_cast<float>(1 / middle);
    double rho = half / middle;
    for (std::size_t k = 1; k < steps; ++k) {
        const double next = 1 / (2 * middle / half - rho);
        out.again[k] = static_cast<float>(next * rho);
        out.fresh[k] = static_cast<float>(2 * next / half);
        rho = next;
    }
    return out;
}
constexpr Recurrence recurrence = make_recurrence();

}  // namespace

void ContactProducts::clear(std::span<const std::size_t> phyxels) {
    for (std::size_t t = 0; t < touched_count_; ++t) slot_[touched_[t].part][touched_[t].phyxel] = 0;
    for (auto* list : {&ends_, &by_phyxel_}) list->clear();
    springs_.clear();
    touched_.clear();
    spring_count_ = touched_count_ = 0;
    slot_.resize(phyxels.size());
    for (std::size_t p = 0; p < phyxels.size(); ++p) slot_[p].resize(phyxels[p], 0);
}

void ContactProducts::hold(std::uint32_t part, std::uint32_t phyxel, double weight) {
    std::uint32_t& slot = slot_[part][phyxel];
    if (slot == 0) {
        touched_.push_back({part, phyxel});
        slot = static_cast<std::uint32_t>(touched_.size());
    }
    ++touched_[slot - 1].first;
    ends_.push_back({slot - 1, static_cast<float>(weight)});
}

void ContactProducts::add(const Contact& contact, double along, double across) {
    Spring spring;
    spring.normal.head<3>() = contact.normal.cast<float>();
    spring.first = static_cast<std::uint32_t>(ends_.size());
    springs_.push_back(spring);
    set(springs_.size() - 1, along, across);
    double sign = 1;
    for (const ContactSide* side : {&contact.upper, &contact.lower}) {
        for (std::uint32_t k = 0; k < side->count; ++k)
            hold(side->part, side->phyxel[k], sign * side->weight[k]);
        sign = -1;
    }
}

void ContactProducts::add(const HandleSpring& pull, double stiffness) {
    Spring spring;
    spring.across = static_cast<float>(stiffness);
    spring.first = static_cast<std::uint32_t>(ends_.size());
    springs_.push_back(spring);
    hold(pull.part, pull.phyxel, 1);
}

void ContactProducts::set(std::size_t spring, double along, double across) {
    springs_[spring].across = static_cast<float>(across);
    springs_[spring].beyond = static_cast<float>(along - across);
}

// By phyxel which springs hold it: each phyxel then sums up by itself.
void ContactProducts::finish() {
    spring_count_ = springs_.size();
    touched_count_ = touched_.size();
    springs_.emplace_back().first = static_cast<std::uint32_t>(ends_.size());
    std::uint32_t end = 0;
    for (Touched& t : touched_) t.first = end += t.first;
    touched_.push_back({0, 0, end});
    by_phyxel_.resize(ends_.size());
    for (std::size_t s = spring_count_; s-- > 0;)
        for (std::uint32_t e = springs_[s + 1].first; e-- > springs_[s].first;)
            by_phyxel_[--touched_[ends_[e].at].first] = {static_cast<std::uint32_t>(s), ends_[e].weight};
    force_.resize(spring_count_);
    for (auto* array : {&way_, &residual_, &smooth_, &move_}) array->resize(touched_count_);
}

// D bounds E + C by rows' sums (Gershgorin), over both sides of each spring.
void ContactProducts::take_diagonals(std::span<const Diagonal> diagonals) {
    for (std::size_t s = 0; s < spring_count_; ++s) {
        float sum = 0;
        for (std::uint32_t e = springs_[s].first; e < springs_[s + 1].first; ++e)
            sum += std::abs(ends_[e].weight);
        force_[s][0] = sum * (springs_[s].across + std::max(0.0F, springs_[s].beyond));
    }
    for (std::size_t t = 0; t < touched_count_; ++t) {
        Touched& touched = touched_[t];
        const Diagonal& of = diagonals[touched.part];
        const double mobility = of.mobility[touched.phyxel];
        touched.own = touched.bound = touched.inverse = 0;
        if (!(mobility > 0) || (!of.fixed.empty() && of.fixed[touched.phyxel] != 0)) continue;
        touched.own = static_cast<float>(1 / mobility);
        float sum = touched.own;
        for (std::uint32_t e = touched.first; e < touched_[t + 1].first; ++e)
            sum += std::abs(by_phyxel_[e].weight) * force_[by_phyxel_[e].at][0];
        touched.bound = 1 / sum;
        touched.inverse = static_cast<float>(of.inverse[touched.phyxel]);
    }
}

void ContactProducts::take_in(std::span<const RowPart> parts, std::vector<Packed>& to) const {
    for (std::size_t t = 0; t < touched_count_; ++t) {
        const RowPart& part = parts[touched_[t].part];
        const float* const in = part.in + touched_[t].phyxel;
        to[t] = Packed(in[0], in[part.stride], in[2 * part.stride], 0);
    }
}

// Forces of the springs by their phyxels' ways; returns the product of both.
double ContactProducts::push(const std::vector<Packed>& ways, const Parallel& parallel) {
    return sum_(parallel, spring_count_, product_grain, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t s = begin; s < end; ++s) {
            const Spring& spring = springs_[s];
            Packed way = Packed::Zero();
            for (std::uint32_t e = spring.first; e < springs_[s + 1].first; ++e)
                way += ends_[e].weight * ways[ends_[e].at];
            force_[s] = spring.across * way + (spring.beyond * spring.normal.dot(way)) * spring.normal;
            sum += static_cast<double>(way.dot(force_[s]));
        }
        return sum;
    });
}

ContactProducts::Packed ContactProducts::pushed(std::size_t touched) const {
    Packed sum = Packed::Zero();
    for (std::uint32_t e = touched_[touched].first; e < touched_[touched + 1].first; ++e)
        sum += by_phyxel_[e].weight * force_[by_phyxel_[e].at];
    return sum;
}

double ContactProducts::apply(std::span<const RowPart> parts, const Parallel& parallel) {
    take_in(parts, way_);
    const double product = push(way_, parallel);
    const auto sum_up = [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) {
            const Packed sum = pushed(t);
            const RowPart& part = parts[touched_[t].part];
            for (int k = 0; k < 3; ++k)
                part.out[static_cast<std::size_t>(k) * part.stride + touched_[t].phyxel] += sum[k];
        }
    };
    parallel.for_chunks(touched_count_, product_grain, std::cref(sum_up));
    return product;
}

double ContactProducts::smooth(std::span<const RowPart> parts, const Parallel& parallel) {
    take_in(parts, residual_);
    for (std::size_t t = 0; t < touched_count_; ++t)
        smooth_[t] = move_[t] = recurrence.fresh[0] * touched_[t].bound * residual_[t];
    for (std::size_t k = 1; k < steps; ++k) {
        push(smooth_, parallel);
        const auto move = [&](std::size_t begin, std::size_t end) {
            for (std::size_t t = begin; t < end; ++t) {
                const Packed left = residual_[t] - touched_[t].own * smooth_[t] - pushed(t);
                move_[t] = recurrence.again[k] * move_[t] + recurrence.fresh[k] * touched_[t].bound * left;
                smooth_[t] += move_[t];
            }
        };
        parallel.for_chunks(touched_count_, product_grain, std::cref(move));
    }
    double product = 0;
    for (std::size_t t = 0; t < touched_count_; ++t) {
        smooth_[t] -= touched_[t].inverse * residual_[t];
        product += static_cast<double>(smooth_[t].dot(residual_[t]));
    }
    return product;
}

void ContactProducts::add_smoothed(std::span<const RowPart> parts) const {
    for (std::size_t t = 0; t < touched_count_; ++t) {
        const RowPart& part = parts[touched_[t].part];
        for (int k = 0; k < 3; ++k)
            part.out[static_cast<std::size_t>(k) * part.stride + touched_[t].phyxel] += smooth_[t][k];
    }
}

}  // namespace splitcubes::meshless
