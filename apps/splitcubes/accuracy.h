// How near the surface comes to shapes that are known exactly, and how often its
// triangles fold. Lengths are in cells unless said otherwise.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <string>
#include <vector>

namespace splitcubes::app {

/// Sizes of deviations, whatever their signs.
struct Spread {
    double max = 0, sum_of_squares = 0;
    std::size_t count = 0;
    void add(double deviation);
    double rms() const;
};

/// Triangles that face away from the normal of the crossing that their quad belongs
/// to. Triangles under 1e-9 of a cell's face are left out: they face nowhere.
struct Opposing {
    std::size_t triangles = 0, opposing = 0;
    double area = 0, opposing_area = 0;  // in faces of a cell
    double largest = 0;                  // area of the largest opposing one
    double share() const;                // of the triangles
    double area_share() const;
    void add(const Opposing& other);
};

/// A smooth solid whose surface was made with a number of cells across it.
struct SmoothRow {
    std::string shape;        // sphere, torus
    int across = 0;           // cells in the diameter of sphere or tube
    Spread vertices;          // off the true surface, but `moved`; as parts of the radius of sphere or tube
    Spread moved;             // edge vertices that were moved away from a node; in cells
    double volume_error = 0;  // relative, absolute value, mean over the positions
    Opposing normals;
    Opposing unmoved_normals;  // of triangles whose edge vertex was not moved
};

/// Spheres and tori, 8, 16, 32 and 64 cells in the diameter of sphere or tube, each in three
/// positions in the grid. The crossings are those of the true shapes, no input mesh's.
std::vector<SmoothRow> measure_smooth_shapes();

/// Boxes of random place and direction, 9 cells a side.
struct BoxRow {
    int boxes = 0;
    Spread vertices;                   // off the box
    std::size_t beyond_hundredth = 0;  // vertices more than 0.01 off it
    std::size_t beyond_twentieth = 0;  // vertices more than 0.05 off it
    Spread corners;                    // from the box's corner to the nearest vertex
    Opposing normals;
};
BoxRow measure_tilted_boxes(int boxes, const Parallel& parallel);

/// Solids of random place and direction that a random plane cuts.
struct CutRow {
    std::string shape;  // sphere, box
    double radius = 0;  // of the sphere; the box has sides of 1.4 times that
    int cuts = 0;
    Spread skin;                       // boundary vertices, those of the rim among them, off the solid
    Spread rim;                        // vertices between boundary and cut triangles off the plane
    Spread face;                       // vertices of cut triangles, 2 cells and more inside, off the plane
    Opposing face_normals;             // triangles between those, of edge vertices that were not moved
    double largest_volume_change = 0;  // relative to the uncut surface's
    Opposing normals;
};
CutRow measure_cuts(const std::string& shape, double radius, int cuts, const Parallel& parallel);

/// Opposing triangles of a mesh's surface with that many cells along its longest side.
Opposing measure_folds(const geometry::TriangleMesh& mesh, int cells, const Parallel& parallel);

}  // namespace splitcubes::app
