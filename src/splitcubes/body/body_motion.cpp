// The last stages of a step: integration of the body, then node frames and surface.
#include <splitcubes/body/body.h>
#include <splitcubes/body/step_context.h>
#include <splitcubes/body/step_report.h>
#include <splitcubes/node_motion/lattice_node_motion.h>
#include <splitcubes/splitting/surface.h>

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

void Body::advance_deformation(const StepContext& context, StepReport& report) {
    const BoundaryConditions::HeldPoints held =
        boundary_.hold(inside_.rest_position, context.time, context.dt);
    deformation::Motion motion{context.time, context.dt,    context.gravity, std::nullopt,
                               held.held,    held.position, context.parallel};
    if (context.ground)
        motion.ground = deformation::Motion::Ground{context.ground->normal, context.ground->offset,
                                                    context.ground->friction};
    const deformation::MotionReport moved = lattice_->advance(motion);
    samples_.previous_deformation = samples_.phyxels.deformation;
    lattice_->move_phyxels(grid_, samples_.owner, context.dt, samples_.phyxels);
    lattice_->count_step();
    report.solver.substeps = std::max(report.solver.substeps, moved.substeps);
    report.counts.contacts += moved.contacts;
    report.totals.kinetic_energy += moved.kinetic_energy;
    report.totals.elastic_energy += moved.elastic_energy;
    report.totals.momentum += moved.momentum;
    report.totals.angular_momentum += moved.angular_momentum;
    report.totals.top_speed = std::max(report.totals.top_speed, moved.top_speed);
    if (!moved.finite) report.flags |= flag_non_finite;
}

void Body::add_handle_springs(const StepContext& context, std::uint32_t part,
                              std::vector<meshless::HandleSpring>& handle_springs,
                              std::vector<double>& limits) {
    boundary_.add_handle_springs(samples_.phyxels, context.time, context.dt, part, handle_springs, limits);
}

void Body::end_step(const StepContext& context, const meshless::SolverReport& solved, StepReport& report) {
    motion_->count_step();
    report.solver.iterations += solved.iterations;
    report.solver.substeps = std::max(report.solver.substeps, solved.substeps);
    report.counts.contacts += solved.contacts;
    report.solver.energy_excess_pieces += solved.energy_excess_pieces;
    report.solver.retries += solved.retries;
    report.solver.energy_removed += solved.energy_removed;
    if (solved.energy_excess_pieces > 0) report.flags |= flag_energy_excess;
    report.totals.kinetic_energy += solved.kinetic_energy;
    report.totals.elastic_energy += solved.elastic_energy;
    report.totals.contact_energy += solved.contact_energy;
    report.work.holds += solved.work.holds;
    report.work.handles += solved.work.handles;
    report.totals.momentum += solved.momentum;
    report.totals.angular_momentum += solved.angular_momentum;
    report.totals.top_speed = std::max(report.totals.top_speed, solved.top_speed);
    if (solved.took_implicit) report.flags |= flag_took_implicit;
    if (solved.inverted > 0) report.flags |= flag_inverted;
    if (solved.non_finite > 0) report.flags |= flag_non_finite;
    if (solved.rank_deficient > 0) report.flags |= flag_rank_deficient;
    if (solved.residual > context.solver.tolerance) report.flags |= flag_not_converged;
}

void Body::update_node_frames(const StepContext& context, StepReport& report) {
    motion_->update_frames(tracker_context(context.parallel));
    if (motion_->has_fallback_frames()) report.flags |= flag_frame_fallback;
}

void Body::move_surface(const StepContext& context) {
    surface_motion_.update(*surface_, grid_.rest(), motion_->tracker(), motion_->frames(), context.parallel);
}

void Body::draw_as_moved(const StepContext& context) {
    if (surface_motion_.has_set_positions()) move_surface(context);
}

void Body::finish_surface(const StepContext& context, StepReport& report) {
    if (context.contacts && sampler_.revision() != surface_->revision())
        sampler_.rebuild(grid_, *surface_, *pieces_, samples_.spacing, context.parallel);
    report.totals.phyxels += samples_.phyxels.size();
    report.totals.pieces += pieces_->count();
    report.totals.cut_edges += cut_edge_count_;
    report.totals.surface_cells += surface_->cells().size();
    report.totals.triangles += surface_->triangle_count();
    report.totals.pairs += context.parallel.sum<std::size_t>(
        samples_.pairs.size(), 1 << 15, 0, [&](std::size_t begin, std::size_t end) {
            std::uint32_t visible = 0;
            for (std::size_t k = begin; k < end; ++k)
                visible += std::uint32_t{samples_.pairs.visibility[k] > 0};
            return std::size_t{visible};
        });
    struct Gravity {
        double mass = 0;             // kg
        Vec3 moment = Vec3::Zero();  // kg m, mass times position
        Gravity& operator+=(const Gravity& other) {
            mass += other.mass;
            moment += other.moment;
            return *this;
        }
    };
    const meshless::Phyxels& phyxels = samples_.phyxels;
    Gravity sum = context.parallel.sum<Gravity>(
        phyxels.size(), 2048, Gravity{}, [&](std::size_t begin, std::size_t end) {
            Gravity part;
            for (std::size_t i = begin; i < end; ++i) {
                part.mass += phyxels.mass[i];
                if (phyxels.rigid.index(phyxels.piece[i]) < 0)
                    part.moment += phyxels.mass[i] * phyxels.position[i];
            }
            return part;
        });
    for (const meshless::RigidPiece& piece : phyxels.rigid.bodies) sum.moment += piece.mass * piece.centre;
    report.totals.mass += sum.mass;
    report.totals.potential_energy -= context.gravity.dot(sum.moment);
}

}  // namespace splitcubes::body
