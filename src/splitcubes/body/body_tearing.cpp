// The stage in which a body's material gives way.
#include <splitcubes/body/body.h>
#include <splitcubes/body/tearing.h>

namespace splitcubes::body {

void Body::tear(const StepContext& context, StepReport& report) {
    if (!tearing_) return;
    const std::vector<std::int32_t> slots =
        tearing_->tear(grid_, {*pieces_, occluders_, phyxels_, neighbourhoods_, locator_, settings_.material,
                               tracker_, frames_, held_, spacing_, context.dt, context.parallel});
    new_slots_.insert(new_slots_.end(), slots.begin(), slots.end());
    report.new_cut_edges += slots.size();
    report.torn_edges += slots.size();
}

}  // namespace splitcubes::body
