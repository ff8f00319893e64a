#include <splitcubes/core/error.h>
#include <splitcubes/occlusion/disk.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <tuple>

namespace splitcubes::occlusion {

Disk make_disk(const PairQuery& pair) {
    const bool ordered =
        std::tie(pair.a[0], pair.a[1], pair.a[2]) < std::tie(pair.b[0], pair.b[1], pair.b[2]);
    const Vec3& first = ordered ? pair.a : pair.b;
    const Vec3& second = ordered ? pair.b : pair.a;
    const Vec3 difference = second - first;
    const double distance = difference.norm();
    const Vec3 z = difference / distance;
    // The coordinate axis most perpendicular to the segment determines the rotation of the raster.
    int axis = 0;
    z.cwiseAbs().minCoeff(&axis);
    const Vec3 x = Vec3::Unit(axis).cross(z).normalized();
    Disk disk;
    disk.apex = first;
    disk.radius = distance / 2;
    disk.axes.row(0) = x / disk.radius;
    disk.axes.row(1) = z.cross(x) / disk.radius;
    disk.axes.row(2) = z / disk.radius;
    return disk;
}

DiskRaster::DiskRaster(int texels) : size(texels), words(0), sample_count(0) {
    if (texels != 8 && texels != 16 && texels != 32)
        throw InputError("occlusion disk size", "must be 8, 16 or 32 texels, got " + std::to_string(texels));
    words = static_cast<std::size_t>(size * size / 64);
    for (int row = 0; row < size; ++row)
        for (int column = 0; column < size; ++column) {
            if (std::pow(coordinate(row), 2) + std::pow(coordinate(column), 2) > 1) continue;
            const auto bit = static_cast<std::size_t>(row * size + column);
            samples[bit / 64] |= std::uint64_t{1} << (bit % 64);
            ++sample_count;
        }
}

bool ray_crosses(const std::array<Vec3, 3>& local, double x, double y, int orientation) {
    const double sign = orientation;
    const double determinant = sign * local[0].dot(local[1].cross(local[2]));
    if (!(determinant > 0)) return false;
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 edge = sign * local[k].cross(local[(k + 1) % 3]);
        const double side = edge[0] * x + edge[1] * y + edge[2];
        const double decisive = side != 0 ? side : edge[0] != 0 ? edge[0] : edge[1] != 0 ? edge[1] : edge[2];
        if (!(decisive > 0)) return false;
        sum += side;
    }
    return near_depth * sum <= determinant && determinant <= far_depth * sum;
}

DiskCounts count_samples(const DiskMasks& masks, const DiskRaster& raster) {
    DiskCounts counts;
    for (std::size_t w = 0; w < raster.words; ++w) {
        const std::uint64_t in = raster.samples[w] & ~masks.outside[w];
        counts.inside += std::popcount(in);
        counts.visible += std::popcount(in & ~masks.obscured[w]);
    }
    return counts;
}

float visibility_of(const DiskCounts& counts, const geometry::OccluderGrid& occluders, const PairQuery& pair,
                    const VisibilityOptions& options) {
    if (counts.inside == 0) {
        // The segment runs from the first phyxel to the second in the disk's order, so that (a, b) and (b, a)
        // agree.
        const Disk disk = make_disk(pair);
        const Vec3 direction = disk.axes.row(2).transpose() * (disk.radius * disk.radius);
        return occluders.segment_blocked(disk.apex + near_depth * direction,
                                         disk.apex + (2 - near_depth) * direction)
                   ? 0.0F
                   : 1.0F;
    }
    const double visibility = static_cast<double>(counts.visible) / counts.inside;
    return visibility < options.full_occlusion_threshold ? 0.0F : static_cast<float>(visibility);
}

float visibility_of(const DiskMasks& masks, const DiskRaster& raster, const geometry::OccluderGrid& occluders,
                    const PairQuery& pair, const VisibilityOptions& options) {
    return visibility_of(count_samples(masks, raster), occluders, pair, options);
}

void check_options(const VisibilityOptions& options) {
    const DiskRaster raster(options.disk_size);
    const double threshold = options.full_occlusion_threshold;
    if (!(threshold >= 0 && threshold <= 1))
        throw InputError("occlusion threshold", "must lie in 0 .. 1, got " + std::to_string(threshold));
}

geometry::Box double_cone_bounds(const PairQuery& pair) {
    geometry::Box box;
    box.add(pair.a);
    box.add(pair.b);
    const Vec3 difference = pair.b - pair.a;
    const double distance = difference.norm();
    if (!(distance > 0)) return box;
    const double radius = far_depth * distance / 2;  // of either cone at its base
    const Vec3 z = difference / distance;
    for (const Vec3& centre : {Vec3(pair.a + radius * z), Vec3(pair.b - radius * z)}) {
        const Vec3 reach = radius * (Vec3::Ones() - z.cwiseProduct(z)).cwiseMax(0).cwiseSqrt();
        box.add(centre - reach);
        box.add(centre + reach);
    }
    // The margin exceeds the rounding of the kernels, in the pair's and in the rest frame.
    return box.grown(1e-5 * distance);
}

}  // namespace splitcubes::occlusion
