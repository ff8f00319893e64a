// The files of a run: surfaces, metrics, summary, the resolved scene.
#pragma once

#include "carried_surfaces.h"
#include "flag_counts.h"
#include "output_folder.h"
#include "report.h"

#include <splitcubes/body/world.h>
#include <splitcubes/scene/description.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::app {

class RunOutput {
  public:
    struct Seconds {
        double setup = 0, simulate = 0, write = 0;
        std::array<double, body::stage_count> stages{};
    };

    /// What an interrupted run had come to.
    struct Past {
        int frame = -1;       // the last that it finished; -1: there is no past
        std::string metrics;  // table up to it
    };

    /// Is it a file of an earlier run that a new one has no use for? past: the last frame that stays, -1 for
    /// none.
    static bool is_stale(const std::string& name, int past);

    /// Writes scene.json into the folder, which has been cleared. models: per body, what build_world reports;
    /// their attributes go with the surfaces.
    RunOutput(OutputFolder& folder, const scene::SceneDescription& description, const body::World& world,
              const std::vector<io::Model>& models, const Past& past);
    ~RunOutput();

    /// Frame 0 is the state before the first step. Surfaces are written every
    /// nth frame, a row of metrics for each.
    void write_frame(const body::World& world, const body::StepReport& report, int frame);
    /// Writes metrics.csv and summary.json.
    void finish(const body::World& world, int frames, bool interrupted);

    Seconds& seconds() { return seconds_; }
    /// The table so far.
    const std::string& metrics() const { return metrics_; }
    /// For the summary: the tools that cut nothing, and why (note_idle_tools).
    void set_idle_tools(Json list) { idle_tools_ = std::move(list); }
    /// Of all steps of the run, those before it was resumed included.
    const FlagCounts& flags() const { return flags_; }

  private:
    void add_metrics(const body::StepReport& report, int frame);
    void write_metrics() const;
    Json body_report(const body::Body& body) const;

    OutputFolder& folder_;
    const scene::SceneDescription& description_;
    std::string metrics_;
    Seconds seconds_;
    FlagCounts flags_;
    Json idle_tools_ = Json::array();
    CarriedSurfaces surfaces_;
    struct Pictures;
    std::unique_ptr<Pictures> pictures_;
};

}  // namespace splitcubes::app
