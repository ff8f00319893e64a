// The stage of a step in which a body tears.
#include <splitcubes/body/body.h>
#include <splitcubes/body/step_context.h>
#include <splitcubes/body/step_report.h>
#include <splitcubes/body_samples/topology_change.h>
#include <splitcubes/core/error.h>
#include <splitcubes/fracture/tearing.h>
#include <splitcubes/node_motion/node_motion.h>

#include <cmath>

namespace splitcubes::body {

void check_tearing(const TearSettings& s, const std::string& where) {
    if (!(s.strength > 0)) throw InputError(where + ".strength", "must be above zero");
    if (!(s.propagation_ratio > 0 && s.propagation_ratio <= 1))
        throw InputError(where + ".propagation_ratio", "must be above 0 and at most 1");
    if (!(s.crack_speed >= 0) || !std::isfinite(s.crack_speed))
        throw InputError(where + ".crack_speed", "must be a positive number of metres a second");
}

void Body::tear(const StepContext& context, TopologyChange& change, StepReport& report) {
    if (!tearing_) return;
    // The phyxels held in the last step follow from the constraints: those of begin_step are not in a
    // checkpoint.
    const std::span<const std::uint8_t> held =
        boundary_.held_among(samples_.phyxels, context.time - context.dt);
    const std::vector<std::int32_t> slots =
        tearing_->tear(grid_, {*pieces_, occluders_.grid(), samples_.phyxels, samples_.neighbourhoods,
                               samples_.locator, settings_.material, motion_->tracker(), motion_->frames(),
                               held, samples_.spacing, context.dt, context.parallel});
    change.crossings.insert(change.crossings.end(), slots.begin(), slots.end());
    report.counts.new_cut_edges += slots.size();
    report.counts.torn_edges += slots.size();
}

}  // namespace splitcubes::body
