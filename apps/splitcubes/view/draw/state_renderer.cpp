#include "state_renderer.h"

#include "forceps.h"

#include <splitcubes/geometry/shapes.h>
#include <splitcubes/scene/instrument.h>
#include <splitcubes/scene/loft.h>
#include <splitcubes/view/parameters.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace splitcubes::view {

namespace {

constexpr double line_width = 2.6;  // pixels of a picture 720 high
const render::Color active_line(0.05, 0.30, 0.85), passive_line(0.25, 0.45, 0.75), pin_line(0.10, 0.55, 0.25),
    force_line(0.82, 0.10, 0.10);
constexpr double default_age_range = 5;  // s

render::Camera camera_of(const OrbitCamera& camera) {
    return {camera.eye(), camera.target, Vec3::UnitZ(), camera.vertical_fov * 180 / std::numbers::pi};
}

std::vector<render::SlotRange> slots_of(const std::vector<Range>& ranges) {
    std::vector<render::SlotRange> out;
    for (const Range& range : ranges) out.push_back({range.first, range.count});
    return out;
}

// Materials with labels above them: number of the cut, or ms at which the triangle was cut.
std::vector<std::int32_t> labelled(const SurfaceTopology& topology, Colouring colouring) {
    std::vector<std::int32_t> out(topology.materials.size());
    constexpr std::int32_t most = (1 << 27) - 1;
    for (std::size_t t = 0; t < out.size(); ++t) {
        std::int32_t label = 0;
        if (topology.origins[t] == SurfaceOrigin::cut)
            label = colouring == Colouring::cut
                        ? std::clamp(topology.cuts[t], 0, most - 1) + 1
                        : static_cast<std::int32_t>(
                              std::clamp(1e3 * static_cast<double>(topology.born[t]), 1.0, 1.0 * most));
        out[t] = (topology.materials[t] & 15) | label << 4;
    }
    return out;
}

std::string force_text(double newtons) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), newtons < 0.1 ? "%.2g N" : "%.3g N", newtons);
    return text.data();
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

render::Color link_colour(double visibility) {
    const render::Color seen(0.16, 0.42, 0.72), half(0.96, 0.78, 0.26), hidden(0.80, 0.11, 0.11);
    return visibility > 0.5 ? render::Color(half + (2 * visibility - 1) * (seen - half))
                            : render::Color(hidden + 2 * visibility * (half - hidden));
}

StateRenderer::StateRenderer(const gl::Context& context) : context_(context) {}

std::size_t StateRenderer::bytes_copied() const {
    std::size_t out = 0;
    for (const BodyBuffers& body : bodies_) out += body.surface.bytes_copied();
    return out;
}

void StateRenderer::update_options(const Viewer& viewer, int width, int height, Quality quality,
                                   const render::PixelArea& area) {
    const int divisor = quality == Quality::coarse ? 2 : quality == Quality::coarsest ? 3 : 1;
    render::RenderOptions options;
    options.width = std::max(1, width / divisor);
    options.height = std::max(1, height / divisor);
    options.ground = viewer.state()->ground.has_value();
    options.ground_height = viewer.state()->ground.value_or(0);
    options.shadows = options.ambient_occlusion = viewer.display().shadows && quality == Quality::fine;
    options.samples = options.shadows ? 4 : 1;
    options.shadow_map_size = 1024;
    if (area.width > 0) {
        const int right = area.x + area.width + divisor - 1, top = area.y + area.height + divisor - 1;
        options.area = {area.x / divisor, area.y / divisor, right / divisor - area.x / divisor,
                        top / divisor - area.y / divisor};
    }
    if (!renderer_)
        renderer_ = std::make_unique<render::Renderer>(context_, options);
    else
        renderer_->set_options(options);
}

// Only what changed since the state that the buffers hold is copied, if the state still tells it.
void StateRenderer::update_surface(BodyBuffers& buffers, const BodyState& body, const PublishedState& state,
                                   Colouring colouring) {
    const bool has_labels = colouring == Colouring::cut || colouring == Colouring::age;
    const Colouring wanted = has_labels ? colouring : Colouring::material;
    if (buffers.labelled == wanted && buffers.state == state.number && buffers.scene == state.scene) return;
    if (buffers.labelled != wanted) buffers.revision = 0;
    buffers.labelled = wanted;
    const SurfaceTopology& now = *body.topology;
    const bool changes = now.revision != buffers.revision;
    const std::vector<std::int32_t> labels =
        has_labels && changes ? labelled(now, colouring) : std::vector<std::int32_t>();
    render::SurfaceSlots slots{now.triangles, now.materials, now.pieces, now.rest_and_depth, now.corner_uv};
    if (!labels.empty()) slots.materials = labels;
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
        style.pictures.clear();
        if (state.bodies[b].pictures)
            for (const auto& picture : *state.bodies[b].pictures)
                style.pictures.push_back(picture_of(picture));
        style.opacity = display.links ? 0.28 : 1;
        style.now_ms = 1e3 * state.time;
        style.age_range_ms = 1e3 * (display.range > 0 ? display.range : default_age_range);
        style.wireframe = display.wireframe;
        style.is_closed = !viewer.shows_run();
        style.inside = state.bodies[b].inside;
        style.colouring = render::SurfaceColouring::material;
        if (display.colouring == Colouring::piece) style.colouring = render::SurfaceColouring::piece;
        if (display.colouring == Colouring::cut) style.colouring = render::SurfaceColouring::label;
        if (display.colouring == Colouring::age) style.colouring = render::SurfaceColouring::age;
        if (shows_field) style.colouring = render::SurfaceColouring::field;
        style.field_low = 0;
        style.field_high = high;
    }
    if (shows_field) {
        const bool is_strain = viewer.field() == Field::principal_strain;
        legend_ = {std::string(colouring_names[static_cast<std::size_t>(display.colouring)]) +
                       (is_strain ? "" : ", Pa"),
                   high};
    } else if (display.colouring == Colouring::age) {
        legend_ = {"Age of the cut, s", display.range > 0 ? display.range : default_age_range, true};
    } else if (display.links) {
        legend_ = {"Visibility of links", 1, false, true};
    }
}

std::shared_ptr<const render::Picture> StateRenderer::picture_of(
    const std::shared_ptr<const SurfacePicture>& picture) {
    if (!picture) return nullptr;
    std::shared_ptr<const render::Picture>& known = pictures_[picture];
    if (!known)
        known = std::make_shared<const render::Picture>(
            render::Picture{picture->width, picture->height, picture->rgb});
    return known;
}

void StateRenderer::add_line(std::vector<Vec3> points, const render::Color& color, double width,
                             double lift) {
    if (points.size() < 2) return;
    render::LineSet line;
    line.points = std::move(points);
    for (std::uint32_t k = 0; k + 1 < line.points.size(); ++k) line.segments.push_back({k, k + 1});
    line.color = color;
    line.width = width;
    line.depth_offset = lift;
    line.in_bounds = false;
    list_.lines.push_back(std::move(line));
}

// From the point that is pulled in the direction of the force. Bodies do not hide it.
void StateRenderer::add_arrow(const Viewer& viewer, const Vec3& at, const Vec3& force, double length,
                              const render::Color& color) {
    const Vec3 along = force.normalized(), tip = at + length * along;
    Vec3 across = along.cross(viewer.camera().forward());
    across = across.norm() > 1e-3 ? across.normalized() : viewer.camera().right();
    const double lift = 0.45 * viewer.camera().distance, barb = 0.22 * length;
    add_line({at, tip}, color, 3, lift);
    add_line({tip - barb * along + 0.5 * barb * across, tip, tip - barb * along - 0.5 * barb * across}, color,
             3, lift);
}

// The largest force of a picture has an arrow of a fixed length, so that its number tells the rest.
void StateRenderer::add_forces(const Viewer& viewer) {
    labels_.clear();
    if (!viewer.display().forces) return;
    double largest = 0;
    for (const ForceState& force : viewer.state()->forces.arrows)
        largest = std::max(largest, force.force.norm());
    if (!(largest > 1e-6)) return;
    const double size = 0.11 * viewer.camera().distance;
    for (const ForceState& force : viewer.state()->forces.arrows) {
        const double share = force.force.norm() / largest;
        if (share < 0.02) continue;
        const double length = size * (0.3 + 0.7 * share);
        add_arrow(viewer, force.at, force.force, length, force_line);
        labels_.push_back(
            {force.at + 1.1 * length * force.force.normalized(),
             force_text(force.force.norm()) + (force.is_at_limit ? ", all that it holds" : "")});
    }
}

// The paper's view: links that cuts have reached are thick, the other ones of their phyxels thin and grey.
void StateRenderer::add_links(const Viewer& viewer) {
    if (!viewer.display().links) return;
    constexpr int shades = 8;
    for (const BodyState& body : viewer.state()->bodies) {
        const std::size_t count = body.sample_positions.size() / 3;
        std::vector<bool> touched(count, false);
        for (const SampleLink& link : body.links)
            if (link.visibility < 1) touched[link.a] = touched[link.b] = true;
        if (std::find(touched.begin(), touched.end(), true) == touched.end()) touched.assign(count, true);
        std::vector<render::LineSet> sets(shades + 1);
        for (int k = 0; k <= shades; ++k) {
            render::LineSet& set = sets[static_cast<std::size_t>(k)];
            for (std::size_t i = 0; i < count; ++i)
                set.points.push_back(
                    Eigen::Map<const Vec3f>(body.sample_positions.data() + 3 * i).cast<double>());
            set.color = k == shades ? render::Color(0.62, 0.66, 0.70) : link_colour((k + 0.5) / shades);
            set.width = k == shades ? 0.8 : 2.2;
            set.in_bounds = false;
        }
        for (const SampleLink& link : body.links) {
            if (!touched[link.a] && !touched[link.b]) continue;
            const int shade = link.visibility >= 1
                                  ? shades
                                  : std::min(static_cast<int>(link.visibility * shades), shades - 1);
            sets[static_cast<std::size_t>(shade)].segments.push_back({link.a, link.b});
        }
        for (render::LineSet& set : sets)
            if (!set.segments.empty()) list_.lines.push_back(std::move(set));
    }
}

// Points with short lines along their forces, through the body.
void StateRenderer::add_contacts(const Viewer& viewer) {
    if (!viewer.display().contacts || viewer.state()->forces.contacts.empty()) return;
    double largest = 0;
    for (const ContactState& contact : viewer.state()->forces.contacts)
        largest = std::max(largest, contact.force.norm());
    const double size = viewer.bounds().size().norm();
    for (const bool by_a_body : {false, true}) {
        render::PointSet set;
        set.radius = 0.006 * size;
        render::LineSet lines;
        const Vec3 colour = by_a_body ? Vec3(0.80, 0.10, 0.55) : Vec3(0.95, 0.45, 0.05);
        for (const ContactState& contact : viewer.state()->forces.contacts) {
            if (contact.by_a_body != by_a_body) continue;
            for (int k = 0; k < 3; ++k) {
                set.positions.push_back(static_cast<float>(contact.at[k]));
                set.colours.push_back(static_cast<float>(std::pow(colour[k], 2.2)));
            }
            const auto first = static_cast<std::uint32_t>(lines.points.size());
            lines.points.push_back(contact.at);
            lines.points.push_back(contact.at + 0.12 * size / std::max(largest, 1e-12) * contact.force);
            lines.segments.push_back({first, first + 1});
        }
        if (set.positions.empty()) continue;
        list_.points.push_back(std::move(set));
        lines.color = colour;
        lines.width = 1.6;
        lines.depth_offset = 0.45 * viewer.camera().distance;
        lines.in_bounds = false;
        list_.lines.push_back(std::move(lines));
    }
    list_.points_on_top = true;
}

void StateRenderer::add_lines(const Viewer& viewer) {
    const double lift = 0.004 * viewer.bounds().size().norm();
    const auto add = [&](const std::vector<Vec3>& points, const render::Color& color) {
        add_line(points, color, line_width, lift);
    };
    for (const OverlayLine& line : viewer.tools().overlay(viewer.context()))
        add(line.points, line.is_active ? active_line : passive_line);
    // Parts that bodies hide are thin lines.
    for (const OverlayLine& line : viewer.tools().overlay(viewer.context()))
        add_line(line.points, line.is_active ? active_line : passive_line, 0.35 * line_width,
                 0.45 * viewer.camera().distance);
    // Ends of pulls are crosses of a size in pixels.
    for (const PullState& pull : viewer.state()->pulls) {
        if (pull.partner != 0 && (!pull.pinned || pull.partner < pull.slot)) continue;
        const double depth = (pull.target - viewer.camera().eye()).dot(viewer.camera().forward());
        const double half = 6 * viewer.camera().pixel_size(std::max(depth, 1e-6), viewer.size());
        for (const Vec3& axis : {viewer.camera().right(), viewer.camera().up()})
            add({pull.target - half * axis, pull.target + half * axis}, pull.pinned ? pin_line : active_line);
    }
}

void StateRenderer::add_points(const Viewer& viewer) {
    if (!viewer.display().phyxels || viewer.shows_run()) return;
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

void StateRenderer::add_parts(const std::vector<scene::InstrumentPart>& parts, const Isometry& frame) {
    for (const scene::InstrumentPart& part : parts) {
        geometry::TriangleMesh mesh = part.mesh;
        for (Vec3& p : mesh.positions) p = frame * p;
        render::add_mesh(list_, mesh, part.finish, part.mesh.positions);
    }
}

// A pair of jaws is drawn once.
void StateRenderer::add_forceps(const PublishedState& state) {
    for (const PullState& jaw : state.pulls) {
        if (jaw.partner <= jaw.slot) continue;
        bool is_strained = false;
        for (const PullState& one : state.pulls)
            is_strained |= (one.slot == jaw.slot || one.slot == jaw.partner) && one.is_at_limit();
        add_parts(forceps_parts(jaw.width, jaw.opening, is_strained), jaw.frame);
    }
}

void StateRenderer::add_instruments(const PublishedState& state) {
    for (const InstrumentState& instrument : state.instruments)
        add_parts(*instrument.parts, instrument.frame);
    for (const RodState& rod : state.rods) {
        geometry::TriangleMesh mesh = geometry::make_sphere(rod.radius, 3);
        for (Vec3& p : mesh.positions) p += rod.target;
        if ((rod.target - rod.at).norm() > 0.2 * rod.radius)
            mesh.append(scene::make_tube({rod.at, rod.target}, 0.35 * rod.radius));
        render::add_mesh(list_, mesh, render::Color(0.93, 0.45, 0.08));
    }
}

// The past has no hands in it.
void StateRenderer::add_hand_instrument(const Viewer& viewer) {
    if (viewer.shows_run() || viewer.scrubbed()) return;
    const std::optional<HandInstrument> hand = viewer.tools().instrument(viewer.context());
    if (!hand) return;
    if (hand->kind == ToolKind::forceps)
        return add_parts(forceps_parts(hand->opening, hand->opening, false), hand->frame);
    if (hand_parts_.empty() || hand->kind != hand_.kind || hand->from != hand_.from || hand->to != hand_.to) {
        scene::ToolDescription tool;
        tool.name = "hand";
        tool.blades = {scene::StraightBlade{hand->from, hand->to}};
        scene::BladeInstrument blade;
        blade.kind = hand->kind == ToolKind::scalpel ? scene::BladeKind::scalpel : scene::BladeKind::knife;
        blade.grip = hand->kind == ToolKind::scalpel ? scene::Grip::start : scene::Grip::end;
        blade.back = hand->back;
        blade.handle = hand->handle;
        tool.instrument = blade;
        scene::KeyframeMotion still;
        still.keyframes.resize(1);
        tool.motion = still;
        hand_parts_ = scene::instrument_parts(tool);
    }
    hand_ = *hand;
    add_parts(hand_parts_, hand->frame);
}

void StateRenderer::make_list(const Viewer& viewer) {
    const PublishedState& state = *viewer.state();
    list_ = {};
    bodies_.resize(state.bodies.size());
    for (std::size_t b = 0; b < state.bodies.size(); ++b)
        update_surface(bodies_[b], state.bodies[b], state, viewer.display().colouring);
    update_style(viewer, state);
    for (const BodyBuffers& body : bodies_) list_.surfaces.push_back(&body.surface);
    add_colliders(state);
    add_instruments(state);
    add_forceps(state);
    add_hand_instrument(viewer);
    list_.hatch_period = 0.015 * viewer.bounds().size().norm();
    add_lines(viewer);
    add_forces(viewer);
    add_links(viewer);
    add_points(viewer);
    add_contacts(viewer);
    const Display& display = viewer.display();
    if (!display.clips) return;
    const geometry::Box box = viewer.bounds();
    list_.clip.normal = Vec3::Unit(display.clip_axis);
    list_.clip.offset = box.min[display.clip_axis] + display.clip_offset * box.size()[display.clip_axis];
    // The side towards the eye is hidden.
    if (viewer.camera().eye()[display.clip_axis] < box.center()[display.clip_axis]) {
        list_.clip.normal = -list_.clip.normal;
        list_.clip.offset = -list_.clip.offset;
    }
}

void StateRenderer::draw(const Viewer& viewer, int width, int height, unsigned framebuffer, Quality quality,
                         const render::PixelArea& area) {
    update_options(viewer, width, height, quality, area);
    make_list(viewer);
    renderer_->draw_into(list_, camera_of(viewer.camera()), framebuffer, width, height);
}

render::Picture StateRenderer::picture(const Viewer& viewer, int width, int height, Quality quality) {
    update_options(viewer, width, height, quality);
    make_list(viewer);
    return renderer_->draw(list_, camera_of(viewer.camera()));
}

}  // namespace splitcubes::view
