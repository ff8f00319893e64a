// All that a simulation holds, and how it is copied and put back.
#pragma once

#include <splitcubes/api/internal/slot_list.h>
#include <splitcubes/api/internal/surface_stream.h>
#include <splitcubes/api/settings.h>
#include <splitcubes/body/body_settings.h>
#include <splitcubes/io/read_mesh.h>
#include <splitcubes/math/sampled_motion.h>
#include <splitcubes/world/world.h>

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

namespace splitcubes::api {

/// Source of a body; all states that have the body share it.
struct BodySource {
    io::Model model;  // in its own frame
    body::BodySettings settings;
    std::shared_ptr<const geometry::AttributeTransfer> transfer;  // none: the model has no attributes
};
std::shared_ptr<const BodySource> make_source(io::Model model, body::BodySettings settings);

/// Poses as they came; the world's things read them where they are.
using Track = std::shared_ptr<SampledMotion>;

struct BodyEntry {
    std::shared_ptr<const BodySource> source;
};
struct ToolEntry {
    bool lowered = false;
    std::vector<BodyId> cutting = {};  // that it cut in the last step
};
struct HandleEntry {
    BodyId body;
    std::string name;
    Region region;
    double stiffness, limit;
    double from;  // s
    Track track;
};
struct ConstraintEntry {
    BodyId body;
    Region region;
    double from;  // s
    Track track;
};
using ShapeSource =
    std::variant<HalfSpaceShape, SphereShape, BoxShape, std::shared_ptr<const geometry::TriangleMesh>>;
struct ColliderEntry {
    std::string name;
    double friction;
    ShapeSource shape;
    std::shared_ptr<const geometry::SignedDistance> solid;
    Track track;
};
/// Makes the signed distance of a shape; throws InputError.
std::shared_ptr<const geometry::SignedDistance> make_solid(const ShapeSource& shape, const std::string& where,
                                                           const Parallel& parallel);

/// All things of a simulation, by their ids and in the order of the world.
struct Things {
    SlotList<BodyTag, BodyEntry> bodies{"body"};
    SlotList<ToolTag, ToolEntry> tools{"tool"};
    SlotList<HandleTag, HandleEntry> handles{"handle"};
    SlotList<ConstraintTag, ConstraintEntry> constraints{"constraint"};
    SlotList<ColliderTag, ColliderEntry> colliders{"collider"};

    /// With tracks of its own.
    Things copy() const;
    void continue_after(const Things& other);
    /// Returns the index of a handle or constraint among those of its body.
    template <class List, class Name>
    static std::size_t index_in_body(const List& list, Name id) {
        std::size_t index = 0;
        const std::size_t position = list.position(id);
        for (std::size_t k = 0; k < position; ++k) index += list.at(k).body == list.at(position).body;
        return index;
    }
};

/// A state that a session can go back to. Moves of its world are in `state` as a checkpoint's; all else is
/// here.
struct Snapshot {
    body::WorldSettings settings;
    Things things;
    std::vector<body::Tool> tools;  // with their paths
    std::int32_t next_cut_number = 0;
    std::string state;
};

/// A world, and what names its things. Calls throw InputError and Error; those that add have changed nothing
/// then.
class Session {
  public:
    Session(const body::WorldSettings& settings, std::shared_ptr<const Parallel> parallel);
    /// As it was; throws DamagedState for a state that is none of its things.
    Session(const Snapshot& snapshot, std::shared_ptr<const Parallel> parallel);

    body::World& world() { return *world_; }
    const body::World& world() const { return *world_; }
    Things& things() { return things_; }
    const Things& things() const { return things_; }
    const Parallel& parallel() const { return *parallel_; }
    const std::shared_ptr<const Parallel>& shared_parallel() const { return parallel_; }
    body::Body& body(BodyId id) { return *world_->bodies()[things_.bodies.position(id)]; }
    const body::Body& body(BodyId id) const { return *world_->bodies()[things_.bodies.position(id)]; }
    SurfaceStream& stream(std::size_t position) { return *streams_[position]; }
    const SurfaceStream& stream(std::size_t position) const { return *streams_[position]; }
    Snapshot snapshot() const;

    BodyId add_body(BodyEntry entry);
    void remove_body(BodyId id);
    HandleId add_handle(HandleEntry entry);
    void remove_handle(HandleId id);
    ConstraintId add_constraint(ConstraintEntry entry);
    void remove_constraint(ConstraintId id);
    ColliderId add_collider(ColliderEntry entry);
    void remove_collider(ColliderId id);
    /// Throws where no cut number is left.
    void require_cut_number() const;
    /// Takes a change of one body's topology into its surface.
    void update_surface(std::size_t position);
    /// Takes a step into all surfaces.
    void update_surfaces();
    /// Drops the poses that no further step reads.
    void forget_past_poses();

  private:
    void make_body(const BodyEntry& entry);
    void make_handle(const HandleEntry& entry);
    void make_constraint(const ConstraintEntry& entry);
    void make_collider(const ColliderEntry& entry);
    void require_sample(BodyId body, const std::function<bool(const Vec3&)>& region,
                        const std::string& where);

    std::shared_ptr<const Parallel> parallel_;
    std::unique_ptr<body::World> world_;
    Things things_;
    std::vector<std::unique_ptr<SurfaceStream>> streams_;  // per body
};

}  // namespace splitcubes::api
