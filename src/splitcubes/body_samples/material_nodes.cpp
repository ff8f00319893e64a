#include <splitcubes/body_samples/material_nodes.h>
#include <splitcubes/body_samples/tuning.h>
#include <splitcubes/math/decompose.h>
#include <splitcubes/splitting/extract.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace splitcubes::body {

NodeExtents node_extents(const splitting::NodeGrid& grid, const Vec3i& node) {
    NodeExtents out{Vec3::Constant(0.5), Vec3::Constant(0.5)};
    for (int axis = 0; axis < 3; ++axis)
        for (const int step : {-1, 1}) {
            Vec3i lower = node;
            if (step < 0) --lower[axis];
            const std::int32_t slot = grid.slot({lower, axis});
            if (slot < 0 || grid.crossing(slot).origin != splitting::Origin::boundary) continue;
            const double t = grid.crossing(slot).parameter;
            (step > 0 ? out.above : out.below)[axis] = step > 0 ? t : 1 - t;
        }
    return out;
}

double MaterialNodes::total_volume() const {
    double total = 0;
    for (const double v : volume) total += v;
    return total;
}

void MaterialNodes::label_pieces(const splitting::NodeGrid& grid, const splitting::Pieces& pieces) {
    for (std::size_t r = 0; r + 1 < first_of_brick.size(); ++r) {
        const std::uint32_t begin = first_of_brick[r], end = first_of_brick[r + 1];
        const std::int32_t common = pieces.common_piece(grid.bricks().brick_of(node[begin]));
        if (common >= 0)
            std::fill(piece.begin() + begin, piece.begin() + end, common);
        else
            for (std::uint32_t i = begin; i < end; ++i) piece[i] = pieces.piece_of(grid, node[i]);
    }
}

Vec3 MaterialNodes::extents_of(std::span<const std::uint32_t> nodes) const {
    // Moments about one of the nodes, in one pass.
    double total = 0;
    Vec3 first = Vec3::Zero();
    Mat3 second = Mat3::Zero();
    for (const std::uint32_t n : nodes) {
        const Vec3 arm = rest_position[n] - rest_position[nodes.front()];
        total += volume[n];
        first += volume[n] * arm;
        second += volume[n] * arm * arm.transpose();
    }
    const Vec3 centre = first / total;
    second = second / total - centre * centre.transpose();
    second += cell_size * cell_size / 12 * Mat3::Identity();
    return (12 * eigen_symmetric(second).values).cwiseMax(0).cwiseSqrt();
}

void MaterialNodes::weigh(std::span<const std::uint32_t> nodes, double density,
                          meshless::RigidPiece& body) const {
    std::vector<Vec3> rest;
    std::vector<double> mass;
    for (const std::uint32_t n : nodes) {
        rest.push_back(rest_position[n]);
        mass.push_back(density * volume[n]);
    }
    meshless::weigh({rest, mass, cell_size}, body);
}

MaterialNodes list_material_nodes(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                                  const splitting::Pieces& pieces, const Parallel& parallel) {
    MaterialNodes out;
    out.cell_size = grid.rest().cell_size;
    for (std::size_t brick = 0; brick < grid.bricks().total(); ++brick) {
        if (brick % tuning::set_up::bricks_between_checks == 0) parallel.check();
        if (grid.inside_word(brick) != 0)
            out.first_of_brick.push_back(static_cast<std::uint32_t>(out.size()));
        for (std::uint64_t word = grid.inside_word(brick); word; word &= word - 1) {
            const auto local = static_cast<unsigned>(std::countr_zero(word));
            out.node.push_back(grid.bricks().base(brick) + splitting::BrickLayout::local_node(local));
        }
    }
    out.first_of_brick.push_back(static_cast<std::uint32_t>(out.size()));
    const double cell_volume = std::pow(grid.rest().cell_size, 3);
    out.rest_position.resize(out.size());
    out.piece.resize(out.size());
    out.volume.resize(out.size());
    parallel.for_each(out.size(), 1024, [&](std::size_t i) {
        const Vec3i& node = out.node[i];
        out.rest_position[i] = grid.rest().node_position(node);
        out.piece[i] = pieces.piece_of(grid, node);
        const NodeExtents extents = node_extents(grid, node);
        out.volume[i] = cell_volume * (extents.below + extents.above).prod();
    });
    // Scales the volumes so that those of a piece's nodes sum to the volume that its surface encloses.
    const auto measures = splitting::measure_pieces(
        splitting::extract(grid, surface, pieces, {}, {}, parallel), pieces.count());
    std::vector<double> lumped(pieces.count(), 0);
    for (std::size_t i = 0; i < out.size(); ++i)
        lumped[static_cast<std::size_t>(out.piece[i])] += out.volume[i];
    for (std::size_t i = 0; i < out.size(); ++i) {
        const auto piece = static_cast<std::size_t>(out.piece[i]);
        if (measures[piece].volume > 0) out.volume[i] *= measures[piece].volume / lumped[piece];
    }
    return out;
}

}  // namespace splitcubes::body
