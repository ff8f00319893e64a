// Measures the distance of the surface from shapes that are known exactly, and how often its triangles fold.
// Lengths are in cells unless stated otherwise.
#pragma once

#include <splitcubes/core/parallel.h>
#include <splitcubes/geometry/triangle_mesh.h>

#include <string>
#include <vector>

namespace splitcubes::app {

/// Statistics of absolute deviations.
struct Spread {
    double max = 0, sum_of_squares = 0;
    std::size_t count = 0;
    void add(double deviation);
    double rms() const;
};

/// Triangles that face away from the normal of the crossing of their quad. Triangles under 1e-9 of a cell's
/// face are left out: their normals are undefined.
struct Opposing {
    std::size_t triangles = 0, opposing = 0;
    double area = 0, opposing_area = 0;  // in faces of a cell
    double largest = 0;                  // area of the largest opposing one
    double share() const;                // by number of triangles
    double area_share() const;
    void add(const Opposing& other);
};

/// A smooth solid meshed with a number of cells across it.
struct SmoothRow {
    std::string shape;  // sphere, torus
    int across = 0;     // cells in the diameter of sphere or tube
    Spread vertices;  // distance from the true surface, without `moved`; relative to the radius of sphere or
                      // tube
    Spread moved;     // edge vertices that were moved away from a node; in cells
    double volume_error = 0;  // relative, absolute value, mean over the positions
    Opposing normals;
    Opposing unmoved_normals;  // of triangles whose edge vertex was not moved
};

/// Measures spheres and tori with 8, 16, 32 and 64 cells in the diameter of sphere or tube, each in three
/// positions in the grid. The crossings are those of the exact shapes, not of a mesh.
std::vector<SmoothRow> measure_smooth_shapes();

/// Boxes of random position and orientation, 9 cells a side.
struct BoxRow {
    int boxes = 0;
    Spread vertices;                   // distance from the box
    std::size_t beyond_hundredth = 0;  // vertices more than 0.01 off it
    std::size_t beyond_twentieth = 0;  // vertices more than 0.05 off it
    Spread corners;                    // from the box's corner to the nearest vertex
    Opposing normals;
};
BoxRow measure_tilted_boxes(int boxes, const Parallel& parallel);

/// Solids of random position and orientation, cut by a random plane.
struct CutRow {
    std::string shape;  // sphere, box
    double radius = 0;  // of the sphere; the box has sides of 1.4 times that
    int cuts = 0;
    Spread boundary;        // distance of boundary vertices (rim included) from the solid
    Spread rim;             // distance from the plane of vertices between boundary and cut triangles
    Spread face;            // distance from the plane of cut vertices at least 2 cells inside
    Opposing face_normals;  // of triangles between those, with edge vertices that were not moved
    double largest_volume_change = 0;  // relative to the uncut surface's
    Opposing normals;
};
CutRow measure_cuts(const std::string& shape, double radius, int cuts, const Parallel& parallel);

/// Counts opposing triangles of a mesh's surface with that many cells along its longest side.
Opposing measure_folds(const geometry::TriangleMesh& mesh, int cells, const Parallel& parallel);

}  // namespace splitcubes::app
