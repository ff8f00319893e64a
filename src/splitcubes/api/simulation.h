// Soft bodies that blades cut while they deform: the interface for programs that show them.
#pragma once

#include <splitcubes/api/error.h>
#include <splitcubes/api/mesh.h>
#include <splitcubes/api/samples.h>
#include <splitcubes/api/settings.h>
#include <splitcubes/api/step_result.h>
#include <splitcubes/api/surface.h>
#include <splitcubes/api/types.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace splitcubes {

/// Memory that the simulation keeps beside the bodies themselves, bytes.
struct MemoryUse {
    std::size_t surfaces = 0;        ///< arrays of surface(), all bodies; grow with what is cut
    std::size_t motion_samples = 0;  ///< poses of tools, handles, constraints and colliders not yet passed
    std::size_t history_memory = 0;  ///< undo and redo, within HistorySettings::memory_budget
    std::size_t history_disk = 0;    ///< undo and redo, within HistorySettings::disk_budget
};

/// A state of a simulation, kept in memory; copies share it. It belongs to the simulation that it was taken
/// of and to copies of it that were loaded from its files.
class KeptState {
  public:
    /// None.
    KeptState() = default;
    /// Whether there is a state.
    explicit operator bool() const { return state_ != nullptr; }
    /// Its size, bytes.
    std::size_t bytes() const;

  private:
    friend class Simulation;
    std::shared_ptr<const void> state_;
};

/// A world of soft bodies, tools, handles, constraints and colliders, advanced in time steps of equal length.
///
/// **Order of things.** Between two steps the caller adds poses with times after time(); step() advances by
/// one time step. A blade cuts what it crossed in the time step before the one that is taken, both ends of
/// which are known then: its mark appears one step after it passed.
///
/// **Threads.** Calls of one simulation are made by one thread at a time; const calls may run beside each
/// other. A call that runs beside one that it may not run beside, and one made from within a RegionTest,
/// throws ErrorKind::busy: a thread that draws while another one steps needs a mutex of the caller around
/// both. Different simulations have nothing in common. A step uses SimulationSettings::thread_count threads
/// of its own; results do not depend on it by a bit.
///
/// **Lifetimes.** Views that are given (MeshView, BladeView) are read during the call. Spans that are
/// returned are valid until the next call that is not const. Ids are values.
///
/// **Errors.** Every call throws Error and nothing else, and has changed nothing then (but see step).
///
/// **Memory** does not grow with time: poses that are past are dropped, the history has a budget, and bodies
/// grow with what is cut of them, at most to all edges of their grids.
class Simulation {
  public:
    /// @throws Error for settings out of range.
    explicit Simulation(const SimulationSettings& settings = {});
    ~Simulation();
    /// One that was moved from throws at every call until another one is assigned to it.
    Simulation(Simulation&&) noexcept;
    /// See the other.
    Simulation& operator=(Simulation&&) noexcept;

    /// s; 0 at the start, one time step more after each step.
    double time() const;
    /// s, as in the settings.
    double time_step() const;
    /// What set_step_settings changes.
    StepSettings step_settings() const;
    /// Changes settings from the next step on; time goes on. Bodies are made again from their meshes: this
    /// takes as long as adding them did. Poses of tools that are lowered should end with a step whose length
    /// changes: what a blade swept before is looked up over one new time step.
    void set_step_settings(const StepSettings& settings);

    // --- bodies ---

    /// Adds a body at rest as its mesh is placed, moving as its settings say.
    BodyId add_body(const MeshView& mesh, const BodySettings& settings);
    /// The same from a file: OBJ, PLY, STL, glTF or GLB, with its texture coordinates and materials.
    BodyId add_body(const std::string& mesh_file, const BodySettings& settings);
    /// Removes a body with its handles and constraints.
    void remove_body(BodyId body);
    /// In the order in which they were added.
    std::vector<BodyId> bodies() const;
    /// Pieces that it has come to, those that lie apart from the start included; numbered from 0.
    std::size_t piece_count(BodyId body) const;
    /// Names of the materials in SurfaceView::triangle_material: those of the input, then those of cut and
    /// bare faces.
    std::vector<std::string> material_names(BodyId body) const;
    /// Material of a body.
    MaterialSettings material(BodyId body) const;
    /// Changes the material from the next step on; the shape stays as it is. Bodies are made again from their
    /// meshes: this takes as long as adding them did.
    void set_material(BodyId body, const MaterialSettings& material);
    /// When a body tears; none: it does not.
    std::optional<TearingSettings> tearing(BodyId body) const;
    /// Changes when a body tears, as set_material.
    void set_tearing(BodyId body, const std::optional<TearingSettings>& tearing);
    /// Side of the cells of a body's grid, m.
    double cell_size(BodyId body) const;
    /// The elastic samples as they are now.
    SampleState samples(BodyId body) const;
    /// The pairs of its samples as they are now, of one piece each. Time and memory grow with their number,
    /// about 20 times that of the samples: for pictures, not for each step.
    std::vector<SampleLink> links(BodyId body) const;
    /// The surface as it is now, and what the last call changed of it.
    SurfaceView surface(BodyId body) const;
    /// Writes the surface as it is now: PLY, OBJ, STL or GLB. piece: that one alone; below 0: all.
    void write_surface(BodyId body, const std::string& file, int piece = -1) const;

    /// Cuts a body along a sheet of triangles in rest coordinates. Returns the number of grid edges cut. With
    /// HistorySettings::automatic undo takes it back, unless a tool is lowered; so for blades. Pieces that
    /// come off are no events: see piece_count().
    std::size_t cut_with_sheet(BodyId body, const MeshView& sheet);
    /// Cuts a body along what a blade sweeps on a path, in rest coordinates: two poses or more, times
    /// increasing.
    std::size_t cut_with_blade(BodyId body, const BladeView& blade, std::span<const TimedPose> path);

    // --- tools ---

    /// Adds a blade that is raised.
    ToolId add_tool(const BladeView& blade, const ToolSettings& settings = {});
    /// Sets the tool's pose at a time, after time() and after its last pose. Between poses it goes straight,
    /// after the last it stands still; any number may be given between two steps. A pose cannot be taken
    /// back: one that lies far ahead keeps the tool from others until then.
    /// @throws Error pose_not_later otherwise.
    void add_tool_pose(ToolId tool, double time, const Pose& pose);
    /// From time() on it cuts. With HistorySettings::automatic, and where no other tool is lowered, undo goes
    /// back to just before. Nothing where it is lowered already.
    void lower_tool(ToolId tool);
    /// From time() on it moves without cutting. Nothing where it is raised already.
    void raise_tool(ToolId tool);
    /// Whether it cuts.
    bool is_lowered(ToolId tool) const;
    /// Removes a tool. Its cuts stay. Edges that it crossed in the last time step are not cut yet: to cut
    /// them, raise it and step once before.
    void remove_tool(ToolId tool);
    /// In the order in which they were added, as StepResult::tools.
    std::vector<ToolId> tools() const;

    // --- handles, constraints, colliders ---

    /// Adds springs that pull a region of a body.
    HandleId add_handle(BodyId body, const HandleSettings& settings);
    /// Sets the target of the springs at a time (world from rest), as add_tool_pose.
    void add_handle_pose(HandleId handle, double time, const Pose& pose);
    /// Lets go.
    void remove_handle(HandleId handle);
    /// Holds a region of a body.
    ConstraintId add_constraint(BodyId body, const ConstraintSettings& settings);
    /// Sets the pose of the region at a time (world from rest), as add_tool_pose.
    void add_constraint_pose(ConstraintId constraint, double time, const Pose& pose);
    /// Lets go.
    void remove_constraint(ConstraintId constraint);
    /// Adds a thing that bodies push against. A body at rest, without gravity, that it overlaps from the
    /// start is not pushed until one of them moves.
    ColliderId add_collider(const ColliderSettings& settings);
    /// Sets its pose at a time, as add_tool_pose.
    void add_collider_pose(ColliderId collider, double time, const Pose& pose);
    /// Removes a collider. Bodies that lay on it fall.
    void remove_collider(ColliderId collider);
    /// In the order in which they were added.
    std::vector<HandleId> handles() const;
    /// In the order in which they were added.
    std::vector<ConstraintId> constraints() const;
    /// In the order in which they were added, without the ground.
    std::vector<ColliderId> colliders() const;

    // --- time ---

    /// Advances everything by one time step.
    /// @throws Error of the kind out_of_memory or failed where it could not; the simulation is
    /// ErrorKind::broken then, until undo or load.
    StepResult step();
    /// The points that pushed on each other in the last step, body by body; a copy. Those of fragments that
    /// move as rigid bodies are not among them.
    std::vector<ContactPoint> contacts() const;
    /// Returns a hash of the whole state: equal for equal runs, bit for bit.
    std::uint64_t state_hash() const;

    // --- state ---

    /// Keeps the state as it is now for undo, and forgets what could be redone.
    void mark_undo_point();
    /// Goes back to the last kept state: bodies, tools, their poses, time. Ids of what is there in that state
    /// name it again. Returns whether there was one. Bodies are made again from their meshes: this takes as
    /// long as adding them did.
    bool undo();
    /// Takes the last undo back. Returns whether there was one.
    bool redo();
    /// Forgets all kept states: there is nothing to undo or redo.
    void forget_history();
    /// Kept states that undo can go back to.
    std::size_t undo_count() const;
    /// Kept states that redo can go forward to.
    std::size_t redo_count() const;
    /// Keeps the state as it is now outside of the history, for restore().
    KeptState keep() const;
    /// Becomes what was kept, as undo does; the history stays. Ids are those of the kept state.
    /// @throws Error invalid_argument for none.
    void restore(const KeptState& kept);
    /// Writes all of the simulation but its history, whole or not at all; read by this version of the library
    /// on machines of this byte order only. Regions by RegionTest cannot be written
    /// (ErrorKind::invalid_argument).
    void save(const std::string& file) const;
    /// Becomes what was saved, time step and gravity included; threads and history stay as they are set, and
    /// the history is emptied. Ids are those of the simulation that was saved.
    void load(const std::string& file);

    /// Returns the memory that it keeps beside the bodies.
    MemoryUse memory_use() const;

  private:
    class Impl;
    Impl& impl() const;
    std::unique_ptr<Impl> impl_;
};

}  // namespace splitcubes
