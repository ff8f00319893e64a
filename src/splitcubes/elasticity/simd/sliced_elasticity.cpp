#include <splitcubes/elasticity/simd/sliced_elasticity.h>
#include <splitcubes/elasticity/tuning.h>
#include <splitcubes/math/decompose.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

namespace splitcubes::meshless {

namespace {

constexpr std::size_t lanes = LinkSlices::lanes;

}  // namespace

SliceState SlicedElasticity::arrays() {
    SliceState state;
    state.high = high_.data();
    state.low = low_.data();
    state.gradient = gradient_.data();
    state.turn = turn_.data();
    state.twist = twists_.stiffness.data();
    state.twist_sum = twists_.sum.data();
    state.distortion = twists_.distortion.data();
    state.majorizer = twists_.majorizer.data();
    state.tension = tension_.data();
    state.penalty = penalty_.data();
    state.fallback = fallback_.data();
    return state;
}

SliceState SlicedElasticity::arrays_of_tangents() {
    SliceState state = arrays();
    if (frame_.is_rotated) state.turn = frame_.turn.data();
    return state;
}

// The mean of some rotations, the same for the same motion of the body at another place and orientation.
void SlicedElasticity::choose_frame(const Configuration& configuration) {
    const std::span<const Mat3> rotations = configuration.last_rotation;
    frame_.world.setIdentity();
    if (configuration.is_rotated && !rotations.empty()) {
        const std::size_t stride =
            (rotations.size() + tuning::links::frame_samples - 1) / tuning::links::frame_samples;
        Mat3 sum = Mat3::Zero();
        bool is_uniform = true;
        for (std::size_t i = 0; i < rotations.size(); i += stride) {
            sum += rotations[i];
            is_uniform = is_uniform && rotations[i] == rotations[0];
        }
        frame_.world = is_uniform ? rotations[0] : rotation_of(sum, rotations[0]);
        if (!frame_.world.allFinite()) frame_.world.setIdentity();
    }
    frame_.is_rotated = !frame_.world.isIdentity(0);
    if (frame_.is_rotated) frame_.turn.resize(9 * stride());
}

// Writes the rotation of phyxel i in the world. Tangents are used in the world: their rounding errors change
// how a solve converges, not its result.
void SlicedElasticity::turn_to_world(std::size_t i) {
    set_matrix(frame_.turn, i, frame_.world * (Mat3::Identity() + matrix_at(turn_, i)) - Mat3::Identity());
}

void SlicedElasticity::size_buffers(const Neighbourhoods& neighbourhoods, const Material& material) {
    neighbourhoods_ = &neighbourhoods;
    slices_ = &neighbourhoods.slices();
    material_ = material;
    corotated_ = is_frame_sufficient(material);
    const std::size_t n = stride();
    // Rows past the last phyxel must stay zero.
    const auto size = [](FloatArray& array, std::size_t length) {
        if (array.size() != length) array.assign(length, 0);
    };
    for (FloatArray* array : {&high_, &low_, &penalty_, &direction_, &force_}) size(*array, 3 * n);
    for (FloatArray* array : {&gradient_, &turn_, &tension_}) size(*array, 9 * n);
    size(twists_.stiffness, 6 * n);
    size(twists_.sum, 2 * n);
    for (FloatArray* array : {&twists_.distortion, &twists_.majorizer, &diagonal_, &energy_}) size(*array, n);
    fallback_.resize(slice_count());
    energies_.row.resize(n);
    deformation_.resize(neighbourhoods.size());
    rotation_.resize(neighbourhoods.size());
    if (!corotated_) tangent_.resize(neighbourhoods.size());
    list_off_plane_rows();
}

Mat3 SlicedElasticity::matrix_at(const FloatArray& array, std::size_t i) const {
    const std::size_t n = stride();
    Mat3 out;
    for (std::size_t k = 0; k < 9; ++k)
        out(static_cast<int>(k / 3), static_cast<int>(k % 3)) = static_cast<double>(array[k * n + i]);
    return out;
}

void SlicedElasticity::set_matrix(FloatArray& array, std::size_t i, const Mat3& matrix) const {
    const std::size_t n = stride();
    for (std::size_t k = 0; k < 9; ++k)
        array[k * n + i] = static_cast<float>(matrix(static_cast<int>(k / 3), static_cast<int>(k % 3)));
}

void SlicedElasticity::set_symmetric(FloatArray& array, std::size_t i, const Mat3& matrix) const {
    std::size_t at = i;
    for (int r = 0; r < 3; ++r)
        for (int c = r; c < 3; ++c, at += stride()) array[at] = static_cast<float>(matrix(r, c));
}

// Stores displacements relative to the first phyxel's, in the frame, as high + low, exact to about 48 bits.
void SlicedElasticity::take_displacement(const Configuration& configuration, const Parallel& parallel) {
    const std::size_t rows = slices_->row_count(), n = stride();
    if (rows == 0) return;
    const Vec3 start = configuration.position[0], rest_start = configuration.rest_position[0];
    const Vec3 first = start - rest_start;
    const Mat3 to_frame = frame_.world.transpose();
    for_phyxels(parallel, rows, [&](std::size_t i) {
        const Vec3 moved = frame_.is_rotated
                               ? Vec3(to_frame * (configuration.position[i] - start) -
                                      (configuration.rest_position[i] - rest_start))
                               : Vec3(configuration.position[i] - configuration.rest_position[i] - first);
        for (int k = 0; k < 3; ++k) {
            const double u =
                std::clamp(moved[k], -tuning::links::max_displacement, tuning::links::max_displacement);
            const auto high = static_cast<float>(u);
            const std::size_t at = static_cast<std::size_t>(k) * n + i;
            high_[at] = high;
            low_[at] = static_cast<float>(u - static_cast<double>(high));
        }
    });
}

// Computes F, R and tension of one phyxel in double precision. Returns false if they are not finite.
bool SlicedElasticity::take_row(const Configuration& configuration, std::size_t i) {
    const Mat3 H = matrix_at(gradient_, i);
    Mat3 F, R;
    bool finite = complete_deformation(*neighbourhoods_, i, H,
                                       frame_.world.transpose() * configuration.last_rotation[i], F, R);
    const Mat3 plastic =
        resolved_plastic_strain(*neighbourhoods_, material_, i, configuration.plastic_strain);
    Mat3 tension = neighbourhoods_->volume()[i] * piola_stress(material_, F, R, plastic) -
                   neighbourhoods_->penalty()[i] * H * neighbourhoods_->moment()[i];
    if (!tension.allFinite() || !(tension.cwiseAbs().sum() < 1e37)) {
        tension.setZero();
        finite = false;
    }
    set_matrix(tension_, i, tension);
    twists_.distortion[i] = meshless::is_distorted(F, R) ? 1.0F : 0.0F;
    deformation_[i] = frame_.world * F;
    rotation_[i] = frame_.world * R;
    if (corotated_) {
        set_matrix(turn_, i, R - Mat3::Identity());
    } else if (configuration.has_tangents) {
        tangent_[i] = tangent(material_, deformation_[i], rotation_[i], plastic);
    }
    return finite;
}

void SlicedElasticity::take_rows(const Configuration& configuration, const SliceRange& range,
                                 std::size_t& bad) {
    const Lame lame{static_cast<float>(material_.lame_mu()), static_cast<float>(material_.lame_lambda())};
    state_pass(*slices_, range, arrays(), corotated_, lame);
    for (std::size_t slice = range.begin; slice < range.end; ++slice)
        for (unsigned fallback = fallback_[slice]; fallback != 0; fallback &= fallback - 1) {
            const std::size_t i = slice * lanes + static_cast<std::size_t>(std::countr_zero(fallback));
            if (i < slices_->row_count()) bad += !take_row(configuration, i);
        }
    if (!frame_.is_rotated || !corotated_) return;
    for (std::size_t i = range.begin * lanes; i < std::min(range.end * lanes, slices_->row_count()); ++i)
        turn_to_world(i);
}

void SlicedElasticity::take_configuration(const Neighbourhoods& neighbourhoods, const Material& material,
                                          const Configuration& configuration, const Parallel& parallel) {
    size_buffers(neighbourhoods, material);
    assert(configuration.position.size() == neighbourhoods.size());
    choose_frame(configuration);
    take_displacement(configuration, parallel);
    energies_.are_taken = false;
}

std::size_t SlicedElasticity::take_state(const Neighbourhoods& neighbourhoods, const Material& material,
                                         const Configuration& configuration, const Parallel& parallel) {
    take_configuration(neighbourhoods, material, configuration, parallel);
    return count_(parallel, slice_count(), slice_grain(slice_count()),
                  [&](std::size_t begin, std::size_t end) {
                      std::size_t bad = 0;
                      take_rows(configuration, {begin, end}, bad);
                      return bad;
                  });
}

std::size_t SlicedElasticity::take_state_and_energy(const Neighbourhoods& neighbourhoods,
                                                    const Material& material,
                                                    const Configuration& configuration,
                                                    const Parallel& parallel) {
    take_configuration(neighbourhoods, material, configuration, parallel);
    const std::size_t grain = slice_grain(slice_count());
    energies_.range.resize((slice_count() + grain - 1) / grain);
    const std::size_t bad = count_(parallel, slice_count(), grain, [&](std::size_t begin, std::size_t end) {
        std::size_t bad_rows = 0;
        take_rows(configuration, {begin, end}, bad_rows);
        energies_.range[begin / grain] = range_energy(configuration, {begin, end});
        return bad_rows;
    });
    energies_.are_taken = true;
    return bad;
}

void SlicedElasticity::twists_of_slice(const TwistState& from, std::size_t slice) {
    float gradient[9 * lanes] = {}, turn[9 * lanes] = {}, stretch[lanes] = {};
    const std::size_t first = slice * lanes, count = std::min(lanes, from.deformation.size() - first);
    for (std::size_t i = 0; i < count; ++i) {
        const Mat3 H = from.deformation[first + i] - Mat3::Identity();
        const Mat3 Y = from.rotation[first + i] - Mat3::Identity();
        for (std::size_t k = 0; k < 9; ++k) {
            gradient[k * lanes + i] = static_cast<float>(H(static_cast<int>(k / 3), static_cast<int>(k % 3)));
            turn[k * lanes + i] = static_cast<float>(Y(static_cast<int>(k / 3), static_cast<int>(k % 3)));
        }
        const Mat3 next = corotated_ ? matrix_at(frame_.is_rotated ? frame_.turn : turn_, first + i)
                                     : Mat3(rotation_[first + i] - Mat3::Identity());
        stretch[i] = static_cast<float>(0.5 * (next - Y).squaredNorm());
    }
    const Lame lame{static_cast<float>(material_.lame_mu()), static_cast<float>(material_.lame_lambda())};
    twist_pass(*slices_, slice, gradient, turn, stretch, arrays(), lame);
}

// Sums the twists of each piece.
void SlicedElasticity::sum_twists(const TwistState& from) {
    twists_.exact.assign(from.restrained.size(), 0);
    twists_.positive.assign(from.restrained.size(), 0);
    for (std::size_t i = 0; i < from.piece.size(); ++i) {
        const auto piece = static_cast<std::size_t>(from.piece[i]);
        if (piece >= from.restrained.size()) continue;
        const auto volume = static_cast<double>(slices_->volume()[i]);
        twists_.exact[piece] += volume * static_cast<double>(twists_.sum[i]);
        twists_.positive[piece] += volume * static_cast<double>(twists_.sum[stride() + i]);
    }
}

// Returns the factor on the twist of phyxel i.
double SlicedElasticity::twist_factor(const TwistState& from, std::size_t i) const {
    if (from.piece.empty()) return 1;
    const auto piece = static_cast<std::size_t>(from.piece[i]);
    if (piece >= from.restrained.size() || from.restrained[piece] == 0) return 0;
    const double exact = twists_.exact[piece], positive = twists_.positive[piece];
    return exact < positive ? std::max(exact / positive, 0.0) : 1;
}

void SlicedElasticity::take_twists(const TwistState& from, const Parallel& parallel) {
    if (material_.model != MaterialModel::corotated || material_.plasticity) return;
    const std::size_t n = stride();
    const bool is_any_restrained =
        std::any_of(from.restrained.begin(), from.restrained.end(), [](std::uint8_t is) { return is != 0; });
    if (from.piece.empty() || is_any_restrained) {
        for_slices(parallel, slice_count(), [&](const SliceRange& range) {
            for (std::size_t slice = range.begin; slice < range.end; ++slice) twists_of_slice(from, slice);
        });
    } else {
        for (FloatArray* array : {&twists_.stiffness, &twists_.sum})
            std::fill(array->begin(), array->end(), 0.0F);
    }
    sum_twists(from);
    for_phyxels(parallel, slices_->row_count(), [&](std::size_t i) {
        const Twist sums{{}, static_cast<double>(twists_.sum[i]), static_cast<double>(twists_.sum[n + i])};
        const double factor = twist_factor(from, i);
        const bool is_majorizer = is_distorted(i) && !(factor > 0 && is_taut(material_, sums));
        twists_.majorizer[i] = is_majorizer ? 1.0F : 0.0F;
        if (is_majorizer) {
            set_symmetric(twists_.stiffness, i, majorizer_twist(material_));
        } else if (factor != 1) {
            for (std::size_t k = 0; k < 6; ++k) twists_.stiffness[k * n + i] *= static_cast<float>(factor);
        }
        if (corotated_) return;
        tangent_[i].twist = twist(i);
        tangent_[i].is_majorizer = is_majorizer;
    });
}

Mat3 SlicedElasticity::stress_change(std::size_t i, const Mat3& dF, double twist_share) const {
    if (!corotated_) return meshless::stress_change(material_, tangent_[i], dF, twist_share);
    const Mat3 R = Mat3::Identity() + matrix_at(frame_.is_rotated ? frame_.turn : turn_, i);
    return meshless::stress_change(material_, R, twist(i), dF, is_majorizer(i) ? 1 : twist_share);
}

Mat3 SlicedElasticity::twist(std::size_t i) const {
    Mat3 out;
    std::size_t at = i;
    for (int r = 0; r < 3; ++r)
        for (int c = r; c < 3; ++c, at += stride())
            out(r, c) = out(c, r) = static_cast<double>(twists_.stiffness[at]);
    return out;
}

void SlicedElasticity::read_deformation(std::span<Mat3> deformation, std::span<Mat3> rotation,
                                        const Parallel& parallel) const {
    for_phyxels(parallel, slices_->row_count(), [&](std::size_t i) {
        if ((fallback_[i / lanes] >> i % lanes & 1U) != 0) {
            deformation[i] = deformation_[i];
            rotation[i] = rotation_[i];
            return;
        }
        deformation[i] = Mat3::Identity() + matrix_at(gradient_, i);
        rotation[i] = Mat3::Identity() + matrix_at(turn_, i);
        if (!frame_.is_rotated) return;
        deformation[i] = frame_.world * deformation[i];
        rotation[i] = frame_.world * rotation[i];
    });
}

double SlicedElasticity::row_energy(const Configuration& configuration, std::size_t i) const {
    // A phyxel without neighbours has no restoring force, so no energy.
    if (neighbourhoods_->rank()[i] == 0) return 0;
    return neighbourhoods_->volume()[i] *
               energy_density(
                   material_, deformation_[i], rotation_[i],
                   resolved_plastic_strain(*neighbourhoods_, material_, i, configuration.plastic_strain)) +
           penalty_energy(*neighbourhoods_, i, deformation_[i], configuration.position);
}

double SlicedElasticity::range_energy(const Configuration& configuration, const SliceRange& range) {
    const Lame lame{static_cast<float>(material_.lame_mu()), static_cast<float>(material_.lame_lambda())};
    double energy = corotated_ ? energy_pass(*slices_, range, arrays(), lame, energy_.data()) : 0;
    for (std::size_t i = range.begin * lanes; i < range.end * lanes; ++i)
        energies_.row[i] = static_cast<double>(energy_[i]);
    for (std::size_t slice = range.begin; slice < range.end; ++slice)
        for (unsigned fallback = fallback_[slice]; fallback != 0; fallback &= fallback - 1) {
            const std::size_t i = slice * lanes + static_cast<std::size_t>(std::countr_zero(fallback));
            if (i >= slices_->row_count()) continue;
            energies_.row[i] = row_energy(configuration, i);
            energy += energies_.row[i];
        }
    return energy;
}

double SlicedElasticity::energy(const Configuration& configuration, const Parallel& parallel,
                                std::span<double> rows) {
    const std::size_t grain = slice_grain(slice_count());
    return sum_(parallel, slice_count(), grain, [&](std::size_t begin, std::size_t end) {
        const double part =
            energies_.are_taken ? energies_.range[begin / grain] : range_energy(configuration, {begin, end});
        const std::size_t last = std::min(end * lanes, rows.size());
        for (std::size_t i = begin * lanes; i < last; ++i) rows[i] = energies_.row[i];
        return part;
    });
}

const float* SlicedElasticity::forces(const Parallel& parallel) {
    for_slices(parallel, slice_count(),
               [&](const SliceRange& range) { force_pass(*slices_, range, arrays(), force_.data()); });
    add_off_plane_forces(force_.data());
    if (frame_.is_rotated)
        for_phyxels(parallel, slices_->row_count(), [&](std::size_t i) {
            const std::size_t n = stride();
            Vec3 own;
            for (std::size_t k = 0; k < 3; ++k)
                own[static_cast<int>(k)] = static_cast<double>(force_[k * n + i]);
            const Vec3 world = frame_.world * own;
            for (std::size_t k = 0; k < 3; ++k)
                force_[k * n + i] = static_cast<float>(world[static_cast<int>(k)]);
        });
    return force_.data();
}

void SlicedElasticity::forces(std::span<Vec3> force, const Parallel& parallel) {
    const float* const found = forces(parallel);
    const std::size_t n = stride();
    for_phyxels(parallel, force.size(), [&](std::size_t i) {
        for (std::size_t k = 0; k < 3; ++k)
            force[i][static_cast<int>(k)] = static_cast<double>(found[k * n + i]);
    });
}

// Computes tensions from the gradients of a direction for materials without the vector path.
void SlicedElasticity::change_stress(const SliceRange& range, double twist_share) {
    const std::size_t end = std::min(range.end * lanes, slices_->row_count());
    for (std::size_t i = range.begin * lanes; i < end; ++i) {
        const Mat3 dF = matrix_at(gradient_, i);
        set_matrix(
            tension_, i,
            neighbourhoods_->volume()[i] * meshless::stress_change(material_, tangent_[i], dF, twist_share) -
                neighbourhoods_->penalty()[i] * dF * neighbourhoods_->moment()[i]);
    }
}

double SlicedElasticity::apply_stiffness(float factor, const float* diagonal, const float* dx, float* out,
                                         const Parallel& parallel, float twist_factor) {
    const Lame lame{static_cast<float>(material_.lame_mu()), static_cast<float>(material_.lame_lambda())};
    const bool weights = corotated_ && slices_->weights_pay();
    const float twist_share = factor > 0 ? twist_factor / factor : 0;
    assert(twist_share <= 1);
    for_slices(parallel, slice_count(), [&](const SliceRange& range) {
        if (weights)
            weighted_direction_pass(*slices_, range, dx, arrays_of_tangents(), lame, twist_share);
        else
            direction_pass(*slices_, range, dx, arrays_of_tangents(), corotated_, lame, twist_share);
        if (!corotated_) change_stress(range, static_cast<double>(twist_share));
        change_deficient_rows(range, dx, static_cast<double>(twist_share), weights);
    });
    const auto find_forces = [&](const SliceRange& range) {
        if (weights)
            weighted_force_pass(*slices_, range, arrays(), out);
        else
            force_pass(*slices_, range, arrays(), out);
    };
    if (!off_plane_.rows.empty()) {
        for_slices(parallel, slice_count(), find_forces);
        add_off_plane_changes(out);
    }
    return sum_(parallel, slice_count(), slice_grain(slice_count()), [&](std::size_t begin, std::size_t end) {
        if (off_plane_.rows.empty()) find_forces({begin, end});
        return finish_product(stride(), {begin, end}, diagonal, factor, dx, out);
    });
}

double SlicedElasticity::apply_stiffness(double factor, std::span<const double> diagonal,
                                         std::span<const Vec3> dx, std::span<Vec3> out,
                                         const Parallel& parallel, double twist_factor) {
    const std::size_t n = stride();
    for_phyxels(parallel, slices_->row_count(), [&](std::size_t i) {
        diagonal_[i] = static_cast<float>(diagonal[i]);
        for (std::size_t k = 0; k < 3; ++k)
            direction_[k * n + i] = static_cast<float>(dx[i][static_cast<int>(k)]);
    });
    const double product = apply_stiffness(static_cast<float>(factor), diagonal_.data(), direction_.data(),
                                           force_.data(), parallel, static_cast<float>(twist_factor));
    for_phyxels(parallel, slices_->row_count(), [&](std::size_t i) {
        for (std::size_t k = 0; k < 3; ++k)
            out[i][static_cast<int>(k)] = static_cast<double>(force_[k * n + i]);
    });
    return product;
}

}  // namespace splitcubes::meshless
