#include "other_tools.h"

#include <splitcubes/geometry/triangle_mesh.h>

#ifdef SPLITCUBES_WITH_OPENVDB

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <splitcubes/core/stopwatch.h>
#include <tbb/global_control.h>

namespace splitcubes::bench {

Timed openvdb_surface(const geometry::TriangleMesh& mesh, const geometry::RestGrid& grid, int threads,
                      int runs) {
    Timed out{"OpenVDB " OPENVDB_LIBRARY_VERSION_STRING, "",      threads, 0,
              {"meshToLevelSet", "volumeToMesh"},        {{}, {}}};
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    openvdb::initialize();
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    for (const Vec3& p : mesh.positions)
        points.emplace_back(static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]));
    for (const geometry::Triangle& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
    for (int run = 0; run < runs; ++run) {
        const auto frame = openvdb::math::Transform::createLinearTransform(grid.cell_size);
        frame->postTranslate(openvdb::Vec3d(grid.origin[0], grid.origin[1], grid.origin[2]));
        Stopwatch watch;
        const auto level_set = openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*frame, points, triangles);
        out.seconds[0].push_back(watch.lap());
        std::vector<openvdb::Vec3s> made_points;
        std::vector<openvdb::Vec3I> made_triangles;
        std::vector<openvdb::Vec4I> made_quads;
        watch.lap();
        openvdb::tools::volumeToMesh(*level_set, made_points, made_triangles, made_quads, 0.0, 0.0);
        out.seconds[1].push_back(watch.lap());
        out.triangles = made_triangles.size() + 2 * made_quads.size();
    }
    return out;
}

}  // namespace splitcubes::bench

#else

namespace splitcubes::bench {

Timed openvdb_surface(const geometry::TriangleMesh&, const geometry::RestGrid&, int threads, int) {
    return {"OpenVDB", "not installed", threads, 0, {}, {}};
}

}  // namespace splitcubes::bench

#endif
