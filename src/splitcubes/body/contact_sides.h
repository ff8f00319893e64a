// Which phyxels stand for a point of the skin.
#pragma once

#include <splitcubes/math/types.h>
#include <splitcubes/meshless/contact.h>

#include <span>
#include <utility>

namespace splitcubes::body {

/// Changes the weights so that the side's point goes where every affine motion of the body takes
/// `place` (linear reproduction, as in moving least squares: weights times a linear function). The
/// mean of the phyxels lies up to a spacing off the skin: a push there would have another arm than
/// the skin's own motion, and make energy where a body rolls. rest: m, of the body's phyxels; place: m,
/// rest space; spacing: m.
void carry_exactly(std::span<const Vec3> rest, const Vec3& place, double spacing,
                   meshless::ContactSide& side);

/// The side of a place that lies between the points of several sides of one body: of the phyxels that
/// those share, by `weights` of the sides (each > 0), the heaviest, so that they carry `place` exactly.
/// At least one side. Arguments as of carry_exactly.
meshless::ContactSide side_between(std::span<const meshless::ContactSide> sides,
                                   std::span<const double> weights, std::span<const Vec3> rest,
                                   const Vec3& place, double spacing);

}  // namespace splitcubes::body
