// Saves a body to a checkpoint and restores it. State that follows from other state is not stored but
// derived, so that it cannot contradict it: grid, surface and pieces from the cuts, masses from the mass
// lumping, kernels and vertices from phyxels and nodes. Every stored number is checked when it is read.
#include <splitcubes/body/body.h>
#include <splitcubes/math/state_numbers.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::body {

namespace {

// Stored bytes of a cut edge: bounds the count that is read.
constexpr std::size_t bytes_of_cut = 44;

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
    tracker_.save(writer, samples_.phyxels);
    save_motion(writer);
}

void Body::load(StateReader& reader, const Parallel& parallel) {
    try {
        load_cuts(reader);
        samples_.load(sample_context(parallel), reader);
        tracker_.load(reader, tracker_context(parallel));
        load_motion(reader);
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
            slots.push_back(grid_.put(crossing));
        }
        surface_->retessellate(grid_, slots);
        pieces_->update(grid_, slots);
        cut_edge_count_ = stage_ends[s];
    }
    cut_stage_ends_ = stage_ends;
    inside_.label_pieces(grid_, *pieces_);
}

void Body::save_motion(StateWriter& writer) const {
    writer.add(numbers_of(frames_));
    writer.add(step_);
    // Only the positions of nodes that were near a blade in the last step are used again.
    std::vector<std::uint32_t> nodes;
    std::vector<Vec3> positions;
    for (std::uint32_t node = 0; node < cut_step_.size(); ++node) {
        if (cut_step_[node] != step_ - 1) continue;
        nodes.push_back(node);
        positions.push_back(cut_position_[node]);
    }
    writer.add(std::uint64_t{nodes.size()});
    writer.add(std::span<const std::uint32_t>(nodes));
    writer.add(numbers_of(positions));
    if (!deformation_) return;
    const std::vector<double> state = deformation_->state();
    writer.add(std::span<const double>(state));
    writer.add(numbers_of(node_frames_before_));
}

void Body::load_motion(StateReader& reader) {
    read_numbers(reader, tracker_.size(), frames_, "a node with an invalid frame or position");
    step_ = reader.number<std::int64_t>(0, std::numeric_limits<std::int32_t>::max(), "an invalid step count");
    const std::size_t near_blades = reader.count(sizeof(Vec3) + sizeof(std::uint32_t));
    const std::vector<std::uint32_t> nodes = reader.numbers<std::uint32_t>(near_blades);
    std::vector<Vec3> positions;
    read_numbers(reader, near_blades, positions, "a node with an invalid frame or position");
    cut_position_.assign(tracker_.size(), Vec3::Zero());
    cut_step_.assign(tracker_.size(), -2);
    for (std::size_t k = 0; k < near_blades; ++k) {
        require_state(nodes[k] < tracker_.size(), "an unknown node");
        cut_position_[nodes[k]] = positions[k];
        cut_step_[nodes[k]] = step_ - 1;
    }
    if (!deformation_) return;
    std::vector<double> state;
    read_numbers(reader, deformation_->state().size(), state, "an invalid deformation state");
    read_numbers(reader, inside_.size(), node_frames_before_, "a node with an invalid frame or position");
    restore_deformation(state);
}

// Rebuilds all state that is not stored.
void Body::rebuild_derived_state(const Parallel& parallel) {
    occluders_.rebuild(grid_, *surface_, parallel);
    samples_.rebuild_locator();
    samples_.neighbourhoods.rebuild(samples_.phyxels, samples_.pairs, settings_.material, parallel);
    boundary_.forget_phyxels();
    surface_motion_.retrack_nodes(grid_, *surface_, tracker_);
    if (deformation_) deformation_->node_frames(node_frames_, parallel);
    surface_motion_.update(*surface_, grid_.rest(), tracker_, frames_, parallel);
    sampler_.rebuild(grid_, *surface_, *pieces_, samples_.spacing, parallel);
}

}  // namespace splitcubes::body
