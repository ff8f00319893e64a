// Events and forces of a step, by ids, kept until the next one.
#pragma once

#include <splitcubes/api/internal/session.h>
#include <splitcubes/api/step_result.h>

#include <vector>

namespace splitcubes::api {

/// Compares what each body had before a step with what it has after it.
class StepEvents {
  public:
    void begin(const Session& session);
    /// The result's spans are of this.
    StepResult end(Session& session, const body::StepReport& report);

  private:
    struct Before {
        std::size_t crossings;
        std::vector<std::int32_t> rigid;  // pieces, in order
    };
    void list_cuts(Session& session, std::size_t body);
    void list_pieces(const Session& session, std::size_t body);
    void list_forces(const Session& session, const body::StepReport& report);

    std::vector<Before> before_;                // per body
    std::vector<std::vector<BodyId>> cutting_;  // per tool: bodies that it cuts in this step
    std::vector<StageTime> stages_;
    std::vector<ToolResult> tools_;
    std::vector<HandleResult> handles_;
    std::vector<CutBegan> cuts_began_;
    std::vector<PieceSeparated> pieces_separated_;
    std::vector<Torn> torn_;
    std::vector<FragmentMadeRigid> made_rigid_;
};

}  // namespace splitcubes::api
