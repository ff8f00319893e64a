// The loops of InfluenceTable over its lists. `stride` numbers are from one list to the next.
#pragma once

#include <splitcubes/body/influence_table.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace splitcubes::body {

struct InfluenceLists {
    const float* numbers;
    std::size_t stride, begin, end;
};

/// Writes those that reach the cube from `to` on, in their order; returns how many. With `recentre`,
/// from the cube's centre. There must be room for sixteen more than are written.
std::size_t choose_influences(const InfluenceLists& from, const InfluenceTable::Cube& cube, bool recentre,
                              float* to, std::size_t to_stride);
/// Sums of nine lists, in sixteen parts that are added in order.
void sum_lists(const float* first, std::size_t stride, std::size_t count, std::span<float, 9> sums);
/// Low and high ends of what those that reach the cube make of it; both infinite where none does.
void bound_influences(const InfluenceLists& from, const InfluenceTable::Cube& cube, std::span<float, 3> low,
                      std::span<float, 3> high);

}  // namespace splitcubes::body
