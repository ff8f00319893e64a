// The cases of `splitcubes bench validation` with tetrahedra.
#pragma once

#include "mesh.h"

#include <functional>
#include <string>
#include <vector>

namespace splitcubes::tetrahedra {

/// A case that was computed on a mesh.
struct Outcome {
    std::size_t elements = 0, nodes = 0, free_nodes = 0;
    double measured = 0, expected = 0;
    double error() const { return measured / expected - 1; }
};

/// A case; the name and `across` are those of the validation.
struct Case {
    std::string test, unit;
    int across = 0;
    int free_phyxels = 0;  // about as many free nodes the meshes get
    std::function<Outcome(Order, int free_nodes)> run;
};

/// All cases, coarse to fine. Those with across = 0 are the finest meshes, one a test: they show how far
/// the theory, which neglects ends and edges, is from the body itself.
std::vector<Case> validation_cases();

/// A body that is to be divided into cells.
struct Extent {
    Vec3 lengths = Vec3::Ones();
    Vec3i least = Vec3i::Ones();  // cells along each axis
    Vec3i step = Vec3i::Ones();   // cells are multiples of it
    int held_planes = 0;          // of nodes, normal to x
    bool square = false;          // as many cells along y as along z
};

/// Returns the numbers of cells along the axes with which as many nodes as wanted are free, of nearly cubic
/// cells.
Vec3i choose_cells(const Extent& extent, Order order, int free_nodes);

}  // namespace splitcubes::tetrahedra
