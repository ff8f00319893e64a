#include <splitcubes/dynamics/implicit/rigid_modes.h>
#include <splitcubes/dynamics/tuning.h>
#include <splitcubes/math/cross_matrix.h>
#include <splitcubes/samples/loops.h>

#include <algorithm>
#include <functional>

namespace splitcubes::meshless {

namespace {

// Displacements by the six modes of an aggregate at an arm from its centre: [I, -[arm]x].
Eigen::Matrix<double, 3, 6> modes_at(const Vec3& arm) {
    Eigen::Matrix<double, 3, 6> out;
    out << Mat3::Identity(), -cross_matrix(arm);
    return out;
}

}  // namespace

RigidModes::Block& RigidModes::block(std::uint32_t row, std::uint32_t column) {
    for (Entry& entry : blocks_[row])
        if (entry.column == column) return entry.block;
    return blocks_[row].emplace_back(Entry{column, Block::Zero()}).block;
}

// Adds a block and its transpose; one triangle is kept.
void RigidModes::add_pair(std::uint32_t a, std::uint32_t b, const Block& sum) {
    if (a >= b)
        block(a, b) += sum;
    else
        block(b, a) += sum.transpose();
}

void RigidModes::find_centres(std::span<const Part> parts) {
    std::uint32_t count = 0;
    first_.clear();
    for (const Part& part : parts) {
        first_.push_back(count);
        count += static_cast<std::uint32_t>(part.aggregates.count());
    }
    centre_.assign(count, Vec3::Zero());
    std::vector<std::size_t> phyxels(count, 0);
    index_.resize(parts.size());
    arm_.resize(parts.size());
    for (std::size_t p = 0; p < parts.size(); ++p) {
        const std::size_t n = parts[p].position.size();
        index_[p].assign(n, -1);
        arm_[p].assign(n, Vec3::Zero());
        for (std::size_t i = 0; i < n; ++i) {
            const std::int32_t k = parts[p].aggregates.index()[i];
            if (k < 0 || static_cast<std::size_t>(k) >= parts[p].aggregates.count()) continue;
            index_[p][i] = static_cast<std::int32_t>(first_[p]) + k;
            centre_[static_cast<std::size_t>(index_[p][i])] += parts[p].position[i];
            ++phyxels[static_cast<std::size_t>(index_[p][i])];
        }
    }
    first_member_.assign(count + 1, 0);
    for (std::size_t c = 0; c < count; ++c) {
        if (phyxels[c] > 0) centre_[c] /= static_cast<double>(phyxels[c]);
        first_member_[c + 1] = first_member_[c] + phyxels[c];
    }
    member_.resize(first_member_.back());
    std::vector<std::size_t> next(first_member_.begin(), first_member_.end() - 1);
    for (std::size_t p = 0; p < parts.size(); ++p)
        for (std::size_t i = 0; i < index_[p].size(); ++i) {
            if (index_[p][i] < 0) continue;
            const auto own = static_cast<std::size_t>(index_[p][i]);
            arm_[p][i] = parts[p].position[i] - centre_[own];
            member_[next[own]++] = {static_cast<std::uint32_t>(p), static_cast<std::uint32_t>(i)};
        }
}

// Sums what row i sees of each aggregate. Returns whether its strain in the rigid motions counts.
bool RigidModes::see_row(const Part& part, std::uint32_t p, std::size_t i) {
    const Neighbourhoods& links = part.neighbourhoods;
    const std::int32_t own = index_[p][i];
    bool counts = links.rank()[i] < 3 || part.elastic.twist(i).trace() > 0;
    for (std::uint32_t l = links.links_begin(i); l < links.links_end(i) && !counts; ++l)
        counts = index_[p][links.neighbour()[l]] != own && links.weight()[l] > 0;
    if (!counts || links.rank()[i] == 0) return false;
    seen_.clear();
    const auto seen_of = [&](std::int32_t aggregate) -> Seen& {
        for (Seen& seen : seen_)
            if (seen.aggregate == static_cast<std::uint32_t>(aggregate)) return seen;
        return seen_.emplace_back(Seen{static_cast<std::uint32_t>(aggregate)});
    };
    const bool is_off_plane = links.has_neighbours_off_plane(i);
    double total_height = 0;
    for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l) {
        const std::uint32_t j = links.neighbour()[l];
        const double w = links.penalty()[i] * links.weight()[l];
        if (index_[p][j] < 0) continue;
        Seen& seen = seen_of(index_[p][j]);
        const Vec3& arm = arm_[p][j];
        seen.gradient += links.gradient()[l];
        seen.arm_gradient += arm * links.gradient()[l].transpose();
        seen.weight += w;
        seen.arm += w * arm;
        seen.arm_square += w * arm * arm.transpose();
        if (!is_off_plane) continue;
        const double height = w * links.basis()[i].col(2).dot(links.rest_edge()[l]);
        seen.height += height;
        seen.height_arm += height * arm;
        total_height += height;
    }
    if (own < 0) return true;
    // The displacement of i itself, subtracted in every link; add_penalty knows its weight.
    Seen& seen = seen_of(own);
    seen.gradient -= links.gradient_sum()[i];
    seen.arm_gradient -= arm_[p][i] * links.gradient_sum()[i].transpose();
    seen.height -= total_height;
    seen.height_arm -= total_height * arm_[p][i];
    return true;
}

// Penalties sum_j c w_ij |u_j - u_i|^2 of row i, without the fitted part.
void RigidModes::add_penalty(const Part& part, std::uint32_t p, std::size_t i) {
    const std::int32_t own = index_[p][i];
    const Modes at = own >= 0 ? modes_at(arm_[p][i]) : Modes::Zero();
    double weight = 0;
    const Neighbourhoods& links = part.neighbourhoods;
    for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l)
        weight += links.penalty()[i] * links.weight()[l];
    if (own >= 0)
        add_pair(static_cast<std::uint32_t>(own), static_cast<std::uint32_t>(own),
                 part.factor * weight * at.transpose() * at);
    for (const Seen& seen : seen_) {
        Block square = Block::Zero();
        square.topLeftCorner<3, 3>() = seen.weight * Mat3::Identity();
        square.topRightCorner<3, 3>() = -cross_matrix(seen.arm);
        square.bottomLeftCorner<3, 3>() = cross_matrix(seen.arm);
        square.bottomRightCorner<3, 3>() = seen.arm_square.trace() * Mat3::Identity() - seen.arm_square;
        add_pair(seen.aggregate, seen.aggregate, part.factor * square);
        if (own < 0) continue;
        Modes sum;
        sum << seen.weight * Mat3::Identity(), -cross_matrix(seen.arm);
        const Block cross = -part.factor * at.transpose() * sum;  // own x seen
        if (seen.aggregate == static_cast<std::uint32_t>(own))
            add_pair(seen.aggregate, seen.aggregate, cross + cross.transpose());
        else
            add_pair(static_cast<std::uint32_t>(own), seen.aggregate, cross);
    }
}

void RigidModes::add_row(const Part& part, std::uint32_t p, std::size_t i) {
    if (!see_row(part, p, i)) return;
    add_penalty(part, p, i);
    std::vector<Gradients> strain(seen_.size()), stress(seen_.size());
    for (std::size_t k = 0; k < seen_.size(); ++k)
        for (int m = 0; m < 6; ++m) {
            Mat3 dF = Mat3::Zero();
            if (m < 3)
                dF.row(m) = seen_[k].gradient.transpose();
            else
                dF = cross_matrix(Vec3::Unit(m - 3)) * seen_[k].arm_gradient;
            strain[k].col(m) = dF.reshaped();
            stress[k].col(m) = (part.factor * part.elastic.tension_change(i, dF, 1 / part.factor)).reshaped();
        }
    for (std::size_t a = 0; a < seen_.size(); ++a)
        for (std::size_t b = 0; b <= a; ++b)
            add_pair(seen_[a].aggregate, seen_[b].aggregate, strain[a].transpose() * stress[b]);
    if (part.neighbourhoods.has_neighbours_off_plane(i)) add_off_plane(part, i, strain);
}

// Pull of displacements off the plane of a flat phyxel on its normal, which turns with the strain.
void RigidModes::add_off_plane(const Part& part, std::size_t i, std::span<const Gradients> strain) {
    const Completion completion = part.elastic.completion(i);
    std::vector<Modes> turn(seen_.size()), pull(seen_.size());
    for (std::size_t k = 0; k < seen_.size(); ++k) {
        for (int m = 0; m < 6; ++m)
            turn[k].col(m) = -completion.normal_change(Mat3(strain[k].col(m).reshaped(3, 3)));
        pull[k] << part.factor * seen_[k].height * Mat3::Identity(),
            -part.factor * cross_matrix(seen_[k].height_arm);
    }
    for (std::size_t a = 0; a < seen_.size(); ++a)
        for (std::size_t b = 0; b <= a; ++b)
            add_pair(seen_[a].aggregate, seen_[b].aggregate,
                     turn[a].transpose() * pull[b] + pull[a].transpose() * turn[b]);
}

void RigidModes::add_inertia(const Part& part, std::uint32_t p) {
    for (std::size_t i = 0; i < part.position.size(); ++i) {
        if (index_[p][i] < 0) continue;
        const auto own = static_cast<std::uint32_t>(index_[p][i]);
        const Modes at = modes_at(arm_[p][i]);
        block(own, own) += part.inertia[i] * at.transpose() * at;
    }
}

void RigidModes::add_springs(const ContactProducts& springs) {
    std::vector<std::pair<std::uint32_t, Modes>> sides;
    springs.each_spring([&](const ContactProducts::SpringView& spring) {
        sides.clear();
        for (std::size_t e = 0; e < spring.count; ++e) {
            const auto [part, phyxel, weight] = spring.incidence(e);
            const std::int32_t own = index_[part][phyxel];
            if (own < 0) continue;
            auto at = std::find_if(sides.begin(), sides.end(), [&](const auto& side) {
                return side.first == static_cast<std::uint32_t>(own);
            });
            if (at == sides.end()) at = sides.insert(at, {static_cast<std::uint32_t>(own), Modes::Zero()});
            at->second += weight * modes_at(arm_[part][phyxel]);
        }
        const Mat3 stiffness = spring.stiffness();
        for (std::size_t a = 0; a < sides.size(); ++a)
            for (std::size_t b = 0; b <= a; ++b)
                add_pair(sides[a].first, sides[b].first,
                         sides[a].second.transpose() * stiffness * sides[b].second);
    });
}

bool RigidModes::factorise() {
    const auto size = static_cast<Eigen::Index>(6 * centre_.size());
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t row = 0; row < blocks_.size(); ++row)
        for (const Entry& entry : blocks_[row])
            for (int r = 0; r < 6; ++r)
                for (int c = 0; c < 6; ++c)
                    if (entry.column != row || c <= r)
                        entries.emplace_back(static_cast<int>(6 * row) + r,
                                             static_cast<int>(6 * entry.column) + c, entry.block(r, c));
    // Rotations of single phyxels and lines have no stiffness.
    for (std::size_t row = 0; row < blocks_.size(); ++row) {
        const Block& own = block(static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(row));
        const double shift = own.topLeftCorner<3, 3>().trace(), turn = own.bottomRightCorner<3, 3>().trace();
        for (int r = 0; r < 6; ++r)
            entries.emplace_back(static_cast<int>(6 * row) + r, static_cast<int>(6 * row) + r,
                                 r < 3      ? 1e-9 * shift
                                 : turn > 0 ? 1e-6 * turn
                                            : 1.0);
    }
    matrix_.resize(size, size);
    matrix_.setFromTriplets(entries.begin(), entries.end());
    factors_.compute(matrix_);
    return factors_.info() == Eigen::Success && factors_.vectorD().allFinite() &&
           factors_.vectorD().minCoeff() > 0;
}

void RigidModes::assemble(std::span<const Part> parts) {
    find_centres(parts);
    blocks_.assign(centre_.size(), {});
    for (std::uint32_t p = 0; p < parts.size(); ++p) {
        add_inertia(parts[p], p);
        for (std::size_t i = 0; i < parts[p].position.size(); ++i) add_row(parts[p], p, i);
    }
    elastic_blocks_ = blocks_;
    is_assembled_ = true;
}

bool RigidModes::build(std::span<const Part> parts, const ContactProducts* springs) {
    if (!is_assembled_)
        assemble(parts);
    else
        blocks_ = elastic_blocks_;
    if (springs != nullptr) add_springs(*springs);
    is_built_ = factorise();
    return is_built_;
}

double RigidModes::correct(std::span<const ContactProducts::RowPart> rows, const Parallel& parallel) {
    sum_.resize(static_cast<Eigen::Index>(6 * centre_.size()));
    const auto sum_up = [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) {
            Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
            for (std::size_t m = first_member_[c]; m < first_member_[c + 1]; ++m) {
                const auto [p, i] = member_[m];
                const float* const in = rows[p].in + i;
                const Vec3 r(in[0], in[rows[p].stride], in[2 * rows[p].stride]);
                force += r;
                torque += arm_[p][i].cross(r);
            }
            sum_.segment<3>(static_cast<Eigen::Index>(6 * c)) = force;
            sum_.segment<3>(static_cast<Eigen::Index>(6 * c + 3)) = torque;
        }
    };
    parallel.for_chunks(centre_.size(), tuning::grains::aggregates, std::cref(sum_up));
    solution_ = factors_.solve(sum_);
    return sum_.dot(solution_);
}

void RigidModes::add_correction(std::span<const ContactProducts::RowPart> rows,
                                const Parallel& parallel) const {
    for (std::size_t p = 0; p < rows.size(); ++p)
        for_phyxels(parallel, index_[p].size(), [&](std::size_t i) {
            if (index_[p][i] < 0) return;
            const Eigen::Index own = 6 * index_[p][i];
            const Vec3 displacement =
                solution_.segment<3>(own) + Vec3(solution_.segment<3>(own + 3)).cross(arm_[p][i]);
            for (std::size_t k = 0; k < 3; ++k)
                rows[p].out[k * rows[p].stride + i] += static_cast<float>(displacement[static_cast<int>(k)]);
        });
}

}  // namespace splitcubes::meshless
