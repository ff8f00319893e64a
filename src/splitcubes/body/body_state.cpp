// Saves a body to a checkpoint and restores it. State that follows from other state is not stored but
// derived, so that it cannot contradict it: grid, surface and pieces from the cuts, masses from the mass
// lumping, kernels and vertices from phyxels and nodes. Every stored number is checked when it is read.
#include <splitcubes/body/body.h>
#include <splitcubes/math/state_numbers.h>
#include <splitcubes/node_motion/blade_fronts.h>
#include <splitcubes/node_motion/node_motion.h>
#include <splitcubes/splitting/surface.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace splitcubes::body {

namespace {

// Stored bytes of a cut edge: bounds the count that is read.
constexpr std::size_t bytes_of_cut = 48;

// Whether an edge lies within the material and is uncut.
bool can_be_cut(const splitting::NodeGrid& grid, const splitting::GridEdge& edge) {
    return edge.axis < 3 && grid.has_edge(edge) && grid.inside(edge.node) && grid.inside(edge.upper()) &&
           !grid.is_cut(edge);
}

bool is_direction_along(const Vec3& normal, int axis) {
    return std::abs(normal.norm() - 1) <= 1e-9 && normal[axis] >= 0;
}

}  // namespace

void Body::save(StateWriter& writer) const {
    save_cuts(writer);
    samples_.save(grid_, settings_.material, writer);
    motion_->save(writer, samples_.phyxels);
}

void Body::load(StateReader& reader, const Parallel& parallel) {
    try {
        load_cuts(reader);
        samples_.load(sample_context(parallel), reader);
        motion_->load(reader, tracker_context(parallel));
        rebuild_derived_state(parallel);
    } catch (const DamagedState& damaged) {
        throw DamagedState(std::string(damaged.what()) + " in body '" + settings_.name + "'");
    }
}

void Body::save_cuts(StateWriter& writer) const {
    writer.add(std::uint64_t{cut_edge_count_});
    const auto all = std::span(grid_.crossings()).subspan(solid_crossings_);
    for (const splitting::Crossing& c : all) writer.add(splitting::edge_id(c.edge));
    for (const splitting::Crossing& c : all) writer.add(c.hit);
    for (const splitting::Crossing& c : all) write_numbers(writer, c.normal);
    for (const splitting::Crossing& c : all) writer.add(c.cut);
    for (const splitting::Crossing& c : all)
        for (const std::uint8_t front : c.front) writer.add(front);
    writer.add(std::uint64_t{cut_stage_ends_.size()});
    writer.add(std::span<const std::uint32_t>(cut_stage_ends_));
}

// Repeats the cuts stage by stage, which reproduces surface and pieces.
void Body::load_cuts(StateReader& reader) {
    const std::size_t count = reader.count(bytes_of_cut);
    const std::vector<std::uint64_t> edges = reader.numbers<std::uint64_t>(count);
    const std::vector<double> hits = reader.numbers<double>(count, 0, 1, "a cut position outside its edge");
    std::vector<Vec3> normals;
    read_numbers(reader, count, normals, "an invalid cut normal");
    const std::vector<std::int32_t> cuts =
        reader.numbers<std::int32_t>(count, 0, std::numeric_limits<std::int32_t>::max(), "an invalid cut id");
    const std::vector<std::uint8_t> fronts =
        reader.numbers<std::uint8_t>(4 * count, 0, splitting::front_steps - 1, "a front outside its face");
    const std::vector<std::uint32_t> stage_ends = reader.numbers<std::uint32_t>(reader.count(4));
    require_state(stage_ends.empty() ? count == 0 : stage_ends.back() == count, "cuts assigned to no step");
    require_state(stage_ends.size() >= cut_stage_ends_.size() &&
                      std::equal(cut_stage_ends_.begin(), cut_stage_ends_.end(), stage_ends.begin()),
                  "initial cuts that differ from the scene's");
    for (std::size_t k = 0; k < cut_edge_count_; ++k)
        require_state(splitting::edge_id(grid_.crossings()[solid_crossings_ + k].edge) == edges[k],
                      "initial cuts that differ from the scene's");
    for (std::size_t s = cut_stage_ends_.size(); s < stage_ends.size(); ++s) {
        require_state(stage_ends[s] > cut_edge_count_ && stage_ends[s] <= count, "cuts assigned to no step");
        std::vector<std::int32_t> slots;
        for (std::size_t k = cut_edge_count_; k < stage_ends[s]; ++k) {
            splitting::Crossing crossing;
            crossing.edge = splitting::edge_from_id(edges[k]);
            require_state(can_be_cut(grid_, crossing.edge), "a cut on an edge that cannot be cut");
            require_state(is_direction_along(normals[k], crossing.edge.axis), "an invalid cut normal");
            crossing.hit = hits[k];
            crossing.normal = normals[k];
            crossing.origin = splitting::Origin::cut;
            crossing.cut = cuts[k];
            std::copy_n(fronts.begin() + static_cast<std::ptrdiff_t>(4 * k), 4, crossing.front.begin());
            slots.push_back(grid_.put(crossing));
        }
        surface_->retessellate(grid_, slots);
        pieces_->update(grid_, slots);
        cut_edge_count_ = stage_ends[s];
    }
    cut_stage_ends_ = stage_ends;
    std::vector<std::int32_t> all(cut_edge_count_);
    std::iota(all.begin(), all.end(), static_cast<std::int32_t>(solid_crossings_));
    *fronts_ = {};
    fronts_->add(grid_, all);
    inside_.label_pieces(grid_, *pieces_);
}

// Rebuilds all state that is not stored.
void Body::rebuild_derived_state(const Parallel& parallel) {
    occluders_.rebuild(grid_, *surface_, parallel);
    samples_.rebuild_locator();
    samples_.neighbourhoods.rebuild(samples_.phyxels, samples_.pairs, settings_.material, parallel);
    boundary_.forget_phyxels();
    surface_motion_.retrack_nodes(grid_, *surface_, motion_->tracker());
    surface_motion_.update(*surface_, grid_.rest(), motion_->tracker(), motion_->frames(), parallel);
    sampler_.rebuild(grid_, *surface_, *pieces_, samples_.spacing, parallel);
}

}  // namespace splitcubes::body
