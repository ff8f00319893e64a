// Runs the course of a scene in its world.
#pragma once

#include <splitcubes/scene/course.h>

#include <memory>
#include <utility>
#include <vector>

namespace splitcubes::body {
class World;
}

namespace splitcubes::scene {

/// Drives a world, which build_world made from the scene, by the scene's course: poses of tools, motions of
/// colliders, constraints and handles, and when they act. The scene must outlive it.
class WorldCourse {
  public:
    /// world: before its first step. Throws InputError for a region that holds no phyxel.
    WorldCourse(const SceneDescription& scene, body::World& world);

    /// To be called before each step of the world.
    void advance(body::World& world);
    /// Motions are left to recorded tracks (follow_tracks): only starts and ends are decided.
    void leave_motions() { moves_ = false; }
    const Course& course() const { return *course_; }

    void save(StateWriter& writer) const { course_->save(writer); }
    /// world: as it was when the course was saved. Throws DamagedState.
    void load(StateReader& reader, body::World& world);

  private:
    std::vector<BodySamples> samples_of(const body::World& world);
    void take_motions(body::World& world);
    void move_tools(body::World& world, double from, double to) const;
    void set_activity(body::World& world) const;

    const SceneDescription& scene_;
    std::vector<std::vector<Vec3>> at_start_;  // m, world at time 0, of the phyxels of each body
    std::shared_ptr<Course> course_;           // shared with the motions that the world evaluates
    // Of constraints and handles: numbers of their bodies, and theirs there.
    std::vector<std::pair<std::size_t, std::size_t>> constraints_, handles_;
    bool moves_ = true;
};

}  // namespace splitcubes::scene
