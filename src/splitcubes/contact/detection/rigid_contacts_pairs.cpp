// Search for contacts of rigid fragments with each other, after a step.
#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/rigid_contacts.h>
#include <splitcubes/contact/detection/tuning.h>
#include <splitcubes/samples/phyxels.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace splitcubes::body {

// Returns a lower bound of the gap (m) that face_between finds: that of the upper fragment's box.
double RigidContacts::box_gap(const Fragment& upper, const Fragment& lower) {
    const Mat3 rotation = lower.start_rotation.transpose() * upper.start_rotation;
    const Vec3 middle = lower.start_rotation.transpose() * (upper.start_centre - lower.start_centre) +
                        0.5 * (rotation * (upper.low + upper.high)) - 0.5 * (lower.low + lower.high);
    const Vec3 half = 0.5 * (rotation.cwiseAbs() * (upper.high - upper.low) + (lower.high - lower.low));
    return (middle.cwiseAbs() - half).maxCoeff();
}

// Returns the face of the lower fragment's box with the largest separation (or smallest penetration) from the
// upper one's points.
RigidContacts::BoxFace RigidContacts::face_between(const Fragment& upper, const Fragment& lower) const {
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const Vec3& own : phyxels_[upper.body]->rigid.points_of(piece_of(upper))) {
        const Vec3 point = lower.start_rotation.transpose() * (upper.start_point(own) - lower.start_centre);
        low = low.cwiseMin(point);
        high = high.cwiseMax(point);
    }
    BoxFace best;
    for (int axis = 0; axis < 3; ++axis)
        for (const int sign : {-1, 1}) {
            const double gap = sign > 0 ? low[axis] - lower.high[axis] : lower.low[axis] - high[axis];
            if (gap > best.gap) best = {axis, sign, gap};
        }
    return best;
}

// Finds the contacts of one fragment's points with the face of the other one's box that separates the two
// best.
void RigidContacts::meet_fragment(const Task& task, std::uint32_t first, std::uint32_t second,
                                  std::vector<ContactRow>& rows) const {
    const Fragment& a = fragments_[first];
    const Fragment& b = fragments_[second];
    const double spacing = std::min(task.bodies[a.body].spacing, task.bodies[b.body].spacing);
    // Both sides can be moved by corrections, so even what moves away can meet.
    const double limit = tuning::fragments::max_displacement_share * spacing;
    const double motion = std::min(a.motion, limit) + std::min(b.motion, limit);
    const double fall = 2 * task.dt * task.dt * task.gravity.norm();
    const double speculative = tuning::fragments::speculative_share * spacing + fall;
    const double near = speculative + motion, far = a.radius + b.radius + near;
    const double end_near = speculative + std::min(motion, tuning::fragments::max_end_gap_share * spacing);
    if ((a.start_centre - b.start_centre).squaredNorm() > far * far) return;
    const double surely = near + tuning::fragments::negligible_share * spacing;
    if (box_gap(a, b) > surely || box_gap(b, a) > surely) return;
    const BoxFace of_second = face_between(a, b);
    if (of_second.gap > near) return;
    const BoxFace of_first = face_between(b, a);
    const bool takes_second = of_second.gap >= of_first.gap;
    const BoxFace face = takes_second ? of_second : of_first;
    if (face.gap > near) return;
    add_face_rows(task, takes_second ? first : second, takes_second ? second : first, face, near, end_near,
                  rows);
}

// Adds the contacts of a fragment's points with a face of another one's box that are at most near before the
// step, and at most end_near after it (m).
void RigidContacts::add_face_rows(const Task& task, std::uint32_t upper, std::uint32_t lower,
                                  const BoxFace& face, double near, double end_near,
                                  std::vector<ContactRow>& rows) const {
    const Fragment &moving = fragments_[upper], &box = fragments_[lower];
    const double spacing = std::min(task.bodies[moving.body].spacing, task.bodies[box.body].spacing);
    const Vec3 normal = face.sign * Vec3::Unit(face.axis);
    const Vec3 low = box.low - Vec3::Constant(tuning::fragments::speculative_share * spacing);
    const Vec3 high = box.high + Vec3::Constant(tuning::fragments::speculative_share * spacing);
    const double extent = face.sign > 0 ? box.high[face.axis] : -box.low[face.axis];
    bool any = false;
    // If no point lies in front of the face itself, all count: edges cross.
    for (const bool strict : {true, false}) {
        if (any) break;
        for (const Vec3& own : phyxels_[moving.body]->rigid.points_of(piece_of(moving))) {
            const Vec3 point = moving.start_point(own);
            const Vec3 in_box = box.start_rotation.transpose() * (point - box.start_centre);
            const double distance = normal.dot(in_box) - extent;
            bool beside = false;
            for (int axis = 0; axis < 3; ++axis)
                beside =
                    beside || (axis != face.axis && (in_box[axis] < low[axis] || in_box[axis] > high[axis]));
            if (distance > near || (strict && beside)) continue;
            any = true;
            ContactRow row;
            row.upper = upper;
            row.lower = static_cast<std::int32_t>(lower);
            row.own = own;
            row.lower_own = in_box - distance * normal;
            row.normal = box.start_rotation * normal;
            row.gap = distance;
            row.max_depenetration = tuning::fragments::depenetration_share * spacing +
                                    tuning::fragments::depth_share * std::max(-distance, 0.0);
            row.friction = task.friction;
            row.start = point - box.start_point(row.lower_own);
            const Vec3 end = piece_of(moving).world_point(own) - piece_of(box).world_point(row.lower_own);
            if (row.gap + row.normal.dot(end - row.start) <= end_near) rows.push_back(row);
        }
    }
}

// Measures how far each fragment moved beside the common motion of all, which makes no contacts.
void RigidContacts::measure_motions() {
    Vec3 common = Vec3::Zero();  // m, mean displacement
    for (const Fragment& fragment : fragments_) {
        const Vec3 displacement = piece_of(fragment).centre - fragment.start_centre;
        if (displacement.allFinite()) common += displacement / static_cast<double>(fragments_.size());
    }
    for (Fragment& fragment : fragments_) {
        const meshless::RigidPiece& piece = piece_of(fragment);
        // The displacement of a point by the rotation is at most this times its arm.
        const double turn = (piece.rotation - fragment.start_rotation).norm() / std::sqrt(2.0);
        fragment.motion = (piece.centre - fragment.start_centre - common).norm() + turn * fragment.radius;
        if (!std::isfinite(fragment.motion)) fragment.motion = 0;
    }
}

// Lists all contacts, those between fragments among them.
void RigidContacts::list_rows(const Task& task, const Parallel& parallel) {
    constexpr std::size_t grain = 16;
    measure_motions();
    const double fall = task.dt * task.dt * task.gravity.norm();
    const double limit = tuning::fragments::max_displacement_share * spacing_;
    balls_.clear();
    for (const Fragment& fragment : fragments_)
        balls_.push_back({fragment.start_centre, fragment.radius +
                                                     0.5 * tuning::fragments::speculative_share * spacing_ +
                                                     fall + std::min(fragment.motion, limit)});
    grid_.build(balls_);
    parallel.for_chunks(fragments_.size(), grain, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> others;
        for (auto k = static_cast<std::uint32_t>(begin); k < end; ++k) {
            grid_.meeting_after(k, others);
            for (const std::uint32_t other : others) meet_fragment(task, k, other, fragments_[k].rows);
        }
    });
    rows_.clear();
    for (const Fragment& fragment : fragments_)
        rows_.insert(rows_.end(), fragment.rows.begin(), fragment.rows.end());
    find_end_positions();
    listed_ = rows_.size();
}

}  // namespace splitcubes::body
