// Finishes by name. Sizes of speckles are those of the things themselves.
#include <splitcubes/scene/appearance.h>

#include <algorithm>
#include <utility>

namespace splitcubes::scene {

namespace {

using geometry::Finish;

Finish plain(const Vec3& colour, double roughness, double metalness = 0) {
    Finish out;
    out.colour = colour;
    out.roughness = roughness;
    out.metalness = metalness;
    return out;
}

Finish speckled(Finish finish, double size, double share, const Vec3& colour) {
    finish.speckles.push_back({size, share, colour});
    return finish;
}

const std::vector<std::pair<std::string_view, Finish>>& kinds() {
    static const std::vector<std::pair<std::string_view, Finish>> list = {
        {"steel", plain(Vec3(0.80, 0.81, 0.83), 0.30, 1)},
        {"brass", plain(Vec3(0.87, 0.71, 0.38), 0.35, 1)},
        {"plastic", plain(Vec3(0.10, 0.10, 0.11), 0.42)},
        {"ceramic", plain(Vec3(0.93, 0.93, 0.91), 0.20)},
        {"rubber", plain(Vec3(0.20, 0.21, 0.23), 0.80)},
        {"wood", speckled(plain(Vec3(0.60, 0.41, 0.24), 0.65), 0.003, 0.15, Vec3(0.55, 0.37, 0.21))},
        {"stone", speckled(plain(Vec3(0.62, 0.61, 0.59), 0.85), 0.005, 0.30, Vec3(0.45, 0.45, 0.46))},
        {"skin", plain(Vec3(0.90, 0.74, 0.62), 0.55)},
        {"flesh", speckled(plain(Vec3(0.72, 0.20, 0.18), 0.38), 0.003, 0.15, Vec3(0.80, 0.34, 0.30))},
        {"fat", plain(Vec3(0.95, 0.86, 0.62), 0.45)},
        {"liver", plain(Vec3(0.43, 0.14, 0.11), 0.28)},
        {"jelly", plain(Vec3(0.78, 0.08, 0.12), 0.12)},
        {"crust", speckled(plain(Vec3(0.70, 0.45, 0.22), 0.75), 0.0035, 0.18, Vec3(0.61, 0.36, 0.15))},
        {"crumb", speckled(plain(Vec3(0.96, 0.90, 0.76), 0.95), 0.004, 0.22, Vec3(0.84, 0.74, 0.55))},
        {"sponge", speckled(plain(Vec3(0.95, 0.80, 0.48), 0.95), 0.003, 0.20, Vec3(0.85, 0.67, 0.36))},
        {"cream", plain(Vec3(0.98, 0.95, 0.88), 0.60)},
        {"chocolate", plain(Vec3(0.30, 0.17, 0.10), 0.35)},
        {"cheese", plain(Vec3(0.97, 0.79, 0.34), 0.45)},
        {"peel", speckled(plain(Vec3(0.96, 0.53, 0.08), 0.42), 0.0015, 0.20, Vec3(0.90, 0.45, 0.05))},
        {"pith", plain(Vec3(0.98, 0.93, 0.80), 0.80)},
        {"pulp", speckled(plain(Vec3(0.98, 0.62, 0.16), 0.25), 0.004, 0.20, Vec3(1.00, 0.74, 0.32))},
        {"rope", speckled(plain(Vec3(0.82, 0.70, 0.48), 0.90), 0.002, 0.30, Vec3(0.70, 0.56, 0.34))},
    };
    return list;
}

}  // namespace

const geometry::Finish* finish_of_kind(std::string_view kind) {
    const auto found =
        std::find_if(kinds().begin(), kinds().end(), [&](const auto& one) { return one.first == kind; });
    return found == kinds().end() ? nullptr : &found->second;
}

const std::vector<std::string_view>& finish_kind_names() {
    static const std::vector<std::string_view> names = [] {
        std::vector<std::string_view> out;
        for (const auto& [name, finish] : kinds()) out.push_back(name);
        return out;
    }();
    return names;
}

}  // namespace splitcubes::scene
