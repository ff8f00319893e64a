// Bodies for the tests of samples, elasticity and dynamics.
#pragma once

#include <splitcubes/core/random.h>
#include <splitcubes/dynamics/time_integrator.h>

#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <optional>
#include <vector>

namespace splitcubes::meshless::fixtures {

inline const Parallel& two_threads() {
    static const Parallel pool(2);
    return pool;
}

/// A plane on which phyxels rest by their contact radii.
struct Ground {
    Vec3 normal = Vec3::UnitZ();  // unit, world; the side it points to is free
    double offset = 0;            // m
    double friction = 0;
};

/// A body with everything that a step needs.
struct Specimen {
    Phyxels phyxels;
    Pairs pairs;
    Neighbourhoods neighbourhoods;
    Material material;
    TimeIntegrator solver;
    StepInput input;
    SolverOptions options;

    void connect(const Parallel& parallel) {
        double spacing = 1e-3;
        for (const double h : phyxels.support_radius) spacing = std::max(spacing, h);
        const PhyxelLocator locator(phyxels.rest_position, spacing);
        compute_support_radii(phyxels, locator, parallel);
        pairs = find_pairs(phyxels, locator, parallel);
        neighbourhoods.rebuild(phyxels, pairs, material, parallel);
    }
    std::optional<Ground> ground;
    std::vector<Contact> contacts;
    std::vector<CachedContact> cached;

    /// Contacts of phyxels with the ground that are possible within a step.
    void find_contacts() {
        contacts.clear();
        for (std::uint32_t i = 0; ground && i < phyxels.size(); ++i) {
            Contact contact;
            contact.key = i;
            contact.upper.count = 1;
            contact.upper.phyxel[0] = i;
            contact.upper.weight[0] = 1;
            contact.normal = ground->normal;
            contact.gap =
                ground->normal.dot(phyxels.position[i]) - ground->offset - phyxels.contact_radius[i];
            contact.friction = ground->friction;
            contact.max_depenetration = 0.04 * phyxels.contact_radius[i];
            const double reach = phyxels.velocity[i].norm() + input.gravity.norm() * input.dt;
            if (contact.gap < reach * input.dt + 0.2 * phyxels.contact_radius[i]) contacts.push_back(contact);
        }
        input.contacts.contacts = contacts;
        input.contacts.cached = &cached;
    }
    SolverReport step(const Parallel& parallel) {
        if (ground) find_contacts();
        return solver.step(phyxels, neighbourhoods, material, input, options, parallel);
    }
    void add(const Vec3& rest, double spacing, std::int32_t piece = 0) {
        phyxels.append(rest, 0.5 * spacing, piece);
        phyxels.volume.back() = spacing * spacing * spacing;
        phyxels.mass.back() = material.density * phyxels.volume.back();
        phyxels.support_radius.back() = 2 * spacing;
    }
    /// Sets positions and velocities: x = position_of(X), v = speed(x).
    void move(const std::function<Vec3(const Vec3&)>& position_of,
              const std::function<Vec3(const Vec3&)>& speed) {
        for (std::size_t i = 0; i < phyxels.size(); ++i) {
            phyxels.position[i] = position_of(phyxels.rest_position[i]);
            phyxels.velocity[i] = speed(phyxels.position[i]);
        }
    }
};

/// A lattice of nx x ny x nz phyxels centred at the origin.
inline Specimen block(int nx, int ny, int nz, double spacing, const Material& material,
                      const Parallel& parallel) {
    Specimen body;
    body.material = material;
    for (int z = 0; z < nz; ++z)
        for (int y = 0; y < ny; ++y)
            for (int x = 0; x < nx; ++x)
                body.add(spacing * Vec3(x - 0.5 * (nx - 1), y - 0.5 * (ny - 1), z - 0.5 * (nz - 1)), spacing);
    body.connect(parallel);
    return body;
}

inline Vec3 random_vector(Random& random, double size) {
    const double x = random.uniform(-size, size), y = random.uniform(-size, size);
    return {x, y, random.uniform(-size, size)};
}

inline Mat3 random_rotation(Random& random) {
    const Vec3 axis = random_vector(random, 1).normalized();
    return Eigen::AngleAxisd(random.uniform(0, std::numbers::pi), axis).toRotationMatrix();
}

/// Sets the visibility of pairs that a plane through `point` separates to zero. Returns them.
inline std::vector<std::uint32_t> cut_by_plane(Specimen& body, const Vec3& point, const Vec3& normal) {
    std::vector<std::uint32_t> changed;
    for (std::size_t p = 0; p < body.pairs.size(); ++p) {
        const double a = normal.dot(body.phyxels.rest_position[body.pairs.a[p]] - point);
        const double b = normal.dot(body.phyxels.rest_position[body.pairs.b[p]] - point);
        if ((a < 0) == (b < 0) || body.pairs.visibility[p] == 0) continue;
        body.pairs.visibility[p] = 0;
        changed.push_back(static_cast<std::uint32_t>(p));
    }
    return changed;
}

/// Cuts by random planes near the body's middle and rebuilds.
inline void cut_randomly(Specimen& body, int count, double reach, std::uint64_t seed,
                         const Parallel& parallel) {
    Random random(seed);
    for (int k = 0; k < count; ++k) {
        const Vec3 point = random_vector(random, reach);
        cut_by_plane(body, point, random_vector(random, 1).normalized());
    }
    body.neighbourhoods.rebuild(body.phyxels, body.pairs, body.material, parallel);
}

/// Returns the largest |F - R| at the phyxels' current positions.
inline double largest_strain(const Specimen& body) {
    double largest = 0;
    for (std::size_t i = 0; i < body.phyxels.size(); ++i)
        largest = std::max(largest, (body.phyxels.deformation[i] - body.phyxels.rotation[i]).norm());
    return largest;
}

}  // namespace splitcubes::meshless::fixtures
