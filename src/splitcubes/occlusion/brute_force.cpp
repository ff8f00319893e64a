#include <splitcubes/occlusion/brute_force.h>

#include <cassert>

namespace splitcubes::occlusion {

namespace {

struct LocalTriangle {
    std::array<std::array<Vec3, 3>, 2> corner;  // in the local coordinates of either apex
    bool boundary;
};

// Result of one ray. obscured: the sample is not visible from the apex. odd: an odd number of boundary
// triangles lies between them.
struct RayResult {
    bool obscured = false;
    bool odd = false;
};

RayResult cast(const std::vector<LocalTriangle>& triangles, std::size_t apex, double x, double y) {
    RayResult result;
    const Vec3 begin = near_depth * Vec3(x, y, 1), end = far_depth * Vec3(x, y, 1);
    for (const LocalTriangle& triangle : triangles) {
        const std::array<Vec3, 3>& corner = triangle.corner[apex];
        result.obscured = result.obscured || geometry::segment_meets_triangle(begin, end, corner);
        if (triangle.boundary && (ray_crosses(corner, x, y, 1) || ray_crosses(corner, x, y, -1)))
            result.odd = !result.odd;
    }
    return result;
}

class BruteForceBackend final : public VisibilityBackend {
  public:
    explicit BruteForceBackend(const VisibilityOptions& options)
        : options_(options), raster_(options.disk_size) {}

    std::string name() const override { return "brute-force"; }

    void evaluate(const geometry::OccluderGrid& occluders, std::span<const PairQuery> pairs,
                  std::span<float> visibility, const Parallel& parallel) override {
        assert(visibility.size() == pairs.size());
        parallel.for_each(pairs.size(), 4, [&](std::size_t i) {
            visibility[i] = coincide(pairs[i])
                                ? 1.0F
                                : visibility_of(brute_force_masks(occluders, pairs[i], raster_), raster_,
                                                occluders, pairs[i], options_);
        });
    }

  private:
    VisibilityOptions options_;
    DiskRaster raster_;
};

}  // namespace

DiskMasks brute_force_masks(const geometry::OccluderGrid& occluders, const PairQuery& pair,
                            const DiskRaster& raster) {
    const Disk disk = make_disk(pair);
    std::vector<LocalTriangle> triangles;
    occluders.visit(double_cone_bounds(pair), [&](const geometry::OccluderTriangle& t) {
        LocalTriangle local;
        local.boundary = t.boundary;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 p = disk.local(t.corner[k]);
            local.corner[0][k] = p;
            local.corner[1][k] = {p[0], p[1], 2 - p[2]};
        }
        triangles.push_back(local);
    });
    DiskMasks masks;
    for (int row = 0; row < raster.size; ++row)
        for (int column = 0; column < raster.size; ++column) {
            const double x = raster.coordinate(column), y = raster.coordinate(row);
            const RayResult first = cast(triangles, 0, x, y), second = cast(triangles, 1, x, y);
            const auto bit = static_cast<std::size_t>(row * raster.size + column);
            const std::uint64_t flag = std::uint64_t{1} << (bit % 64);
            if (first.obscured || second.obscured) masks.obscured[bit / 64] |= flag;
            if (first.odd) masks.outside[bit / 64] |= flag;
        }
    return masks;
}

std::unique_ptr<VisibilityBackend> make_brute_force_backend(const VisibilityOptions& options) {
    check_options(options);
    return std::make_unique<BruteForceBackend>(options);
}

}  // namespace splitcubes::occlusion
