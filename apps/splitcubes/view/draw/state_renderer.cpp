#include "state_renderer.h"

#include <splitcubes/geometry/shapes.h>
#include <splitcubes/scene/instrument.h>
#include <splitcubes/scene/loft.h>
#include <splitcubes/view/parameters.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace splitcubes::view {

namespace {

constexpr double line_width = 2.6;  // pixels of a picture 720 high
const render::Color active_line(0.05, 0.30, 0.85), passive_line(0.25, 0.45, 0.75), pin_line(0.10, 0.55, 0.25);

render::Camera camera_of(const OrbitCamera& camera) {
    return {camera.eye(), camera.target, Vec3::UnitZ(), camera.vertical_fov * 180 / std::numbers::pi};
}

std::vector<render::SlotRange> slots_of(const std::vector<Range>& ranges) {
    std::vector<render::SlotRange> out;
    for (const Range& range : ranges) out.push_back({range.first, range.count});
    return out;
}

// A round upper end that holds nearly all values: single ones beyond it have its colour.
double nice_maximum(std::vector<float> values) {
    std::erase_if(values, [](float v) { return !(v > 0); });
    if (values.empty()) return 1;
    const auto at =
        values.begin() + static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    const double power = std::pow(10.0, std::floor(std::log10(*at)));
    for (const double factor : {1.0, 2.0, 5.0, 10.0})
        if (factor * power >= *at) return factor * power;
    return 10 * power;
}

}  // namespace

StateRenderer::StateRenderer(const gl::Context& context) : context_(context) {}

std::size_t StateRenderer::bytes_copied() const {
    std::size_t out = 0;
    for (const BodyBuffers& body : bodies_) out += body.surface.bytes_copied();
    return out;
}

void StateRenderer::update_options(const Viewer& viewer, int width, int height, Quality quality) {
    const int divisor = quality == Quality::coarse ? 2 : 1;
    render::RenderOptions options;
    options.width = std::max(1, width / divisor);
    options.height = std::max(1, height / divisor);
    options.ground = viewer.state()->ground.has_value();
    options.ground_height = viewer.state()->ground.value_or(0);
    options.shadows = options.ambient_occlusion = viewer.display().shadows && quality == Quality::fine;
    options.samples = options.shadows ? 4 : 1;
    options.shadow_map_size = 1024;
    if (!renderer_)
        renderer_ = std::make_unique<render::Renderer>(context_, options);
    else
        renderer_->set_options(options);
}

// Only what changed since the state that the buffers hold is copied, if the state still tells it.
void StateRenderer::update_surface(BodyBuffers& buffers, const BodyState& body, const PublishedState& state) {
    if (buffers.state == state.number && buffers.scene == state.scene) return;
    const SurfaceTopology& now = *body.topology;
    const render::SurfaceSlots slots{now.triangles, now.materials, now.pieces, now.rest_and_depth};
    const bool is_told = !now.changes.empty() && now.changes.front().revision <= buffers.revision + 1 &&
                         now.revision > buffers.revision &&
                         now.revision - buffers.revision <= now.changes.size();
    if (is_told) {
        for (const SurfaceChange& change : now.changes)
            if (change.revision > buffers.revision)
                buffers.surface.patch_topology(slots, slots_of(change.triangles), slots_of(change.vertices));
    } else if (now.revision != buffers.revision) {
        buffers.surface.set_topology(slots);
    }
    if (!body.marks.empty()) buffers.surface.set_marks(body.marks);
    buffers.surface.set_vertices(body.positions, body.normals, body.field);
    buffers.revision = now.revision;
    buffers.state = state.number;
    buffers.scene = state.scene;
}

void StateRenderer::update_style(const Viewer& viewer, const PublishedState& state) {
    const Display& display = viewer.display();
    legend_ = {};
    double high = display.range;
    const bool shows_field = viewer.field() != Field::none;
    if (shows_field && !(high > 0)) {
        std::vector<float> values;
        for (const BodyState& body : state.bodies)
            values.insert(values.end(), body.field.begin(), body.field.end());
        high = nice_maximum(std::move(values));
    }
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        render::LiveStyle& style = bodies_[b].surface.style;
        const std::vector<Vec3>& palette = *state.bodies[b].palette;
        for (std::size_t k = 0; k < std::min(palette.size(), style.palette.size()); ++k)
            style.palette[k] = palette[k];
        style.finishes.clear();
        if (state.bodies[b].finishes) style.finishes = *state.bodies[b].finishes;
        style.wireframe = display.wireframe;
        style.colouring = render::SurfaceColouring::material;
        if (display.colouring == Colouring::piece) style.colouring = render::SurfaceColouring::piece;
        if (shows_field) style.colouring = render::SurfaceColouring::field;
        style.field_low = 0;
        style.field_high = high;
    }
    if (shows_field) {
        const bool is_strain = viewer.field() == Field::principal_strain;
        legend_ = {std::string(colouring_names[static_cast<std::size_t>(display.colouring)]) +
                       (is_strain ? "" : ", Pa"),
                   high};
    }
}

void StateRenderer::add_lines(const Viewer& viewer) {
    const double lift = 0.004 * viewer.bounds().size().norm();
    const auto add = [&](const std::vector<Vec3>& points, const render::Color& color) {
        if (points.size() < 2) return;
        render::LineSet line;
        line.points = points;
        for (std::uint32_t k = 0; k + 1 < points.size(); ++k) line.segments.push_back({k, k + 1});
        line.color = color;
        line.width = line_width;
        line.depth_offset = lift;
        line.in_bounds = false;
        list_.lines.push_back(std::move(line));
    };
    for (const OverlayLine& line : viewer.tools().overlay(viewer.context()))
        add(line.points, line.is_active ? active_line : passive_line);
    // Ends of pulls are crosses of a size in pixels.
    for (const PullState& pull : viewer.state()->pulls) {
        const double depth = (pull.target - viewer.camera().eye()).dot(viewer.camera().forward());
        const double half = 6 * viewer.camera().pixel_size(std::max(depth, 1e-6), viewer.size());
        for (const Vec3& axis : {viewer.camera().right(), viewer.camera().up()})
            add({pull.target - half * axis, pull.target + half * axis}, pull.pinned ? pin_line : active_line);
    }
}

void StateRenderer::add_points(const Viewer& viewer) {
    if (!viewer.display().phyxels) return;
    const double spacing = viewer.state()->parameters[phyxel_spacing];
    for (const BodyState& body : viewer.state()->bodies) {
        render::PointSet set;
        set.positions = body.sample_positions;
        set.radius = 0.22 * spacing;
        for (const float value : body.sample_field) {
            const Vec3 srgb = legend_.title.empty()
                                  ? Vec3(0.16, 0.38, 0.75)
                                  : render::scale_colour(value / std::max(legend_.high, 1e-30));
            for (int k = 0; k < 3; ++k) set.colours.push_back(static_cast<float>(std::pow(srgb[k], 2.2)));
        }
        list_.points.push_back(std::move(set));
    }
    list_.points_on_top = true;
}

void StateRenderer::add_colliders(const PublishedState& state) {
    for (const ColliderState& collider : state.colliders) {
        geometry::TriangleMesh mesh = *collider.mesh;
        for (Vec3& p : mesh.positions) p = collider.frame * p;
        if (collider.finish)
            render::add_mesh(list_, mesh, *collider.finish, collider.mesh->positions);
        else
            render::add_mesh(list_, mesh, render::Color(0.62, 0.65, 0.70));
    }
}

void StateRenderer::add_instruments(const PublishedState& state) {
    for (const InstrumentState& instrument : state.instruments)
        for (const scene::InstrumentPart& part : *instrument.parts) {
            geometry::TriangleMesh mesh = part.mesh;
            for (Vec3& p : mesh.positions) p = instrument.frame * p;
            render::add_mesh(list_, mesh, part.finish, part.mesh.positions);
        }
    for (const RodState& rod : state.rods) {
        geometry::TriangleMesh mesh = geometry::make_sphere(rod.radius, 3);
        for (Vec3& p : mesh.positions) p += rod.target;
        if ((rod.target - rod.at).norm() > 0.2 * rod.radius)
            mesh.append(scene::make_tube({rod.at, rod.target}, 0.35 * rod.radius));
        render::add_mesh(list_, mesh, render::Color(0.93, 0.45, 0.08));
    }
}

void StateRenderer::make_list(const Viewer& viewer) {
    const PublishedState& state = *viewer.state();
    list_ = {};
    bodies_.resize(state.bodies.size());
    for (std::size_t b = 0; b < state.bodies.size(); ++b) update_surface(bodies_[b], state.bodies[b], state);
    update_style(viewer, state);
    for (const BodyBuffers& body : bodies_) list_.surfaces.push_back(&body.surface);
    add_colliders(state);
    add_instruments(state);
    list_.hatch_period = 0.015 * viewer.bounds().size().norm();
    add_lines(viewer);
    add_points(viewer);
    const Display& display = viewer.display();
    if (!display.clips) return;
    const geometry::Box box = viewer.bounds();
    list_.clip.normal = Vec3::Unit(display.clip_axis);
    list_.clip.offset = box.min[display.clip_axis] + display.clip_offset * box.size()[display.clip_axis];
    // Of the two sides the one towards the eye is hidden.
    if (viewer.camera().eye()[display.clip_axis] < box.center()[display.clip_axis]) {
        list_.clip.normal = -list_.clip.normal;
        list_.clip.offset = -list_.clip.offset;
    }
}

void StateRenderer::draw(const Viewer& viewer, int width, int height, unsigned framebuffer, Quality quality) {
    update_options(viewer, width, height, quality);
    make_list(viewer);
    renderer_->draw_into(list_, camera_of(viewer.camera()), framebuffer, width, height);
}

render::Picture StateRenderer::picture(const Viewer& viewer, int width, int height) {
    update_options(viewer, width, height, Quality::fine);
    make_list(viewer);
    return renderer_->draw(list_, camera_of(viewer.camera()));
}

}  // namespace splitcubes::view
