#include <splitcubes/body/body.h>
#include <splitcubes/body/step_context.h>
#include <splitcubes/body/step_report.h>
#include <splitcubes/body_samples/ligaments.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/state_hash.h>
#include <splitcubes/dynamics/cut_relaxation.h>
#include <splitcubes/dynamics/time_integrator.h>
#include <splitcubes/fracture/tearing.h>
#include <splitcubes/geometry/shape_frame.h>
#include <splitcubes/node_motion/blade_fronts.h>
#include <splitcubes/node_motion/lattice_node_motion.h>
#include <splitcubes/node_motion/phyxel_node_motion.h>
#include <splitcubes/splitting/extract.h>
#include <splitcubes/splitting/sheet_cut.h>
#include <splitcubes/splitting/validate.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace splitcubes::body {

namespace {

void check_settings(const BodySettings& s) {
    const std::string where = "body '" + s.name + "'";
    if (!(s.phyxel_spacing >= 0) || !std::isfinite(s.phyxel_spacing))
        throw InputError(where, "phyxel spacing must be a positive number of metres");
    if (s.phyxel_spacing == 0 && s.phyxel_count < 1)
        throw InputError(where, "phyxel count must be at least 1");
    if (!s.velocity.allFinite() || !s.angular_velocity.allFinite())
        throw InputError(where, "velocities must be finite");
    if (!s.pose.matrix().allFinite()) throw InputError(where, "pose must be finite");
    if (s.deformation && !s.pose.matrix().isIdentity(0))
        throw InputError(where, "a deformation moves bodies whose mesh is given in the world");
}

// Returns the settings with the strength as a function of the rest position.
TearSettings strength_at_rest(TearSettings settings, const Isometry& pose) {
    if (settings.strength_factor)
        settings.strength_factor = [factor = std::move(settings.strength_factor), pose](const Vec3& rest) {
            return factor(pose * rest);
        };
    return settings;
}

std::unique_ptr<occlusion::Criterion> criterion_of(const BodySettings& settings) {
    return occlusion::make_criterion(settings.criterion,
                                     settings.make_visibility_backend
                                         ? settings.make_visibility_backend(settings.visibility)
                                         : occlusion::make_cpu_backend(settings.visibility));
}

}  // namespace

Body::AtRest Body::at_rest(const geometry::TriangleMesh& mesh, const BodySettings& settings) {
    AtRest out{mesh, settings};
    if (!settings.follows_shape || settings.deformation) return out;
    const Mat3 axes = geometry::shape_frame(mesh);
    if (axes.isIdentity(0)) return out;
    for (Vec3& p : out.mesh.positions) p = axes.transpose() * p;
    out.settings.pose.linear() = settings.pose.linear() * axes;
    return out;
}

Body::Body(const geometry::TriangleMesh& mesh, const BodySettings& settings, const Parallel& parallel)
    : Body(at_rest(mesh, settings), parallel) {}

Body::Body(AtRest made, const Parallel& parallel)
    : settings_(std::move(made.settings)),
      grid_(splitting::solidify(made.mesh, geometry::grid_around(made.mesh.bounds(), settings_.cell_size),
                                solidify_report_, parallel)),
      surface_((parallel.begin("body '" + settings_.name + "': surface"),
                std::make_unique<splitting::Surface>(grid_, parallel))),
      pieces_(std::make_unique<splitting::Pieces>(grid_)),
      occluders_(grid_.rest()),
      samples_(criterion_of(settings_)),
      solver_(std::make_unique<meshless::TimeIntegrator>()),
      relaxation_(std::make_unique<meshless::CutRelaxation>()),
      fronts_(std::make_unique<BladeFronts>()),
      boundary_(settings_.pose) {
    check_settings(settings_);
    meshless::check_material(settings_.material, "body '" + settings_.name + "' material");
    if (settings_.tearing && settings_.deformation)
        throw InputError("body '" + settings_.name + "'", "only an elastic body of phyxels tears",
                         "take out its tearing or its deformation");
    if (settings_.tearing) {
        check_tearing(*settings_.tearing, "body '" + settings_.name + "' tearing");
    }
    solid_crossings_ = grid_.crossings().size();
    parallel.begin("body '" + settings_.name + "': occluders");
    occluders_.build(grid_, *surface_, parallel);
    parallel.begin("body '" + settings_.name + "': nodes");
    inside_ = list_material_nodes(grid_, *surface_, *pieces_, parallel);
    parallel.begin("body '" + settings_.name + "': phyxels");
    // A deformation model moves the phyxels, so few are enough.
    if (settings_.deformation) settings_.phyxel_count = std::min(settings_.phyxel_count, 64);
    samples_.place(sample_context(parallel),
                   {settings_.name, settings_.phyxel_spacing, settings_.phyxel_count, settings_.velocity,
                    settings_.angular_velocity, !settings_.deformation});
    if (settings_.deformation) {
        const std::vector<double>& mass = samples_.phyxels.mass;
        const LatticeNodeMotion::InitialMotion initial{std::accumulate(mass.begin(), mass.end(), 0.0),
                                                       settings_.velocity, settings_.angular_velocity};
        auto lattice =
            std::make_unique<LatticeNodeMotion>(grid_, inside_.node, initial, settings_.deformation);
        lattice_ = lattice.get();
        motion_ = std::move(lattice);
    } else {
        motion_ = std::make_unique<PhyxelNodeMotion>(grid_.bricks(), samples_.phyxels,
                                                     samples_.previous_deformation);
        sample_small_parts(parallel);
    }
    if (settings_.tearing)
        tearing_ =
            std::make_unique<Tearing>(strength_at_rest(*settings_.tearing, settings_.pose),
                                      settings_.material, grid_, samples_.phyxels, samples_.neighbourhoods);
    parallel.begin("body '" + settings_.name + "': boundary");
    surface_motion_.track_nodes(grid_, *surface_, motion_->tracker());
    const StepContext at_rest{0, 0, Vec3::Zero(), {}, {}, {}, parallel};
    StepReport report;
    update_node_frames(at_rest, report);
    move_surface(at_rest);
    finish_surface(at_rest, report);
}

Body::~Body() = default;

const NodeTracker& Body::nodes() const {
    return motion_->tracker();
}

std::int64_t Body::step_count() const {
    return motion_->step_count();
}

TrackerContext Body::tracker_context(const Parallel& parallel) const {
    return {grid_, *pieces_, occluders_.grid(), samples_.phyxels, samples_.locator, parallel};
}

geometry::SurfaceMesh Body::surface_mesh() const {
    geometry::SurfaceMesh out = splitting::extract(grid_, *surface_, *pieces_, surface_motion_.positions(),
                                                   surface_motion_.normals());
    for (Vec3& rest : out.rest) rest = settings_.pose * rest;
    return out;
}

bool Body::has_phyxel_in(const std::function<bool(const Vec3& at_start)>& region) const {
    return std::any_of(samples_.phyxels.rest_position.begin(), samples_.phyxels.rest_position.end(),
                       [&](const Vec3& rest) { return region(settings_.pose * rest); });
}

void Body::add_to_hash(StateHash& hash) const {
    for (const splitting::Crossing& c : grid_.crossings()) {
        hash.add_word(splitting::edge_id(c.edge));
        hash.add(c.parameter);
    }
    const auto add = [&](const std::vector<Vec3>& values) {
        for (const Vec3& v : values)
            for (int k = 0; k < 3; ++k) hash.add(v[k]);
    };
    add(samples_.phyxels.position);
    add(samples_.phyxels.velocity);
    if (settings_.material.plasticity)
        for (const Mat3& strain : samples_.phyxels.plastic_strain)
            for (int k = 0; k < 9; ++k) hash.add(strain(k / 3, k % 3));
    for (const meshless::RigidPiece& body : samples_.phyxels.rigid.bodies) {
        hash.add(body.piece);
        for (const Vec3& v : {body.centre, body.momentum, body.angular_momentum})
            for (int k = 0; k < 3; ++k) hash.add(v[k]);
        for (int k = 0; k < 9; ++k) hash.add(body.rotation(k / 3, k % 3));
    }
    for (const std::int32_t piece : samples_.phyxels.piece) hash.add(piece);
    for (const double mass : samples_.phyxels.mass) hash.add(mass);
    for (const float v : samples_.pairs.visibility) hash.add(static_cast<double>(v));
    add(surface_motion_.positions());
}

std::vector<std::string> Body::validate() const {
    std::vector<std::string> lines = splitting::validate(grid_);
    for (std::string& line : splitting::validate(grid_, *surface_, *pieces_)) lines.push_back(line);
    for (std::size_t i = 0; i < inside_.size(); ++i)
        if (inside_.piece[i] != pieces_->piece_of(grid_, inside_.node[i])) {
            lines.push_back("a node with the wrong piece");
            break;
        }
    std::vector<std::size_t> phyxels_of(pieces_->count(), 0);
    for (std::size_t i = 0; i < samples_.phyxels.size(); ++i) {
        if (pieces_->piece_of(grid_, samples_.owner[i]) != samples_.phyxels.piece[i])
            lines.push_back("a phyxel with the wrong piece");
        ++phyxels_of[static_cast<std::size_t>(samples_.phyxels.piece[i])];
        if (!samples_.phyxels.position[i].allFinite() || !samples_.phyxels.velocity[i].allFinite())
            lines.push_back("a phyxel that is not finite");
    }
    for (const std::size_t count : phyxels_of)
        if (count == 0) lines.push_back("a piece without phyxels");
    for (std::size_t k = 0; k < samples_.pairs.size(); ++k)
        if (samples_.pairs.visibility[k] > 0 &&
            samples_.phyxels.piece[samples_.pairs.a[k]] != samples_.phyxels.piece[samples_.pairs.b[k]]) {
            lines.push_back("a link between two pieces");
            break;
        }
    for (const meshless::RigidPiece& body : samples_.phyxels.rigid.bodies)
        if (!body.centre.allFinite() || !body.rotation.allFinite() || !body.momentum.allFinite() ||
            !body.angular_momentum.allFinite())
            lines.push_back("a rigid piece that is not finite");
    std::vector<std::uint32_t> all(samples_.phyxels.size());
    std::iota(all.begin(), all.end(), 0U);
    if (!lattice_ && !separate_groups(samples_, pieces_->count(), all).empty())
        lines.push_back("a piece whose phyxels are not connected");
    double lumped = 0;
    for (const double v : samples_.phyxels.volume) lumped += v;
    const double owned = inside_.total_volume();
    if (std::abs(lumped - owned) > 1e-9 * owned) lines.push_back("the volumes of phyxels and nodes differ");
    return lines;
}

}  // namespace splitcubes::body
