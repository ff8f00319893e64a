// The solid of forceps.
#pragma once

#include <splitcubes/scene/instrument.h>

#include <vector>

namespace splitcubes::view {

/// Returns two jaws with their shanks, which meet at the far end. Own frame: the tips lie on the x axis,
/// `opening` m apart and a little below z = 0; the shanks go along z. width: m, between the tips of open
/// forceps, which gives their size. is_strained: they hold with all their force, and are red.
std::vector<scene::InstrumentPart> forceps_parts(double width, double opening, bool is_strained);

}  // namespace splitcubes::view
