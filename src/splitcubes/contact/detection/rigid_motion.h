// Rigid motion of whole pieces, as impulses change it.
#pragma once

#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/math/types.h>

#include <cstdint>
#include <vector>

namespace splitcubes::body {

/// Returns the inverse of an inertia, 1/(kg m^2), symmetric. Axes about which there is hardly any inertia do
/// not turn, as in meshless::angular_velocity. inertia: kg m^2.
Mat3 inverse_of_inertia(const Mat3& inertia);

/// Returns the change of velocity per impulse, 1/kg, at a point of a rigid body. inverse_mass: 1/kg; arm: m,
/// from the centre of mass.
Mat3 mobility_at(double inverse_mass, const Mat3& inverse_inertia, const Vec3& arm);

/// Returns, per piece of a body, 1 if the position of one of its phyxels is prescribed (Phyxels::held).
std::vector<std::uint8_t> held_pieces(const BodyView& body);

}  // namespace splitcubes::body
