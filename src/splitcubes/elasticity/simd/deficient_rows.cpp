// Phyxels of rank 1 and 2 in SlicedElasticity, in double precision.
#include <splitcubes/elasticity/simd/sliced_elasticity.h>

#include <bit>

namespace splitcubes::meshless {

namespace {

// Calls act(row) for the rows of a rank below 3.
template <class Act>
void for_deficient_rows(const LinkSlices& slices, const SliceRange& range, const Act& act) {
    for (std::size_t slice = range.begin; slice < range.end; ++slice)
        for (unsigned bits = slices.deficient()[slice]; bits != 0; bits &= bits - 1) {
            const std::size_t i =
                slice * LinkSlices::lanes + static_cast<std::size_t>(std::countr_zero(bits));
            if (i < slices.row_count()) act(i);
        }
}

// Reads row i of an array of three rows.
Vec3 row_at(const float* array, std::size_t stride, std::size_t i) {
    return {static_cast<double>(array[i]), static_cast<double>(array[stride + i]),
            static_cast<double>(array[2 * stride + i])};
}

void add_to_row(float* array, std::size_t stride, std::size_t i, const Vec3& value) {
    for (std::size_t k = 0; k < 3; ++k)
        array[k * stride + i] += static_cast<float>(value[static_cast<int>(k)]);
}

}  // namespace

Completion SlicedElasticity::completion(std::size_t i) const {
    return {neighbourhoods_->rank()[i], neighbourhoods_->basis()[i], deformation_[i], rotation_[i]};
}

Mat3 SlicedElasticity::tension_change(std::size_t i, const Mat3& dH, double twist_share) const {
    return tension_change(i, completion(i), dH, twist_share);
}

Mat3 SlicedElasticity::tension_change(std::size_t i, const Completion& completed, const Mat3& dH,
                                      double twist_share) const {
    const Neighbourhoods& links = *neighbourhoods_;
    Mat3 out = links.volume()[i] * completed.resolve(stress_change(i, completed.complete(dH), twist_share)) -
               links.penalty()[i] * dH * links.moment()[i];
    if (!links.has_neighbours_off_plane(i)) return out;
    const Vec3 dropped = links.basis()[i].col(2);
    const double square = dropped.dot(links.moment()[i] * dropped);
    return out + completed.resolve_normal(links.penalty()[i] * square * completed.normal_change(dH));
}

void SlicedElasticity::list_off_plane_rows() {
    off_plane_.rows.clear();
    for_deficient_rows(*slices_, {0, slice_count()}, [&](std::size_t i) {
        if (neighbourhoods_->has_neighbours_off_plane(i))
            off_plane_.rows.push_back(static_cast<std::uint32_t>(i));
    });
    if (!off_plane_.rows.empty()) off_plane_.normal_change.resize(slices_->row_count());
}

// Adds the penalty forces of rank 2 phyxels on neighbours off their plane: F maps these by the completed
// normal, which the fitted gradient does not contain and which turns with it.
void SlicedElasticity::add_off_plane_forces(float* force) const {
    const Neighbourhoods& links = *neighbourhoods_;
    const std::size_t n = stride();
    const auto displacement = [&](std::size_t i) -> Vec3 {
        return row_at(high_.data(), n, i) + row_at(low_.data(), n, i);
    };
    for (const std::uint32_t i : off_plane_.rows) {
        const Mat3 F = frame_.world.transpose() * deformation_[i];
        const Vec3 dropped = links.basis()[i].col(2), turned = F * dropped - dropped, here = displacement(i);
        Vec3 sum = Vec3::Zero();
        for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l) {
            const Vec3& edge = links.rest_edge()[l];
            const Vec3 moved = displacement(links.neighbour()[l]) - here;
            sum += links.weight()[l] * dropped.dot(edge) * (F * edge - edge - moved);
        }
        const double penalty = links.penalty()[i];
        const Mat3 tension = Completion(2, links.basis()[i], F, F).resolve_normal(penalty * sum);
        for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l) {
            const Vec3 on_neighbour =
                penalty * links.weight()[l] * dropped.dot(links.rest_edge()[l]) * turned -
                tension * links.gradient()[l];
            add_to_row(force, n, i, -on_neighbour);
            add_to_row(force, n, links.neighbour()[l], on_neighbour);
        }
    }
}

// Replaces the tensions of a direction dx at phyxels of rank 1 and 2, whose completed directions follow it.
// weights: tensions are multiplied by the inverse moment (weighted_direction_pass).
void SlicedElasticity::change_deficient_rows(const SliceRange& range, const float* dx, double twist_share,
                                             bool weights) {
    const Neighbourhoods& links = *neighbourhoods_;
    const std::size_t n = stride();
    const auto change_row = [&](std::size_t i) {
        const Vec3 here = row_at(dx, n, i), dropped = links.basis()[i].col(2);
        const bool is_off_plane = links.has_neighbours_off_plane(i);
        Mat3 dH = Mat3::Zero();
        Vec3 moved = Vec3::Zero();  // off the plane, weighted by height
        for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l) {
            if (!(links.weight()[l] > 0)) continue;
            const Vec3 change = row_at(dx, n, links.neighbour()[l]) - here;
            dH += change * links.gradient()[l].transpose();
            if (is_off_plane) moved += links.weight()[l] * dropped.dot(links.rest_edge()[l]) * change;
        }
        const Completion completed = completion(i);
        Mat3 tension = tension_change(i, completed, dH, twist_share);
        if (is_off_plane) {
            off_plane_.normal_change[i] = completed.normal_change(dH);
            tension -= completed.resolve_normal(links.penalty()[i] * moved);
        }
        if (weights) tension *= links.inverse_moment()[i];
        if (!tension.allFinite() || !(tension.cwiseAbs().sum() < 1e37)) tension.setZero();
        set_matrix(tension_, i, tension);
    };
    for_deficient_rows(*slices_, range, [&](std::size_t i) {
        if (links.rank()[i] > 0) change_row(i);
    });
}

// Adds what the turned normals exert on neighbours off the plane (add_off_plane_forces), of a direction.
void SlicedElasticity::add_off_plane_changes(float* force) const {
    const Neighbourhoods& links = *neighbourhoods_;
    const std::size_t n = stride();
    for (const std::uint32_t i : off_plane_.rows) {
        const Vec3 dropped = links.basis()[i].col(2);
        const Vec3 pull = links.penalty()[i] * off_plane_.normal_change[i];
        for (std::uint32_t l = links.links_begin(i); l < links.links_end(i); ++l) {
            const Vec3 on_neighbour = links.weight()[l] * dropped.dot(links.rest_edge()[l]) * pull;
            add_to_row(force, n, i, -on_neighbour);
            add_to_row(force, n, links.neighbour()[l], on_neighbour);
        }
    }
}

}  // namespace splitcubes::meshless
