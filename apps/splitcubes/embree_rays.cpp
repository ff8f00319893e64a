#include "embree_rays.h"

#include <splitcubes/core/stopwatch.h>

#ifdef SPLITCUBES_WITH_EMBREE
#include <embree3/rtcore.h>
#endif

#include <bit>

namespace splitcubes::app {

#ifdef SPLITCUBES_WITH_EMBREE

struct EmbreeRays::Impl {
    RTCDevice device = rtcNewDevice("threads=1");
    RTCScene scene = rtcNewScene(device);

    Impl() = default;
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
    ~Impl() {
        rtcReleaseScene(scene);
        rtcReleaseDevice(device);
    }
};

namespace {

// Up to 16 rays of a disk from one phyxel; samples: the bits of the rays.
class Packet {
  public:
    Packet(const occlusion::Disk& disk, int apex) : disk_(disk), apex_(apex) {}

    void add(double x, double y, int sample) {
        const double depth = apex_ == 0 ? 0.0 : 2.0;
        const Vec3 ahead(x, y, apex_ == 0 ? 1.0 : -1.0);
        const Vec3 origin = disk_.apex + back(Vec3(0, 0, depth)), direction = back(ahead);
        rays_.org_x[count_] = static_cast<float>(origin[0]);
        rays_.org_y[count_] = static_cast<float>(origin[1]);
        rays_.org_z[count_] = static_cast<float>(origin[2]);
        rays_.dir_x[count_] = static_cast<float>(direction[0]);
        rays_.dir_y[count_] = static_cast<float>(direction[1]);
        rays_.dir_z[count_] = static_cast<float>(direction[2]);
        rays_.tnear[count_] = static_cast<float>(occlusion::near_depth);
        rays_.tfar[count_] = static_cast<float>(occlusion::far_depth);
        rays_.time[count_] = 0;
        rays_.mask[count_] = 0xffffffffU;
        rays_.flags[count_] = 0;
        sample_[count_++] = sample;
    }
    int count() const { return count_; }
    // Marks the occluded samples.
    void trace(RTCScene scene, occlusion::DiskBits& obscured) {
        alignas(64) int valid[16];
        for (int k = 0; k < 16; ++k) valid[k] = k < count_ ? -1 : 0;
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
        rtcOccluded16(valid, scene, &context, &rays_);
        for (int k = 0; k < count_; ++k) {
            const auto bit = static_cast<std::size_t>(sample_[k]);
            if (rays_.tfar[k] < 0) obscured[bit / 64] |= std::uint64_t{1} << (bit % 64);
        }
        count_ = 0;
    }

  private:
    Vec3 back(const Vec3& local) const {
        return disk_.radius * disk_.radius * (disk_.axes.transpose() * local);
    }

    const occlusion::Disk& disk_;
    int apex_;
    int count_ = 0;
    alignas(64) RTCRay16 rays_;
    int sample_[16];
};

}  // namespace

EmbreeRays::EmbreeRays(std::span<const geometry::OccluderTriangle> triangles)
    : impl_(std::make_unique<Impl>()) {
    Stopwatch watch;
    const RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* corner = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3 * triangles.size()));
    auto* index = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), triangles.size()));
    unsigned next = 0;
    for (const geometry::OccluderTriangle& triangle : triangles)
        for (const Vec3& p : triangle.corner) {
            for (int axis = 0; axis < 3; ++axis) *corner++ = static_cast<float>(p[axis]);
            *index++ = next++;
        }
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_MEDIUM);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(impl_->scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(impl_->scene);
    build_seconds_ = watch.seconds();
}

bool EmbreeRays::built_in() {
    return true;
}

void EmbreeRays::count(std::span<const occlusion::PairQuery> pairs, const occlusion::DiskRaster& raster,
                       std::span<int> visible) const {
    for (std::size_t p = 0; p < pairs.size(); ++p) {
        const occlusion::Disk disk = occlusion::make_disk(pairs[p]);
        occlusion::DiskBits obscured{};
        for (const int apex : {0, 1}) {
            Packet packet(disk, apex);
            for (std::size_t w = 0; w < raster.words; ++w)
                for (std::uint64_t open = raster.samples[w] & ~obscured[w]; open; open &= open - 1) {
                    const int bit = static_cast<int>(64 * w) + std::countr_zero(open);
                    packet.add(raster.coordinate(bit % raster.size), raster.coordinate(bit / raster.size),
                               bit);
                    if (packet.count() == 16) packet.trace(impl_->scene, obscured);
                }
            if (packet.count() > 0) packet.trace(impl_->scene, obscured);
        }
        int left = 0;
        for (std::size_t w = 0; w < raster.words; ++w)
            left += std::popcount(raster.samples[w] & ~obscured[w]);
        visible[p] = left;
    }
}

#else

struct EmbreeRays::Impl {};

EmbreeRays::EmbreeRays(std::span<const geometry::OccluderTriangle>) {}

bool EmbreeRays::built_in() {
    return false;
}

void EmbreeRays::count(std::span<const occlusion::PairQuery>, const occlusion::DiskRaster&,
                       std::span<int>) const {}

#endif

EmbreeRays::~EmbreeRays() = default;

}  // namespace splitcubes::app
