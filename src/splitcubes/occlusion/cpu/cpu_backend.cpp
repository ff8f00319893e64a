#include <splitcubes/occlusion/cpu/rasterize.h>

#include <bit>
#include <cassert>

namespace splitcubes::occlusion {

namespace cpu {

void resolve(const Disk& disk, const DiskRaster& raster, const OpenSamples& open, DiskMasks& masks) {
    std::array<Vec3, 3> local;
    for (std::size_t k = 0; k < 3; ++k) {
        local[k] = disk.local(open.triangle->corner[k]);
        if (open.apex == 1) local[k][2] = 2 - local[k][2];
    }
    const double y = raster.coordinate(open.row);
    for (std::uint32_t columns = open.columns; columns; columns &= columns - 1) {
        const int column = std::countr_zero(columns);
        const double x = raster.coordinate(column);
        const auto bit = static_cast<std::size_t>(open.row * raster.size + column);
        const std::uint64_t flag = std::uint64_t{1} << (bit % 64);
        const Vec3 ray(x, y, 1);
        if (geometry::segment_meets_triangle(near_depth * ray, far_depth * ray, local))
            masks.obscured[bit / 64] |= flag;
        if (open.apex == 0 && open.triangle->boundary && ray_crosses(local, x, y, open.orientation))
            masks.outside[bit / 64] ^= flag;
    }
}

}  // namespace cpu

namespace {

class CpuBackend final : public VisibilityBackend {
  public:
    explicit CpuBackend(const VisibilityOptions& options) : options_(options), raster_(options.disk_size) {}

    std::string name() const override { return "cpu"; }

    void evaluate(const geometry::OccluderGrid& occluders, std::span<const PairQuery> pairs,
                  std::span<float> visibility, const Parallel& parallel) override {
        assert(visibility.size() == pairs.size());
        constexpr std::size_t grain = 64;  // some 0.1 ms
        parallel.for_chunks(pairs.size(), grain, [&](std::size_t begin, std::size_t end) {
            cpu::TriangleList near;
            for (std::size_t i = begin; i < end; ++i)
                visibility[i] = evaluate_pair(occluders, pairs[i], near);
        });
    }

  private:
    float evaluate_pair(const geometry::OccluderGrid& occluders, const PairQuery& pair,
                        cpu::TriangleList& near) const {
        if (coincide(pair)) return 1;
        const Disk disk = make_disk(pair);
        near.clear();
        occluders.visit(double_cone_bounds(pair),
                        [&](const geometry::OccluderTriangle& triangle) { near.add(triangle, disk.apex); });
        if (near.count() == 0) return 1;
        DiskMasks masks;
        cpu::rasterize(disk, raster_, near, masks);
        return visibility_of(masks, raster_, occluders, pair, options_);
    }

    VisibilityOptions options_;
    DiskRaster raster_;
};

}  // namespace

std::unique_ptr<VisibilityBackend> make_cpu_backend(const VisibilityOptions& options) {
    check_options(options);
    return std::make_unique<CpuBackend>(options);
}

}  // namespace splitcubes::occlusion
