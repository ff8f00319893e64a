// Looks of a body of a scene in the window: finishes of its materials, depths below its uncut surface, and
// the regions that are held or pulled.
#pragma once

#include "published_state.h"
#include "scene_source.h"

#include <splitcubes/geometry/nearest_point.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace splitcubes::scene {
class Course;
}

namespace splitcubes::view {

/// The index of the material of cut faces; -1: there is none.
int inside_of(const std::vector<std::string>& names);

/// Returns the colours of materials by their names, sRGB. Materials of the input have their own; cut faces
/// are those of a fresh cut.
std::vector<Vec3> palette_of(const std::vector<std::string>& names,
                             const std::vector<geometry::Material>& materials);
/// Returns a material's picture; null: it has none that can be read.
std::shared_ptr<const SurfacePicture> material_picture(const geometry::Material& material);

/// The looks of one body; caches what only cuts change.
class BodyLooks {
  public:
    BodyLooks() = default;
    /// materials: their names, of the body's surface. source must outlive it.
    BodyLooks(const SceneSource& source, std::size_t body, const std::vector<std::string>& materials);

    using Finishes = std::vector<std::shared_ptr<const geometry::Finish>>;
    /// By material; null: its colour. Null where the scene says nothing of the body.
    const std::shared_ptr<const Finishes>& finishes() const { return finishes_; }
    using Pictures = std::vector<std::shared_ptr<const SurfacePicture>>;
    /// By material; null entries: none; null: no material has one.
    const std::shared_ptr<const Pictures>& pictures() const { return pictures_; }
    /// Rest position and depth below the uncut surface, four numbers a vertex slot; empty where nothing
    /// depends on them. Only the slots of the ranges are computed again, and those behind the former end.
    std::vector<float> rest_and_depth(const SurfaceView& surface, bool all);
    /// Per vertex slot: 1 held, -1 pulled, 0 neither, now; empty where there is no region. course: of the
    /// scene.
    std::vector<float> marks(const SurfaceView& surface, double time, const scene::Course& course) const;

  private:
    struct MarkedRegion {
        std::function<bool(const Vec3&)> contains;  // rest
        std::size_t index;                          // of the constraint or handle
        bool is_pulled;
    };
    void read_pictures(const SceneSource& source, std::size_t body);

    std::shared_ptr<const Finishes> finishes_;
    std::shared_ptr<const Pictures> pictures_;
    std::shared_ptr<const geometry::NearestPoint> uncut_;  // null: depths are not needed
    std::vector<float> rest_and_depth_;
    std::vector<MarkedRegion> regions_;
    bool needs_rest_ = false;
};

}  // namespace splitcubes::view
