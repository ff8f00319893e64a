// The files of a run: surfaces, metrics, summary, the resolved scene.
#pragma once

#include "attributed_surfaces.h"
#include "flag_counts.h"
#include "output_folder.h"
#include "report.h"

#include <splitcubes/scene/description.h>
#include <splitcubes/world/world.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace splitcubes::scene {
class Course;
}

namespace splitcubes::app {

class RunOutput {
  public:
    struct Seconds {
        double setup = 0, simulate = 0, write = 0;
        std::array<double, body::stage_count> stages{};
    };

    /// State of an interrupted run.
    struct Past {
        int frame = -1;       // the last finished one; -1: there is no earlier run
        std::string metrics;  // table up to that frame
    };

    /// Returns whether a file is left over from an earlier run and useless for a new one. past: the last
    /// frame to keep, -1 for none.
    static bool is_stale(const std::string& name, int past);

    /// Writes scene.json into the folder, which has been cleared. models: per body, from build_world; their
    /// attributes are written with the surfaces. course: of the scene; must outlive it.
    RunOutput(OutputFolder& folder, const scene::SceneDescription& description, const body::World& world,
              const scene::Course& course, const std::vector<io::Model>& models, const Past& past);
    ~RunOutput();

    /// Frame 0 is the state before the first step. Surfaces are written every nth frame, a row of metrics for
    /// each frame.
    void write_frame(const body::World& world, const body::StepReport& report, int frame);
    /// Writes metrics.csv and summary.json.
    void finish(const body::World& world, int frames, bool interrupted);

    Seconds& seconds() { return seconds_; }
    /// Returns the table so far.
    const std::string& metrics() const { return metrics_; }
    /// Sets the summary's list of tools that cut nothing and why (note_idle_tools).
    void set_idle_tools(Json list) { idle_tools_ = std::move(list); }
    /// Counts all steps of the run, including those before a resume.
    const FlagCounts& flags() const { return flags_; }

  private:
    void add_metrics(const body::StepReport& report, int frame);
    /// Writes metrics.csv, and scene_as_run.json where the scene's course depends on the state.
    void write_tables(int frame) const;
    Json body_report(const body::Body& body) const;

    OutputFolder& folder_;
    const scene::SceneDescription& description_;
    const scene::Course& course_;
    std::string metrics_;
    Seconds seconds_;
    FlagCounts flags_;
    Json idle_tools_ = Json::array();
    AttributedSurfaces surfaces_;
    struct Pictures;
    std::unique_ptr<Pictures> pictures_;
};

}  // namespace splitcubes::app
