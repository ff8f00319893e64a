#include "cut_pieces.h"

#include "interrupts.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/plain_number.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <numeric>

namespace splitcubes::app {

namespace {

std::string piece_name(Fate fate, std::size_t number) {
    char digits[24];
    std::snprintf(digits, sizeof digits, "-%04zu", number);
    const char* const kinds[] = {"piece", "removed", "dropped"};
    return kinds[static_cast<std::size_t>(fate)] + std::string(digits);
}

Json vector_json(const Vec3& v) {
    return {v[0], v[1], v[2]};
}

std::vector<Fate> fates_of(const std::vector<splitting::PieceMeasure>& measures,
                           const std::vector<std::uint8_t>& removed, const splitting::PieceChoice& choice) {
    std::vector<double> volumes;
    for (const splitting::PieceMeasure& measure : measures) volumes.push_back(measure.volume);
    const std::vector<std::uint8_t> dropped = splitting::pieces_to_drop(volumes, removed, choice);
    std::vector<Fate> out;
    for (std::size_t k = 0; k < measures.size(); ++k)
        out.push_back(removed[k] != 0 ? Fate::removed : dropped[k] != 0 ? Fate::dropped : Fate::kept);
    return out;
}

}  // namespace

std::size_t CutResult::count(Fate fate) const {
    return static_cast<std::size_t>(
        std::count_if(pieces.begin(), pieces.end(), [&](const CutPiece& p) { return p.fate == fate; }));
}

double CutResult::volume(Fate fate) const {
    double sum = 0;
    for (const CutPiece& piece : pieces)
        if (piece.fate == fate) sum += piece.measure.volume;
    return sum;
}

CutResult arrange_pieces(geometry::SurfaceMesh whole, const splitting::Pieces& pieces,
                         const std::vector<std::uint8_t>& removed, const splitting::PieceChoice& choice) {
    const std::size_t count = pieces.count();
    const auto measures = splitting::measure_pieces(whole, count);
    const std::vector<Fate> fates = fates_of(measures, removed, choice);
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        if (fates[a] != fates[b]) return fates[a] < fates[b];
        if (measures[a].volume != measures[b].volume) return measures[a].volume > measures[b].volume;
        return a < b;
    });
    CutResult out;
    std::vector<std::int32_t> new_index(count);
    std::vector<std::uint8_t> kept;
    std::array<std::size_t, 3> next_numbers{};  // next number, by fate
    for (const std::size_t k : order) {
        new_index[k] = static_cast<std::int32_t>(out.pieces.size());
        const std::size_t number = next_numbers[static_cast<std::size_t>(fates[k])]++;
        out.pieces.push_back({piece_name(fates[k], number), fates[k], pieces.node_counts()[k], measures[k]});
        kept.push_back(fates[k] == Fate::kept);
    }
    for (std::int32_t& piece : whole.vertex_piece) piece = new_index[static_cast<std::size_t>(piece)];
    out.whole = std::move(whole);
    if (next_numbers[0] < count) out.rest = splitting::extract_pieces(out.whole, kept);
    return out;
}

Json pieces_report(const CutResult& result) {
    Json out = Json::array();
    for (const CutPiece& piece : result.pieces) {
        const splitting::PieceMeasure& m = piece.measure;
        out.push_back({{"name", piece.name},
                       {"removed", piece.fate == Fate::removed},
                       {"dropped", piece.fate == Fate::dropped},
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

void write_pieces(OutputFolder& folder, const std::string& extension, const CutResult& result,
                  const MeshScale& scale, Json& pieces) {
    folder.clear([](const std::string&) { return false; });
    for (std::size_t k = 0; k < result.pieces.size(); ++k) {
        if (result.pieces[k].fate == Fate::dropped) continue;
        if (interrupted()) throw JobError("interrupted between two pieces; the files written are complete");
        if (extension == ".obj") folder.add(result.pieces[k].name + ".mtl");
        const std::filesystem::path path = folder.add(result.pieces[k].name + extension);
        write_scaled(path, splitting::extract_piece(result.whole, static_cast<std::int32_t>(k)), scale);
        pieces[k]["file"] = path.string();
    }
}

std::string pieces_table(const CutResult& result, const MeshScale& scale) {
    if (result.pieces.size() - result.count(Fate::dropped) > 20) return "";
    const geometry::LengthUnit& unit = scale.unit();
    char line[120];
    std::snprintf(line, sizeof line, "%-14s %14s %14s\n", "piece",
                  ("volume " + scale.unit_name + "^3").c_str(), ("area " + scale.unit_name + "^2").c_str());
    std::string out = line;
    for (const CutPiece& piece : result.pieces) {
        if (piece.fate == Fate::dropped) continue;
        const splitting::PieceMeasure& m = piece.measure;
        std::snprintf(line, sizeof line, "%-14s %14s %14s\n", piece.name.c_str(),
                      plain_number(unit.volume_from_metres(m.volume), 6).c_str(),
                      plain_number(unit.area_from_metres(m.boundary_area + m.cut_area), 6).c_str());
        out += line;
    }
    return out;
}

}  // namespace splitcubes::app
