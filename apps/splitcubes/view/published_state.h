// States that the simulation publishes after each step: plain values that never change again, so that the
// window draws them without a lock.
#pragma once

#include <splitcubes/api/simulation.h>
#include <splitcubes/geometry/box.h>
#include <splitcubes/geometry/triangle_mesh.h>
#include <splitcubes/math/types.h>
#include <splitcubes/scene/description.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace splitcubes::scene {
struct InstrumentPart;
}

namespace splitcubes::view {

/// Parts of a surface's arrays that one change touched.
struct SurfaceChange {
    std::uint64_t revision = 0;  // after it
    std::vector<Range> vertices, triangles;
};

/// The part of a surface that only cuts change; shared by the states between two cuts.
struct SurfaceTopology {
    std::vector<std::uint32_t> triangles;  // three vertex slots a triangle slot
    std::vector<SurfaceOrigin> origins;    // a triangle slot
    std::vector<std::int32_t> materials;   // a triangle slot
    std::vector<std::int32_t> pieces;      // a vertex slot, -1: free
    std::vector<float> rest;               // x, y, z a vertex slot, m
    std::vector<std::int32_t> cuts;        // a triangle slot: number of the cut that made it, -1: none
    std::vector<float> born;               // a triangle slot: s, when it was cut; negative: it was not
    std::vector<float> corner_uv;          // u, v of each corner of a triangle slot; empty: no pictures
    std::uint64_t revision = 0;
    std::vector<SurfaceChange> changes;  // the last ones, ascending
    std::vector<float> rest_and_depth;   // four a vertex slot, m; empty: no finish depends on them
    std::size_t bytes() const;
};

/// Quantity that colours a surface.
enum class Field { none, von_mises_stress, principal_stress, principal_strain };

/// Things that states hold beside the surfaces, where they are shown; bits.
enum Detail : unsigned { show_samples = 1, show_links = 2, show_contacts = 4 };

/// A picture on a material, of a file or in memory.
struct SurfacePicture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;  // rows from the top
};

/// A body as it was after a step.
struct BodyState {
    BodyId id;
    std::string name;
    std::shared_ptr<const SurfaceTopology> topology;
    std::vector<float> positions;                      // x, y, z a vertex slot, m, world
    std::vector<float> normals;                        // x, y, z a vertex slot
    std::vector<float> field;                          // a vertex slot; empty: none is shown
    std::vector<float> sample_positions;               // x, y, z a phyxel, m, world; empty: not shown
    std::vector<float> sample_field;                   // a phyxel
    std::vector<SampleLink> links;                     // between phyxels; empty: not shown
    std::shared_ptr<const std::vector<Vec3>> palette;  // sRGB, of the materials
    /// Finishes of the materials; null entries: the palette's colour; null: no entries.
    std::shared_ptr<const std::vector<std::shared_ptr<const geometry::Finish>>> finishes;
    /// Pictures of the materials, by their index; null entries: none; null: no entries.
    std::shared_ptr<const std::vector<std::shared_ptr<const SurfacePicture>>> pictures;
    int inside = -1;           // material of cut faces; negative: none
    std::vector<float> marks;  // a vertex slot: 1 held, -1 pulled, 0 neither; empty: neither
    std::size_t pieces = 0;
    /// Lower and upper corners of runs of triangles_per_block triangle slots, for picks; infinite: all free.
    std::vector<std::array<float, 6>> blocks;
    geometry::Box bounds;  // m, world
};
inline constexpr std::size_t triangles_per_block = 48;
/// Fills `blocks` and `bounds` from positions and topology.
void find_bounds(BodyState& body);

/// A thing that does not deform.
struct ColliderState {
    std::shared_ptr<const geometry::TriangleMesh> mesh;  // own frame
    Isometry frame = Isometry::Identity();               // world from own
    std::optional<geometry::Finish> finish;
};

/// The solid of a tool.
struct InstrumentState {
    std::shared_ptr<const std::vector<scene::InstrumentPart>> parts;  // own frame
    Isometry frame = Isometry::Identity();                            // world from own
};

/// From a region that a scene's handle pulls to where it is pulled; m, world.
struct RodState {
    Vec3 at = Vec3::Zero(), target = Vec3::Zero();
    double radius = 0;  // m, of the ball at its end
};

/// A region that is pulled.
struct PullState {
    int slot = 0;
    bool pinned = false;
    Vec3 at = Vec3::Zero();      // m, world, of the material
    Vec3 target = Vec3::Zero();  // m, world
    double force = 0;            // N
    // Of a jaw of forceps.
    int partner = 0;                        // slot of the other one; 0: it is no jaw
    double limit = 0;                       // N, of the force
    Isometry frame = Isometry::Identity();  // of the forceps, world from own, tip at the target
    double width = 0, opening = 0;          // m, between the jaws when they are open, and now
    bool is_at_limit() const { return limit > 0 && force > 0.98 * limit; }
};

/// A force of a tool or of a pull on a body.
struct ForceState {
    Vec3 at = Vec3::Zero();     // m, world
    Vec3 force = Vec3::Zero();  // N, world
    bool is_at_limit = false;   // it cannot be larger
};

/// A point where a body is pushed.
struct ContactState {
    Vec3 at = Vec3::Zero();     // m, world
    Vec3 force = Vec3::Zero();  // N, world, on the body
    bool by_a_body = false;
};

struct ForceStates {
    std::vector<ForceState> arrows;
    std::vector<ContactState> contacts;  // where they are shown
};

inline constexpr std::size_t stage_count = 12;

/// Measures of a step.
struct StepStatistics {
    std::array<float, stage_count> stage_ms{};
    double step_ms = 0;                             // all of the step, publishing included
    double kinetic_energy = 0, elastic_energy = 0;  // J
    double tool_force = 0;                          // N, the sum of all blades' and pulls' magnitudes
    std::size_t contacts = 0, new_cut_edges = 0;
    int solver_iterations = 0;
    std::uint32_t warnings = 0;  // StepWarning bits
};

/// All that the window shows of the simulation.
struct PublishedState {
    std::uint64_t number = 0;    // of states published
    std::uint64_t scene = 0;     // goes up when another scene is opened
    std::uint64_t commands = 0;  // number of commands that it contains
    std::int64_t step = 0;
    double time = 0;  // s
    std::vector<BodyState> bodies;
    std::vector<std::vector<Vec3>> blades;  // m, world, edges of lowered blades and of the scene's tools
    std::vector<PullState> pulls;
    std::vector<ColliderState> colliders;
    std::vector<InstrumentState> instruments;
    std::vector<RodState> rods;
    ForceStates forces;
    /// Number of frames of a run that is played back, of which `step` is one; 0: a simulation.
    std::int64_t run_frames = 0;
    std::optional<double> ground;     // m, height of the table
    scene::CameraDescription camera;  // that the scene asks for
    StepStatistics statistics;
    std::size_t undo_count = 0, redo_count = 0;
    bool playing = false;
    double speed = 1;                // of simulated time that is wished for
    double real_time_factor = 0;     // of simulated time that is reached
    std::string title;               // of the scene
    std::string notice;              // the last message, one line
    std::uint64_t notices = 0;       // number of messages
    std::vector<double> parameters;  // by the index of parameter_list()
    /// Memory, without what states share.
    std::size_t bytes() const;
};
using State = std::shared_ptr<const PublishedState>;

}  // namespace splitcubes::view
