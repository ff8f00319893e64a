// One soft solid: its topology, its surface and its elastic samples, and the stages of a step that keep
// the three consistent.
#pragma once

#include <splitcubes/body/body_settings.h>
#include <splitcubes/body/boundary_conditions.h>
#include <splitcubes/body/surface_occluders.h>
#include <splitcubes/body_samples/elastic_samples.h>
#include <splitcubes/body_samples/material_nodes.h>
#include <splitcubes/contact/detection/surface_sampler.h>
#include <splitcubes/node_motion/surface_motion.h>
#include <splitcubes/splitting/pieces.h>
#include <splitcubes/splitting/solidify.h>

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes {
class StateHash;
class StateReader;
class StateWriter;
namespace cutting {
class Blade;
struct SweptBlade;
}  // namespace cutting
namespace meshless {
class CutRelaxation;
struct HandleSpring;
struct SolverReport;
struct StepInput;
class TimeIntegrator;
}  // namespace meshless
namespace splitting {
class Surface;
}
}  // namespace splitcubes

namespace splitcubes::body {

class BladeFronts;
struct BodyView;
class LatticeNodeMotion;
class NodeMotion;
class NodeTracker;
struct StepContext;
struct StepReport;
class Tearing;
struct ToolForce;
struct TopologyChange;
struct TrackerContext;

/// One soft solid. Its rest space is the frame of its mesh, rotated to the axes of its shape, so nothing of
/// what is made there (grid, surface, phyxels) depends on where the body is placed. Regions and cuts at rest
/// are given in the world at time 0.
class Body {
  public:
    /// mesh: in its own frame, which settings.pose places. Throws InputError if the mesh encloses no volume
    /// or a setting is out of range.
    Body(const geometry::TriangleMesh& mesh, const BodySettings& settings, const Parallel& parallel);
    Body(const Body&) = delete;
    Body& operator=(const Body&) = delete;
    ~Body();

    void add_constraint(HoldConstraint constraint) { boundary_.add_constraint(std::move(constraint)); }
    void add_handle(Handle handle) { boundary_.add_handle(std::move(handle)); }
    /// Removes one; those behind it move up by one.
    void remove_handle(std::size_t index) { boundary_.remove_handle(index, samples_.phyxels); }
    void remove_constraint(std::size_t index) { boundary_.remove_constraint(index, samples_.phyxels); }
    void set_constraint_active(std::size_t index, double from, double until) {
        boundary_.set_constraint_active(index, from, until);
    }
    void set_handle_active(std::size_t index, double from, double until) {
        boundary_.set_handle_active(index, from, until);
    }
    const std::vector<Handle>& handles() const { return boundary_.handles(); }
    void set_handle_motion(std::size_t index, std::function<Isometry(double time)> motion) {
        boundary_.set_handle_motion(index, std::move(motion));
    }
    /// Appends the springs of the active handles; see BoundaryConditions::add_handle_springs.
    void add_handle_springs(const StepContext& context, std::uint32_t part,
                            std::vector<meshless::HandleSpring>& handle_springs, std::vector<double>& limits);
    const std::vector<HoldConstraint>& constraints() const { return boundary_.constraints(); }
    void set_constraint_motion(std::size_t index, std::function<Isometry(double time)> motion) {
        boundary_.set_constraint_motion(index, std::move(motion));
    }

    // The stages of a step. World::step calls them in this order.

    /// Cuts the grid edges that the blades crossed during the last interval, in which both edges and blades
    /// move. last_normal: of the stroke, kept between steps. tool_before, tool_now: frames of the tool at the
    /// ends of the interval. Adds the cutting resistance to tool_force.
    void cut_edges(std::span<const cutting::SweptBlade> blades, std::int32_t cut_number, Vec3& last_normal,
                   const StepContext& context, TopologyChange& change, StepReport& report,
                   const Isometry& tool_before, const Isometry& tool_now, ToolForce& tool_force);
    /// Cuts the grid edges that the stress of the last step tears.
    void tear(const StepContext& context, TopologyChange& change, StepReport& report);
    void retessellate(const Parallel& parallel, TopologyChange& change, StepReport& report);
    void label_pieces(TopologyChange& change);
    void update_visibility(const StepContext& context, TopologyChange& change, StepReport& report);
    /// Gives new pieces the phyxels that they need. Fragments that rotate too fast become rigid.
    void resample(const StepContext& context, TopologyChange& change, StepReport& report);
    void rebuild_neighbourhoods(const StepContext& context, TopologyChange& change);
    /// Returns the step's input without its contacts. Its spans refer to this body and are valid until the
    /// next call.
    meshless::StepInput begin_step(const StepContext& context);
    /// Adds the solver's report to the step's, after the phyxels have been stepped.
    void end_step(const StepContext& context, const meshless::SolverReport& solved, StepReport& report);
    void update_node_frames(const StepContext& context, StepReport& report);
    /// Moves the surface's vertices with the node frames.
    void move_surface(const StepContext& context);
    /// Draws a vertex at a position, m, world, until the surface moves again.
    void draw_vertex(std::uint32_t vertex, const Vec3& position) {
        surface_motion_.set_position(vertex, position);
    }
    /// Takes vertices back to where the node frames put them.
    void draw_as_moved(const StepContext& context);
    /// Chooses the contact samples of a changed surface and adds the body's sums to the report.
    void finish_surface(const StepContext& context, StepReport& report);

    /// Cuts the body at rest along a sheet, world at time 0, and runs all stages except the integration.
    /// Returns the number of newly cut edges.
    std::size_t cut_with_sheet(const geometry::TriangleMesh& sheet, std::int32_t cut_number,
                               const Parallel& parallel);

    /// The same along the whole path of a blade.
    std::size_t cut_with_blade(const cutting::Blade& blade, std::int32_t cut_number,
                               const Parallel& parallel);

    const std::string& name() const { return settings_.name; }
    const BodySettings& settings() const { return settings_; }
    /// World at time 0 from rest space.
    const Isometry& pose() const { return settings_.pose; }
    /// Whether one of the phyxels is in a region at time 0.
    bool has_phyxel_in(const std::function<bool(const Vec3& at_start)>& region) const;
    const splitting::SolidifyReport& solidify_report() const { return solidify_report_; }
    const splitting::NodeGrid& grid() const { return grid_; }
    const splitting::Surface& surface() const { return *surface_; }
    const splitting::Pieces& pieces() const { return *pieces_; }
    /// Pieces that the last step or the last cut at rest separated.
    const std::vector<splitting::PieceSplit>& splits() const { return last_splits_; }
    const meshless::Phyxels& phyxels() const { return samples_.phyxels; }
    meshless::Phyxels& phyxels() { return samples_.phyxels; }
    meshless::TimeIntegrator& solver() { return *solver_; }
    /// Whether a deformation model moves the body instead of its phyxels. Such a body takes no part in
    /// contacts and steps by advance_deformation.
    bool is_lattice_driven() const { return lattice_ != nullptr; }
    void advance_deformation(const StepContext& context, StepReport& report);
    const meshless::Pairs& pairs() const { return samples_.pairs; }
    const meshless::Neighbourhoods& neighbourhoods() const { return samples_.neighbourhoods; }
    /// The triangles that can block a line of sight between phyxels, in rest space.
    const geometry::OccluderGrid& occluders() const { return occluders_.grid(); }
    /// Returns phyxels and pairs as input for a visibility criterion; spans refer to this body.
    occlusion::PairSet pair_set() const { return samples_.pair_set(); }
    const NodeTracker& nodes() const;
    double phyxel_spacing() const { return samples_.spacing; }
    /// Per surface vertex, world frame, as of the last update_surface.
    const std::vector<Vec3>& vertex_positions() const { return surface_motion_.positions(); }
    const std::vector<Vec3>& vertex_normals() const { return surface_motion_.normals(); }
    /// Returns the current surface, world frame; its rest positions are those of the world at time 0.
    geometry::SurfaceMesh surface_mesh() const;
    std::size_t cut_edge_count() const { return cut_edge_count_; }

    /// Samples of the surface, about two per phyxel spacing, as of the last update_surface with
    /// StepContext::contacts.
    const std::vector<ContactSample>& contact_samples() const { return sampler_.samples(); }
    /// Changes whenever contact_samples() does.
    std::uint64_t sample_revision() const { return sampler_.revision(); }
    /// Returns the parts that contact search sees.
    BodyView view();

    std::int64_t step_count() const;
    void add_to_hash(StateHash& hash) const;
    /// Writes all state that a step reads and that neither follows from the settings nor from other state.
    void save(StateWriter& writer) const;
    /// Restores saved state into a body made with the same settings, which has no cuts but those made at rest
    /// before the first step. Throws DamagedState if the data is no state of such a body; the body must not
    /// be used then.
    void load(StateReader& reader, const Parallel& parallel);
    /// Returns the inconsistencies between grid, surface, pieces and samples; empty: none. For tests and
    /// debug builds.
    std::vector<std::string> validate() const;

  private:
    /// A mesh in rest space, and settings with its pose.
    struct AtRest {
        geometry::TriangleMesh mesh;
        BodySettings settings;
    };
    static AtRest at_rest(const geometry::TriangleMesh& mesh, const BodySettings& settings);
    Body(AtRest made, const Parallel& parallel);

    void save_cuts(StateWriter& writer) const;
    void load_cuts(StateReader& reader);
    void rebuild_derived_state(const Parallel& parallel);
    void cut_edges_near(std::span<const cutting::SweptBlade> blades, std::int32_t cut_number,
                        Vec3& last_normal, const Parallel& parallel);
    void accumulate_cut_force(std::int32_t slot, double dt, const Isometry& tool_before,
                              const Isometry& tool_now, ToolForce& tool_force) const;
    void settle_topology(const Parallel& parallel, TopologyChange& change);
    void find_fast_fragments(const StepContext& context, TopologyChange& change) const;
    void resample_splits(const StepContext& context, TopologyChange& change, StepReport& report);
    void sample_small_parts(const Parallel& parallel);
    void update_links(const Parallel& parallel, TopologyChange& change);
    bool update_held(const StepContext& context);
    void relax_cut(const StepContext& context, const TopologyChange& change);
    SampleContext sample_context(const Parallel& parallel) const {
        return {grid_, *pieces_, occluders_.grid(), inside_, settings_.material, settings_.pose, parallel};
    }
    TrackerContext tracker_context(const Parallel& parallel) const;

    BodySettings settings_;
    splitting::SolidifyReport solidify_report_;
    splitting::NodeGrid grid_;
    std::unique_ptr<splitting::Surface> surface_;
    std::unique_ptr<splitting::Pieces> pieces_;
    SurfaceOccluders occluders_;

    MaterialNodes inside_;
    ElasticSamples samples_;
    std::unique_ptr<meshless::TimeIntegrator> solver_;
    std::unique_ptr<meshless::CutRelaxation> relaxation_;

    std::unique_ptr<NodeMotion> motion_;
    std::unique_ptr<BladeFronts> fronts_;
    LatticeNodeMotion* lattice_ = nullptr;  // motion_ if a deformation model moves the nodes; else null
    SurfaceMotion surface_motion_;
    std::size_t cut_edge_count_ = 0;
    std::vector<splitting::PieceSplit> last_splits_;  // see splits()

    // Crossings of the uncut body, and the number of cut edges after each stage that cut some. A checkpoint
    // stores only later ones; loading repeats the stages to rebuild surface and pieces.
    std::size_t solid_crossings_ = 0;
    std::vector<std::uint32_t> cut_stage_ends_;

    std::unique_ptr<Tearing> tearing_;  // null: does not tear

    BoundaryConditions boundary_;
    SurfaceSampler sampler_;
};

/// Returns the views of several bodies.
std::vector<BodyView> views_of(std::span<const std::unique_ptr<Body>> bodies);

}  // namespace splitcubes::body
