// The user's tools: from the motion of the pointer to commands for the simulation.
#pragma once

#include "camera_control.h"
#include "commands.h"
#include "picking.h"

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace splitcubes::view {

enum class ToolKind { knife, scalpel, scissors, grab, tear, free_blade, pin, forceps };

/// Name, key and one line of help of a tool.
struct ToolInfo {
    std::string_view name, key, help;
};
inline constexpr std::size_t tool_count = 8;
const std::array<ToolInfo, tool_count>& tool_list();

/// Settings of the tools; lengths in metres.
struct ToolSettingsOfUser {
    bool knife_through = true;  // cuts everything along the view
    double knife_depth = 0.02;  // below the surface, where it does not
    double scalpel_depth = 0.01;
    double scalpel_tilt = 0;  // degrees, sideways
    double scissors_length = 0.03;
    double pull_strength = 1;     // factor on the spring of grab and tear
    double blade_length = 0.1;    // of the free blade
    double forceps_width = 0.02;  // between the open jaws
    double forceps_grip = 1;      // factor on the force up to which forceps hold
};

/// State and view that a tool works in.
struct ToolContext {
    const PublishedState& state;
    const OrbitCamera& camera;
    const ViewSize& size;
};

/// Lines over the picture.
struct OverlayLine {
    std::vector<Vec3> points;  // m, world
    bool is_active = false;    // cuts or pulls
};

/// A solid in the hand: a straight edge in its own frame, drawn with what is behind it.
struct HandInstrument {
    ToolKind kind = ToolKind::scalpel;
    Vec3 from = Vec3::Zero(), to = Vec3::UnitZ();  // m, own frame, of the edge
    Vec3 back = -Vec3::UnitX();                    // own frame, from the edge to the back
    double handle = 0;                             // m, its length
    double opening = 0;                            // m, between the jaws of forceps
    Isometry frame = Isometry::Identity();         // world from own
};

class Tools {
  public:
    ToolKind kind() const { return kind_; }
    /// Ends what is under way.
    void select(ToolKind kind, std::vector<Command>& out);
    /// Lengths that suit bodies of a size, m; where the size is about that of the last time, as after a
    /// restart, they stay what the user made them.
    void suit(double body_size);

    void press(double x, double y, const ToolContext& context, std::vector<Command>& out);
    void move(double x, double y, const ToolContext& context, std::vector<Command>& out);
    void release(const ToolContext& context, std::vector<Command>& out);
    /// Tells whether the wheel is the tool's: otherwise it zooms.
    bool wheel(double notches, const ToolContext& context, std::vector<Command>& out);
    /// Moves the free blade by a device with six axes; see ViewerInput.
    void six_axis(const std::array<double, 6>& axes, const ToolContext& context, std::vector<Command>& out);
    bool key(const std::string& name, const ToolContext& context, std::vector<Command>& out);
    /// Ends what is under way.
    void cancel(std::vector<Command>& out);
    bool is_busy() const { return busy_; }
    std::vector<OverlayLine> overlay(const ToolContext& context) const;
    /// Returns the force up to which forceps hold, N.
    double grip_limit(const PublishedState& state) const;
    /// The scalpel, the free blade or open forceps where the pointer is.
    std::optional<HandInstrument> instrument(const ToolContext& context) const;

    ToolSettingsOfUser settings;

  private:
    struct BladePose {
        Isometry frame = Isometry::Identity();
        std::optional<MaterialPoint> anchor;
    };
    std::optional<BladePose> knife_pose(const ToolContext& context);
    std::optional<BladePose> scalpel_pose(const ToolContext& context);
    BladePose free_pose(const ToolContext& context) const;
    std::optional<BladePose> blade_pose(const ToolContext& context);
    std::vector<Vec3> blade_points(const ToolContext& context) const;
    void begin_blade(const ToolContext& context, std::vector<Command>& out);
    void move_blade(const ToolContext& context, std::vector<Command>& out);
    void begin_pull(const ToolContext& context, std::vector<Command>& out);
    void move_pull(const ToolContext& context, std::vector<Command>& out);
    void toggle_pin(const ToolContext& context, std::vector<Command>& out);
    bool take_pin_off(const ToolContext& context, std::vector<Command>& out) const;
    Isometry forceps_frame(const Pick& hit, const ToolContext& context) const;
    double jaw_radius(const PublishedState& state) const;
    void begin_grip(const ToolContext& context, std::vector<Command>& out);
    bool is_pull() const;
    void snip(const ToolContext& context, std::vector<Command>& out);
    Vec3 point_at_depth(const ToolContext& context, double depth) const;

    double suited_ = 0;  // m, size of the bodies that lengths suit
    ToolKind kind_ = ToolKind::knife;
    bool busy_ = false;     // the button is down and has begun something
    bool lowered_ = false;  // a blade is in the simulation
    double x_ = 0, y_ = 0;  // pixels, of the pointer
    double depth_ = 0;      // m, along the view: of the last pick, the pull or the free blade
    bool has_depth_ = false;
    Vec3 last_point_ = Vec3::Zero(), last_normal_ = Vec3::UnitZ(), direction_ = Vec3::Zero();
    std::vector<Vec3> trail_;    // m, world, of the stroke: a knife is a point in the view
    std::optional<Pick> start_;  // of scissors
    int next_slot_ = 10;         // of pulls; blades have those below
    int slot_ = 0;
    bool pinned_ = false;
    // World from own, where the pointer was over a body last.
    std::optional<Isometry> scalpel_, forceps_;
    Vec3 angles_ = Vec3::Zero();  // rad, of the free blade: roll, pitch, yaw
    Vec3 shift_ = Vec3::Zero();   // m, of the free blade from the pointer: right, up, towards the eye
};

}  // namespace splitcubes::view
