// SIMD loops of InfluenceTable over its lists, which begin `stride` numbers apart.
#pragma once

#include <splitcubes/node_motion/influence_table.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace splitcubes::body {

struct InfluenceLists {
    const float* numbers;
    std::size_t stride, begin, end;
};

/// Copies the entries that reach the cube to `to` in their order and returns their number. recentre: makes
/// positions and maps relative to the cube's centre. `to` needs capacity for sixteen entries more than are
/// written.
std::size_t choose_influences(const InfluenceLists& from, const InfluenceTable::Cube& cube, bool recentre,
                              float* to, std::size_t to_stride);
/// Sums nine lists, each in sixteen partial sums that are added in order.
void sum_lists(const float* first, std::size_t stride, std::size_t count, std::span<float, 9> sums);
/// Computes lower and upper bounds of the cube's points under the maps of the entries that reach it;
/// +infinity and -infinity if none does.
void bound_influences(const InfluenceLists& from, const InfluenceTable::Cube& cube, std::span<float, 3> low,
                      std::span<float, 3> high);

}  // namespace splitcubes::body
