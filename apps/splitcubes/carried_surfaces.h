// The surfaces of a world with the attributes of the meshes that its bodies were made of.
#pragma once

#include <splitcubes/body/world.h>
#include <splitcubes/geometry/attribute_transfer.h>
#include <splitcubes/io/read_mesh.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

namespace splitcubes::app {

/// Keeps each body's attributes as long as its surface has the same triangles at rest.
class CarriedSurfaces {
  public:
    /// models: per body; without attributes: the body has none.
    CarriedSurfaces(const body::World& world, const std::vector<io::Model>& models);

    /// Writes pictures that the meshes' files held as files into a folder, for
    /// formats that hold none. `before` is told of each before it is written.
    void write_images(const std::filesystem::path& folder,
                      const std::function<void(const std::filesystem::path&)>& before);

    /// As World::surface_mesh. Where no body has attributes, without rest positions.
    geometry::SurfaceMesh now(const body::World& world);

  private:
    struct Carried {
        std::optional<geometry::AttributeTransfer> transfer;
        std::vector<geometry::Material> materials;  // of the input, as files are to refer to them
        geometry::MeshAttributes attributes;
        geometry::SurfaceMesh surface;  // that they belong to: triangles, origins and rest only
        std::uint64_t revision = 0;
        bool known = false;
    };
    void update(Carried& carried, const body::Body& body, const geometry::SurfaceMesh& surface,
                const Parallel& parallel) const;

    std::vector<Carried> bodies_;
    bool any_ = false;
};

}  // namespace splitcubes::app
