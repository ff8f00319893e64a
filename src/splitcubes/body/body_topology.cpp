// The middle stages of a step, which update topology, visibility and neighbourhoods after edges were cut.
#include <splitcubes/body/body.h>
#include <splitcubes/body/step_context.h>
#include <splitcubes/body/step_report.h>
#include <splitcubes/body_samples/ligaments.h>
#include <splitcubes/body_samples/resampling.h>
#include <splitcubes/body_samples/rigid_outline.h>
#include <splitcubes/body_samples/topology_change.h>
#include <splitcubes/dynamics/cut_relaxation.h>
#include <splitcubes/node_motion/node_motion.h>
#include <splitcubes/splitting/surface.h>

#include <algorithm>
#include <cassert>
#include <numeric>

namespace splitcubes::body {

namespace {

// Lists the pieces with gaps among those to resample.
void resample_gaps(const meshless::Phyxels& phyxels, TopologyChange& change) {
    for (const Gap& gap : change.gaps)
        change.splits.push_back({phyxels.piece[gap.inside], phyxels.piece[gap.inside]});
}

}  // namespace

void Body::retessellate(const Parallel& parallel, TopologyChange& change, StepReport& report) {
    const std::vector<std::uint32_t>& changed =
        surface_->retessellate(grid_, change.crossings, change.fronts);
    change.cells = changed;
    change.boxes = occluders_.update(grid_, *surface_, changed, parallel);
    cut_edge_count_ += change.crossings.size();
    // Checkpoints rely on all crossings being stored in the order in which they were cut.
    assert(solid_crossings_ + cut_edge_count_ == grid_.crossings().size());
    assert(std::is_sorted(change.crossings.begin(), change.crossings.end()));
    if (!change.crossings.empty()) cut_stage_ends_.push_back(static_cast<std::uint32_t>(cut_edge_count_));
    report.counts.changed_cells += changed.size();
    surface_motion_.track_nodes(grid_, *surface_, motion_->tracker());
}

void Body::label_pieces(TopologyChange& change) {
    last_splits_.clear();
    if (change.crossings.empty()) return;
    change.splits = pieces_->update(grid_, change.crossings);
    last_splits_ = change.splits;
    if (change.splits.empty()) return;
    inside_.label_pieces(grid_, *pieces_);
    motion_->tracker().mark_pieces_changed();
}

void Body::update_visibility(const StepContext& context, TopologyChange& change, StepReport& report) {
    if (change.boxes.empty()) return;
    const ElasticSamples::VisibilityUpdate updated =
        samples_.update_visibility(sample_context(context.parallel), change);
    if (updated.pieces_changed) motion_->tracker().mark_pieces_changed();
    report.counts.disks += updated.evaluated;
    motion_->tracker().mark_near(change.boxes, samples_.largest_support(), occluders_.grid().changes(),
                                 context.parallel);
}

void Body::resample(const StepContext& context, TopologyChange& change, StepReport& report) {
    find_fast_fragments(context, change);
    resample_gaps(samples_.phyxels, change);
    if (!change.gaps.empty()) motion_->tracker().mark_pieces_changed();
    resample_splits(context, change, report);
    refresh_outlines(grid_, *surface_, *pieces_, change.cells, samples_.phyxels.rigid);
}

// Lists fragments that implicit steps cannot rotate, unless something holds them.
void Body::find_fast_fragments(const StepContext& context, TopologyChange& change) const {
    if (!(context.dt > 0) || context.solver.kind == meshless::SolverKind::explicit_steps || lattice_) return;
    change.fast_fragments = samples_.fast_fragments(pieces_->count(), context.dt);
    if (change.fast_fragments.empty()) return;
    std::vector<std::uint8_t> is_attached(pieces_->count(), 0);
    for (std::size_t i = 0; i < samples_.phyxels.size(); ++i)
        if (boundary_.is_held(samples_.phyxels, i) || boundary_.is_pulled(samples_.phyxels, i))
            is_attached[static_cast<std::size_t>(samples_.phyxels.piece[i])] = 1;
    std::erase_if(change.fast_fragments,
                  [&](std::int32_t piece) { return is_attached[static_cast<std::size_t>(piece)] != 0; });
    for (const std::int32_t piece : change.fast_fragments) change.splits.push_back({piece, piece});
    if (!change.fast_fragments.empty()) motion_->tracker().mark_pieces_changed();
}

void Body::resample_splits(const StepContext& context, TopologyChange& change, StepReport& report) {
    if (change.splits.empty()) return;
    // The phyxels held in the last step follow from the constraints: those of begin_step are not in a
    // checkpoint. Before the first step none is held.
    Attachments attachments;
    if (context.dt > 0) attachments.held = boundary_.held_among(samples_.phyxels, context.time - context.dt);
    attachments.holds = boundary_.constraints().size();
    attachments.handles = boundary_.handles().size();
    attachments.hold_acts_on = [this](std::size_t i) { return boundary_.is_held(samples_.phyxels, i); };
    attachments.handle_acts_on = [this](std::size_t i) { return boundary_.is_pulled(samples_.phyxels, i); };
    attachments.hold_offset = [&](const Vec3& rest, const Vec3& position) {
        return boundary_.hold_offset(rest, position, context.time);
    };
    body::resample(sample_context(context.parallel), *surface_, motion_->tracker(), attachments, samples_,
                   change);
    if (change.new_phyxels > 0) boundary_.forget_phyxels();
    report.counts.new_phyxels += change.new_phyxels;
}

// Treats parts of the input that are too small to deform as pieces that were cut off: gives them phyxels, or
// makes them rigid.
void Body::sample_small_parts(const Parallel& parallel) {
    TopologyChange change;
    std::vector<std::uint32_t> all(samples_.phyxels.size());
    std::iota(all.begin(), all.end(), 0U);
    bridge_ligaments(grid_, pieces_->count(), samples_, all, change);
    resample_gaps(samples_.phyxels, change);
    for (const std::int32_t piece : samples_.coarse_parts(pieces_->count()))
        change.splits.push_back({piece, piece});
    if (!change.splits.empty())
        body::resample(sample_context(parallel), *surface_, motion_->tracker(), {}, samples_, change);
    update_links(parallel, change);
}

void Body::update_links(const Parallel& parallel, TopologyChange& change) {
    if (!change.dirty_pairs.empty())
        samples_.neighbourhoods.update(samples_.phyxels, samples_.pairs, change.dirty_pairs,
                                       settings_.material, parallel);
    if (change.volumes_changed)
        samples_.neighbourhoods.refresh_volumes(samples_.phyxels, settings_.material, parallel);
    change.dirty_pairs.clear();
}

// Tells the neighbourhoods which phyxels the coming step holds. Returns whether others are than before.
bool Body::update_held(const StepContext& context) {
    if (lattice_) return false;
    const std::span<const std::uint8_t> held = boundary_.held_among(samples_.phyxels, context.time);
    samples_.phyxels.held.assign(held.begin(), held.end());
    return samples_.neighbourhoods.update_held(samples_.phyxels, samples_.pairs, settings_.material,
                                               context.parallel);
}

// Takes away elastic energy that the new neighbourhoods would add: those of a cut, of a hold that lets go.
// There is none before the first step.
void Body::relax_cut(const StepContext& context, const TopologyChange& change) {
    if (!(context.dt > 0) || lattice_ || !(samples_.phyxels.history_step > 0)) return;
    relaxation_->relax(
        samples_.phyxels, samples_.neighbourhoods, settings_.material,
        {samples_.phyxels.held, change.rejoined, context.gravity, static_cast<int>(pieces_->count())},
        context.parallel);
}

void Body::rebuild_neighbourhoods(const StepContext& context, TopologyChange& change) {
    motion_->edges_cut(grid_, change.crossings);
    const bool is_relinked = !change.dirty_pairs.empty() || change.volumes_changed;
    update_links(context.parallel, change);
    const bool is_held_otherwise = update_held(context);
    if (is_held_otherwise || is_relinked) relax_cut(context, change);
    motion_->tracker().let_sleep();
    motion_->tracker().refresh(tracker_context(context.parallel));
}

}  // namespace splitcubes::body
