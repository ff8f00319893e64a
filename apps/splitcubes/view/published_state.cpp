#include "published_state.h"

#include <algorithm>
#include <limits>

namespace splitcubes::view {

void find_bounds(BodyState& body) {
    constexpr float far = std::numeric_limits<float>::infinity();
    const std::vector<std::uint32_t>& corners = body.topology->triangles;
    const std::size_t triangles = corners.size() / 3;
    body.blocks.assign((triangles + triangles_per_block - 1) / triangles_per_block,
                       {far, far, far, -far, -far, -far});
    body.bounds = {};
    for (std::size_t b = 0; b < body.blocks.size(); ++b) {
        std::array<float, 6>& box = body.blocks[b];
        const std::size_t end = std::min(triangles, (b + 1) * triangles_per_block);
        for (std::size_t t = b * triangles_per_block; t < end; ++t) {
            if (corners[3 * t] == corners[3 * t + 1]) continue;
            for (std::size_t k = 3 * t; k < 3 * t + 3; ++k)
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    const float value = body.positions[3 * std::size_t{corners[k]} + axis];
                    box[axis] = std::min(box[axis], value);
                    box[axis + 3] = std::max(box[axis + 3], value);
                }
        }
        if (!(box[0] <= box[3])) continue;
        body.bounds.add(Vec3(box[0], box[1], box[2]));
        body.bounds.add(Vec3(box[3], box[4], box[5]));
    }
}

std::size_t SurfaceTopology::bytes() const {
    std::size_t out = sizeof(SurfaceTopology);
    const auto add = [&](const auto& array) { out += sizeof(array[0]) * array.capacity(); };
    add(triangles);
    add(origins);
    add(materials);
    add(pieces);
    add(rest);
    add(cuts);
    add(born);
    add(corner_uv);
    add(rest_and_depth);
    for (const SurfaceChange& change : changes) {
        add(change.vertices);
        add(change.triangles);
    }
    return out;
}

std::size_t PublishedState::bytes() const {
    std::size_t out = sizeof(PublishedState);
    const auto add = [&](const auto& array) { out += sizeof(array[0]) * array.capacity(); };
    for (const BodyState& body : bodies) {
        add(body.positions);
        add(body.normals);
        add(body.field);
        add(body.sample_positions);
        add(body.sample_field);
        add(body.links);
        add(body.marks);
        add(body.blocks);
        out += sizeof(BodyState);
    }
    add(forces.contacts);
    add(forces.arrows);
    add(instruments);
    return out;
}

}  // namespace splitcubes::view
