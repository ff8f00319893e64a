// Ground, colliders and motions of a scene, read by code of this folder's own.
#pragma once

#include "surface_file.h"

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace splitcubes::torture {

/// Keyframes of a displacement and a rotation about a pivot, linear in between.
class Motion {
  public:
    Motion() = default;
    Motion(const nlohmann::ordered_json& keyframes, const Vec3& pivot);
    bool moves() const { return keys_.size() > 1; }
    Eigen::Isometry3d at(double time) const;
    /// The largest speed of the displacement, m/s.
    double top_speed() const;
    /// Returns whether it turns.
    bool turns() const;

  private:
    struct Key {
        double time;
        Vec3 position;
        Eigen::Quaterniond rotation;
    };
    std::vector<Key> keys_;
    Vec3 pivot_ = Vec3::Zero();
};

Vec3 vector_of(const nlohmann::ordered_json& json);
Eigen::Quaterniond rotation_of(const nlohmann::ordered_json& json);

/// A half space, ball or box.
class Obstacle {
  public:
    /// The ground of a scene, or one of its colliders.
    static Obstacle ground(double height);
    explicit Obstacle(const nlohmann::ordered_json& collider);

    /// Returns whether depths of its shape are known.
    bool known() const { return kind_ != Kind::other; }
    const std::string& name() const { return name_; }
    const Motion& motion() const { return motion_; }
    /// The pose to give to depth(): own coordinates from the world.
    Eigen::Isometry3d own_from_world(double time) const;
    /// Returns how deep a point in own coordinates is inside, m; negative outside.
    double depth(const Vec3& point) const;

  private:
    enum class Kind { half_space, ball, box, other };
    Obstacle() = default;

    Kind kind_ = Kind::other;
    std::string name_;
    Eigen::Isometry3d placement_ = Eigen::Isometry3d::Identity();
    Motion motion_;
    Vec3 half_ = Vec3::Zero();  // of a box without its rounding
    double radius_ = 0;         // of a ball, of the rounding
};

}  // namespace splitcubes::torture
