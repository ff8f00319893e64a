#include <splitcubes/math/decompose.h>
#include <splitcubes/meshless/elasticity.h>

#include <atomic>
#include <cassert>

namespace splitcubes::meshless {

namespace {

// The completed F and its rotation from H = sum_j (u_j - u_i) g_ij^T, u = x - X.
void complete(const Mat3& H, int rank, const Mat3& basis, const Mat3& last, Mat3& F, Mat3& R) {
    if (rank == 0) {
        F = R = last;
        return;
    }
    F = Mat3::Identity() + H;
    if (rank == 1) {
        const Vec3 line = basis.col(0);
        const Vec3 image = F * line;
        R = rotation_of(minimal_rotation(last * line, image) * last, last);
        F = R + (image - R * line) * line.transpose();
        return;
    }
    if (rank == 2) {
        const Vec3 dropped = basis.col(2);
        const Vec3 image0 = F * basis.col(0);
        const Vec3 image1 = F * basis.col(1);
        const Vec3 cross = image0.cross(image1);
        const bool flat = cross.norm() > 1e-12 * image0.norm() * image1.norm();
        const Vec3 normal = flat ? Vec3(cross.normalized()) : Vec3(last * dropped);
        F += (normal - F * dropped) * dropped.transpose();
    }
    R = rotation_of(F, last);
}

}  // namespace

std::size_t compute_deformation(const Neighbourhoods& neighbourhoods, std::span<const Vec3> rest_position,
                                std::span<const Vec3> position, std::span<const Mat3> last_rotation,
                                std::span<Mat3> deformation, std::span<Mat3> rotation,
                                const Parallel& parallel) {
    const std::size_t n = neighbourhoods.size();
    assert(position.size() == n && deformation.size() == n && rotation.size() == n);
    // Displacements rather than positions: at rest F is the identity exactly.
    const auto displacement_gradient = [&](std::size_t i) {
        const Vec3 here = position[i] - rest_position[i];
        Mat3 sum = Mat3::Zero();
        const std::uint32_t end = neighbourhoods.offsets()[i + 1];
        for (std::uint32_t l = neighbourhoods.offsets()[i]; l < end; ++l) {
            const std::uint32_t j = neighbourhoods.neighbour()[l];
            const Vec3& g = neighbourhoods.gradient()[l];
            const Vec3 difference = (position[j] - rest_position[j]) - here;
            for (int k = 0; k < 3; ++k) sum.col(k) += difference * g[k];
        }
        return sum;
    };
    std::atomic<std::size_t> bad = 0;
    for_phyxels(parallel, n, [&](std::size_t i) {
        const Mat3 last = last_rotation[i];
        complete(displacement_gradient(i), neighbourhoods.rank()[i], neighbourhoods.basis()[i], last,
                 deformation[i], rotation[i]);
        if (deformation[i].allFinite() && rotation[i].allFinite()) return;
        deformation[i] = rotation[i] = last;
        ++bad;
    });
    return bad;
}

void update_deformation(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Parallel& parallel) {
    compute_deformation(neighbourhoods, phyxels.rest_position, phyxels.position, phyxels.rotation,
                        phyxels.deformation, phyxels.rotation, parallel);
}

namespace {

// The part of the plastic strain in the directions that a phyxel's neighbours tell:
// across them the material has no strain, and stress there would make a torque.
Mat3 plastic_strain_of(const Neighbourhoods& neighbourhoods, const Material& material,
                       const ElasticState& state, std::size_t i) {
    if (!material.plasticity) return Mat3::Zero();
    if (neighbourhoods.rank()[i] == 3) return state.plastic_strain[i];
    const Mat3 projection = neighbourhoods.kept_directions(i);
    return projection * state.plastic_strain[i] * projection;
}

}  // namespace

double ElasticForces::energy(const Neighbourhoods& neighbourhoods, const Material& material,
                             const ElasticState& state, const Parallel& parallel) {
    const auto of_phyxel = [&](std::size_t i) {
        // One without neighbours is as it was left: nothing works against it.
        if (neighbourhoods.rank()[i] == 0) return 0.0;
        double energy = neighbourhoods.volume()[i] *
                        energy_density(material, state.deformation[i], state.rotation[i],
                                       plastic_strain_of(neighbourhoods, material, state, i));
        for (std::uint32_t l = neighbourhoods.offsets()[i]; l < neighbourhoods.offsets()[i + 1]; ++l) {
            const std::uint32_t j = neighbourhoods.neighbour()[l];
            const double s = neighbourhoods.share()[l];
            const Vec3 error =
                (s * state.deformation[i] + (1 - s) * state.deformation[j]) * neighbourhoods.rest_edge()[l] -
                (state.position[j] - state.position[i]);
            // A quarter: each pair is met from both ends.
            energy += 0.25 * neighbourhoods.pair_stiffness()[l] * error.squaredNorm();
        }
        return energy;
    };
    return sum_(parallel, neighbourhoods.size(), [&](std::size_t begin, std::size_t end) {
        double energy = 0;
        for (std::size_t i = begin; i < end; ++i) energy += of_phyxel(i);
        return energy;
    });
}

// Sum over the links of row i of body(link, neighbour).
template <class Body>
inline void for_links(const Neighbourhoods& neighbourhoods, std::size_t i, const Body& body) {
    const std::uint32_t* const neighbour = neighbourhoods.neighbour().data();
    const std::uint32_t end = neighbourhoods.offsets()[i + 1];
    for (std::uint32_t l = neighbourhoods.offsets()[i]; l < end; ++l) body(l, neighbour[l]);
}

// sum_j (u_j - u_i) g_ij^T. Differences first: a translation gives exactly zero.
ElasticForces::PaddedMatrix ElasticForces::displacement_gradient(const Neighbourhoods& neighbourhoods,
                                                                 std::size_t i) const {
    const Vec3* const gradient = neighbourhoods.gradient().data();
    const Padded* const u = displacement_.data();
    const Padded here = u[i];
    PaddedMatrix sum = PaddedMatrix::Zero();
    for_links(neighbourhoods, i, [&](std::uint32_t l, std::uint32_t j) {
        const Padded difference = u[j] - here;
        const Vec3& g = gradient[l];
        sum.col(0) += difference * g.x();
        sum.col(1) += difference * g.y();
        sum.col(2) += difference * g.z();
    });
    return sum;
}

// Adds sum_j k s e x^T to the tension and writes sum_j k e, for the pair errors e
// of gradient_ and displacement_. The part of F_i is summed beforehand.
void ElasticForces::pair_terms(const Neighbourhoods& neighbourhoods, std::size_t i, PaddedMatrix& tension,
                               Vec3& pair_force) const {
    const Vec3* const rest_edge = neighbourhoods.rest_edge().data();
    const double* const stiffness = neighbourhoods.pair_stiffness().data();
    const double* const share = neighbourhoods.share().data();
    const PaddedMatrix* const gradient = gradient_.data();
    const Padded* const u = displacement_.data();
    const Padded here = u[i];
    PaddedMatrix sum = gradient[i] * neighbourhoods.pair_second()[i];
    Padded force = gradient[i] * neighbourhoods.pair_first()[i];
    for_links(neighbourhoods, i, [&](std::uint32_t l, std::uint32_t j) {
        const Vec3& edge = rest_edge[l];
        const double other = 1 - share[l];
        const PaddedMatrix& far = gradient[j];
        const Padded error = far.col(0) * (other * edge.x()) + far.col(1) * (other * edge.y()) +
                             far.col(2) * (other * edge.z()) - (u[j] - here);
        const Padded weighted = error * stiffness[l];
        force += weighted;
        const Vec3 shared = share[l] * edge;
        sum.col(0) += weighted * shared.x();
        sum.col(1) += weighted * shared.y();
        sum.col(2) += weighted * shared.z();
    });
    tension += sum;
    pair_force = force.head<3>();
}

// T_i G_i - sum_j T_j g_ji - sum_j k e: the force on i, gathered.
Vec3 ElasticForces::gather_force(const Neighbourhoods& neighbourhoods, std::size_t i) const {
    const Vec3* const reverse = neighbourhoods.reverse_gradient().data();
    const PaddedMatrix* const tension = tension_.data();
    Padded force = tension[i] * neighbourhoods.gradient_sum()[i];
    for_links(neighbourhoods, i, [&](std::uint32_t l, std::uint32_t j) {
        const PaddedMatrix& T = tension[j];
        const Vec3& g = reverse[l];
        force -= T.col(0) * g.x() + T.col(1) * g.y() + T.col(2) * g.z();
    });
    return force.head<3>() - pair_force_[i];
}

void ElasticForces::forces(const Neighbourhoods& neighbourhoods, const Material& material,
                           const ElasticState& state, std::span<Vec3> force, const Parallel& parallel) {
    const std::size_t n = neighbourhoods.size();
    tension_.resize(n);
    pair_force_.resize(n);
    const std::span<const Mat3> F = state.deformation;
    for_phyxels(parallel, n, [&](std::size_t i) {
        Mat3 tension =
            neighbourhoods.volume()[i] * piola_stress(material, F[i], state.rotation[i],
                                                      plastic_strain_of(neighbourhoods, material, state, i));
        pair_force_[i].setZero();
        // Each error as a whole, so that it is exactly zero at rest.
        for_links(neighbourhoods, i, [&](std::uint32_t l, std::uint32_t j) {
            const double s = neighbourhoods.share()[l];
            const Vec3& edge = neighbourhoods.rest_edge()[l];
            const Vec3 error = (s * F[i] + (1 - s) * F[j]) * edge - (state.position[j] - state.position[i]);
            pair_force_[i] += neighbourhoods.pair_stiffness()[l] * error;
            tension += neighbourhoods.pair_stiffness()[l] * s * error * edge.transpose();
        });
        tension_[i].topRows<3>() = tension;
        tension_[i].row(3).setZero();
    });
    for_phyxels(parallel, n, [&](std::size_t i) { force[i] = gather_force(neighbourhoods, i); });
}

void ElasticForces::linearise(const Neighbourhoods& neighbourhoods, const Material& material,
                              const ElasticState& state, const Parallel& parallel) {
    const std::size_t n = neighbourhoods.size();
    frame_.clear();
    turning_.clear();
    tangent_.clear();
    if (frame_is_all(material)) {
        frame_.assign(state.rotation.begin(), state.rotation.end());
        turning_.resize(n);
        for (std::size_t i = 0; i < n; ++i) turning_[i] = turning_resistance(state.deformation[i], frame_[i]);
        return;
    }
    tangent_.resize(n);
    for_phyxels(parallel, n, [&](std::size_t i) {
        tangent_[i] = tangent(material, state.deformation[i], state.rotation[i],
                              plastic_strain_of(neighbourhoods, material, state, i));
    });
}

double ElasticForces::apply_stiffness(const Neighbourhoods& neighbourhoods, const Material& material,
                                      double factor, std::span<const double> diagonal,
                                      std::span<const Vec3> dx, std::span<Vec3> out,
                                      const Parallel& parallel) {
    const std::size_t n = neighbourhoods.size();
    assert(frame_.size() + tangent_.size() == n);
    displacement_.resize(n);
    gradient_.resize(n);
    tension_.resize(n);
    pair_force_.resize(n);
    for_phyxels(parallel, n, [&](std::size_t i) { displacement_[i] << dx[i], 0; });
    for_phyxels(parallel, n, [&](std::size_t i) { gradient_[i] = displacement_gradient(neighbourhoods, i); });
    for_phyxels(parallel, n, [&](std::size_t i) {
        PaddedMatrix tension = PaddedMatrix::Zero();
        pair_terms(neighbourhoods, i, tension, pair_force_[i]);
        const Mat3 dF = gradient_[i].topRows<3>();
        tension.topRows<3>() += neighbourhoods.volume()[i] *
                                (frame_.empty() ? stress_change(material, tangent_[i], dF)
                                                : stress_change(material, frame_[i], turning_[i], dF));
        tension_[i] = factor * tension;
        pair_force_[i] *= factor;
    });
    return sum_(parallel, n, [&](std::size_t begin, std::size_t end) {
        double product = 0;
        for (std::size_t i = begin; i < end; ++i) {
            out[i] = diagonal[i] * dx[i] - gather_force(neighbourhoods, i);
            product += dx[i].dot(out[i]);
        }
        return product;
    });
}

}  // namespace splitcubes::meshless
