// The simulation of a session: carries out commands, steps, and publishes states. One thread at a time.
#pragma once

#include "commands.h"
#include "parameters.h"
#include "published_state.h"
#include "sample_field.h"
#include "scene_source.h"
#include "session_curve.h"
#include "stroke_log.h"
#include "strokes.h"

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace splitcubes::view {

class BodyLooks;
class SceneDriver;

/// Settings of an engine.
struct EngineSettings {
    int threads = 0;                                          // 0: all
    std::uint64_t undo_bytes = std::uint64_t{256} << 20;      // of states for undo
    std::uint64_t timeline_bytes = std::uint64_t{256} << 20;  // of states to go on from
    double keep_every = 0.5;                                  // s, between those
};

class Engine {
  public:
    /// script: commands that are carried out at their steps. Throws InputError and Error.
    explicit Engine(SceneSource source, const EngineSettings& settings = {}, const Recording& script = {});
    ~Engine();

    /// Carries out a command of the simulation. A failure becomes the notice of the next state.
    void apply(const Command& command);
    void step();
    /// Makes a state of what is now. Fields that only the loop knows are left at their defaults.
    std::shared_ptr<PublishedState> publish();

    double time() const;
    double step_length() const;
    std::int64_t step_count() const { return step_; }
    std::uint64_t state_hash() const;
    std::size_t pieces() const;
    const SceneSource& source() const { return *source_; }
    Recording recording() const;
    /// Tells the user one line.
    void notify(const std::string& notice);
    /// Makes the state of an earlier step by repeating what was done since one that is kept; the present is
    /// as before. Null where that step is not in the past, an undo came between, or is_wanted() became false.
    std::shared_ptr<PublishedState> look_back(std::int64_t step, const std::function<bool()>& is_wanted);
    /// Steps to go on from, ascending.
    std::vector<std::int64_t> kept_steps() const;
    /// The strokes and pulls that were not undone.
    const StrokeLog& log() const { return log_; }

  private:
    /// Numbers of edges that were cut, and when: those below `first` until `second`, s.
    using EdgeTimes = std::vector<std::pair<std::int32_t, double>>;
    struct Kept {
        std::int64_t step;
        KeptState state;
        Pulls pulls;
        std::shared_ptr<const SceneDriver> driver;  // null: there is none
        std::size_t commands;                       // that were carried out until then
        std::int64_t number;                        // of steps and travels until then
        std::vector<EdgeTimes> edge_times;          // a body
    };
    /// A command before which undo goes back, and the step at which it came.
    struct Mark {
        std::size_t command;  // its number among those recorded
        std::int64_t step;
    };
    /// An undo or redo: it led to an earlier state.
    struct Travel {
        std::size_t command;
        Mark to;
        bool is_undo;
        Pulls pulls;  // that were left
    };
    /// A state to redo.
    struct Undone {
        std::shared_ptr<const SceneDriver> driver;
        Mark undo;                          // before which it was
        Mark mark;                          // to which that went back
        std::vector<EdgeTimes> edge_times;  // a body
    };
    /// A part of the way to a state: from a kept state, or from where a travel led.
    struct Leg {
        const Kept* kept;
        const Travel* travel;           // null: from `kept`
        std::size_t command, commands;  // the first one to carry out, and the one behind the last
        std::int64_t step;              // its end
    };
    struct Present;
    struct BodyRecord {
        std::shared_ptr<const SurfaceTopology> topology;
        std::deque<SurfaceChange> changes;
        SampleField field;
        std::shared_ptr<const std::vector<Vec3>> palette;
        std::shared_ptr<BodyLooks> looks;
        EdgeTimes edge_times;
        std::size_t triangles = 0;  // that are not free
    };

    void start();
    void carry_out(const Command& command);
    void mark_undo_point();
    void begin_stroke(const Command& command);
    void begin_pull(const Command& command);
    void set_parameter(std::size_t index, double value);
    void apply_preset(const std::string& name);
    void change_materials(const std::function<void(MaterialSettings&)>& change);
    void change_strength(double strength);
    void change_steps(std::size_t index, double value);
    void save(const Command& command);
    void save_surfaces(const std::string& file) const;
    scene::SceneDescription scene_with_strokes() const;
    bool travel(bool back);
    void note_travel(bool back, std::shared_ptr<const SceneDriver> left);
    void forget_gestures();
    void remove_unowned();
    void resume_at(std::int64_t step);
    void run_script();
    void keep_state(bool at_once);
    std::vector<EdgeTimes> edge_times() const;
    void set_edge_times(const std::vector<EdgeTimes>& times);
    void note_births();
    void become(const Kept& kept);
    std::size_t commands_until(std::int64_t step) const;
    std::vector<Leg> way_to(std::int64_t step) const;
    void repeat_travel(const Travel& travel);
    bool go(const std::vector<Leg>& way, const std::function<bool()>& is_wanted);
    void save_pieces(const std::string& folder) const;
    double parameter_value(std::size_t index) const;
    BodySettings started_settings(const BodySettings& settings) const;
    void start_from_checkpoint();
    void start_from_source();
    std::shared_ptr<const SurfaceTopology> take_topology(BodyRecord& record, const SurfaceView& surface);
    void find_births(BodyRecord& record, const SurfaceView& surface, bool all, SurfaceTopology& out) const;
    BodyState body_state(std::size_t index);
    void add_samples(std::size_t index, const SurfaceView& surface, BodyState& out);
    void count_step();

    std::unique_ptr<const SceneSource> source_;
    EngineSettings settings_;
    std::unique_ptr<Simulation> simulation_;
    std::vector<BodyId> bodies_;
    std::unique_ptr<SceneDriver> driver_;
    Strokes strokes_;
    Pulls pulls_;
    StrokeLog log_;
    SessionCurve curve_;
    std::vector<ForceState> scene_forces_;
    std::map<std::size_t, double> changed_;  // parameters that differ from the source's
    std::map<std::string, double> initial_;  // those at the start
    std::deque<RecordedCommand> script_;
    Recording played_;  // that the script is of
    std::vector<BodyRecord> records_;
    StepStatistics statistics_;
    std::int64_t step_ = 0;
    double spacing_ = 0;  // m, of the first body's phyxels
    std::vector<RecordedCommand> recorded_;
    struct Past {
        std::deque<Kept> kept;
        std::int64_t count = 0;      // of undos and redos
        std::vector<Mark> marks;     // the next one last
        std::vector<Undone> undone;  // the next one last
        std::vector<Travel> travels;
        bool is_shown = false;  // for a moment
    };
    Past past_;
    Field field_ = Field::none;
    unsigned details_ = 0;  // Detail bits
    std::string notice_;
    std::uint64_t notices_ = 0, published_ = 0;
};

}  // namespace splitcubes::view
