// Search for contacts between bodies, pieces and colliders.
#pragma once

#include <splitcubes/contact/detection/body_view.h>
#include <splitcubes/contact/detection/collider.h>
#include <splitcubes/contact/detection/contact_sides.h>
#include <splitcubes/contact/detection/piece_turns.h>
#include <splitcubes/contact/detection/quiet_motion.h>
#include <splitcubes/contact/detection/sample_grid.h>
#include <splitcubes/contact/detection/vertex_contacts.h>
#include <splitcubes/contact/response/contact.h>
#include <splitcubes/geometry/box.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace splitcubes::meshless {
struct Phyxels;
}

namespace splitcubes::body {

struct ContactSample;
class SurfaceChanges;

/// Bodies that are solved together because they may push on each other, or a single body.
struct ContactIsland {
    std::vector<std::size_t> bodies;          // ascending; part k of the contacts is bodies[k]
    std::vector<meshless::Contact> contacts;  // sorted by key
};

/// Finds the contacts of a time step. The surface is sampled at its vertices, about two per phyxel spacing.
/// Each sample moves with the few phyxels that have the largest influence on it.
///
/// Colliders: the path that a sample will take, by its velocity and gravity, is followed in the collider's
/// own moving frame up to where it meets the solid, so fast samples do not tunnel. A contact is the tangent
/// plane there.
///
/// Pieces and bodies: the samples of another piece around a sample, with normals that face it, define the
/// contact. The signed distances to the planes through them are averaged with weights that fall with distance
/// (implicit moving least squares, Kolluri 2005). Two samples of one piece can meet only if they are far
/// apart at rest or a cut separates them there: the segment between points just below them crosses a surface.
///
/// Rigid pieces meet colliders on their own (meshless::step_rigid) and everything else by RigidContacts.
/// Lattice-driven bodies meet the ground only.
///
/// The contacts of a step depend only on the bodies in that step. Samples and their influences are cached
/// only where nothing changed. Buffers are reused from step to step.
class ContactFinder {
  public:
    struct Task {
        std::span<const BodyView> bodies;
        std::span<const Collider> colliders;
        ContactOptions options;
        double time = 0;  // s, at the start of the step
        double dt = 0;    // s
        Vec3 gravity = Vec3::Zero();
    };
    /// Finds the contacts and groups the bodies into islands, in order of their first bodies; a body that
    /// touches no other one is an island by itself. Replaces the islands and reuses their memory. Every call
    /// must get the same bodies, in whatever state they are.
    void find(const Task& task, const Parallel& parallel, std::vector<ContactIsland>& islands);

    /// Returns whether the last call of find needed no search between surfaces (QuietMotion).
    bool was_quiet() const { return quiet_.remembers() && quiet_steps_ > 0; }

    /// Sample of elastic surface, as the last call of find listed it.
    struct SurfaceSample {
        std::uint32_t body, vertex;
        std::int32_t piece;
    };
    SurfaceSample surface_sample(std::size_t k) const {
        return {list_.samples[k].body, list_.samples[k].vertex, list_.samples[k].piece};
    }
    /// Positions (m, world) and normals (unit, outward, world), by sample.
    std::span<const Vec3> sample_positions() const { return placement_.position; }
    std::span<const Vec3> sample_normals() const { return placement_.normal; }

  private:
    /// Contact sample. It fills one cache line because the neighbours of a sample are read in random order.
    struct alignas(64) Sample {
        Vec3 rest = Vec3::Zero();           // m, rest space
        Vec3f rest_normal = Vec3f::Zero();  // unit, outward
        std::int32_t piece = 0;
        std::uint32_t vertex = 0;
        std::uint32_t node = 0;  // tracked node with the largest influence on it
        std::uint32_t cell = 0;  // of the surface; determines the influences together with the corners
        std::uint16_t body = 0;
        std::uint8_t corners = 0;
        // As in ContactSample: whether the sample pushes on other bodies and colliders, and on its own body.
        bool pushes : 1 = true;
        bool searches_own_body : 1 = true;
        std::uint32_t serial = 0;  // unique; new if position, normal, piece or node changes
        std::uint32_t slot = 0;    // index of its cached data; kept while the influences stay the same
    };
    /// Cache of one sample: which other samples, by serial number, a cut separates from it at rest.
    struct KnownSeparations {
        static constexpr std::size_t size = 32;  // about seven are queried per step

        struct Answer {
            std::uint32_t is_separated : 1 = 0;
            std::uint32_t last_change : 31 = 0;  // last change of the surface that is taken into account
            // Id of the occluder that separates them; if none does, the occluders' change counter at that
            // time.
            std::uint32_t witness = 0;
        };
        std::array<std::uint32_t, size> other{};  // 0: empty
        std::array<Answer, size> answer{};
        // Nothing has changed after `from` and up to `until` within `bounds`, the bounding box (m, rest
        // space) of all queried segments. So most samples need not check every other sample.
        geometry::Box bounds;
        std::uint32_t from = 0, until = 0;
    };
    struct Influence {
        meshless::ContactSide side;    // no phyxels: not known yet
        Vec3 offset = Vec3::Zero();    // m, rest space, from the weighted mean; nonzero for few in a plane
        std::uint64_t row = 0;         // NodeTracker::row_revision when it was found
        std::size_t phyxel_count = 0;  // without a row: phyxel count when the nearest one was found; else 0
    };
    /// State of a body from which its samples were listed.
    struct Listed {
        std::uint64_t surface_revision = 0, sample_revision = 0;
        std::size_t pieces = 0, rigid = 0;
        std::uint32_t full_change = 0;  // SurfaceChanges::last_full_change
        std::size_t first = 0;          // index of its first sample

        /// Returns whether pieces and tracked node indices are the same.
        bool same_nodes(const Listed& o) const {
            return pieces == o.pieces && rigid == o.rigid && full_change == o.full_change;
        }
        bool same_as(const Listed& o) const {
            return surface_revision == o.surface_revision && sample_revision == o.sample_revision &&
                   same_nodes(o);
        }
    };
    /// Sample of the face that another sample meets.
    struct FaceSample {
        std::uint32_t index, entry;  // sample index; grid entry
        double height, end_height;   // m, heights above the plane through this one, now and after the step
        double weight;               // in the mean
    };
    enum class May : std::uint8_t { unknown, no, yes };
    /// Work buffers and results of one thread. The assignment to threads does not affect the results.
    struct Chunk {
        std::vector<meshless::Contact> found;
        std::vector<std::uint64_t> keys;  // of `found`, by index
        std::vector<std::uint32_t> near;
        std::vector<SampleGrid::FacingPoint> faced;  // all samples that face the current one
        std::vector<May> may;  // per entry of `faced`: whether it can meet the current one
        std::vector<std::uint64_t> order;
        std::vector<FaceSample> face;  // the face that the current sample meets, in order of the grid entries
        SideBlend blend;

        /// Capacities of the buffers for the neighbourhood of one sample.
        struct Capacity {
            std::size_t near = 0, faced = 0, may = 0, order = 0, face = 0, blend = 0;

            void include(const Chunk& chunk) {
                near = std::max(near, chunk.near.size());
                faced = std::max(faced, chunk.faced.capacity());
                may = std::max(may, chunk.may.capacity());
                order = std::max(order, chunk.order.capacity());
                face = std::max(face, chunk.face.capacity());
                blend = std::max(blend, chunk.blend.capacity());
            }
            void reserve_in(Chunk& chunk) const {
                chunk.near.resize(near);  // never shrinks
                chunk.faced.reserve(faced);
                chunk.may.reserve(may);
                chunk.order.reserve(order);
                chunk.face.reserve(face);
                chunk.blend.reserve(blend);
            }
        };
    };
    /// Bounds of a range of consecutive samples.
    struct Patch {
        geometry::Box box;            // m, world
        double spacing = 0;           // m, maximum of their bodies
        double max_displacement = 0;  // m, of a sample in the step
    };
    struct Speeds {
        Vec3 sum = Vec3::Zero();  // m/s, of velocities
        double max_square = 0;    // m^2/s^2, maximum squared speed
    };
    struct Found {
        std::uint64_t key;
        const meshless::Contact* contact;
    };
    struct SearchRange {
        double spacing;     // m, maximum of all bodies
        double radius;      // m, base search radius around a sample
        double max_radius;  // m, search radius including all displacements
        double fall;        // m, allowance for phyxels that begin to fall
    };

    // Samples or phyxels per chunk of a parallel loop; they do not affect the results.
    static constexpr std::size_t grain = 64, list_grain = 256, speed_grain = 4096;
    static std::size_t body_of(std::uint64_t key) { return key >> 48; }
    void reserve_chunks(std::size_t threads);
    Chunk& take_chunk();
    KnownSeparations& take_known();
    Influence& influence_of(std::size_t k) { return slots_.influences[list_.samples[k].slot]; }
    const Influence& influence_of(std::size_t k) const { return slots_.influences[list_.samples[k].slot]; }
    double spacing_of(const Sample& sample) const { return bounds_.spacing[sample.body]; }
    void give_back(Chunk& chunk);
    /// Calls work(chunk, begin, end) for subranges of [0, count).
    template <class Work>
    void in_chunks(const Parallel& parallel, std::size_t count, const Work& work) {
        const auto with_chunk = [&](std::size_t begin, std::size_t end) {
            Chunk& chunk = take_chunk();
            work(chunk, begin, end);
            give_back(chunk);
        };
        // Passed by reference because a copied function object would be allocated.
        parallel.for_chunks(count, grain, std::cref(with_chunk));
    }
    bool is_listed(const Task& task);
    void list_samples(const Task& task, const Parallel& parallel);
    void relist(const Task& task, const Parallel& parallel);
    void list_points(const BodyView& body, std::uint32_t body_index, std::size_t first, std::size_t begin,
                     std::size_t end);
    static bool pushes_for(const BodyView& body, std::uint32_t vertex, std::uint32_t by, bool is_uncut);
    static std::uint32_t opposite_of(const BodyView& body, const ContactSample& point);
    void compact();
    void restart_serials();
    void keep_slots();
    void drop_known(std::uint32_t slot);
    std::uint32_t take_slot();
    bool is_quiet(const Task& task);
    void find_quiet(const Task& task, const Parallel& parallel);
    bool is_clear(const Task& task, const Parallel& parallel);
    void measure_speeds(const Task& task, const Parallel& parallel);
    void measure_pieces(const Task& task, const Parallel& parallel);
    double piece_displacement(const Sample& sample) const;
    void place_sample(const Task& task, std::size_t k);
    void place_samples(const Task& task, const Parallel& parallel);
    static bool is_still_nearest(const meshless::Phyxels& phyxels, const Sample& sample,
                                 const Influence& influence);
    void find_influences(const Task& task, std::size_t k);
    void meet_colliders(const Task& task, const Parallel& parallel);
    void meet_collider(const Task& task, std::size_t collider_index, const ColliderPoses& poses,
                       std::size_t k, Chunk& chunk);
    bool is_far(const Collider& collider, const ColliderPoses& poses, const Patch& patch) const;
    void place_exactly(const Task& task, std::span<const std::uint32_t> kept, const Parallel& parallel);
    void meet_pieces(const Task& task, const Parallel& parallel);
    bool are_separated(const BodyView& body, std::size_t a, std::size_t b);
    static void update_answer(const BodyView& body, const Vec3& from, const Vec3& to, bool is_known,
                              KnownSeparations::Answer& answer);
    static void update_interval(const SurfaceChanges& changes, std::uint32_t now, KnownSeparations& known);
    bool may_meet(const Task& task, std::size_t a, std::size_t b);
    bool may_meet(const Task& task, std::size_t k, std::size_t n, Chunk& chunk);
    const SampleGrid::FacingPoint* partner_of(const Task& task, std::size_t k, Chunk& chunk);
    double speculative_gap(std::size_t k, const SearchRange& range) const;
    bool find_facing(std::size_t entry, double radius, const SearchRange& range, Chunk& chunk) const;
    double width_of(std::size_t k, const SampleGrid::FacingPoint& partner, const SearchRange& range) const;
    const SampleGrid::FacingPoint* find_partner(const Task& task, std::size_t entry, const SearchRange& range,
                                                Chunk& chunk);
    const SampleGrid::FacingPoint* widen(std::size_t entry, const SampleGrid::FacingPoint& partner,
                                         double near, const SearchRange& range, Chunk& chunk) const;
    void find_face(const Task& task, std::size_t k, const SampleGrid::FacingPoint& chosen,
                   const SearchRange& range, Chunk& chunk);
    bool meet(const Task& task, std::size_t entry, const SearchRange& range, Chunk& chunk,
              meshless::Contact& out);
    bool set_lower_side(const Task& task, const Vec3& foot, double total, std::size_t partner, Chunk& chunk,
                        meshless::Contact& out) const;
    bool is_covered_by_opposite(const Task& task, std::size_t k) const;
    bool searches(const Task& task, std::size_t entry) const;
    SearchRange search_range(const Task& task) const;
    void sort_found();
    void form_islands(std::size_t bodies, std::vector<ContactIsland>& islands);
    void fill_islands(const Task& task, const Parallel& parallel, std::vector<ContactIsland>& islands);

    /// Samples of all bodies, in order of the bodies.
    struct SampleList {
        std::vector<Sample> samples;
        std::vector<std::uint32_t> opposite;  // per sample: vertex, as in ContactSample
        std::vector<Listed> bodies;           // per body
    };
    /// Match of a fresh list with the previous one.
    struct Matching {
        // Per fresh sample: its previous index, new_sample (-1) or no_sample (-2).
        std::vector<std::int32_t> previous;
        std::vector<std::uint8_t> is_kept;  // per previous sample: whether it is kept
    };
    /// Cached data per slot; a sample keeps its slot while others come and go.
    struct Slots {
        std::vector<Influence> influences;
        std::vector<KnownSeparations*> separations;  // nullptr: nothing is known
        std::vector<std::uint32_t> free;
    };
    /// Memory of the known separations.
    struct SeparationPool {
        std::deque<KnownSeparations> all;  // only grows; elements keep their addresses
        std::vector<KnownSeparations*> free;
    };
    /// Positions and normals of the samples, per sample.
    struct Placement {
        std::vector<Vec3> position, normal;  // m; unit, outward; world
        std::vector<std::uint16_t> owner;    // body
        std::vector<std::uint8_t> placed;    // 1: the position follows the phyxels exactly
        std::vector<Patch> patches;          // per `grain` samples
    };
    /// Bounds of the motion in the step.
    struct MotionBounds {
        std::vector<double> spacing;                          // m, per body
        std::vector<double> max_displacement;                 // m, per body: of a sample
        std::vector<Speeds> speeds;                           // per range of a body's phyxels
        Vec3 mean_displacement = Vec3::Zero();                // m, of all phyxels
        std::vector<double> square;                           // m^2, per phyxel of a body
        std::vector<std::vector<double>> piece_displacement;  // m, per body and piece: see measure_pieces
        std::vector<std::span<const Vec3>> velocity;          // m/s, per body and phyxel
        std::vector<std::vector<Vec3>> drift;                 // m, per body and phyxel: see drift_of
    };
    /// Chunks of all threads.
    struct ChunkPool {
        std::vector<std::unique_ptr<Chunk>> all;  // `part` of their contacts is the index of the body
        std::vector<Chunk*> free;
    };
    /// Contacts of all chunks in order of their keys, and a buffer for sorting them.
    struct SortedContacts {
        std::vector<Found> order, spare;
    };
    /// Grouping of the bodies into islands.
    struct Islands {
        std::vector<std::uint32_t> parent;           // per body: union-find
        std::vector<std::uint32_t> part_of;          // per body: index in its island
        std::vector<std::uint32_t> index_in_island;  // per contact
        std::vector<std::size_t> island_of;          // per body
        std::vector<std::size_t> size;               // per island: number of contacts
    };

    SampleList list_, fresh_;
    Matching matching_;
    Slots slots_;
    SeparationPool known_;
    std::uint32_t last_serial_ = 0;  // last serial number of a sample
    Placement placement_;
    MotionBounds bounds_;
    PieceTurns turns_;
    std::vector<SampleGrid::Motion> motions_;  // per sample that the grid keeps
    SampleGrid grid_, clear_grid_;
    QuietMotion quiet_;
    int quiet_wait_ = 0;     // steps without contacts before a state is tested
    int steps_without_ = 0;  // such steps in a row
    int quiet_steps_ = 0;    // steps since the remembered state
    std::mutex mutex_;       // guards chunks_ and known_
    ChunkPool chunks_;
    VertexContacts vertex_contacts_;
    SortedContacts found_;
    Islands islands_;
};

}  // namespace splitcubes::body
