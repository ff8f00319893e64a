// Which points of the bodies' skins may push on what within a step.
#pragma once

#include <splitcubes/body/body.h>
#include <splitcubes/body/collider.h>
#include <splitcubes/body/contact_sides.h>
#include <splitcubes/body/sample_grid.h>
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

namespace splitcubes::body {

/// Bodies that step on their own, or together since they may push on each other.
struct ContactIsland {
    std::vector<std::size_t> bodies;          // ascending; part k of the contacts is bodies[k]
    std::vector<meshless::Contact> contacts;  // sorted by key
};

/// The skin is sampled by vertices of the surface, about two a phyxel spacing. Each moves as
/// the four phyxels do that carry most of it.
///
/// Colliders: the way that a sample will go by its velocity and gravity is followed in the
/// collider's own, moving frame up to where it meets the solid, so that nothing is jumped over;
/// a contact is the tangent plane there.
///
/// Pieces and bodies: of the samples of another piece around a sample, with normals that face
/// it, the signed distance to the plane through each, averaged by nearness (implicit moving
/// least squares, Kolluri 2005). Within one piece only what a cut parts at rest can meet:
/// the segment between points just below the two samples crosses a surface.
///
/// Rigid pieces meet colliders on their own (meshless::step_rigid), and all else by RigidContacts; bodies
/// that a deformation carries meet the ground only.
///
/// What a step finds depends on that step's bodies alone: samples and who carries them are kept
/// from step to step only where nothing changed. Its buffers are kept from step to step.
class ContactFinder {
  public:
    struct Task {
        std::span<const std::unique_ptr<Body>> bodies;
        std::span<const Collider> colliders;
        ContactOptions options;
        double time = 0;  // s, at the start of the step
        double dt = 0;    // s
        Vec3 gravity = Vec3::Zero();
    };
    /// One group for every body that has a part in none else; in order of their first bodies. The
    /// groups are replaced; their memory is used again. The bodies must be the same from call to call, but
    /// for what happened to them.
    void find(const Task& task, const Parallel& parallel, std::vector<ContactIsland>& groups);

    /// The samples of elastic skin, as the last find has left them.
    struct SurfaceSample {
        std::uint32_t body, vertex;
        std::int32_t piece;
    };
    SurfaceSample surface_sample(std::size_t k) const {
        return {samples_[k].body, samples_[k].vertex, samples_[k].piece};
    }
    /// Of each, m, world; and unit, outward.
    std::span<const Vec3> sample_positions() const { return position_; }
    std::span<const Vec3> sample_normals() const { return normal_; }

  private:
    /// One line of memory: those around a sample are read in no order of theirs.
    struct alignas(64) Sample {
        Vec3 rest = Vec3::Zero();           // m, rest space
        Vec3f rest_normal = Vec3f::Zero();  // unit, outward
        std::int32_t piece = 0;
        std::uint32_t vertex = 0;
        std::uint32_t node = 0;  // tracked, that carries it
        std::uint32_t cell = 0;  // of the surface; that and which corners tell who carries it
        std::uint16_t body = 0;
        std::uint8_t corners = 0;
        // As of ContactSample: whether it pushes on what is not its body's, and on its body.
        bool pushes : 1 = true;
        bool searches_own_body : 1 = true;
        std::uint32_t serial = 0;  // as long as nothing above changes, and no other's
        std::uint32_t slot = 0;    // of what is kept about it, as long as it is carried by the same
    };
    /// Of one sample: which others, by serial numbers, a cut parts from it at rest.
    struct KnownSeparations {
        static constexpr std::size_t size = 32;  // some seven are asked for in a step

        struct Answer {
            std::uint32_t is_separated : 1 = 0;
            std::uint32_t when : 31 = 0;  // the last change of the surface that it knows of
            // Which occluder parts them; where none does, what the occluders had counted then.
            std::uint32_t witness = 0;
        };
        std::array<std::uint32_t, size> other{};  // 0: none
        std::array<Answer, size> answer{};
        // Within the box of all that was looked along, m, rest space, nothing has changed after `from`, up to
        // `until`: most samples need not ask for each other one.
        geometry::Box along;
        std::uint32_t from = 0, until = 0;
    };
    struct Influence {
        meshless::ContactSide side;  // no phyxels: not known yet
        Vec3 offset =
            Vec3::Zero();  // m, rest space, from the carriers' mean; not zero only where few lie in a plane
        std::uint64_t row = 0;  // NodeTracker::row_revision when it was found
        std::size_t among = 0;  // of how many phyxels it was the nearest, where no row told; else 0
    };
    /// What a body's samples were listed from.
    struct Listed {
        std::uint64_t surface = 0, skin = 0;
        std::size_t pieces = 0, rigid = 0;
        std::uint32_t anew = 0;  // SurfaceChanges::last_full_change
        std::size_t first = 0;   // of its samples

        /// Whether nodes are of the same pieces, and tracked by the same numbers.
        bool same_nodes(const Listed& o) const {
            return pieces == o.pieces && rigid == o.rigid && anew == o.anew;
        }
        bool same_as(const Listed& o) const {
            return surface == o.surface && skin == o.skin && same_nodes(o);
        }
    };
    /// A sample of the face that another one lies before.
    struct Facing {
        std::uint32_t index, place;  // among the samples; in the grid
        double along, next;          // m, of the other one above the plane through it, now and after the step
        double weight;               // in the mean
    };
    enum class May : std::uint8_t { unknown, no, yes };
    /// What one thread works with and finds; which, is part of no result.
    struct Chunk {
        std::vector<meshless::Contact> found;
        std::vector<std::uint64_t> keys;  // of what is found
        std::vector<std::uint32_t> near;
        std::vector<SampleGrid::Faced> faced;  // of one sample: all that face it
        std::vector<May> may;                  // of each, whether it can meet
        std::vector<std::uint64_t> order;
        std::vector<Facing> face;  // of one sample: the face that it lies before, in order of the samples
        SideBetween between;

        /// Of what is around one sample.
        struct Room {
            std::size_t near = 0, faced = 0, may = 0, order = 0, face = 0, between = 0;

            void take_in(const Chunk& chunk) {
                near = std::max(near, chunk.near.size());
                faced = std::max(faced, chunk.faced.capacity());
                may = std::max(may, chunk.may.capacity());
                order = std::max(order, chunk.order.capacity());
                face = std::max(face, chunk.face.capacity());
                between = std::max(between, chunk.between.room());
            }
            void give(Chunk& chunk) const {
                chunk.near.resize(near);  // never shrinks
                chunk.faced.reserve(faced);
                chunk.may.reserve(may);
                chunk.order.reserve(order);
                chunk.face.reserve(face);
                chunk.between.make_room(between);
            }
        };
    };
    /// Samples that follow each other in their list.
    struct Patch {
        geometry::Box box;    // m, world
        double spacing = 0;   // m, the widest of their bodies
        double most_way = 0;  // m, that one of them goes in the step at most
    };
    struct Speeds {
        Vec3 sum = Vec3::Zero();  // m/s
        double top = 0;           // m^2/s^2
    };
    struct Found {
        std::uint64_t key;
        const meshless::Contact* contact;
    };
    /// A collider at the step's beginning and end.
    struct ColliderPlaces {
        Isometry before, after;        // world from own
        Isometry to_before, to_after;  // own from world
    };
    struct Reach {
        double spacing;  // m, the widest
        double radius;   // m, about a sample
        double most;     // m, the same with all ways
        double fall;     // m, that is allowed for what begins to fall
    };

    // Samples, and phyxels, a work chunk; part of no result.
    static constexpr std::size_t grain = 64, list_grain = 256, speed_grain = 4096;
    static std::uint64_t key_of(std::uint32_t body, std::size_t other, std::uint32_t vertex) {
        return static_cast<std::uint64_t>(body) << 48 | static_cast<std::uint64_t>(other) << 32 | vertex;
    }
    static std::size_t body_of(std::uint64_t key) { return key >> 48; }
    void warm_chunks(std::size_t threads);
    Chunk& take_chunk();
    KnownSeparations& take_known();
    Influence& influence_of(std::size_t k) { return influences_[samples_[k].slot]; }
    const Influence& influence_of(std::size_t k) const { return influences_[samples_[k].slot]; }
    double spacing_of(const Sample& sample) const { return spacing_[sample.body]; }
    void give_back(Chunk& chunk);
    /// Calls work(chunk, begin, end) for parts of [0, count).
    template <class Work>
    void in_chunks(const Parallel& parallel, std::size_t count, const Work& work) {
        const auto with_chunk = [&](std::size_t begin, std::size_t end) {
            Chunk& chunk = take_chunk();
            work(chunk, begin, end);
            give_back(chunk);
        };
        // By reference: a function object of its own would be allocated.
        parallel.for_chunks(count, grain, std::cref(with_chunk));
    }
    bool is_listed(const Task& task);
    void list_samples(const Task& task, const Parallel& parallel);
    void relist(const Task& task, const Parallel& parallel);
    void list_points(const Body& body, std::uint32_t number, std::size_t first, std::size_t begin,
                     std::size_t end);
    static bool pushes_for(const Body& body, std::uint32_t vertex, std::uint32_t by, bool same_pieces);
    static std::uint32_t opposite_of(const Body& body, const ContactSample& point);
    void squeeze_out();
    void renumber();
    void keep_slots();
    void drop_known(std::uint32_t slot);
    std::uint32_t take_slot();
    static Vec3 drift_of(const Task& task, const meshless::Phyxels& phyxels, std::size_t i);
    void measure_speeds(const Task& task, const Parallel& parallel);
    void measure_pieces(const Task& task, const Parallel& parallel);
    double way_of_piece(const Sample& sample) const;
    void place_sample(const Task& task, std::size_t k);
    void place_samples(const Task& task, const Parallel& parallel);
    static bool is_still_nearest(const meshless::Phyxels& phyxels, const Sample& sample,
                                 const Influence& influence);
    void find_influences(const Task& task, std::size_t k);
    void meet_colliders(const Task& task, const Parallel& parallel);
    void meet_collider(const Task& task, std::size_t number, const ColliderPlaces& places, std::size_t k,
                       Chunk& chunk);
    bool is_far(const Collider& collider, const ColliderPlaces& places, const Patch& patch) const;
    void place_exactly(const Task& task, std::span<const std::uint32_t> kept, const Parallel& parallel);
    void meet_pieces(const Task& task, const Parallel& parallel);
    bool are_separated(const Body& body, std::size_t a, std::size_t b);
    static void look(const Body& body, const Vec3& from, const Vec3& to, bool is_known,
                     KnownSeparations::Answer& answer);
    static void bring_up_to(const SurfaceChanges& changes, std::uint32_t now, KnownSeparations& known);
    bool may_meet(const Task& task, std::size_t a, std::size_t b);
    bool may_meet(const Task& task, std::size_t k, std::size_t n, Chunk& chunk);
    const SampleGrid::Faced* partner_of(const Task& task, std::size_t k, Chunk& chunk);
    double soon(std::size_t k, const Reach& reach) const;
    bool find_facing(std::size_t place, double radius, const Reach& reach, Chunk& chunk) const;
    double width_of(std::size_t k, const SampleGrid::Faced& partner, const Reach& reach) const;
    const SampleGrid::Faced* find_partner(const Task& task, std::size_t place, const Reach& reach,
                                          Chunk& chunk);
    const SampleGrid::Faced* widen(std::size_t place, const SampleGrid::Faced& partner, double near,
                                   const Reach& reach, Chunk& chunk) const;
    void find_face(const Task& task, std::size_t k, const SampleGrid::Faced& chosen, const Reach& reach,
                   Chunk& chunk);
    bool meet(const Task& task, std::size_t place, const Reach& reach, Chunk& chunk, meshless::Contact& out);
    bool push_on(const Task& task, const Vec3& foot, double total, std::size_t partner, Chunk& chunk,
                 meshless::Contact& out) const;
    bool is_answered_by_opposite(const Task& task, std::size_t k) const;
    bool asks(const Task& task, std::size_t place) const;
    Reach reach_of(const Task& task) const;
    void sort_found();
    void form_groups(std::size_t bodies, std::vector<ContactIsland>& groups);
    void group(const Task& task, const Parallel& parallel, std::vector<ContactIsland>& groups);

    std::vector<Sample> samples_, fresh_;
    std::vector<std::uint32_t> opposite_, fresh_opposite_;  // per sample: vertex, as of ContactSample
    // Per slot, which stays the same as samples come and go.
    std::vector<Influence> influences_;
    std::vector<KnownSeparations*> separations_;  // nullptr: nothing is known
    std::vector<std::uint32_t> free_slots_;
    std::deque<KnownSeparations> known_;  // grows only, and stays where it is
    std::vector<KnownSeparations*> free_known_;
    std::uint32_t serials_ = 0;  // given so far
    // Per fresh sample: its number before, or -1; -2: no sample.
    std::vector<std::int32_t> old_;
    std::vector<std::uint8_t> stays_;  // per sample before
    std::vector<Listed> listed_, now_;
    std::vector<Vec3> position_, normal_;         // m; unit, outward; world
    std::vector<std::uint16_t> owner_;            // body
    std::vector<std::uint8_t> placed_;            // 1: the position is where the carriers take it
    std::vector<Patch> patches_;                  // per `grain` samples
    std::vector<double> spacing_;                 // per body: m
    std::vector<double> way_;                     // per body: m, that a sample goes in the step at most
    std::vector<Speeds> speeds_;                  // per part of a body's phyxels
    Vec3 mean_way_ = Vec3::Zero();                // m, of all phyxels in the step
    std::vector<double> square_;                  // m^2, per phyxel of a body
    std::vector<std::vector<double>> piece_way_;  // m, see measure_pieces
    std::vector<std::span<const Vec3>> velocity_;
    std::vector<std::vector<Vec3>> drift_;  // per body and phyxel: m, see drift_of
    std::vector<SampleGrid::Way> way_of_;   // per sample that the grid keeps
    SampleGrid grid_;
    std::mutex mutex_;                            // of chunks_ and known_
    std::vector<std::unique_ptr<Chunk>> chunks_;  // contacts' part: number of the body
    std::vector<Chunk*> free_chunks_;
    std::vector<Found> order_, spare_order_;
    std::vector<std::uint32_t> first_, part_of_, place_of_;
    std::vector<std::size_t> group_of_, group_size_;
};

}  // namespace splitcubes::body
