// A body's surface in slots that stay, and what the last call changed of it.
#pragma once

#include <splitcubes/api/surface.h>
#include <splitcubes/geometry/attribute_transfer.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace splitcubes::body {
class Body;
}

namespace splitcubes::api {

/// Vertex slots are those of splitting::Surface; quad q of it is triangle slots 2 q and 2 q + 1. The
/// cost of a change grows with the number of changed cells; a separation of pieces passes all vertices once.
class SurfaceStream {
  public:
    /// transfer: of the body's input; none: materials by origin.
    SurfaceStream(const body::Body& body, std::shared_ptr<const geometry::AttributeTransfer> transfer,
                  const Parallel& parallel);

    /// Nothing has changed from here on, until take_changes.
    void forget_changes();
    /// Updates the cells that the body's last retessellate changed, and the pieces that separated with it.
    void take_changes(const body::Body& body, const Parallel& parallel);
    /// Updates positions and normals of the vertices.
    void move(const body::Body& body, const Parallel& parallel);

    SurfaceView view() const;
    const std::vector<std::string>& material_names() const { return material_names_; }
    std::size_t bytes() const;

  private:
    /// Quads of a cell, as they are in the triangle slots.
    struct Run {
        std::uint32_t first = 0, count = 0;
    };
    void update_cells(const body::Body& body, std::span<const std::uint32_t> cells, const Parallel& parallel);
    void clear_run(const Run& run);
    void write_run(const body::Body& body, std::uint32_t cell);
    void update_vertex(const body::Body& body, std::uint32_t vertex);
    void update_pieces(const body::Body& body, const Parallel& parallel);
    void update_attributes(const body::Body& body, const Parallel& parallel);

    std::shared_ptr<const geometry::AttributeTransfer> transfer_;
    std::vector<std::string> material_names_;
    std::vector<float> positions_, normals_, rest_;  // three a vertex slot
    std::vector<std::int32_t> pieces_;               // a vertex slot; -1: free
    std::vector<std::uint64_t> identity_;            // a vertex slot: names its vertex; 0: free
    std::vector<std::uint32_t> triangles_;           // three a triangle slot
    std::vector<SurfaceOrigin> origins_;             // a triangle slot
    std::vector<std::int32_t> material_;             // a triangle slot
    std::vector<float> uv_;                          // six a triangle slot, or empty
    std::vector<std::int32_t> cuts_, edges_;         // a triangle slot
    std::vector<Run> runs_;                          // a cell
    // Slots of the last change, then as ranges.
    std::vector<std::uint32_t> changed_quads_, changed_, fresh_;
    std::vector<Range> vertex_ranges_, triangle_ranges_, new_ranges_;
    std::uint64_t revision_;
};

}  // namespace splitcubes::api
