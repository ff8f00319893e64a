// A random cloud of phyxels and nodes, for tests of lumped mass.
#pragma once

#include "dynamics/bodies.h"

#include <splitcubes/samples/mass_lumping.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace splitcubes::meshless::fixtures {

/// Random phyxels in a box and the nodes of a grid over it, optionally cut at x = 0.
struct LumpingScene {
    Phyxels phyxels;
    std::vector<Vec3> nodes;
    std::vector<double> volumes;
    std::vector<std::int32_t> pieces;
    PhyxelLocator locator;
    double density = 900;

    explicit LumpingScene(std::uint64_t seed) {
        Random random(seed);
        for (int i = 0; i < 200; ++i) {
            phyxels.append(random_vector(random, 0.2), 0.02);
            phyxels.support_radius.back() = random.uniform(0.03, 0.09);
            phyxels.position.back() =
                random_vector(random, 0.02) + phyxels.rest_position.back() + Vec3(5, -3, 2);
            phyxels.velocity.back() = random_vector(random, 1) + Vec3(3, 0, -4);
        }
        for (int z = -6; z <= 6; ++z)
            for (int y = -6; y <= 6; ++y)
                for (int x = -6; x <= 6; ++x) {
                    nodes.push_back(0.032 * Vec3(x, y, z));
                    volumes.push_back(random.uniform(0.2, 1) * 3e-5);
                }
        pieces.assign(nodes.size(), 0);
        locator = PhyxelLocator(phyxels.rest_position, 0.06);
    }
    MaterialNodes material_nodes() const { return {nodes, volumes, pieces}; }
    void part(double at, std::int32_t piece) {
        for (std::size_t b = 0; b < nodes.size(); ++b)
            if (nodes[b].x() > at) pieces[b] = piece;
        for (std::size_t i = 0; i < phyxels.size(); ++i)
            if (phyxels.rest_position[i].x() > at) phyxels.piece[i] = piece;
    }
    /// Parts a piece at a plane.
    void part(const Vec3& normal, double at, std::int32_t parent, std::int32_t piece) {
        for (std::size_t b = 0; b < nodes.size(); ++b)
            if (pieces[b] == parent && normal.dot(nodes[b]) > at) pieces[b] = piece;
        for (std::size_t i = 0; i < phyxels.size(); ++i)
            if (phyxels.piece[i] == parent && normal.dot(phyxels.rest_position[i]) > at)
                phyxels.piece[i] = piece;
    }
    double piece_volume(std::int32_t piece) const {
        double sum = 0;
        for (std::size_t b = 0; b < nodes.size(); ++b) sum += pieces[b] == piece ? volumes[b] : 0;
        return sum;
    }
};

}  // namespace splitcubes::meshless::fixtures
