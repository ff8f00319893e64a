/// Linear systems of implicit steps, for tests of preconditioners.
#pragma once

#include <splitcubes/dynamics/implicit/aggregates.h>
#include <splitcubes/dynamics/implicit/block_jacobi.h>
#include <splitcubes/dynamics/implicit/rigid_modes.h>

#include "bodies.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

namespace splitcubes::meshless::fixtures {

enum class Preconditioner : std::uint8_t { diagonal, aggregates, rigid_modes, blocks };

/// A body with the linear system of a step, linearised at its current positions.
struct LinearSystem {
    Specimen body;
    std::vector<std::uint8_t> held;
    std::vector<double> inertia, added;
    Aggregates aggregates;
    SlicedElasticity elastic;
    std::unique_ptr<RigidModes> modes = std::make_unique<RigidModes>();
    std::unique_ptr<BlockJacobi> blocks = std::make_unique<BlockJacobi>();

    LinearSystem(Specimen specimen, double dt) : body(std::move(specimen)) {
        held.assign(size(), 0);
        for (const double mass : body.phyxels.mass) inertia.push_back(mass / (dt * dt));
    }
    std::size_t size() const { return body.phyxels.size(); }
    void hold(const std::function<bool(const Vec3&)>& which) {
        for (std::size_t i = 0; i < size(); ++i) held[i] = which(body.phyxels.rest_position[i]);
    }
    void update(const Parallel& parallel, const ContactProducts* springs = nullptr) {
        aggregates.update(body.phyxels, body.neighbourhoods, held, parallel);
        aggregates.compute_weights(body.neighbourhoods, 1, inertia, added, parallel);
        elastic.take_state(body.neighbourhoods, body.material, configuration_of(body.phyxels), parallel);
        modes->clear();
        const std::array<RigidModes::Part, 1> parts = {RigidModes::Part{body.neighbourhoods, aggregates,
                                                                        elastic, body.phyxels.rest_position,
                                                                        body.phyxels.position, inertia, 1}};
        modes->build(parts, springs);
        blocks->clear();
        blocks->build(parts, springs, parallel);
    }
    std::vector<Vec3> random_residual(Random& random) const {
        std::vector<Vec3> r(size(), Vec3::Zero());
        for (std::size_t i = 0; i < size(); ++i)
            if (held[i] == 0) r[i] = random_vector(random, 1);
        return r;
    }
    // Returns the aggregates' corrections of r; `product`: their product with r, as reported.
    std::vector<Vec3> correct(const std::vector<Vec3>& r, const Parallel& parallel, double& product) {
        const std::size_t n = body.neighbourhoods.slices().stride();
        FloatArray rows(3 * n, 0);
        for (std::size_t i = 0; i < size(); ++i)
            for (std::size_t k = 0; k < 3; ++k)
                rows[k * n + i] = static_cast<float>(r[i][static_cast<int>(k)]);
        product = aggregates.correct(rows.data(), parallel);
        std::vector<Vec3> z(size());
        const std::size_t stride = aggregates.count() + 1;
        for (std::size_t i = 0; i < size(); ++i)
            for (std::size_t k = 0; k < 3; ++k)
                z[i][static_cast<int>(k)] = static_cast<double>(
                    aggregates.correction()[k * stride + static_cast<std::size_t>(aggregates.index()[i])]);
        return z;
    }
    std::vector<Vec3> correct(const std::vector<Vec3>& r, const Parallel& parallel) {
        double product = 0;
        return correct(r, parallel, product);
    }
    /// Returns the displacements by rigid modes for r; `product`: their product with r, as reported.
    std::vector<Vec3> correct_by_modes(const std::vector<Vec3>& r, const Parallel& parallel,
                                       double& product) {
        return correct_by_part(*modes, r, parallel, product);
    }
    /// The same by exact solves of blocks.
    std::vector<Vec3> correct_by_blocks(const std::vector<Vec3>& r, const Parallel& parallel,
                                        double& product) {
        return correct_by_part(*blocks, r, parallel, product);
    }
    template <class Part>
    std::vector<Vec3> correct_by_part(Part& part, const std::vector<Vec3>& r, const Parallel& parallel,
                                      double& product) {
        const std::size_t n = body.neighbourhoods.slices().stride();
        FloatArray in(3 * n, 0), out(3 * n, 0);
        for (std::size_t i = 0; i < size(); ++i)
            for (std::size_t k = 0; k < 3; ++k) in[k * n + i] = static_cast<float>(r[i][static_cast<int>(k)]);
        const std::array<ContactProducts::RowPart, 1> rows = {
            ContactProducts::RowPart{n, in.data(), out.data()}};
        product = part.correct(rows, parallel);
        part.add_correction(rows, parallel);
        std::vector<Vec3> z(size());
        for (std::size_t i = 0; i < size(); ++i)
            for (std::size_t k = 0; k < 3; ++k)
                z[i][static_cast<int>(k)] = static_cast<double>(out[k * n + i]);
        return z;
    }
    std::vector<Vec3> correct_by(Preconditioner preconditioner, const std::vector<Vec3>& r,
                                 const Parallel& parallel) {
        double product = 0;
        if (preconditioner == Preconditioner::diagonal) return std::vector<Vec3>(size(), Vec3::Zero());
        if (preconditioner == Preconditioner::aggregates) return correct(r, parallel);
        std::vector<Vec3> z = correct_by_modes(r, parallel, product);
        if (preconditioner != Preconditioner::blocks) return z;
        const std::vector<Vec3> by_blocks = correct_by_blocks(r, parallel, product);
        for (std::size_t i = 0; i < size(); ++i) z[i] += by_blocks[i];
        return z;
    }
    // Number of iterations to a relative residual of a thousandth, in the norm of the inverse diagonal.
    int iterations(const std::vector<Vec3>& rhs, Preconditioner preconditioner, const Parallel& parallel);
};

inline double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
    return sum;
}

inline int LinearSystem::iterations(const std::vector<Vec3>& rhs, Preconditioner preconditioner,
                                    const Parallel& parallel) {
    std::vector<Vec3> r = rhs, p(size(), Vec3::Zero()), q(size());
    double rz = 1, first = 0;
    for (int k = 0; k < 1000; ++k) {
        std::vector<Vec3> z = correct_by(preconditioner, r, parallel);
        double square = 0;
        for (std::size_t i = 0; i < size(); ++i) {
            const double inverse = 1 / (inertia[i] + body.neighbourhoods.stiffness_diagonal()[i]);
            z[i] += inverse * r[i];
            square += inverse * r[i].squaredNorm();
        }
        if (k == 0) first = square;
        if (!(square > 1e-6 * first)) return k;
        const double next = dot(r, z);
        for (std::size_t i = 0; i < size(); ++i) p[i] = z[i] + (k > 0 ? next / rz : 0) * p[i];
        rz = next;
        elastic.apply_stiffness(1, inertia, p, q, parallel);
        for (std::size_t i = 0; i < size(); ++i)
            if (held[i] != 0) q[i].setZero();
        const double alpha = rz / dot(p, q);
        for (std::size_t i = 0; i < size(); ++i) r[i] -= alpha * q[i];
    }
    return 1000;
}

}  // namespace splitcubes::meshless::fixtures
