// A surface that stays in the driver's memory and is updated in parts, for windows.
#pragma once

#include <splitcubes/geometry/box.h>
#include <splitcubes/geometry/finish.h>
#include <splitcubes/math/types.h>
#include <splitcubes/render/picture.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace splitcubes::render {

/// Quantity that colours a live surface.
enum class SurfaceColouring {
    material,
    piece,
    field,
    label,  // of the triangle; see SurfaceSlots
    age,    // of the label, which is a time in ms
};

/// Style that a live surface is drawn in.
struct LiveStyle {
    SurfaceColouring colouring = SurfaceColouring::material;
    std::array<Vec3, 16> palette{};  // sRGB, of materials; larger numbers begin again
    /// By material; null and beyond the end: the palette's colour.
    std::vector<std::shared_ptr<const geometry::Finish>> finishes = {};
    /// By material; null and beyond the end: none. Multiply the colours; the first max_pictures are drawn.
    std::vector<std::shared_ptr<const Picture>> pictures = {};
    static constexpr std::size_t max_pictures = 4;
    bool wireframe = false;   // its edges, over it
    double opacity = 1;       // below 1 what is inside of it is seen
    double now_ms = 0;        // that ages are counted from
    double age_range_ms = 1;  // age at the lower end of the colour scale
    double field_low = 0;     // value at the lower end of the colour scale
    double field_high = 1;    // value at the upper end
    double roughness = 0.5;   // 0 mirror .. 1 chalk; without finishes from 0.3 on
    /// The surface is closed: its inside is not seen from outside.
    bool is_closed = false;
    /// Material of what a clip plane lays open, where materials are shown; negative: the inner side of the
    /// surface is seen.
    int inside = -1;
};

/// Half space that is hidden: points p with normal . p > offset.
struct ClipPlane {
    Vec3 normal = Vec3::Zero();  // world; zero: nothing is hidden
    double offset = 0;           // m
};

/// Consecutive slots.
struct SlotRange {
    std::size_t first = 0, count = 0;
};

/// Arrays of a surface in slots; see LiveSurface.
struct SurfaceSlots {
    std::span<const std::uint32_t> triangles;  // three vertices a triangle; without extent: free
    /// A triangle: material in the lowest 4 bits, above them a label; label 0: none.
    std::span<const std::int32_t> materials;
    std::span<const std::int32_t> pieces;  // a vertex
    std::span<const float> rest = {};  // four a vertex: rest position and depth below the uncut surface, m
    std::span<const float> corner_uv = {};  // six a triangle: u, v of its corners; empty: no pictures
};

/// Vertices and triangles in slots. Topology is updated in the ranges that changed, positions as a whole.
/// Made, used and destroyed while the renderer's context is current.
class LiveSurface {
  public:
    LiveSurface();
    ~LiveSurface();
    LiveSurface(LiveSurface&&) noexcept;
    LiveSurface& operator=(LiveSurface&&) noexcept;

    /// Copies everything.
    void set_topology(const SurfaceSlots& slots);
    /// Copies the ranges of triangles and vertices, and what is behind the present ends.
    void patch_topology(const SurfaceSlots& slots, std::span<const SlotRange> triangles,
                        std::span<const SlotRange> vertices);
    /// Replaces the marks of all vertices.
    void set_marks(std::span<const float> marks);
    /// x, y, z a vertex, m, world; normals unit; field: a number a vertex, or empty. Vertices whose piece is
    /// negative are free.
    void set_vertices(std::span<const float> positions, std::span<const float> normals,
                      std::span<const float> field);

    /// Bounds of the vertices that are used.
    const geometry::Box& bounds() const;
    /// Needs of its style: 0 colours, 1 finishes, 2 pictures, too.
    int looks() const;
    /// Bytes that were copied to the driver since the surface was made.
    std::size_t bytes_copied() const;

    LiveStyle style;

  private:
    friend class Renderer;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Small balls at points, e.g. samples of a body.
struct PointSet {
    std::vector<float> positions;  // x, y, z a point, m, world
    std::vector<float> colours;    // red, green, blue a point, linear
    double radius = 0;             // m
};

/// Colour scale of fields: share 0 .. 1 to sRGB, from blue over green and yellow to red.
Vec3 scale_colour(double share);
/// Colour of a piece, sRGB.
Vec3 piece_colour(std::int32_t piece);

}  // namespace splitcubes::render
