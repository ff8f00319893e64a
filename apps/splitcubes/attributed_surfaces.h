// The surfaces of a world with the attributes of the meshes that its bodies were made from.
#pragma once

#include <splitcubes/geometry/attribute_transfer.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/scene/description.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

namespace splitcubes::body {
class Body;
class World;
}  // namespace splitcubes::body

namespace splitcubes::app {

/// Caches each body's attributes as long as the triangles of its surface are unchanged at rest.
class AttributedSurfaces {
  public:
    /// models: per body; a model without attributes gives none. The scene tells the appearance of bodies.
    AttributedSurfaces(const body::World& world, const std::vector<io::Model>& models,
                       const scene::SceneDescription& scene);

    /// Writes pictures embedded in the meshes' files into a folder, for formats that cannot embed them.
    /// `before` is called with each name before it is written.
    void write_images(const std::filesystem::path& folder,
                      const std::function<void(const std::filesystem::path&)>& before);

    /// Returns World::surface_mesh with attributes and, of several bodies, their numbers; without rest
    /// positions if no body has attributes and the format is not PLY.
    geometry::SurfaceMesh now(const body::World& world);

  private:
    struct Cached {
        std::optional<geometry::AttributeTransfer> transfer;
        std::vector<geometry::Material> materials;  // of the input, named as in output files
        scene::AppearanceDescription appearance;
        geometry::MeshAttributes transferred;  // what the transfer gave
        geometry::MeshAttributes attributes;   // the same with the materials of the appearance
        geometry::SurfaceMesh surface;         // of the attributes: triangles, origins, rest
        std::uint64_t revision = 0;
        bool known = false;
    };
    void update(Cached& cached, const body::Body& body, const geometry::SurfaceMesh& surface,
                const Parallel& parallel) const;

    std::vector<Cached> bodies_;
    bool any_ = false;
    bool keeps_rest_;
};

}  // namespace splitcubes::app
