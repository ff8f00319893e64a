// Blades and pulls that the user moves, in the simulation.
#pragma once

#include "commands.h"
#include "published_state.h"
#include "stroke_log.h"

#include <deque>
#include <map>
#include <optional>
#include <vector>

namespace splitcubes::view {

/// Blades by slot. A blade is lowered when its stroke begins, takes the poses of a step at even times within
/// it, and stays until the step after its end has cut what it crossed last.
class Strokes {
  public:
    void begin(const Command& command, Simulation& simulation, StrokeLog& log);
    void move(const Command& command, const Simulation& simulation);
    void end(int slot);
    /// Gives the simulation the poses of the next step.
    void before_step(Simulation& simulation, StrokeLog& log);
    void after_step(Simulation& simulation, StrokeLog& log);
    /// Forces of the last step on blades.
    void take_forces(const StepResult& result);
    void append_forces(std::vector<ForceState>& out) const;
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
        std::size_t logged = 0;
        std::size_t body = 0;       // that was touched last
        std::int32_t piece = -1;    // of it; negative: all
        Vec3 force = Vec3::Zero();  // N
    };
    std::map<int, Stroke> strokes_;
};

/// Springs by slot that pull a ball of material, or pin it. Jaws of forceps are pairs of them: each pulls a
/// ball beside the anchor, with a force of its own limit, and they close on what lies between; what is done
/// to one is done to both.
class Pulls {
  public:
    void begin(const Command& command, BodyId body, Simulation& simulation, StrokeLog& log);
    void move(int slot, const Vec3& target);
    void end(int slot, Simulation& simulation, StrokeLog& log);
    void set_pinned(int slot);
    void before_step(Simulation& simulation, StrokeLog& log);
    /// Lets go of what has slipped out of forceps, and returns whether it did.
    bool slips(Simulation& simulation, StrokeLog& log);
    /// Keeps those that the simulation still has, and lets go of those that are not pinned.
    void after_travel(Simulation& simulation, StrokeLog& log);
    /// Becomes what was left after a travel, of pulls that it has itself.
    void become(const Pulls& left);
    bool is_idle() const;  // nothing but pins
    void clear() { pulls_.clear(); }
    bool owns(HandleId handle) const;
    void append_states(const Simulation& simulation, std::vector<PullState>& out);
    void take_forces(const StepResult& result);
    double total_force() const;
    void append_forces(std::vector<ForceState>& out) const;

  private:
    struct Jaw {
        int partner = 0;                        // slot; 0: it is none
        double limit = 0;                       // N
        double reach = 0;                       // m, from material to target, beyond which it slips
        Vec3 offset = Vec3::Zero();             // m, rest space, of its region from the anchor
        Vec3 closing = Vec3::Zero();            // m, world, when it has closed
        double closed = 1;                      // share of that
        Isometry frame = Isometry::Identity();  // of the forceps when they were set
    };
    struct Pull {
        HandleId handle;
        BodyId body;
        MaterialPoint point;
        Mat3 rotation = Mat3::Identity();  // of the material when it was taken
        Vec3 target = Vec3::Zero();        // m, world
        bool moved = false, pinned = false;
        Vec3 force = Vec3::Zero();  // N, on the body
        Vec3 at = Vec3::Zero();
        std::size_t logged = 0;
        Jaw jaw;

        Isometry pose() const;  // world from rest
        double opening(double closed) const;
    };
    void let_go(int slot, Simulation& simulation, StrokeLog& log);
    Pull* partner_of(const Pull& pull);
    std::map<int, Pull> pulls_;
};

}  // namespace splitcubes::view
