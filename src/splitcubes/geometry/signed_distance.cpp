#include <splitcubes/core/error.h>
#include <splitcubes/geometry/nearest_point.h>
#include <splitcubes/geometry/signed_distance.h>
#include <splitcubes/geometry/tuning.h>
#include <splitcubes/geometry/winding_number.h>

#include <algorithm>
#include <cmath>

namespace splitcubes::geometry {

namespace {

class PlaneDistance : public SignedDistance {
  public:
    PlaneDistance(const Vec3& normal, double offset) : normal_(normal), offset_(offset) {}
    Sample at(const Vec3& point) const override { return {normal_.dot(point) - offset_, normal_}; }
    bool is_flat() const override { return true; }

  private:
    Vec3 normal_;
    double offset_;
};

class SphereDistance : public SignedDistance {
  public:
    explicit SphereDistance(double radius) : radius_(radius) {}
    Sample at(const Vec3& point) const override {
        const double length = point.norm();
        return {length - radius_, length > 0 ? Vec3(point / length) : Vec3(Vec3::UnitZ())};
    }

  private:
    double radius_;
};

class BoxDistance : public SignedDistance {
  public:
    BoxDistance(const Vec3& size, double rounding)
        : half_(0.5 * size - Vec3::Constant(rounding)), rounding_(rounding) {}
    Sample at(const Vec3& point) const override {
        const Vec3 beyond = point.cwiseAbs() - half_;
        const auto sign = [&](int axis) { return point[axis] < 0 ? -1.0 : 1.0; };
        const Vec3 out = beyond.cwiseMax(0.0);
        const double length = out.norm();
        if (length > 0) {
            const Vec3 normal = out / length;
            return {length - rounding_, Vec3(normal[0] * sign(0), normal[1] * sign(1), normal[2] * sign(2))};
        }
        int axis = 0;
        const double inner = beyond.maxCoeff(&axis);
        Vec3 normal = Vec3::Zero();
        normal[axis] = sign(axis);
        return {inner - rounding_, normal};
    }

  private:
    Vec3 half_;
    double rounding_;
};

class MeshDistance : public SignedDistance {
  public:
    MeshDistance(const TriangleMesh& mesh, int cells, const Parallel& parallel) {
        const Box box = mesh.bounds();
        if (mesh.triangles.empty() || !box.min.allFinite() || !box.max.allFinite())
            throw InputError("collider mesh", "has no triangles", "give a closed mesh");
        cell_ = box.size().maxCoeff() / std::max(cells, 4);
        if (!(cell_ > 0)) throw InputError("collider mesh", "has no extent", "give a closed mesh");
        origin_ = box.min - Vec3::Constant(2 * cell_);
        count_ = (box.size() / cell_).array().ceil().cast<int>() + 5;
        values_.resize(static_cast<std::size_t>(count_.prod()));
        const NearestPoint nearest(mesh);
        const WindingNumber winding(mesh);
        parallel.for_each(values_.size(), 256, [&](std::size_t k) {
            const Vec3 point = origin_ + cell_ * coordinates_of(k).cast<double>();
            const double distance = nearest.at({point}).distance;
            const WindingNumber::Estimate quick = winding.quick_at(point);
            const bool is_clear = std::abs(quick.value - 0.5) > quick.tolerance;
            const bool inside = (is_clear ? quick.value : winding.at(point)) > 0.5;
            values_[k] = inside ? -distance : distance;
        });
        if (std::none_of(values_.begin(), values_.end(), [](double v) { return v < 0; }))
            throw InputError("collider mesh", "encloses nothing that its grid sees",
                             "give a closed mesh whose triangles face outwards");
    }

    Sample at(const Vec3& point) const override {
        const Vec3 last = (count_ - Vec3i::Ones()).cast<double>();
        const Vec3 wanted = (point - origin_) / cell_;
        const Vec3 clamped = wanted.cwiseMax(0.0).cwiseMin(last);
        const Vec3i base = clamped.array().floor().cast<int>().matrix().cwiseMin(count_ - Vec3i::Constant(2));
        const Vec3 t = clamped - base.cast<double>();
        double value = 0;
        Vec3 gradient = Vec3::Zero();
        for (int corner = 0; corner < 8; ++corner) {
            const Vec3i bit(corner & 1, corner >> 1 & 1, corner >> 2);
            const Vec3 w(bit[0] ? t[0] : 1 - t[0], bit[1] ? t[1] : 1 - t[1], bit[2] ? t[2] : 1 - t[2]);
            const double node = values_[index_of(base + bit)];
            value += node * w[0] * w[1] * w[2];
            for (int axis = 0; axis < 3; ++axis)
                gradient[axis] += node * (bit[axis] ? 1 : -1) * w[(axis + 1) % 3] * w[(axis + 2) % 3];
        }
        const double length = gradient.norm();
        const Vec3 normal = length > 0 ? Vec3(gradient / length) : Vec3(Vec3::UnitZ());
        // Outside the grid the distance is at least that to the grid's rim, and the rim's value less that.
        const double outside = cell_ * (wanted - clamped).norm();
        return {outside > 0 ? std::max(outside, value - outside) : value, normal};
    }
    // Between nodes each axis has a slope of up to 1; outside the grid the distance to the rim adds
    // another 1.
    double lipschitz_constant() const override { return 3; }

  private:
    std::size_t index_of(const Vec3i& at) const {
        return static_cast<std::size_t>((at[2] * count_[1] + at[1]) * count_[0] + at[0]);
    }
    Vec3i coordinates_of(std::size_t k) const {
        const int i = static_cast<int>(k);
        return {i % count_[0], i / count_[0] % count_[1], i / (count_[0] * count_[1])};
    }

    Vec3 origin_ = Vec3::Zero();  // m
    double cell_ = 0;             // m
    Vec3i count_ = Vec3i::Zero();
    std::vector<double> values_;  // m, x fastest
};

void check_positive(const char* what, double value) {
    if (!(value > 0) || !std::isfinite(value))
        throw InputError("collider", std::string(what) + " must be positive");
}

}  // namespace

std::shared_ptr<const SignedDistance> make_plane_distance(const Vec3& normal, double offset) {
    const double length = normal.norm();
    if (!(length > 0) || !std::isfinite(length) || !std::isfinite(offset))
        throw InputError("collider", "a plane needs a normal of some length and a finite offset");
    return std::make_shared<PlaneDistance>(normal / length, offset / length);
}

std::shared_ptr<const SignedDistance> make_sphere_distance(double radius) {
    check_positive("a sphere's radius", radius);
    return std::make_shared<SphereDistance>(radius);
}

std::shared_ptr<const SignedDistance> make_box_distance(const Vec3& size, double rounding) {
    for (int axis = 0; axis < 3; ++axis) check_positive("a box's sides", size[axis]);
    if (!(rounding >= 0) || rounding > 0.5 * size.minCoeff())
        throw InputError("collider", "a box's rounding must be from 0 to half its shortest side");
    return std::make_shared<BoxDistance>(size, rounding);
}

std::shared_ptr<const SignedDistance> make_mesh_distance(const TriangleMesh& mesh, int cells,
                                                         const Parallel& parallel) {
    return std::make_shared<MeshDistance>(mesh, cells, parallel);
}

double first_contact(const SignedDistance& solid, const Vec3& from, const Vec3& to, double margin) {
    const double length = (to - from).norm();
    double travelled = 0;
    for (int k = 0; k < tuning::distance::max_trace_steps; ++k) {
        const double share = length > 0 ? travelled / length : 0;
        const double distance = solid.at(from + share * (to - from)).distance;
        if (distance < margin) return share;
        travelled += distance;
        if (travelled > length) return solid.at(to).distance < margin ? 1 : 2;
    }
    return length > 0 ? travelled / length : 0;
}

}  // namespace splitcubes::geometry
