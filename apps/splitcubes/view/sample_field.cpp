#include "sample_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace splitcubes::view {

namespace {

using Cell = std::array<int, 3>;

// Samples by cells of their spacing.
struct SampleCells {
    double size;
    std::map<Cell, std::vector<std::uint32_t>> cells;

    explicit SampleCells(const SampleState& samples) : size(std::max(1.2 * samples.spacing, 1e-9)) {
        for (std::size_t i = 0; i < samples.size(); ++i) {
            const Vector3& p = samples.rest_positions[i];
            cells[cell_of(p.x, p.y, p.z)].push_back(static_cast<std::uint32_t>(i));
        }
    }
    Cell cell_of(double x, double y, double z) const {
        const auto index = [&](double v) { return static_cast<int>(std::floor(v / size)); };
        return {index(x), index(y), index(z)};
    }
    template <class Use>
    void around(const Cell& cell, const Use& use) const {
        for (int k = 0; k < 27; ++k) {
            const auto it = cells.find({cell[0] + k % 3 - 1, cell[1] + k / 3 % 3 - 1, cell[2] + k / 9 - 1});
            if (it == cells.end()) continue;
            for (const std::uint32_t sample : it->second) use(sample);
        }
    }
};

}  // namespace

const std::vector<float>& SampleField::values(const SampleState& samples, Field field) {
    switch (field) {
        case Field::principal_stress:
            return samples.principal_stress;
        case Field::principal_strain:
            return samples.principal_strain;
        default:
            return samples.von_mises_stress;
    }
}

void SampleField::find_weights(const SurfaceView& surface, const SampleState& samples) {
    const SampleCells cells(samples);
    weights_.assign(surface.vertex_slots(), {});
    for (std::size_t v = 0; v < surface.vertex_slots(); ++v) {
        if (surface.pieces[v] < 0) continue;
        const float* p = surface.rest_positions.data() + 3 * v;
        std::array<std::pair<double, std::uint32_t>, neighbour_count> nearest;
        nearest.fill({std::numeric_limits<double>::infinity(), 0});
        cells.around(cells.cell_of(p[0], p[1], p[2]), [&](std::uint32_t i) {
            if (samples.pieces[i] != surface.pieces[v]) return;
            const Vector3& q = samples.rest_positions[i];
            const double square =
                (q.x - p[0]) * (q.x - p[0]) + (q.y - p[1]) * (q.y - p[1]) + (q.z - p[2]) * (q.z - p[2]);
            if (square >= nearest.back().first) return;
            nearest.back() = {square, i};
            std::sort(nearest.begin(), nearest.end());
        });
        double sum = 0;
        std::array<double, neighbour_count> shares{};
        for (std::size_t k = 0; k < neighbour_count; ++k)
            if (std::isfinite(nearest[k].first))
                sum += shares[k] = 1 / (nearest[k].first + 1e-4 * samples.spacing * samples.spacing);
        for (std::size_t k = 0; k < neighbour_count && sum > 0; ++k) {
            weights_[v].samples[k] = nearest[k].second;
            weights_[v].shares[k] = static_cast<float>(shares[k] / sum);
        }
    }
}

std::vector<float> SampleField::at_vertices(const SurfaceView& surface, const SampleState& samples,
                                            Field field) {
    if (revision_ != surface.revision || sample_count_ != samples.size()) {
        find_weights(surface, samples);
        revision_ = surface.revision;
        sample_count_ = samples.size();
    }
    const std::vector<float>& of = values(samples, field);
    std::vector<float> out(weights_.size(), 0.0F);
    for (std::size_t v = 0; v < weights_.size(); ++v)
        for (std::size_t k = 0; k < neighbour_count; ++k)
            if (weights_[v].shares[k] > 0) out[v] += weights_[v].shares[k] * of[weights_[v].samples[k]];
    return out;
}

}  // namespace splitcubes::view
