// The weights that the visibility criteria give at cuts near a phyxel: the subject of figure 7 of Pietroni et
// al. 2007.
#pragma once

#include <splitcubes/occlusion/segment_criteria.h>

#include <array>
#include <string>
#include <vector>

namespace splitcubes::app::figures {

/// Phyxels on a lattice of spacing 1, one of them at the origin, and flat cuts in the plane x = 0.5, viewed
/// in the plane z = 0.
struct CutScene {
    std::string name;
    std::vector<std::array<double, 2>> cut;  // ranges of y that are cut
    geometry::OccluderGrid occluders;
};
CutScene make_cut(const std::string& name, std::vector<std::array<double, 2>> ranges);

/// Returns the support radius of the lattice's phyxels: 3 times the mean distance of the ten nearest (Mueller
/// et al. 2004), which shows more than the program's factor 1.6.
double lattice_support();

/// Coordinate of the ends of cuts that extend beyond the view.
inline constexpr double far_away = 7;

/// Returns for each point the factor of its weight about the origin's phyxel, 0 .. 1.
std::vector<double> factors(const CutScene& scene, occlusion::CriterionKind kind,
                            const std::vector<Vec3>& points);

/// Returns the kernel's weight at a distance; 1 at distance 0.
double kernel_weight(double distance);

}  // namespace splitcubes::app::figures
