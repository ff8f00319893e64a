#include "published_state.h"

namespace splitcubes::view {

// Arrays that states share are counted once a cut, with the state that follows it.
std::size_t PublishedState::bytes() const {
    std::size_t out = sizeof(PublishedState);
    for (const BodyState& body : bodies) {
        out += sizeof(float) * (body.positions.size() + body.normals.size() + body.field.size() +
                                body.sample_positions.size() + body.sample_field.size());
        if (statistics.new_cut_edges > 0)
            out += 17 * body.topology->origins.size() + 16 * body.topology->pieces.size();
    }
    return out;
}

}  // namespace splitcubes::view
