// Settings of a body.
#pragma once

#include <splitcubes/deformation/deformation.h>
#include <splitcubes/fracture/tear_settings.h>
#include <splitcubes/occlusion/criterion.h>
#include <splitcubes/samples/material.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace splitcubes::body {

struct BodySettings {
    std::string name = "body";
    /// World at time 0 from the frame of the mesh: a rotation and a displacement, m.
    Isometry pose = Isometry::Identity();
    /// Whether grid and phyxels follow the axes of the shape (geometry::shape_frame) instead of those of the
    /// mesh's frame. Not for bodies with a deformation.
    bool follows_shape = true;
    double cell_size = 0;       // m, > 0
    double phyxel_spacing = 0;  // m; 0: chosen to match phyxel_count
    int phyxel_count = 800;     // target; used only if no spacing is given
    meshless::Material material;
    Vec3 velocity = Vec3::Zero();          // m/s, at time 0
    Vec3 angular_velocity = Vec3::Zero();  // rad/s, about the centre of mass, at time 0
    occlusion::VisibilityOptions visibility;
    occlusion::CriterionKind criterion = occlusion::CriterionKind::occlusion_disk;
    /// Creates the backend that evaluates the occlusion disks; empty: the CPU backend.
    std::function<std::unique_ptr<occlusion::VisibilityBackend>(const occlusion::VisibilityOptions&)>
        make_visibility_backend;
    /// Creates the deformation model that moves the nodes; empty: the phyxels' elasticity moves them. A body
    /// with such a model cannot tear, and its phyxels follow their nodes.
    deformation::MakeDeformation deformation;
    std::optional<TearSettings> tearing;  // none: the body never tears, only tools cut it
};

}  // namespace splitcubes::body
