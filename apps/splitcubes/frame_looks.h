// Looks of the frames of a run, by its scene.
#pragma once

#ifdef SPLITCUBES_WITH_RENDER

#include <splitcubes/geometry/nearest_point.h>
#include <splitcubes/render/draw_list.h>
#include <splitcubes/scene/description.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace splitcubes::app {

/// Finds the finishes, depths, regions and pictures of a run's surfaces. Their materials tell the bodies'
/// finishes by name; their vertices tell the body where a scene has several.
class FrameLooks {
  public:
    explicit FrameLooks(const scene::SceneDescription& scene);
    /// Takes the regions that are held and pulled from the scene as it is now.
    void find_regions();

    render::SurfaceLooks of(const geometry::SurfaceMesh& surface, double time);
    /// Appends rods from the regions that handles pull to where they are pulled.
    void add_handles(render::DrawList& list, const geometry::SurfaceMesh& surface, double time) const;

  private:
    struct Region {
        std::size_t body = 0;
        bool is_pulled = false;
        double from = 0, until = 1e300;  // s
        std::optional<scene::Condition> release_when;
        std::function<bool(const Vec3&)> contains;  // rest
        std::function<Isometry(double)> motion;     // world from rest; of handles
    };
    bool acts(const Region& region, double time, const geometry::SurfaceMesh& surface) const;
    std::int32_t body_of_vertex(const geometry::SurfaceMesh& surface, std::size_t vertex) const;
    std::size_t pieces_of(const std::string& body, const geometry::SurfaceMesh& surface) const;
    void find_depth(const geometry::SurfaceMesh& surface, const std::vector<std::int32_t>& body_of_material,
                    render::SurfaceLooks& out);
    const geometry::NearestPoint* uncut_surface(std::size_t body);
    std::shared_ptr<const render::Picture> picture_of(const geometry::Material& material);

    const scene::SceneDescription& scene_;
    std::vector<Region> regions_;
    std::map<std::size_t, std::unique_ptr<const geometry::NearestPoint>> uncut_;  // by body
    std::map<std::string, std::shared_ptr<const render::Picture>> pictures_;      // by file
};

}  // namespace splitcubes::app

#endif
