#include "obstacles.h"

#include <algorithm>
#include <numbers>

namespace splitcubes::torture {

using Json = nlohmann::ordered_json;

Vec3 vector_of(const Json& json) {
    return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

Eigen::Quaterniond rotation_of(const Json& json) {
    const Vec3 axis = json.contains("axis") ? vector_of(json["axis"]) : Vec3(0, 0, 1);
    const double angle = json.value("angle_degrees", 0.0) * std::numbers::pi / 180;
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

Motion::Motion(const Json& keyframes, const Vec3& pivot) : pivot_(pivot) {
    for (const Json& key : keyframes)
        keys_.push_back(
            {key.at("time").get<double>(),
             key.contains("position") ? vector_of(key["position"]) : Vec3::Zero(),
             key.contains("rotation") ? rotation_of(key["rotation"]) : Eigen::Quaterniond::Identity()});
}

Eigen::Isometry3d Motion::at(double time) const {
    Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
    if (keys_.empty()) return out;
    std::size_t next = 0;
    while (next < keys_.size() && keys_[next].time <= time) ++next;
    const Key& a = keys_[next == 0 ? 0 : next - 1];
    const Key& b = keys_[std::min(next, keys_.size() - 1)];
    const double s = b.time > a.time ? std::clamp((time - a.time) / (b.time - a.time), 0.0, 1.0) : 0;
    out = Eigen::Translation3d(a.position + s * (b.position - a.position) + pivot_) *
          a.rotation.slerp(s, b.rotation) * Eigen::Translation3d(-pivot_);
    return out;
}

double Motion::top_speed() const {
    double out = 0;
    for (std::size_t k = 1; k < keys_.size(); ++k)
        out = std::max(
            out, (keys_[k].position - keys_[k - 1].position).norm() / (keys_[k].time - keys_[k - 1].time));
    return out;
}

bool Motion::turns() const {
    return std::any_of(keys_.begin(), keys_.end(), [&](const Key& key) {
        return key.rotation.angularDistance(keys_.front().rotation) > 1e-9;
    });
}

Obstacle Obstacle::ground(double height) {
    Obstacle out;
    out.kind_ = Kind::half_space;
    out.name_ = "ground";
    out.placement_.translation() = Vec3(0, 0, height);
    return out;
}

Obstacle::Obstacle(const Json& collider) : name_(collider.value("name", "collider")) {
    if (collider.contains("half_space")) {
        kind_ = Kind::half_space;
        const Json& plane = collider["half_space"];
        placement_ = Eigen::Translation3d(vector_of(plane.at("point"))) *
                     Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), vector_of(plane.at("normal")));
    } else if (collider.contains("shape")) {
        const Json placement = collider.value("placement", Json::object());
        const double scale = placement.value("scale", 1.0);
        if (placement.contains("position")) placement_.translation() = vector_of(placement["position"]);
        if (placement.contains("rotation"))
            placement_.linear() = rotation_of(placement["rotation"]).toRotationMatrix();
        const Json& shape = collider["shape"];
        if (shape.contains("sphere")) {
            kind_ = Kind::ball;
            radius_ = scale * shape["sphere"].at("radius").get<double>();
        } else if (shape.contains("box")) {
            kind_ = Kind::box;
            radius_ = collider.value("rounding", 0.0);
            half_ = scale * vector_of(shape["box"].at("size")) / 2 - Vec3::Constant(radius_);
        }
    }
    const Vec3 pivot =
        collider.contains("pivot") ? vector_of(collider["pivot"]) : Vec3(placement_.translation());
    if (collider.contains("keyframes")) motion_ = Motion(collider["keyframes"], pivot);
}

Eigen::Isometry3d Obstacle::own_from_world(double time) const {
    return (motion_.at(time) * placement_).inverse();
}

double Obstacle::depth(const Vec3& point) const {
    if (kind_ == Kind::half_space) return -point.z();
    if (kind_ == Kind::ball) return radius_ - point.norm();
    const Vec3 q = point.cwiseAbs() - half_;
    return radius_ - q.cwiseMax(0).norm() - std::min(q.maxCoeff(), 0.0);
}

}  // namespace splitcubes::torture
