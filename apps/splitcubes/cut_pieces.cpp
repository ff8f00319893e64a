#include "cut_pieces.h"

#include "interrupts.h"

#include <splitcubes/core/error.h>
#include <splitcubes/io/write_mesh.h>

#include <algorithm>
#include <cstdio>
#include <numeric>

namespace splitcubes::app {

namespace {

std::string piece_name(bool removed, std::size_t number) {
    char digits[24];
    std::snprintf(digits, sizeof digits, "-%04zu", number);
    return (removed ? "removed" : "piece") + std::string(digits);
}

// A name that piece_name makes.
bool is_piece_name(const std::string& name) {
    const std::size_t dash = name.find('-');
    if (dash == std::string::npos || name.size() < dash + 5) return false;
    if (name.substr(0, dash) != "piece" && name.substr(0, dash) != "removed") return false;
    return name.find_first_not_of("0123456789", dash + 1) == std::string::npos;
}

Json vector_json(const Vec3& v) {
    return {v[0], v[1], v[2]};
}

void make_folder(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw InputError(folder.string(), "cannot be made: " + error.message());
}

}  // namespace

std::size_t CutResult::kept_count() const {
    return static_cast<std::size_t>(
        std::count_if(pieces.begin(), pieces.end(), [](const CutPiece& p) { return !p.removed; }));
}

double CutResult::volume(bool removed) const {
    double sum = 0;
    for (const CutPiece& piece : pieces)
        if (piece.removed == removed) sum += piece.measure.volume;
    return sum;
}

CutResult arrange_pieces(geometry::SurfaceMesh whole, const splitting::Pieces& pieces,
                         const std::vector<std::uint8_t>& removed) {
    const std::size_t count = pieces.count();
    const auto measures = splitting::measure_pieces(whole, count);
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        if (removed[a] != removed[b]) return removed[a] < removed[b];
        if (measures[a].volume != measures[b].volume) return measures[a].volume > measures[b].volume;
        return a < b;
    });
    CutResult out;
    std::vector<std::int32_t> place(count);
    std::vector<std::uint8_t> kept;
    for (const std::size_t k : order) {
        place[k] = static_cast<std::int32_t>(out.pieces.size());
        const std::size_t number = out.pieces.size() - (removed[k] ? out.kept_count() : 0);
        out.pieces.push_back(
            {piece_name(removed[k] != 0, number), removed[k] != 0, pieces.node_counts()[k], measures[k]});
        kept.push_back(removed[k] ? 0 : 1);
    }
    for (std::int32_t& piece : whole.vertex_piece) piece = place[static_cast<std::size_t>(piece)];
    out.whole = std::move(whole);
    if (out.kept_count() < count) out.rest = splitting::extract_pieces(out.whole, kept);
    return out;
}

Json pieces_report(const CutResult& result) {
    Json out = Json::array();
    for (const CutPiece& piece : result.pieces) {
        const splitting::PieceMeasure& m = piece.measure;
        out.push_back({{"name", piece.name},
                       {"removed", piece.removed},
                       {"nodes", piece.nodes},
                       {"triangles", m.triangles},
                       {"volume", m.volume},
                       {"boundary_area", m.boundary_area},
                       {"cut_area", m.cut_area},
                       {"bounds", {{"min", vector_json(m.bounds.min)}, {"max", vector_json(m.bounds.max)}}},
                       {"center_of_mass", vector_json(m.center_of_mass)}});
    }
    return out;
}

void check_pieces_folder(const std::filesystem::path& folder) {
    std::error_code ignored;
    if (!folder.empty() && std::filesystem::exists(folder, ignored) &&
        !std::filesystem::is_directory(folder, ignored))
        throw InputError(folder.string(), "is a file", "give a folder for the pieces");
}

void write_pieces(const std::filesystem::path& folder, const std::string& extension, const CutResult& result,
                  Json& pieces) {
    make_folder(folder);
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().extension() == extension && is_piece_name(entry.path().stem().string()))
            std::filesystem::remove(entry.path());
    for (std::size_t k = 0; k < result.pieces.size(); ++k) {
        if (interrupted()) throw JobError("interrupted between two pieces; what was written is whole");
        const std::filesystem::path path = folder / (result.pieces[k].name + extension);
        io::write_mesh(path, splitting::extract_piece(result.whole, static_cast<std::int32_t>(k)));
        pieces[k]["file"] = path.string();
    }
}

std::string pieces_table(const CutResult& result) {
    if (result.pieces.size() > 20) return "";
    char line[120];
    std::snprintf(line, sizeof line, "%-14s %14s %14s\n", "piece", "volume m^3", "area m^2");
    std::string out = line;
    for (const CutPiece& piece : result.pieces) {
        const splitting::PieceMeasure& m = piece.measure;
        std::snprintf(line, sizeof line, "%-14s %14.6g %14.6g\n", piece.name.c_str(), m.volume,
                      m.boundary_area + m.cut_area);
        out += line;
    }
    return out;
}

}  // namespace splitcubes::app
