#include "accuracy_bench.h"
#include "accuracy.h"

#include <splitcubes/io/read_mesh.h>

#include <cstdio>
#include <filesystem>

namespace splitcubes::app {

namespace {

Json spread_json(const Spread& spread) {
    return {{"max", spread.max}, {"rms", spread.rms()}, {"count", spread.count}};
}

Json opposing_json(const Opposing& normals) {
    return {{"triangles", normals.triangles},
            {"opposing", normals.opposing},
            {"area_share", normals.area_share()},
            {"largest", normals.largest}};
}

Json smooth_table() {
    Json rows = Json::array();
    std::printf(
        "| shape  | cells across |  max off |  rms off | ratio | volume error | ratio | moved max | opposing "
        "| largest |\n");
    std::printf("|---|---|---|---|---|---|---|---|---|---|\n");
    SmoothRow last;
    for (const SmoothRow& row : measure_smooth_shapes()) {
        std::printf("| %-6s | %12d | %8.2e | %8.2e | ", row.shape.c_str(), row.across, row.vertices.max,
                    row.vertices.rms());
        if (row.shape == last.shape)
            std::printf("%5.1f | %12.2e | %5.1f |", last.vertices.rms() / row.vertices.rms(),
                        row.volume_error, last.volume_error / row.volume_error);
        else
            std::printf("      | %12.2e |       |", row.volume_error);
        std::printf(" %.4f | %zu of %zu | %.4f |\n", row.moved.max, row.normals.opposing,
                    row.normals.triangles, row.normals.largest);
        rows.push_back({{"shape", row.shape},
                        {"across", row.across},
                        {"vertices", spread_json(row.vertices)},
                        {"volume_error", row.volume_error},
                        {"moved", spread_json(row.moved)},
                        {"normals", opposing_json(row.normals)},
                        {"unmoved_normals", opposing_json(row.unmoved_normals)}});
        last = row;
    }
    return rows;
}

Json box_table(const Parallel& parallel) {
    const BoxRow row = measure_tilted_boxes(100, parallel);
    std::printf(
        "\n| tilted boxes | vertices | max off | rms off | over 0.01 | over 0.05 | corners max | "
        "opposing | of the area |\n");
    std::printf("|---|---|---|---|---|---|---|---|---|\n");
    const auto count = static_cast<double>(row.vertices.count);
    std::printf("| %d | %zu | %.3f | %.5f | %.3f %% | %.3f %% | %.0e | %.2f %% | %.3f %% |\n", row.boxes,
                row.vertices.count, row.vertices.max, row.vertices.rms(),
                100 * static_cast<double>(row.beyond_hundredth) / count,
                100 * static_cast<double>(row.beyond_twentieth) / count, row.corners.max,
                100 * row.normals.share(), 100 * row.normals.area_share());
    return {{"boxes", row.boxes},
            {"vertices", spread_json(row.vertices)},
            {"beyond_hundredth", row.beyond_hundredth},
            {"beyond_twentieth", row.beyond_twentieth},
            {"corners", spread_json(row.corners)},
            {"normals", opposing_json(row.normals)}};
}

Json cut_table(const Parallel& parallel) {
    Json rows = Json::array();
    std::printf(
        "\n| cut    | radius | boundary max | boundary rms | rim max | rim rms | face max | volume change | "
        "opposing "
        "| of the area |\n");
    std::printf("|---|---|---|---|---|---|---|---|---|---|\n");
    for (const char* shape : {"sphere", "box"})
        for (const double radius : {5.3, 9.3, 16.3}) {
            const CutRow row = measure_cuts(shape, radius, 20, parallel);
            std::printf(
                "| %-6s | %6.1f | %12.3f | %12.4f | %7.3f | %7.4f | %8.3f | %13.1e | %6.2f %% | %9.2f %% |\n",
                shape, radius, row.boundary.max, row.boundary.rms(), row.rim.max, row.rim.rms(), row.face.max,
                row.largest_volume_change, 100 * row.normals.share(), 100 * row.normals.area_share());
            rows.push_back({{"shape", shape},
                            {"radius", radius},
                            {"cuts", row.cuts},
                            {"boundary", spread_json(row.boundary)},
                            {"rim", spread_json(row.rim)},
                            {"face", spread_json(row.face)},
                            {"face_normals", opposing_json(row.face_normals)},
                            {"largest_volume_change", row.largest_volume_change},
                            {"normals", opposing_json(row.normals)}});
        }
    return rows;
}

Json fold_table(const std::vector<std::string>& files, const Parallel& parallel) {
    Json rows = Json::array();
    if (files.empty()) return rows;
    std::printf(
        "\n| mesh | cells | triangles | opposing | share | of the area | largest "
        "|\n|---|---|---|---|---|---|---|\n");
    for (const std::string& file : files) {
        const geometry::TriangleMesh mesh = read_noted(file);
        const std::string name = std::filesystem::path(file).stem().string();
        for (const int cells : {48, 96}) {
            const Opposing normals = measure_folds(mesh, cells, parallel);
            std::printf("| %s | %d | %zu | %zu | %.2f %% | %.3f %% | %.2f |\n", name.c_str(), cells,
                        normals.triangles, normals.opposing, 100 * normals.share(),
                        100 * normals.area_share(), normals.largest);
            rows.push_back({{"mesh", name}, {"cells", cells}, {"normals", opposing_json(normals)}});
        }
    }
    return rows;
}

}  // namespace

Json bench_accuracy(const std::vector<std::string>& files, const Parallel& parallel) {
    // Reads the files before the minutes of work, so that a wrong name is reported at once.
    for (const std::string& file : files) io::read_mesh(file);
    Json out = {{"bench", "surface"}};
    out["smooth"] = smooth_table();
    out["boxes"] = box_table(parallel);
    out["cuts"] = cut_table(parallel);
    out["meshes"] = fold_table(files, parallel);
    return out;
}

}  // namespace splitcubes::app
