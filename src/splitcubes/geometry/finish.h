// Looks of surfaces for pictures: colour, gloss and solid textures over rest space.
#pragma once

#include <splitcubes/math/types.h>

#include <cstddef>
#include <vector>

namespace splitcubes::geometry {

/// Material between the surface of the uncut body and a depth below it.
struct FinishLayer {
    double depth = 0;                   // m, lower end
    Vec3 colour = Vec3::Constant(0.8);  // sRGB
    bool operator==(const FinishLayer&) const = default;
};

/// Material from a height along an axis on, up to the next stripe.
struct FinishStripe {
    double from = 0;                    // m, along the axis
    Vec3 colour = Vec3::Constant(0.8);  // sRGB
    bool operator==(const FinishStripe&) const = default;
};

/// Balls of another colour, spread at random.
struct FinishSpeckles {
    double size = 0.003;                // m, largest diameter
    double share = 0.2;                 // of the volume, 0 .. 0.6
    Vec3 colour = Vec3::Constant(0.5);  // sRGB
    bool operator==(const FinishSpeckles&) const = default;
};

/// How a surface looks. Layers hide stripes, which hide the colour; speckles lie over all. They are
/// functions of the rest position, so that they move with the material and fit across cuts.
struct Finish {
    static constexpr std::size_t max_layers = 4, max_stripes = 8, max_speckles = 2;

    Vec3 colour = Vec3::Constant(0.8);       // sRGB
    double roughness = 0.5;                  // 0 mirror .. 1 chalk
    double metalness = 0;                    // 0 plastic .. 1 metal
    std::vector<FinishLayer> layers = {};    // by increasing depth
    Vec3 stripe_axis = Vec3::UnitZ();        // world at time 0, of any length above zero
    std::vector<FinishStripe> stripes = {};  // by increasing height
    std::vector<FinishSpeckles> speckles = {};

    bool is_plain() const { return layers.empty() && stripes.empty() && speckles.empty(); }
    bool operator==(const Finish&) const = default;
};

}  // namespace splitcubes::geometry
