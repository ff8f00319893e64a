#include <splitcubes/occlusion/cpu/packs.h>

#include <algorithm>
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

namespace {

void find_near(const geometry::OccluderGrid& occluders, const PairQuery& pair, const Disk& disk,
               NearPacks& near) {
    near.clear();
    const geometry::PackedTriangles* last = nullptr;
    std::array<float, 3> offset{};
    occluders.visit_packs(
        double_cone_bounds(pair),
        [&](const geometry::OccluderPack& pack, const geometry::PackedTriangles& home) {
            if (&home != last) {
                last = &home;
                const Vec3 at = disk.local(home.centre());
                for (std::size_t k = 0; k < 3; ++k)
                    offset[k] = static_cast<float>(at[static_cast<Eigen::Index>(k)]);
                near.extent = std::max(near.extent, home.extent() / static_cast<float>(disk.radius));
            }
            near.packs.push_back({&pack, offset});
        },
        [&](std::uint32_t id) {
            near.leftover.push_back({id, 0});
            near.leftover.push_back({id, 1});
        });
}

}  // namespace

DiskMasks masks_of(const geometry::OccluderGrid& occluders, const PairQuery& pair, const Disk& disk,
                   const DiskRaster& raster, Buffers& buffers) {
    DiskMasks masks;
    find_near(occluders, pair, disk, buffers.near);
    if (!buffers.near.packs.empty()) rasterize_packs(disk, raster, occluders, buffers.near, masks);
    if (buffers.near.leftover.empty()) return masks;
    buffers.others.clear();
    for (const ProjectedTriangle& projected : buffers.near.leftover)
        buffers.others.add(occluders.triangle(projected.triangle), disk.apex, 1U << projected.apex);
    rasterize(disk, raster, buffers.others, masks);
    return masks;
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
        constexpr std::size_t grain = 64;  // about 0.1 ms
        parallel.for_chunks(pairs.size(), grain, [&](std::size_t begin, std::size_t end) {
            cpu::Buffers buffers;
            for (std::size_t i = begin; i < end; ++i)
                visibility[i] = evaluate_pair(occluders, pairs[i], buffers);
        });
    }

  private:
    float evaluate_pair(const geometry::OccluderGrid& occluders, const PairQuery& pair,
                        cpu::Buffers& buffers) const {
        if (coincide(pair)) return 1;
        const DiskMasks masks = cpu::masks_of(occluders, pair, make_disk(pair), raster_, buffers);
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
