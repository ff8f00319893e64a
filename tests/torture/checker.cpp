#include "checker.h"

#include "ledger.h"
#include "metrics_table.h"
#include "obstacles.h"
#include "surface_file.h"
#include "topology.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>

namespace splitcubes::torture {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json read_json(const fs::path& file) {
    std::ifstream in(file);
    if (!in) throw std::runtime_error(file.string() + ": cannot be read");
    try {
        return Json::parse(in, nullptr, true, true);
    } catch (const nlohmann::json::exception& error) {
        throw std::runtime_error(file.string() + ": " + error.what());
    }
}

double smallest_cell(const Json& scene, const fs::path& run) {
    double out = std::numeric_limits<double>::infinity();
    const auto take = [&](const Json& bodies) {
        for (const Json& body : bodies)
            if (body.contains("cell_size") && body["cell_size"].is_number())
                out = std::min(out, body["cell_size"].get<double>());
    };
    take(scene.at("bodies"));
    if (fs::exists(run / "summary.json")) take(read_json(run / "summary.json").at("bodies"));
    if (!std::isfinite(out)) throw std::runtime_error("no cell size is known");
    return out;
}

// Holds what frames are compared with.
class FrameChecks {
  public:
    FrameChecks(const Surroundings& surroundings, double cell_size, Verdict& verdict)
        : surroundings_(surroundings), cell_size_(cell_size), verdict_(verdict) {}

    void check(const Surface& surface, const std::vector<PieceMeasure>& pieces, int frame) {
        check_numbers(surface, frame);
        if (frame == 0 || surface.triangles != triangles_) {
            triangles_ = surface.triangles;
            check_topology(surface, frame);
            if (!surface.rest.empty()) check_rest(pieces, frame);
        }
        check_volumes(pieces, frame);
        check_obstacles(surface, pieces, frame);
    }

  private:
    double cells(double volume) const { return volume / (cell_size_ * cell_size_ * cell_size_); }

    void check_numbers(const Surface& surface, int frame) {
        for (const Vec3& p : surface.positions)
            if (!p.allFinite()) return verdict_.measure(Law::complete, 1, frame, "a position is not finite");
    }

    void check_topology(const Surface& surface, int frame) {
        const Topology topology = topology_of(surface);
        verdict_.measure(Law::closed, static_cast<double>(topology.open_edges), frame);
        verdict_.measure(Law::manifold, static_cast<double>(topology.branching_vertices), frame);
    }

    void check_rest(const std::vector<PieceMeasure>& pieces, int frame) {
        double sum = 0;
        for (const PieceMeasure& piece : pieces) {
            sum += piece.rest_volume;
            verdict_.measure(Law::rest_piece_volume, -cells(piece.rest_volume), frame,
                             "piece " + std::to_string(piece.piece));
        }
        if (frame == 0) rest_volume_ = sum;
        verdict_.measure(Law::rest_volume, std::abs(sum / rest_volume_ - 1), frame);
    }

    void check_volumes(const std::vector<PieceMeasure>& pieces, int frame) {
        for (const PieceMeasure& piece : pieces)
            if (-cells(piece.volume) > verdict_.of(Law::piece_volume).worst) {
                std::array<char, 128> note;
                std::snprintf(note.data(), note.size(), "piece %d, at rest %.4g cubic cells", piece.piece,
                              cells(piece.rest_volume));
                verdict_.measure(Law::piece_volume, -cells(piece.volume), frame, note.data());
            }
    }

    void check_obstacles(const Surface& surface, const std::vector<PieceMeasure>& pieces, int frame) {
        for (const Obstacle& obstacle : surroundings_.obstacles()) {
            if (!obstacle.known()) continue;
            const Eigen::Isometry3d own = obstacle.own_from_world(frame * surroundings_.time_step());
            std::size_t deepest = 0;
            double depth = -std::numeric_limits<double>::infinity();
            for (std::size_t v = 0; v < surface.positions.size(); ++v)
                if (const double d = obstacle.depth(own * surface.positions[v]); d > depth) {
                    depth = d;
                    deepest = v;
                }
            if (surface.positions.empty()) continue;
            const Law law = obstacle.name() == "ground" ? Law::ground : Law::colliders;
            verdict_.measure(law, depth / cell_size_, frame,
                             obstacle.name() + ", " + text_of_piece(pieces, surface.piece[deepest]));
        }
    }

    std::string text_of_piece(const std::vector<PieceMeasure>& pieces, int number) const {
        std::array<char, 96> out;
        for (const PieceMeasure& piece : pieces)
            if (piece.piece == number) {
                std::snprintf(out.data(), out.size(), "piece %d of %.4g cubic cells", number,
                              cells(piece.rest_volume != 0 ? piece.rest_volume : piece.volume));
                return out.data();
            }
        return "no piece";
    }

    const Surroundings& surroundings_;
    double cell_size_;
    Verdict& verdict_;
    std::vector<std::array<int, 3>> triangles_;
    double rest_volume_ = 0;
};

fs::path frame_file(const fs::path& run, int frame) {
    std::array<char, 32> name;
    std::snprintf(name.data(), name.size(), "%06d.ply", frame);
    return run / "surface" / name.data();
}

int frames_of(const Json& scene) {
    if (scene.contains("frames") && scene["frames"].is_number()) return scene["frames"].get<int>();
    if (!scene.contains("duration")) return 120;
    return static_cast<int>(
        std::ceil(scene["duration"].get<double>() / scene.value("time_step", 1.0 / 60) - 1e-9));
}

void check_files(const fs::path& scene_folder, const fs::path& run, bool whole, Verdict& verdict) {
    const Json scene = read_json(scene_folder / "scene.json");
    const Surroundings surroundings(scene);
    const double cell_size = smallest_cell(scene, run);
    const int frames = frames_of(scene);
    const MetricsTable table = read_metrics(run / "metrics.csv");
    if (whole)
        verdict.measure(Law::complete, std::abs(static_cast<double>(table.size()) - frames),
                        static_cast<int>(table.size()), "rows of the metrics");
    for (std::size_t row = 0; row < table.size(); ++row)
        verdict.measure(Law::complete, table.finite(row) ? 0 : 1, static_cast<int>(row) + 1,
                        "a number of the metrics is not finite");
    Ledger ledger(surroundings, table, cell_size);
    FrameChecks checks(surroundings, cell_size, verdict);
    for (int frame = 0; frame <= static_cast<int>(table.size()); ++frame) {
        const Surface surface = read_surface(frame_file(run, frame));
        const std::vector<PieceMeasure> pieces = measure_pieces(surface);
        checks.check(surface, pieces, frame);
        ledger.add_frame(pieces, verdict);
    }
}

}  // namespace

Verdict check_run(const fs::path& scene_folder, const fs::path& run_folder, bool whole) {
    Verdict verdict;
    // A run that is stopped early has no table yet.
    if (!whole && !fs::exists(run_folder / "metrics.csv")) return verdict;
    try {
        check_files(scene_folder, run_folder, whole, verdict);
    } catch (const std::runtime_error& error) {
        verdict.measure(Law::complete, 1, -1, error.what());
    } catch (const nlohmann::json::exception& error) {
        verdict.measure(Law::complete, 1, -1, error.what());
    }
    return verdict;
}

}  // namespace splitcubes::torture
