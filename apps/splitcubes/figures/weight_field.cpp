#include "weight_field.h"

#include <splitcubes/core/parallel.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::app::figures {

namespace {

using occlusion::CriterionKind;

constexpr double cut_plane = 0.5;

// The lattice in the form that the link graph takes.
struct Lattice {
    std::vector<Vec3> rest;
    std::vector<double> support;
    std::vector<std::uint32_t> a, b;
    std::uint32_t origin = 0;

    Lattice() {
        for (int z = -2; z <= 2; ++z)
            for (int y = -5; y <= 5; ++y)
                for (int x = -5; x <= 5; ++x) {
                    if (x == 0 && y == 0 && z == 0) origin = static_cast<std::uint32_t>(rest.size());
                    rest.emplace_back(x, y, z);
                }
        support.assign(rest.size(), lattice_support());
        for (std::uint32_t i = 0; i < rest.size(); ++i)
            for (std::uint32_t j = i + 1; j < rest.size(); ++j)
                if ((rest[j] - rest[i]).norm() < lattice_support()) {
                    a.push_back(i);
                    b.push_back(j);
                }
    }
    occlusion::PairSet set() const { return {rest, support, {}, a, b}; }
};

double ratio(const Vec3& point, double distance) {
    return occlusion::weight_ratio(point.norm(), std::max(distance, point.norm()), lattice_support());
}

// Adds each point as a phyxel that is linked to those within reach.
std::vector<double> graph_factors(const CutScene& scene, const std::vector<Vec3>& points) {
    const Lattice lattice;
    const occlusion::LinkGraph graph(scene.occluders, lattice.set());
    occlusion::LinkGraph::Search search;
    graph.search(lattice.origin, lattice_support(), search);
    std::vector<double> out;
    for (const Vec3& point : points) {
        double shortest = 1e300;
        if (!occlusion::segment_blocked(scene.occluders, {Vec3::Zero(), point}))
            shortest = point.norm();
        else
            for (const std::uint32_t n : search.reached) {
                const double last = (point - lattice.rest[n]).norm();
                if (last >= lattice_support() || search.distance[n] + last >= shortest) continue;
                if (!occlusion::segment_blocked(scene.occluders, {lattice.rest[n], point}))
                    shortest = search.distance[n] + last;
            }
        out.push_back(ratio(point, shortest));
    }
    return out;
}

std::vector<double> disk_factors(const CutScene& scene, const std::vector<Vec3>& points) {
    std::vector<occlusion::PairQuery> pairs;
    for (const Vec3& point : points) pairs.push_back({Vec3::Zero(), point});
    std::vector<float> visibility(pairs.size());
    occlusion::make_cpu_backend({})->evaluate(scene.occluders, pairs, visibility, Parallel());
    return {visibility.begin(), visibility.end()};
}

}  // namespace

double lattice_support() {
    return 3 * (6 + 4 * std::sqrt(2.0)) / 10;
}

double kernel_weight(double distance) {
    return occlusion::weight_ratio(0, distance, lattice_support());
}

CutScene make_cut(const std::string& name, std::vector<std::array<double, 2>> ranges) {
    constexpr int cells = 36;
    constexpr double size = 0.5;
    const Vec3 origin = Vec3::Constant(-0.5 * cells * size);
    CutScene out{name, std::move(ranges), {origin, size, Vec3i::Constant(cells)}};
    constexpr double step = 1;
    for (int row = 0; row < 16; ++row) {
        std::vector<geometry::OccluderTriangle> triangles;
        const double z0 = -8 + row * step, z1 = z0 + step;
        for (const auto& [from, until] : out.cut)
            for (double y = from; y < until; y += step) {
                const double next = std::min(y + step, until);
                const Vec3 p[] = {
                    {cut_plane, y, z0}, {cut_plane, next, z0}, {cut_plane, next, z1}, {cut_plane, y, z1}};
                triangles.push_back({{p[0], p[1], p[2]}, false});
                triangles.push_back({{p[0], p[2], p[3]}, false});
            }
        out.occluders.set_cell({0, 0, row}, triangles);
    }
    return out;
}

std::vector<double> factors(const CutScene& scene, CriterionKind kind, const std::vector<Vec3>& points) {
    if (kind == CriterionKind::occlusion_disk) return disk_factors(scene, points);
    if (kind == CriterionKind::graph_distance) return graph_factors(scene, points);
    std::vector<double> out;
    for (const Vec3& point : points) {
        const occlusion::PairQuery pair{Vec3::Zero(), point};
        out.push_back(kind == CriterionKind::transparency
                          ? occlusion::transparency_factor(scene.occluders, pair, lattice_support())
                      : occlusion::segment_blocked(scene.occluders, pair) ? 0.0
                                                                          : 1.0);
    }
    return out;
}

}  // namespace splitcubes::app::figures
