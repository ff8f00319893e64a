// The stage in which a body's material gives way.
#include <splitcubes/body/body.h>
#include <splitcubes/body/tearing.h>

namespace splitcubes::body {

void Body::tear(const StepContext& context, StepReport& report) {
    if (!tearing_) return;
    // Which phyxels the last step held: from the constraints, not from that step's buffer,
    // which a body that goes on from a checkpoint does not have.
    std::vector<std::uint8_t> held(phyxels_.size(), 0);
    const double then = context.time - context.dt;
    for (const HoldConstraint& constraint : constraints_) {
        if (then < constraint.from || then >= constraint.until) continue;
        context.parallel.for_each(held.size(), 1024, [&](std::size_t i) {
            if (constraint.region(phyxels_.rest_position[i])) held[i] = 1;
        });
    }
    const std::vector<std::int32_t> slots =
        tearing_->tear(grid_, {*pieces_, occluders_, phyxels_, neighbourhoods_, locator_, settings_.material,
                               tracker_, frames_, held, spacing_, context.dt, context.parallel});
    new_slots_.insert(new_slots_.end(), slots.begin(), slots.end());
    report.new_cut_edges += slots.size();
    report.torn_edges += slots.size();
}

}  // namespace splitcubes::body
