#include <splitcubes/fracture/tearing.h>

namespace splitcubes::body {

Tearing::Tearing(const TearSettings& settings, const meshless::Material& material,
                 const splitting::NodeGrid& grid, const meshless::Phyxels& phyxels,
                 const meshless::Neighbourhoods& neighbourhoods)
    : strength_(settings, grid),
      stress_(strength_, phyxels, neighbourhoods),
      cells_(grid),
      front_(strength_, stress_, cells_, material, grid),
      nucleation_(strength_, stress_, cells_, front_, material),
      separation_(strength_, stress_, cells_, material, grid) {}

std::vector<std::int32_t> Tearing::tear(splitting::NodeGrid& grid, const TearContext& context) {
    std::vector<std::int32_t> slots;
    top_load_ = 0;
    if (context.neighbourhoods.size() != context.phyxels.size()) return slots;
    cells_.note_crossings(grid);
    separation_.break_ligaments(grid, context, slots);
    // A crack cell that is not stale would miss these cuts, and after a checkpoint all are stale.
    cells_.note_crossings(grid);
    top_load_ = stress_.find_loads(grid, context);
    if (top_load_ < stress_.min_load()) return slots;
    stress_.begin_nodes(context);
    cells_.begin_step();
    front_.grow_loaded(grid, context, slots);
    nucleation_.begin_cracks(grid, context, slots);
    separation_.cut_passed_edges(grid, context, slots);
    return slots;
}

}  // namespace splitcubes::body
