// Blades and pulls that the user moves, in the simulation.
#pragma once

#include "commands.h"
#include "published_state.h"

#include <deque>
#include <map>
#include <optional>
#include <vector>

namespace splitcubes::view {

/// Blades by slot. A blade is lowered when its stroke begins, takes the poses of a step at even times within
/// it, and stays until the step after its end has cut what it crossed last.
class Strokes {
  public:
    void begin(const Command& command, Simulation& simulation);
    void move(const Command& command, const Simulation& simulation);
    void end(int slot);
    /// Gives the simulation the poses of the next step.
    void before_step(Simulation& simulation);
    void after_step(Simulation& simulation);
    bool empty() const { return strokes_.empty(); }
    void clear() { strokes_.clear(); }
    void append_blades(std::vector<std::vector<Vec3>>& out) const;

  private:
    struct Stroke {
        ToolId tool;
        std::vector<Vec3> points;     // own frame
        std::deque<Isometry> frames;  // still to come
        Isometry now;
        int frames_per_step = 0;  // 0: all
        bool ends = false;
        int steps_left = 2;  // after the end
    };
    std::map<int, Stroke> strokes_;
};

/// Springs by slot that pull a ball of material, or pin it.
class Pulls {
  public:
    void begin(const Command& command, BodyId body, Simulation& simulation);
    void move(int slot, const Vec3& target);
    void end(int slot, Simulation& simulation);
    void set_pinned(int slot);
    void before_step(Simulation& simulation);
    /// Keeps those that the simulation still has, and lets go of those that are not pinned.
    void after_travel(Simulation& simulation);
    bool is_idle() const;  // nothing but pins
    void clear() { pulls_.clear(); }
    bool owns(HandleId handle) const;
    void append_states(const Simulation& simulation, std::vector<PullState>& out);
    void take_forces(const StepResult& result);
    double total_force() const;

  private:
    struct Pull {
        HandleId handle;
        BodyId body;
        MaterialPoint point;
        Mat3 rotation = Mat3::Identity();  // of the material when it was taken
        Vec3 target = Vec3::Zero();        // m, world
        bool moved = false, pinned = false;
        double force = 0;  // N
        Vec3 at = Vec3::Zero();
    };
    std::map<int, Pull> pulls_;
};

}  // namespace splitcubes::view
