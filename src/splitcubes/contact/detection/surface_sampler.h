// Samples of a body's surface at which contacts are searched for.
#pragma once

#include <splitcubes/core/parallel.h>

#include <cstdint>
#include <vector>

namespace splitcubes::splitting {
class NodeGrid;
class Pieces;
class Surface;
}  // namespace splitcubes::splitting

namespace splitcubes::body {

/// Surface vertex at which contacts are searched for.
struct ContactSample {
    std::uint32_t vertex;  // of the surface
    std::int32_t piece;
    // On flat faces: the vertex of the sample that represents it; its own if it is active.
    std::uint32_t representative;
    // For contact between two cut faces: the vertex that represents it; and a vertex of the opposite cut
    // face, in the same cell, that represents both while the two nearly coincide. Its own vertex: none.
    std::uint32_t face_delegate, opposite;

    bool pushes() const { return representative == vertex; }
};

/// Chooses the contact samples of a surface, about two per phyxel spacing.
class SurfaceSampler {
  public:
    /// Chooses the samples of a surface. spacing: m, between phyxels.
    void rebuild(const splitting::NodeGrid& grid, const splitting::Surface& surface,
                 const splitting::Pieces& pieces, double spacing, const Parallel& parallel);
    const std::vector<ContactSample>& samples() const { return samples_; }
    /// Returns the revision of the surface on which the samples were chosen; changes whenever they do.
    std::uint64_t revision() const { return revision_; }

  private:
    void choose_active_samples(const splitting::Surface& surface, int side);
    void choose_cut_face_samples(const splitting::Surface& surface, int side);
    std::vector<std::uint32_t> opposite_samples(const splitting::Surface& surface) const;

    std::vector<ContactSample> samples_;
    std::uint64_t revision_ = ~std::uint64_t{0};
};

}  // namespace splitcubes::body
