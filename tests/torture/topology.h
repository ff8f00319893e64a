// Closed, oriented 2-manifolds, and the volumes of their pieces.
#pragma once

#include "surface_file.h"

#include <vector>

namespace splitcubes::torture {

struct Topology {
    std::size_t open_edges = 0;          // directed edges without exactly one opposite
    std::size_t branching_vertices = 0;  // whose triangles form more than one fan
};

Topology topology_of(const Surface& surface);

/// A piece by the divergence theorem.
struct PieceMeasure {
    int piece = 0;
    std::size_t triangles = 0;
    double volume = 0;                  // m^3, signed, as deformed
    double rest_volume = 0;             // m^3, signed; 0 without positions at rest
    Vec3 centre = Vec3::Zero();         // m, of the volume; of a flat piece the mean of its vertices
    Vec3 affine_centre = Vec3::Zero();  // m, image of the centre at rest by the affine map that fits best
};

/// Those of all pieces, by number.
std::vector<PieceMeasure> measure_pieces(const Surface& surface);

}  // namespace splitcubes::torture
