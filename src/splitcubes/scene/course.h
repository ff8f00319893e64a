// What a scene's things do as it runs: when those start and end that wait for something, and how those move
// that go along with others.
#pragma once

#include <splitcubes/cutting/blade.h>
#include <splitcubes/scene/description.h>
#include <splitcubes/scene/material_frame.h>

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace splitcubes {
class StateReader;
class StateWriter;
}  // namespace splitcubes

namespace splitcubes::scene {

/// The part of a scene's motions that depends on the state of its bodies. Before each step advance() notes
/// what has begun and ended, and where the material that carries things will be at the end of the step; all
/// motions are functions of time up to there. Things that nothing decides move as the scene says.
///
/// A copy is independent. After the simulation has gone back in time, advance() forgets what is later.
class Course {
  public:
    using Bodies = std::span<const BodySamples>;

    /// scene: must outlive it, and stay the same. at_start: its bodies at time 0; empty: none of its things
    /// follows the material. Throws InputError for a region that holds no sample.
    Course(const SceneDescription& scene, Bodies at_start);

    /// Whether anything depends on the state; else advance() does nothing.
    bool depends_on_state() const;
    /// Whether advance() reads samples; else it reads the numbers of pieces alone.
    bool reads_samples() const;
    /// Whether a thing is moved, or started and ended, by the state.
    bool decides_tool(std::size_t index) const;
    bool decides_collider(std::size_t index) const;
    bool decides_constraint(std::size_t index) const;
    bool decides_handle(std::size_t index) const;

    /// Before the step of `time_step`, s, that begins at a time, s.
    void advance(double time, double time_step, Bodies bodies);
    /// Drops what no time from this one on depends on.
    void forget_before(double time);
    /// The simulation has gone back to a time, s: drops what came after it and measures where the material
    /// is.
    void go_back(double time, double time_step, Bodies bodies);

    // Motions; time: s, up to the end of the step that was announced last.

    /// World from the tool's own frame.
    Isometry tool_frame(std::size_t index, double time) const;
    /// World from the collider's own frame, and from where it is at time 0.
    Isometry collider_frame(std::size_t index, double time) const;
    Isometry collider_displacement(std::size_t index, double time) const;
    /// World from rest.
    Isometry constraint_motion(std::size_t index, double time) const;
    Isometry handle_motion(std::size_t index, double time) const;

    /// When a thing acts, s: from the first time to the second one. Not yet started: both are `never`. An
    /// end to come is not in it.
    using Interval = std::pair<double, double>;
    static constexpr double never = 1e300;
    Interval tool_activity(std::size_t index) const;
    Interval constraint_activity(std::size_t index) const;
    Interval handle_activity(std::size_t index) const;
    /// When a tool is drawn, s.
    Interval tool_shown(std::size_t index) const;
    /// Returns the times after `from` and until `to`, s, at which a tool's pose must be sampled for straight
    /// lines between them to follow its own motion; `to` is the last.
    std::vector<double> tool_times(std::size_t index, double from, double to) const;

    /// For checkpoints. load() throws DamagedState.
    void save(StateWriter& writer) const;
    void load(StateReader& reader);

  private:
    struct Plan;
    struct Link;
    struct Clock {
        std::optional<double> started, ended;  // s
    };
    /// Frames that a thing that starts in the middle of a run takes over.
    struct Hold {
        Clock clock;
        std::optional<Isometry> grip;                     // world from rest of its region when it started
        std::optional<std::pair<double, Isometry>> base;  // s, and its carrier's frame when it began to act
    };

    void forget_after(double time);
    void start_and_end(double time, Bodies bodies);
    void follow_material(double time, double time_step, Bodies bodies);
    void take_over(double time, Bodies bodies);
    bool holds_now(const Condition& when, double time, Bodies bodies) const;
    bool has_ended(std::size_t tool, double time) const;
    Isometry carried(const Link& link, double time) const;
    Isometry carried_on(const Hold& hold, const std::optional<Link>& carrier, double from_time,
                        const Isometry& own, double time) const;
    void note_base(Hold& hold, const std::optional<Link>& carrier, double begin, double time) const;

    std::shared_ptr<const Plan> plan_;
    std::vector<Clock> tools_, colliders_;
    std::vector<Hold> constraints_, handles_;
    std::vector<SampledMotion> material_;  // world from rest; by the plan's frames
};

}  // namespace splitcubes::scene
