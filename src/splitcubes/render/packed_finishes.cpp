#include <splitcubes/render/packed_finishes.h>
#include <splitcubes/render/packed_scene.h>

#include <algorithm>

namespace splitcubes::render {

int PackedFinishes::add(const geometry::Finish& finish) {
    const auto known = std::find(finishes_.begin(), finishes_.end(), finish);
    if (known != finishes_.end()) return static_cast<int>(known - finishes_.begin());
    if (finishes_.size() >= max_count) return -1;
    finishes_.push_back(finish);
    const std::size_t base = data_.size();
    data_.resize(base + 4 * texels_each, 0.0F);
    const auto put = [&](std::size_t texel, const Vec3& three, double fourth) {
        for (std::size_t k = 0; k < 3; ++k)
            data_[base + 4 * texel + k] = static_cast<float>(three[static_cast<Eigen::Index>(k)]);
        data_[base + 4 * texel + 3] = static_cast<float>(fourth);
    };
    const std::size_t layers = std::min(finish.layers.size(), geometry::Finish::max_layers);
    const std::size_t stripes = std::min(finish.stripes.size(), geometry::Finish::max_stripes);
    const std::size_t speckles = std::min(finish.speckles.size(), geometry::Finish::max_speckles);
    put(0, linear(finish.colour), std::clamp(finish.roughness, 0.1, 1.0));
    put(1, Vec3(finish.metalness, static_cast<double>(layers), static_cast<double>(stripes)),
        static_cast<double>(speckles));
    put(2, finish.stripe_axis.normalized(), 0);
    for (std::size_t k = 0; k < layers; ++k)
        put(3 + k, linear(finish.layers[k].colour), finish.layers[k].depth);
    for (std::size_t k = 0; k < stripes; ++k)
        put(7 + k, linear(finish.stripes[k].colour), finish.stripes[k].from);
    for (std::size_t k = 0; k < speckles; ++k) {
        put(15 + 2 * k, linear(finish.speckles[k].colour), finish.speckles[k].size);
        put(16 + 2 * k, Vec3(finish.speckles[k].share, 0, 0), 0);
    }
    return static_cast<int>(finishes_.size()) - 1;
}

}  // namespace splitcubes::render
