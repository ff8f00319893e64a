// Figure 7 of Pietroni et al. 2007 for all criteria, as a picture and as numbers.
#pragma once

#include <filesystem>

namespace splitcubes::app::figures {

/// Writes a PNG: columns are a partial cut, a complete one and two with a gap; rows are the criteria in the
/// order of occlusion::criterion_names. Throws JobError in a build without pictures.
void draw_weights(const std::filesystem::path& picture);

/// Writes the same fields at lower resolution: cut,criterion,x,y,weight; x and y in phyxel spacings.
void write_weights(const std::filesystem::path& csv);

}  // namespace splitcubes::app::figures
