#include <splitcubes/dynamics/implicit/block_jacobi.h>
#include <splitcubes/dynamics/tuning.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <functional>
#include <limits>

namespace splitcubes::meshless {

namespace {

// Splits indices at the median along the longest side of their box until at most `most` are left.
template <class Act>
void bisect(std::span<std::uint32_t> indices, std::span<const Vec3> position, std::size_t most,
            const Act& act) {
    if (indices.size() <= most) {
        std::sort(indices.begin(), indices.end());
        return act(indices);
    }
    Vec3 low = position[indices[0]], high = low;
    for (const std::uint32_t i : indices) {
        low = low.cwiseMin(position[i]);
        high = high.cwiseMax(position[i]);
    }
    int axis = 0;
    (high - low).maxCoeff(&axis);
    const auto middle = indices.begin() + static_cast<std::ptrdiff_t>(indices.size() / 2);
    std::nth_element(indices.begin(), middle, indices.end(), [&](std::uint32_t a, std::uint32_t b) {
        return position[a][axis] != position[b][axis] ? position[a][axis] < position[b][axis] : a < b;
    });
    bisect(indices.first(indices.size() / 2), position, most, act);
    bisect(indices.subspan(indices.size() / 2), position, most, act);
}

}  // namespace

void BlockJacobi::find_blocks(std::span<const RigidModes::Part> parts) {
    count_ = 0;
    slot_.resize(parts.size());
    block_of_.resize(parts.size());
    std::vector<std::uint32_t> order;
    for (std::uint32_t p = 0; p < parts.size(); ++p) {
        const std::size_t n = parts[p].position.size();
        const auto aggregates = static_cast<std::int32_t>(parts[p].aggregates.count());
        const std::span<const std::int32_t> index(parts[p].aggregates.index(), n);
        order.clear();
        for (std::uint32_t i = 0; i < n; ++i)
            if (index[i] >= 0 && index[i] < aggregates) order.push_back(i);
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            return index[a] != index[b] ? index[a] < index[b] : a < b;
        });
        slot_[p].assign(n, -1);
        block_of_[p].assign(n, -1);
        const auto add_block = [&](std::span<const std::uint32_t> members) {
            if (blocks_.size() <= count_) blocks_.emplace_back();
            blocks_[count_].members.clear();
            for (const std::uint32_t i : members) {
                block_of_[p][i] = static_cast<std::int32_t>(count_);
                slot_[p][i] = static_cast<std::int32_t>(blocks_[count_].members.size());
                blocks_[count_].members.push_back({p, i});
            }
            ++count_;
        };
        for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
            while (end < order.size() && index[order[end]] == index[order[begin]]) ++end;
            bisect(std::span(order).subspan(begin, end - begin), parts[p].rest_position, max_size, add_block);
        }
    }
}

// Lists the members of blocks that row i sees, by block.
void BlockJacobi::see_row(const RigidModes::Part& part, std::uint32_t p, std::size_t i) {
    const Neighbourhoods& links = part.neighbourhoods;
    seen_.clear();
    const bool is_off_plane = links.has_neighbours_off_plane(i);
    double total = 0, total_height = 0;
    const auto see = [&](std::size_t j, const Vec3& gradient, double weight, double height) {
        if (block_of_[p][j] < 0) return;
        seen_.push_back({static_cast<std::uint32_t>(block_of_[p][j]), 3 * Eigen::Index{slot_[p][j]}, gradient,
                         weight, height});
    };
    for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l) {
        const double weight = part.factor * links.penalty()[i] * links.weight()[l];
        const double height = is_off_plane ? weight * links.basis()[i].col(2).dot(links.rest_edge()[l]) : 0;
        total += weight;
        total_height += height;
        see(links.neighbour()[l], links.gradient()[l], weight, height);
    }
    // The displacement of i itself is subtracted in every link.
    see(i, -links.gradient_sum()[i], total, -total_height);
    std::sort(seen_.begin(), seen_.end(), [](const Seen& a, const Seen& b) { return a.block < b.block; });
}

// Adds the stiffness of row i: V dP : dF less the fitted part of the penalty, and the penalties
// c w_ij |u_j - u_i|^2.
void BlockJacobi::add_row(const RigidModes::Part& part, std::uint32_t p, std::size_t i) {
    const Neighbourhoods& links = part.neighbourhoods;
    if (links.rank()[i] == 0 && links.links_begin(i) == links.links_end(i)) return;
    see_row(part, p, i);
    if (seen_.empty()) return;
    // response[3 a + b]: tension of dH = e_a e_b^T.
    std::array<Mat3, 9> response;
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
            Mat3 dH = Mat3::Zero();
            dH(a, b) = 1;
            response[static_cast<std::size_t>(3 * a + b)] =
                part.factor * part.elastic.tension_change(i, dH, 1 / part.factor);
        }
    const std::int32_t own_block = block_of_[p][i];
    const Eigen::Index own = 3 * Eigen::Index{slot_[p][i]};
    for (std::size_t begin = 0, end = 0; begin < seen_.size(); begin = end) {
        while (end < seen_.size() && seen_[end].block == seen_[begin].block) ++end;
        Eigen::MatrixXf& matrix = blocks_[seen_[begin].block].elastic;
        for (std::size_t k = begin; k < end; ++k) {
            const Eigen::Index column = seen_[k].row;
            // Stress of a unit displacement of member k along s.
            std::array<Mat3, 3> stress;
            for (std::size_t s = 0; s < 3; ++s)
                stress[s] = response[3 * s] * seen_[k].gradient.x() +
                            response[3 * s + 1] * seen_[k].gradient.y() +
                            response[3 * s + 2] * seen_[k].gradient.z();
            for (std::size_t j = begin; j < end; ++j)
                for (std::size_t s = 0; s < 3 && seen_[j].row >= column; ++s)
                    matrix.block<3, 1>(seen_[j].row, column + static_cast<Eigen::Index>(s)) +=
                        (stress[s] * seen_[j].gradient).cast<float>();
            const auto weight = static_cast<float>(seen_[k].weight);
            const bool is_beside_own =
                static_cast<std::int32_t>(seen_[k].block) == own_block && column != own;
            for (Eigen::Index s = 0; s < 3; ++s) {
                matrix(column + s, column + s) += weight;
                if (is_beside_own) matrix(std::max(own, column) + s, std::min(own, column) + s) -= weight;
            }
        }
    }
    if (links.has_neighbours_off_plane(i)) add_off_plane(part, i);
}

// Pull of displacements off the plane of a flat phyxel on its normal, which turns with the strain.
void BlockJacobi::add_off_plane(const RigidModes::Part& part, std::size_t i) {
    const Completion completion = part.elastic.completion(i);
    std::vector<Mat3> turn(seen_.size());  // displacement of a member to minus the turn of the normal
    for (std::size_t k = 0; k < seen_.size(); ++k)
        for (int s = 0; s < 3; ++s)
            turn[k].col(s) = -completion.normal_change(Vec3::Unit(s) * seen_[k].gradient.transpose());
    for (std::size_t k = 0; k < seen_.size(); ++k)
        for (std::size_t j = 0; j < seen_.size(); ++j)
            if (seen_[j].block == seen_[k].block && seen_[j].row >= seen_[k].row)
                blocks_[seen_[k].block].elastic.block<3, 3>(seen_[j].row, seen_[k].row) +=
                    (seen_[j].height * turn[k] + seen_[k].height * turn[j].transpose()).cast<float>();
}

void BlockJacobi::assemble(std::span<const RigidModes::Part> parts) {
    find_blocks(parts);
    for (std::size_t k = 0; k < count_; ++k) {
        Block& block = blocks_[k];
        const auto size = static_cast<Eigen::Index>(3 * block.members.size());
        block.elastic.setZero(size, size);
        for (std::size_t m = 0; m < block.members.size(); ++m)
            for (Eigen::Index s = 0; s < 3; ++s) {
                const Eigen::Index row = 3 * static_cast<Eigen::Index>(m) + s;
                block.elastic(row, row) =
                    static_cast<float>(parts[block.members[m].part].inertia[block.members[m].phyxel]);
            }
        block.is_factorised = false;
    }
    for (std::uint32_t p = 0; p < parts.size() && count_ > 0; ++p)
        for (std::size_t i = 0; i < parts[p].position.size(); ++i) add_row(parts[p], p, i);
    is_assembled_ = true;
}

void BlockJacobi::add_springs(const ContactProducts& springs) {
    struct Side {
        std::size_t block = 0;
        Eigen::Index row = 0;
        double weight = 0;
    };
    std::vector<Side> sides;
    springs.each_spring([&](const ContactProducts::SpringView& spring) {
        sides.clear();
        for (std::size_t e = 0; e < spring.count; ++e) {
            const auto [part, phyxel, weight] = spring.incidence(e);
            const std::int32_t block = block_of_[part][phyxel];
            if (block >= 0)
                sides.push_back(
                    {static_cast<std::size_t>(block), 3 * Eigen::Index{slot_[part][phyxel]}, weight});
        }
        const Mat3 stiffness = spring.stiffness();
        for (const Side& a : sides)
            for (const Side& b : sides)
                if (a.block == b.block && a.row >= b.row)
                    blocks_[a.block].springs.push_back(
                        {a.row, b.row, (a.weight * b.weight * stiffness).cast<float>()});
    });
}

// Returns whether the factors of a block lack its springs; small changes of stiffness hardly matter.
bool BlockJacobi::have_springs_changed(const Block& block) {
    if (block.springs.size() != block.factor_springs.size()) return true;
    double sum = 0, change = 0;
    for (std::size_t k = 0; k < block.springs.size(); ++k) {
        const SpringTerm &now = block.springs[k], &then = block.factor_springs[k];
        if (now.row != then.row || now.column != then.column) return true;
        sum += static_cast<double>(now.stiffness.norm());
        change += static_cast<double>((now.stiffness - then.stiffness).norm());
    }
    return change > tuning::solve::reweighing_share * sum;
}

void BlockJacobi::factorise(Block& block) {
    if (block.is_factorised && !have_springs_changed(block)) return;
    block.factor = block.elastic;
    for (const SpringTerm& term : block.springs)
        block.factor.block<3, 3>(term.row, term.column) += term.stiffness;
    const Eigen::Index size = block.factor.rows();
    block.scale =
        block.factor.diagonal().cwiseMax(std::numeric_limits<float>::min()).cwiseInverse().cwiseSqrt();
    for (Eigen::Index column = 0; column < size; ++column) {
        block.factor.col(column).tail(size - column).array() *=
            block.scale(column) * block.scale.tail(size - column).array();
        block.factor(column, column) += tuning::solve::block_shift;
    }
    // In place.
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXf>> factorisation(block.factor);
    block.is_positive = factorisation.info() == Eigen::Success && block.factor.diagonal().allFinite() &&
                        block.scale.allFinite();
    block.factor_springs = block.springs;
    block.is_factorised = true;
}

void BlockJacobi::build(std::span<const RigidModes::Part> parts, const ContactProducts* springs,
                        const Parallel& parallel) {
    if (!is_assembled_) assemble(parts);
    for (std::size_t k = 0; k < count_; ++k) blocks_[k].springs.clear();
    if (springs != nullptr) add_springs(*springs);
    const auto act = [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) factorise(blocks_[k]);
    };
    parallel.for_chunks(count_, tuning::grains::blocks, std::cref(act));
    is_built_ = true;
}

double BlockJacobi::correct(std::span<const ContactProducts::RowPart> rows, const Parallel& parallel) {
    const auto act = [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            Block& block = blocks_[k];
            if (!block.is_positive) continue;
            block.residual.resize(static_cast<Eigen::Index>(3 * block.members.size()));
            for (std::size_t m = 0; m < block.members.size(); ++m) {
                const ContactProducts::RowPart& row = rows[block.members[m].part];
                const float* const in = row.in + block.members[m].phyxel;
                block.residual.segment<3>(3 * static_cast<Eigen::Index>(m)) =
                    Vec3f(in[0], in[row.stride], in[2 * row.stride]);
            }
            block.solution = block.scale.cwiseProduct(block.residual);
            block.factor.triangularView<Eigen::Lower>().solveInPlace(block.solution);
            block.factor.transpose().triangularView<Eigen::Upper>().solveInPlace(block.solution);
            block.solution.array() *= block.scale.array();
        }
    };
    parallel.for_chunks(count_, tuning::grains::blocks, std::cref(act));
    double product = 0;
    for (std::size_t k = 0; k < count_; ++k)
        if (blocks_[k].is_positive)
            product += static_cast<double>(blocks_[k].residual.dot(blocks_[k].solution));
    return product;
}

void BlockJacobi::add_correction(std::span<const ContactProducts::RowPart> rows,
                                 const Parallel& parallel) const {
    const auto act = [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const Block& block = blocks_[k];
            if (!block.is_positive) continue;
            for (std::size_t m = 0; m < block.members.size(); ++m) {
                const ContactProducts::RowPart& row = rows[block.members[m].part];
                for (std::size_t s = 0; s < 3; ++s)
                    row.out[s * row.stride + block.members[m].phyxel] +=
                        block.solution[static_cast<Eigen::Index>(3 * m + s)];
            }
        }
    };
    parallel.for_chunks(count_, tuning::grains::blocks, std::cref(act));
}

}  // namespace splitcubes::meshless
