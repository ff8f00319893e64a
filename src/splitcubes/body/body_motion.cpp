// The last stages of a step: integration of the body, then node frames and surface.
#include <splitcubes/body/body.h>

#include <algorithm>

namespace splitcubes::body {

meshless::StepInput Body::begin_step(const StepContext& context) {
    boundary_.begin_step(samples_.phyxels, context.time, context.dt, context.parallel);
    samples_.previous_deformation.resize(samples_.phyxels.size());
    context.parallel.for_each(samples_.phyxels.size(), 1024, [&](std::size_t i) {
        samples_.previous_deformation[i] = samples_.phyxels.deformation[i];
    });
    meshless::StepInput input;
    input.dt = context.dt;
    input.gravity = context.gravity;
    input.held = boundary_.held();
    input.held_position = boundary_.held_position();
    input.obstacles = context.obstacles;
    input.kinematic_rigid_pieces = boundary_.kinematic_rigid_pieces();
    input.piece_count = static_cast<int>(pieces_->count());
    return input;
}

void Body::end_step(const StepContext& context, const meshless::SolverReport& solved, StepReport& report) {
    ++step_;
    report.solver_iterations += solved.iterations;
    report.substeps = std::max(report.substeps, solved.substeps);
    report.contacts += solved.contacts;
    report.energy_excess_pieces += solved.energy_excess_pieces;
    report.retries += solved.retries;
    report.energy_removed += solved.energy_removed;
    if (solved.energy_excess_pieces > 0) report.flags |= flag_energy_excess;
    report.kinetic_energy += solved.kinetic_energy;
    report.elastic_energy += solved.elastic_energy;
    report.contact_energy += solved.contact_energy;
    report.momentum += solved.momentum;
    report.angular_momentum += solved.angular_momentum;
    report.top_speed = std::max(report.top_speed, solved.top_speed);
    if (solved.inverted > 0) report.flags |= flag_inverted;
    if (solved.non_finite > 0) report.flags |= flag_non_finite;
    if (solved.rank_deficient > 0) report.flags |= flag_rank_deficient;
    if (solved.residual > context.solver.tolerance) report.flags |= flag_not_converged;
}

void Body::update_node_frames(const StepContext& context, StepReport& report) {
    const TrackerContext tracker = tracker_context(context.parallel);
    tracker_.refresh(tracker);
    evaluate_frames_now(tracker);
    if (!deformation_ && tracker_.fallback_count() > 0) report.flags |= flag_frame_fallback;
}

void Body::update_surface(const StepContext& context, StepReport& report) {
    surface_motion_.update(*surface_, grid_.rest(), tracker_, frames_, context.parallel);
    if (context.contacts && sampler_.revision() != surface_->revision())
        sampler_.rebuild(grid_, *surface_, *pieces_, samples_.spacing, context.parallel);
    report.phyxels += samples_.phyxels.size();
    report.pieces += pieces_->count();
    report.cut_edges += cut_edge_count_;
    report.surface_cells += surface_->cells().size();
    report.triangles += surface_->triangle_count();
    report.pairs += context.parallel.sum<std::size_t>(
        samples_.pairs.size(), 1 << 15, 0, [&](std::size_t begin, std::size_t end) {
            std::uint32_t visible = 0;
            for (std::size_t k = begin; k < end; ++k)
                visible += std::uint32_t{samples_.pairs.visibility[k] > 0};
            return std::size_t{visible};
        });
    report.mass += context.parallel.sum<double>(samples_.phyxels.size(), 2048, 0,
                                                [&](std::size_t begin, std::size_t end) {
                                                    double mass = 0;
                                                    for (std::size_t i = begin; i < end; ++i)
                                                        mass += samples_.phyxels.mass[i];
                                                    return mass;
                                                });
}

}  // namespace splitcubes::body
