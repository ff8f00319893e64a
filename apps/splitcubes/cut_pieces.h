// The pieces that `cut` leaves: which are kept, their names, their measures.
#pragma once

#include "report.h"

#include <splitcubes/splitting/extract.h>

#include <optional>
#include <string>
#include <vector>

namespace splitcubes::app {

struct CutPiece {
    std::string name;  // piece-NNNN or removed-NNNN
    bool removed = false;
    std::size_t nodes = 0;
    splitting::PieceMeasure measure;
};

/// What a cut made, with its pieces in the order of their names: kept before
/// removed, each by volume, largest first, ties by their old number.
struct CutResult {
    geometry::SurfaceMesh whole;                // all of it; vertex_piece is an index into `pieces`
    std::optional<geometry::SurfaceMesh> rest;  // without the removed pieces, where there are some
    std::vector<CutPiece> pieces;

    const geometry::SurfaceMesh& kept() const { return rest ? *rest : whole; }
    std::size_t kept_count() const;
    /// Sum over the pieces that are (not) removed, m^3.
    double volume(bool removed) const;
};

/// removed: a flag a piece, by number in `pieces`.
CutResult arrange_pieces(geometry::SurfaceMesh whole, const splitting::Pieces& pieces,
                         const std::vector<std::uint8_t>& removed);

/// Entries of the report's array `pieces`, in order.
Json pieces_report(const CutResult& result);

/// Throws InputError where `folder` cannot be a folder: asked before the work.
void check_pieces_folder(const std::filesystem::path& folder);

/// Writes one mesh a piece, NAME + `extension`, into `folder`, which is made; adds
/// `file` to the pieces of the report. Pieces of an earlier cut with the same
/// extension are taken away first.
void write_pieces(const std::filesystem::path& folder, const std::string& extension, const CutResult& result,
                  Json& pieces);

/// Name, volume and area of each piece as lines for people; nothing for more than 20.
std::string pieces_table(const CutResult& result);

}  // namespace splitcubes::app
