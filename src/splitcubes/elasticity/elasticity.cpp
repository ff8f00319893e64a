#include <splitcubes/elasticity/elasticity.h>
#include <splitcubes/math/decompose.h>

#include <atomic>
#include <cassert>

namespace splitcubes::meshless {

namespace {

// Computes the completed F and its rotation from H = sum_j (u_j - u_i) g_ij^T, u = x - X.
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

bool complete_deformation(const Neighbourhoods& neighbourhoods, std::size_t i, const Mat3& H,
                          const Mat3& last_rotation, Mat3& deformation, Mat3& rotation) {
    const Mat3 last = last_rotation;
    complete(H, neighbourhoods.rank()[i], neighbourhoods.basis()[i], last, deformation, rotation);
    if (deformation.allFinite() && rotation.allFinite()) return true;
    deformation = rotation = last;
    return false;
}

bool compute_deformation_of(std::size_t i, const Neighbourhoods& neighbourhoods,
                            std::span<const Vec3> rest_position, std::span<const Vec3> position,
                            const Mat3& last_rotation, Mat3& deformation, Mat3& rotation) {
    // Uses displacements, not positions: F is exactly the identity at rest.
    const Vec3 here = position[i] - rest_position[i];
    Mat3 sum = Mat3::Zero();
    const std::uint32_t end = neighbourhoods.links_end(i);
    for (std::uint32_t l = neighbourhoods.links_begin(i); l < end; ++l) {
        const std::uint32_t j = neighbourhoods.neighbour()[l];
        const Vec3& g = neighbourhoods.gradient()[l];
        const Vec3 difference = (position[j] - rest_position[j]) - here;
        for (int k = 0; k < 3; ++k) sum.col(k) += difference * g[k];
    }
    return complete_deformation(neighbourhoods, i, sum, last_rotation, deformation, rotation);
}

std::size_t compute_deformation(const Neighbourhoods& neighbourhoods, std::span<const Vec3> rest_position,
                                std::span<const Vec3> position, std::span<const Mat3> last_rotation,
                                std::span<Mat3> deformation, std::span<Mat3> rotation,
                                const Parallel& parallel) {
    const std::size_t n = neighbourhoods.size();
    assert(position.size() == n && deformation.size() == n && rotation.size() == n);
    std::atomic<std::size_t> bad = 0;
    for_phyxels(parallel, n, [&](std::size_t i) {
        bad += !compute_deformation_of(i, neighbourhoods, rest_position, position, last_rotation[i],
                                       deformation[i], rotation[i]);
    });
    return bad;
}

void update_deformation(Phyxels& phyxels, const Neighbourhoods& neighbourhoods, const Parallel& parallel) {
    compute_deformation(neighbourhoods, phyxels.rest_position, phyxels.position, phyxels.rotation,
                        phyxels.deformation, phyxels.rotation, parallel);
}

Mat3 resolved_plastic_strain(const Neighbourhoods& neighbourhoods, const Material& material, std::size_t i,
                             std::span<const Mat3> plastic_strain) {
    if (!material.plasticity) return Mat3::Zero();
    if (neighbourhoods.rank()[i] == 3) return plastic_strain[i];
    const Mat3 projection = neighbourhoods.kept_directions(i);
    return projection * plastic_strain[i] * projection;
}

double penalty_energy(const Neighbourhoods& neighbourhoods, std::size_t i, const Mat3& deformation,
                      std::span<const Vec3> position) {
    double squares = 0;
    for (std::uint32_t l = neighbourhoods.links_begin(i); l < neighbourhoods.links_end(i); ++l) {
        const std::uint32_t j = neighbourhoods.neighbour()[l];
        const Vec3 error = deformation * neighbourhoods.rest_edge()[l] - (position[j] - position[i]);
        squares += neighbourhoods.weight()[l] * error.squaredNorm();
    }
    return 0.5 * neighbourhoods.penalty()[i] * squares;
}

namespace {

// Returns the pull of the neighbours off the plane of phyxel i on its normal, N m. The gradient and the
// displacements may be those of the state or of a change.
Vec3 pull_on_normal(const Neighbourhoods& neighbourhoods, std::size_t i, const Mat3& gradient,
                    std::span<const Vec3> displacement) {
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t l = neighbourhoods.links_begin(i); l < neighbourhoods.links_end(i); ++l) {
        const Vec3& edge = neighbourhoods.rest_edge()[l];
        const Vec3 error = gradient * edge - (displacement[neighbourhoods.neighbour()[l]] - displacement[i]);
        sum += neighbourhoods.weight()[l] * neighbourhoods.basis()[i].col(2).dot(edge) * error;
    }
    return neighbourhoods.penalty()[i] * sum;
}

}  // namespace

double ElasticForces::energy(const Neighbourhoods& neighbourhoods, const Material& material,
                             const ElasticState& state, const Parallel& parallel) {
    return sum_(parallel, neighbourhoods.size(), [&](std::size_t begin, std::size_t end) {
        double energy = 0;
        for (std::size_t i = begin; i < end; ++i)
            // A phyxel without neighbours has no restoring force, so no energy.
            if (neighbourhoods.rank()[i] > 0)
                energy += neighbourhoods.volume()[i] *
                              energy_density(material, state.deformation[i], state.rotation[i],
                                             resolved_plastic_strain(neighbourhoods, material, i,
                                                                     state.plastic_strain)) +
                          penalty_energy(neighbourhoods, i, state.deformation[i], state.position);
        return energy;
    });
}

// Calls body(link, neighbour) for the links of row i.
template <class Body>
inline void for_links(const Neighbourhoods& neighbourhoods, std::size_t i, const Body& body) {
    const std::uint32_t* const neighbour = neighbourhoods.neighbour().data();
    const std::uint32_t end = neighbourhoods.links_end(i);
    for (std::uint32_t l = neighbourhoods.links_begin(i); l < end; ++l) body(l, neighbour[l]);
}

// Returns the force on i, T_i G_i - sum_j T_j g_ji + sum_j (c_j w_ji e_ji - c_i w_ij e_ij).
Vec3 ElasticForces::gather_force(const Neighbourhoods& neighbourhoods, std::size_t i,
                                 std::span<const Mat3> gradient, std::span<const Vec3> displacement) const {
    Vec3 force = tension_[i] * neighbourhoods.gradient_sum()[i];
    for_links(neighbourhoods, i, [&](std::uint32_t l, std::uint32_t j) {
        force -= tension_[j] * neighbourhoods.reverse_gradient()[l];
        const Vec3& edge = neighbourhoods.rest_edge()[l];
        const Vec3 relative = displacement[j] - displacement[i];
        const double own = neighbourhoods.penalty()[i] * neighbourhoods.weight()[l];
        const double other =
            neighbourhoods.penalty()[j] * neighbourhoods.weight()[neighbourhoods.reverse()[l]];
        force -= own * (gradient[i] * edge - relative) + other * (gradient[j] * edge - relative);
    });
    return force;
}

void ElasticForces::forces(const Neighbourhoods& neighbourhoods, const Material& material,
                           const ElasticState& state, std::span<Vec3> force, const Parallel& parallel) {
    const std::size_t n = neighbourhoods.size();
    tension_.resize(n);
    for_phyxels(parallel, n, [&](std::size_t i) {
        tension_[i] =
            neighbourhoods.volume()[i] *
            piola_stress(material, state.deformation[i], state.rotation[i],
                         resolved_plastic_strain(neighbourhoods, material, i, state.plastic_strain));
        if (neighbourhoods.has_neighbours_off_plane(i)) {
            const Mat3& F = state.deformation[i];
            tension_[i] += Completion(2, neighbourhoods.basis()[i], F, F)
                               .resolve_normal(pull_on_normal(neighbourhoods, i, F, state.position));
        }
    });
    for_phyxels(parallel, n, [&](std::size_t i) {
        force[i] = gather_force(neighbourhoods, i, state.deformation, state.position);
    });
}

void ElasticForces::linearise(const Neighbourhoods& neighbourhoods, const Material& material,
                              const ElasticState& state, const Parallel& parallel) {
    const std::size_t n = neighbourhoods.size();
    tangent_.resize(n);
    completion_.resize(n);
    for_phyxels(parallel, n, [&](std::size_t i) {
        completion_[i] = Completion(neighbourhoods.rank()[i], neighbourhoods.basis()[i], state.deformation[i],
                                    state.rotation[i]);
        tangent_[i] = tangent(material, state.deformation[i], state.rotation[i],
                              resolved_plastic_strain(neighbourhoods, material, i, state.plastic_strain));
    });
}

double ElasticForces::apply_stiffness(const Neighbourhoods& neighbourhoods, const Material& material,
                                      double factor, std::span<const double> diagonal,
                                      std::span<const Vec3> dx, std::span<Vec3> out, const Parallel& parallel,
                                      double twist_factor) {
    const std::size_t n = neighbourhoods.size();
    const double share = factor > 0 ? twist_factor / factor : 0;
    assert(tangent_.size() == n);
    gradient_.resize(n);
    tension_.resize(n);
    for_phyxels(parallel, n, [&](std::size_t i) {
        // Sums differences, so that a translation gives exactly zero.
        Mat3 dF = Mat3::Zero();
        for_links(neighbourhoods, i, [&](std::uint32_t l, std::uint32_t j) {
            dF += (dx[j] - dx[i]) * neighbourhoods.gradient()[l].transpose();
        });
        dF = completion_[i].complete(dF);
        gradient_[i] = dF;
        tension_[i] = neighbourhoods.volume()[i] *
                      completion_[i].resolve(stress_change(material, tangent_[i], dF, share));
        if (neighbourhoods.has_neighbours_off_plane(i))
            tension_[i] += completion_[i].resolve_normal(pull_on_normal(neighbourhoods, i, dF, dx));
    });
    return sum_(parallel, n, [&](std::size_t begin, std::size_t end) {
        double product = 0;
        for (std::size_t i = begin; i < end; ++i) {
            out[i] = diagonal[i] * dx[i] - factor * gather_force(neighbourhoods, i, gradient_, dx);
            product += dx[i].dot(out[i]);
        }
        return product;
    });
}

}  // namespace splitcubes::meshless
