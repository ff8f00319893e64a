// Inside and outside along the edges of a grid in a crowd of large triangles, of which a tree leaves most to
// be summed one by one. Not part of the public interface.
#pragma once

#include <splitcubes/geometry/grid_sweep.h>
#include <splitcubes/geometry/winding_jets.h>
#include <splitcubes/geometry/winding_number.h>
#include <splitcubes/splitting/boundary_crossings.h>

#include <cstdint>
#include <vector>

namespace splitcubes::splitting {

/// All triangles are summed at the nodes only, with derivatives. In between only those are summed whose rim
/// is near: a triangle's own winding number is analytic along an edge away from its rim, but for a step of
/// one where the edge crosses the triangle, which the sweep knows. So the others' sum is a polynomial between
/// its values and derivatives at the ends, plus steps, within a bound on its sixth derivative. Edges with
/// many crossings are divided and treated likewise. What the bounds leave open is left to the sum over all
/// triangles.
class SoupEdges {
  public:
    /// Whether it is faster than one sum for each question.
    static bool pays(const geometry::WindingNumber& winding, const geometry::TriangleMesh& mesh,
                     const RestGrid& rest);

    /// All outlive it.
    SoupEdges(const geometry::TriangleMesh& mesh, const RestGrid& rest, const geometry::GridCrossings& sweep,
              const geometry::WindingNumber& winding, const Parallel& parallel);

    /// Whether nodes are inside, x first, then y; the grid's outermost are not.
    const std::vector<std::uint8_t>& inside() const { return inside_; }

    static constexpr std::uint8_t unknown = 2;
    /// Whether the stretch between each crossing and the next one of the same edge is inside; or unknown.
    const std::vector<std::uint8_t>& after() const { return after_; }
    /// Whether a point of an edge is, by the sum over all triangles.
    bool inside_at(const GridEdge& edge, double parameter) const;
    /// Cuts of the edges between inside and outside that no triangle crosses, but for some.
    const std::vector<BoundaryCut>& holes() const { return holes_; }

  private:
    class Worker;

    struct NodeJet {
        double value;
        std::array<float, 3> gradient, second;
        float error2;
        bool sound;
    };

    Vec3 place(const Vec3& grid_point) const { return grid_point - center_; }
    std::size_t index(const Vec3i& node) const {
        return (static_cast<std::size_t>(node[2]) * static_cast<std::size_t>(rest_.node_count[1]) +
                static_cast<std::size_t>(node[1])) *
                   static_cast<std::size_t>(rest_.node_count[0]) +
               static_cast<std::size_t>(node[0]);
    }
    std::size_t line_of(const Vec3i& node, int axis) const;
    std::span<const geometry::EdgeCrossing> crossings(const GridEdge& edge) const;
    void set_nodes(const Parallel& parallel);
    void set_edges(const Parallel& parallel);

    const RestGrid& rest_;
    const geometry::GridCrossings& sweep_;
    const geometry::WindingNumber& winding_;
    Vec3 center_;                         // of the grid, in cells; a node
    std::vector<std::uint8_t> has_area_;  // by triangle of the mesh
    geometry::WindingJets jets_;
    std::vector<std::uint32_t> numbers_;  // triangle of jets_ by triangle of the mesh
    std::vector<NodeJet> nodes_;
    std::vector<std::uint8_t> inside_, after_;
    std::vector<std::uint32_t> line_begin_;  // first crossing by line, axis after axis
    std::vector<BoundaryCut> holes_;
};

}  // namespace splitcubes::splitting
