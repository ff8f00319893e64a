#include "hand_made_run.h"

#include <stdlib.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <stdexcept>

namespace splitcubes::torture {

namespace {

namespace fs = std::filesystem;

constexpr int frames = 8;
constexpr double time_step = 0.02, mass = 1, side = 0.1;

const std::vector<std::string>& columns() {
    static const std::vector<std::string> names = {"time",
                                                   "new_cut_edges",
                                                   "torn_edges",
                                                   "mass",
                                                   "momentum_x",
                                                   "momentum_y",
                                                   "momentum_z",
                                                   "angular_momentum_x",
                                                   "angular_momentum_y",
                                                   "angular_momentum_z",
                                                   "kinetic_energy",
                                                   "elastic_energy",
                                                   "contact_energy",
                                                   "top_speed",
                                                   "contacts"};
    return names;
}

// The box with a constant acceleration, from rest at a height of 1 m.
HandMadeRun moving_box(const Vec3& acceleration, const Vec3& first_velocity) {
    HandMadeRun out;
    out.scene["time_step"] = time_step;
    out.scene["frames"] = frames;
    out.scene["bodies"] = {{{"name", "box"}, {"cell_size", 0.01}}};
    const Surface box = box_surface({0, 0, 1}, {side, side, 1 + side});
    for (int frame = 0; frame <= frames; ++frame) {
        const double t = frame * time_step;
        const Vec3 velocity = first_velocity + t * acceleration;
        Surface now = box;
        for (Vec3& p : now.positions) p += t * first_velocity + 0.5 * t * t * acceleration;
        out.surfaces.push_back(now);
        if (frame == 0) continue;
        std::map<std::string, double> row;
        for (const std::string& name : columns()) row[name] = 0;
        row["time"] = t;
        row["mass"] = mass;
        row["momentum_x"] = mass * velocity.x();
        row["momentum_y"] = mass * velocity.y();
        row["momentum_z"] = mass * velocity.z();
        row["kinetic_energy"] = 0.5 * mass * velocity.squaredNorm();
        row["top_speed"] = velocity.norm();
        out.rows.push_back(row);
    }
    return out;
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "splitcubes-torture-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
}

void HandMadeRun::write(const fs::path& folder) const {
    fs::create_directories(folder / "run" / "surface");
    std::ofstream(folder / "scene.json") << scene.dump();
    std::ofstream table(folder / "run" / "metrics.csv");
    table.precision(17);
    std::vector<std::string> names = columns();
    for (const char* name : {"potential_energy", "hold_work", "handle_work"})
        if (!rows.empty() && rows[0].count(name) > 0) names.emplace_back(name);
    for (const std::string& name : names) table << name << ',';
    table << "flags\n";
    for (const auto& row : rows) {
        for (const std::string& name : names) table << row.at(name) << ',';
        table << "-\n";
    }
    for (std::size_t k = 0; k < surfaces.size(); ++k) {
        std::array<char, 32> name;
        std::snprintf(name.data(), name.size(), "%06zu.ply", k);
        std::ofstream(folder / "run" / "surface" / name.data(), std::ios::binary)
            << encode_surface(surfaces[k]);
    }
}

Verdict HandMadeRun::check() const {
    const TemporaryFolder folder;
    write(folder.path());
    return check_run(folder.path(), folder.path() / "run");
}

HandMadeRun falling_box(const Vec3& gravity) {
    HandMadeRun out = moving_box(gravity, {1, 0, 0});
    out.scene["gravity"] = {gravity.x(), gravity.y(), gravity.z()};
    out.scene["bodies"][0]["velocity"] = {1, 0, 0};
    return out;
}

HandMadeRun carried_box(double acceleration) {
    HandMadeRun out = moving_box({acceleration, 0, 0}, Vec3::Zero());
    out.scene["gravity"] = {0, 0, -9.81};
    nlohmann::ordered_json keys;
    for (int frame = 0; frame <= frames; ++frame) {
        const double t = frame * time_step;
        keys.push_back({{"time", t}, {"position", {0.5 * acceleration * t * t, 0, 0}}});
    }
    out.scene["constraints"] = {{{"body", "box"}, {"kind", "move"}, {"keyframes", keys}}};
    return out;
}

Surface box_surface(const Vec3& low, const Vec3& high, int piece) {
    Surface out;
    for (int corner = 0; corner < 8; ++corner)
        out.positions.emplace_back((corner & 1) != 0 ? high.x() : low.x(),
                                   (corner & 2) != 0 ? high.y() : low.y(),
                                   (corner & 4) != 0 ? high.z() : low.z());
    out.rest = out.positions;
    out.piece.assign(8, piece);
    constexpr std::array<std::array<int, 4>, 6> faces = {
        {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
    for (const std::array<int, 4>& f : faces) {
        out.triangles.push_back({f[0], f[1], f[2]});
        out.triangles.push_back({f[0], f[2], f[3]});
    }
    return out;
}

void append(Surface& surface, const Surface& other) {
    const auto offset = static_cast<int>(surface.positions.size());
    surface.positions.insert(surface.positions.end(), other.positions.begin(), other.positions.end());
    surface.rest.insert(surface.rest.end(), other.rest.begin(), other.rest.end());
    surface.piece.insert(surface.piece.end(), other.piece.begin(), other.piece.end());
    for (std::array<int, 3> triangle : other.triangles) {
        for (int& corner : triangle) corner += offset;
        surface.triangles.push_back(triangle);
    }
}

}  // namespace splitcubes::torture
