// The pieces that `cut` makes: selection, names, measures.
#pragma once

#include "mesh_scale.h"
#include "output_folder.h"
#include "report.h"

#include <splitcubes/splitting/chosen_pieces.h>
#include <splitcubes/splitting/extract.h>

#include <optional>
#include <string>
#include <vector>

namespace splitcubes::app {

enum class Fate : std::uint8_t {
    kept,
    removed,  // lies inside a cutter in the mode remove
    dropped,  // too small, or not among the largest
};

struct CutPiece {
    std::string name;  // piece-NNNN, removed-NNNN or dropped-NNNN
    Fate fate = Fate::kept;
    std::size_t nodes = 0;
    splitting::PieceMeasure measure;
};

/// Result of a cut with its pieces sorted by name: kept before removed before dropped, each by volume,
/// largest first, ties by their original index.
struct CutResult {
    geometry::SurfaceMesh whole;                // all pieces; vertex_piece is an index into `pieces`
    std::optional<geometry::SurfaceMesh> rest;  // the kept pieces alone, if there are others
    std::vector<CutPiece> pieces;

    const geometry::SurfaceMesh& kept() const { return rest ? *rest : whole; }
    std::size_t count(Fate fate) const;
    /// Sum over the pieces of that fate, m^3.
    double volume(Fate fate) const;
};

/// removed: a flag per index in `pieces`. choice: selects which of the others are kept.
CutResult arrange_pieces(geometry::SurfaceMesh whole, const splitting::Pieces& pieces,
                         const std::vector<std::uint8_t>& removed, const splitting::PieceChoice& choice);

/// Returns the report's array `pieces`, in order.
Json pieces_report(const CutResult& result);

/// Writes each piece that was not dropped as a mesh NAME + `extension` into a folder of the kind
/// pieces_folder and adds `file` to the pieces of the report. Removes pieces of an earlier cut first.
void write_pieces(OutputFolder& folder, const std::string& extension, const CutResult& result,
                  const MeshScale& scale, Json& pieces);

/// Lists name, volume and area of each piece that was not dropped; empty for more than 20.
std::string pieces_table(const CutResult& result, const MeshScale& scale);

}  // namespace splitcubes::app
