// Inside test along the edges of a grid for dense soups of large triangles, in which a tree evaluates most
// triangles individually. Not part of the public interface.
#pragma once

#include <splitcubes/geometry/grid_sweep.h>
#include <splitcubes/geometry/winding_jets.h>
#include <splitcubes/geometry/winding_number.h>
#include <splitcubes/splitting/boundary_crossings.h>

#include <cstdint>
#include <vector>

namespace splitcubes::splitting {

/// Sums all triangles only at the nodes, with derivatives, and in between only those whose boundary is near:
/// a triangle's own winding number is analytic along an edge away from its boundary, except for a step of one
/// where the edge crosses the triangle, which is known from the sweep. The sum of the others is thus a
/// polynomial that interpolates its values and derivatives at the ends, plus steps, within a bound on its
/// sixth derivative. Edges with many crossings are subdivided. Points that the bounds leave undecided are
/// evaluated by the sum over all triangles.
class SoupEdges {
  public:
    /// Returns whether this is faster than a sum per query.
    static bool pays(const geometry::WindingNumber& winding, const geometry::TriangleMesh& mesh,
                     const RestGrid& rest);

    /// The arguments must outlive the object.
    SoupEdges(const geometry::TriangleMesh& mesh, const RestGrid& rest, const geometry::GridCrossings& sweep,
              const geometry::WindingNumber& winding, const Parallel& parallel);

    /// Returns the inside flags of nodes, x fastest, then y; the grid's outermost nodes are outside.
    const std::vector<std::uint8_t>& inside() const { return inside_; }

    static constexpr std::uint8_t unknown = 2;
    /// Returns whether the stretch between each crossing and the next one of the same edge is inside, or
    /// unknown.
    const std::vector<std::uint8_t>& after() const { return after_; }
    /// Returns whether a point of an edge is inside, by the sum over all triangles.
    bool inside_at(const GridEdge& edge, double parameter) const;
    /// Returns the cuts of most edges between inside and outside that no triangle crosses.
    const std::vector<BoundaryCut>& holes() const { return holes_; }

  private:
    class Worker;

    struct NodeJet {
        double value;
        std::array<float, 3> gradient, second;
        float error2;
        bool sound;
    };

    Vec3 centered(const Vec3& grid_point) const { return grid_point - center_; }
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
    std::vector<std::uint32_t> jet_ids_;  // index in jets_ by triangle of the mesh
    std::vector<NodeJet> nodes_;
    std::vector<std::uint8_t> inside_, after_;
    std::vector<std::uint32_t> line_begin_;  // first crossing by line, axis by axis
    std::vector<BoundaryCut> holes_;
};

}  // namespace splitcubes::splitting
