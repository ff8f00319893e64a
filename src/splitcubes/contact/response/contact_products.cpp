#include <splitcubes/contact/response/contact_products.h>
#include <splitcubes/contact/response/tuning.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace splitcubes::meshless {

namespace {

// Chebyshev recurrence: each update is `previous` times the last one plus `residual` times D^-1 of the
// residual.
struct Recurrence {
    std::array<float, tuning::preconditioner::chebyshev_iterations> previous{}, residual{};
};
constexpr Recurrence make_recurrence() {
    constexpr double middle = 0.5 * (tuning::preconditioner::max_eigenvalue +
                                     tuning::preconditioner::min_eigenvalue),
                     half = 0.5 *
                            (tuning::preconditioner::max_eigenvalue - tuning::preconditioner::min_eigenvalue);
    Recurrence out;
    out.residual[0] = static_cast<float>(1 / middle);
    double rho = half / middle;
    for (std::size_t k = 1; k < tuning::preconditioner::chebyshev_iterations; ++k) {
        const double next = 1 / (2 * middle / half - rho);
        out.previous[k] = static_cast<float>(next * rho);
        out.residual[k] = static_cast<float>(2 * next / half);
        rho = next;
    }
    return out;
}
constexpr Recurrence recurrence = make_recurrence();

}  // namespace

void ContactProducts::clear(std::span<const std::size_t> phyxels) {
    for (std::size_t t = 0; t < touched_count_; ++t) slot_[touched_[t].part][touched_[t].phyxel] = 0;
    for (auto* list : {&incidences_, &by_phyxel_}) list->clear();
    springs_.clear();
    touched_.clear();
    spring_count_ = touched_count_ = 0;
    slot_.resize(phyxels.size());
    for (std::size_t p = 0; p < phyxels.size(); ++p) slot_[p].resize(phyxels[p], 0);
}

void ContactProducts::add_incidence(std::uint32_t part, std::uint32_t phyxel, double weight) {
    std::uint32_t& slot = slot_[part][phyxel];
    if (slot == 0) {
        touched_.push_back({part, phyxel});
        slot = static_cast<std::uint32_t>(touched_.size());
    }
    ++touched_[slot - 1].first;
    incidences_.push_back({slot - 1, static_cast<float>(weight)});
}

void ContactProducts::add(const Contact& contact, double along, double across) {
    Spring spring;
    spring.normal.head<3>() = contact.normal.cast<float>();
    spring.first = static_cast<std::uint32_t>(incidences_.size());
    springs_.push_back(spring);
    set(springs_.size() - 1, along, across);
    double sign = 1;
    for (const ContactSide* side : {&contact.upper, &contact.lower}) {
        for (std::uint32_t k = 0; k < side->count; ++k)
            add_incidence(side->part, side->phyxel[k], sign * side->weight[k]);
        sign = -1;
    }
}

void ContactProducts::add(const HandleSpring& handle_spring, double stiffness) {
    Spring spring;
    spring.across = static_cast<float>(stiffness);
    spring.first = static_cast<std::uint32_t>(incidences_.size());
    springs_.push_back(spring);
    add_incidence(handle_spring.part, handle_spring.phyxel, 1);
}

void ContactProducts::set(std::size_t spring, double along, double across) {
    springs_[spring].across = static_cast<float>(across);
    springs_[spring].extra_along = static_cast<float>(along - across);
}

// Lists the springs by phyxel, so that each phyxel sums its own forces.
void ContactProducts::finish() {
    spring_count_ = springs_.size();
    touched_count_ = touched_.size();
    springs_.emplace_back().first = static_cast<std::uint32_t>(incidences_.size());
    std::uint32_t end = 0;
    for (Touched& t : touched_) t.first = end += t.first;
    touched_.push_back({0, 0, end});
    by_phyxel_.resize(incidences_.size());
    for (std::size_t s = spring_count_; s-- > 0;)
        for (std::uint32_t e = springs_[s + 1].first; e-- > springs_[s].first;)
            by_phyxel_[--touched_[incidences_[e].index].first] = {static_cast<std::uint32_t>(s),
                                                                  incidences_[e].weight};
    force_.resize(spring_count_);
    for (auto* array : {&displacement_, &residual_, &smooth_, &update_}) array->resize(touched_count_);
}

// D bounds E + C by absolute row sums (Gershgorin), over both sides of each spring.
void ContactProducts::set_diagonals(std::span<const Diagonal> diagonals) {
    for (std::size_t s = 0; s < spring_count_; ++s) {
        float sum = 0;
        for (std::uint32_t e = springs_[s].first; e < springs_[s + 1].first; ++e)
            sum += std::abs(incidences_[e].weight);
        force_[s][0] = sum * (springs_[s].across + std::max(0.0F, springs_[s].extra_along));
    }
    for (std::size_t t = 0; t < touched_count_; ++t) {
        Touched& touched = touched_[t];
        const Diagonal& diagonal = diagonals[touched.part];
        const double mobility = diagonal.mobility[touched.phyxel];
        touched.own_diagonal = touched.bound = touched.inverse = 0;
        if (!(mobility > 0) || (!diagonal.fixed.empty() && diagonal.fixed[touched.phyxel] != 0)) continue;
        touched.own_diagonal = static_cast<float>(1 / mobility);
        float sum = touched.own_diagonal;
        for (std::uint32_t e = touched.first; e < touched_[t + 1].first; ++e)
            sum += std::abs(by_phyxel_[e].weight) * force_[by_phyxel_[e].index][0];
        touched.bound = 1 / sum;
        touched.inverse = static_cast<float>(diagonal.inverse[touched.phyxel]);
    }
}

void ContactProducts::read_rows(std::span<const RowPart> parts, std::vector<Packed>& to) const {
    for (std::size_t t = 0; t < touched_count_; ++t) {
        const RowPart& part = parts[touched_[t].part];
        const float* const in = part.in + touched_[t].phyxel;
        to[t] = Packed(in[0], in[part.stride], in[2 * part.stride], 0);
    }
}

// Computes the spring forces for displacements of the touched phyxels; returns the product of both.
double ContactProducts::compute_forces(const std::vector<Packed>& displacements, const Parallel& parallel) {
    constexpr std::size_t grain = tuning::grains::contact_products;
    return sum_(parallel, spring_count_, grain, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t s = begin; s < end; ++s) {
            const Spring& spring = springs_[s];
            Packed displacement = Packed::Zero();
            for (std::uint32_t e = spring.first; e < springs_[s + 1].first; ++e)
                displacement += incidences_[e].weight * displacements[incidences_[e].index];
            force_[s] = spring.across * displacement +
                        (spring.extra_along * spring.normal.dot(displacement)) * spring.normal;
            sum += static_cast<double>(displacement.dot(force_[s]));
        }
        return sum;
    });
}

ContactProducts::Packed ContactProducts::sum_forces(std::size_t touched) const {
    Packed sum = Packed::Zero();
    for (std::uint32_t e = touched_[touched].first; e < touched_[touched + 1].first; ++e)
        sum += by_phyxel_[e].weight * force_[by_phyxel_[e].index];
    return sum;
}

double ContactProducts::apply(std::span<const RowPart> parts, const Parallel& parallel) {
    read_rows(parts, displacement_);
    const double product = compute_forces(displacement_, parallel);
    const auto sum_up = [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) {
            const Packed sum = sum_forces(t);
            const RowPart& part = parts[touched_[t].part];
            for (int k = 0; k < 3; ++k)
                part.out[static_cast<std::size_t>(k) * part.stride + touched_[t].phyxel] += sum[k];
        }
    };
    parallel.for_chunks(touched_count_, tuning::grains::contact_products, std::cref(sum_up));
    return product;
}

double ContactProducts::smooth(std::span<const RowPart> parts, const Parallel& parallel) {
    read_rows(parts, residual_);
    for (std::size_t t = 0; t < touched_count_; ++t)
        smooth_[t] = update_[t] = recurrence.residual[0] * touched_[t].bound * residual_[t];
    for (std::size_t k = 1; k < tuning::preconditioner::chebyshev_iterations; ++k) {
        compute_forces(smooth_, parallel);
        const auto update = [&](std::size_t begin, std::size_t end) {
            for (std::size_t t = begin; t < end; ++t) {
                const Packed residual = residual_[t] - touched_[t].own_diagonal * smooth_[t] - sum_forces(t);
                update_[t] = recurrence.previous[k] * update_[t] +
                             recurrence.residual[k] * touched_[t].bound * residual;
                smooth_[t] += update_[t];
            }
        };
        parallel.for_chunks(touched_count_, tuning::grains::contact_products, std::cref(update));
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
