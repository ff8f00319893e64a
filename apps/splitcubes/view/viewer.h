// The viewer without its window: takes events, has a camera, tools and settings of the display, and says what
// the simulation and the window are to do.
#pragma once

#include "camera_control.h"
#include "input.h"
#include "tools.h"

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace splitcubes::view {

/// Quantity that colours a surface.
enum class Colouring { material, piece, von_mises_stress, principal_stress, principal_strain, cut, age };
inline constexpr std::array<std::string_view, 7> colouring_names = {
    "Material", "Piece", "Von Mises stress", "Principal stress", "Principal strain", "Cut", "Age of the cut"};

/// Settings of the display; kept from session to session.
struct Display {
    Colouring colouring = Colouring::material;
    bool wireframe = false;
    bool phyxels = false;
    bool links = false;        // between phyxels, by visibility
    bool contacts = false;     // points that push, with their forces
    bool forces = true;        // of tools and pulls, as arrows with numbers
    bool gallery = false;      // in place of the scene
    bool clips = false;        // hides what is in front of a plane
    int clip_axis = 0;         // its normal: 0 to 2: x, y, z
    double clip_offset = 0.5;  // share of the bodies' extent along it
    bool shadows = true;       // and ambient occlusion
    bool panels = true;
    bool help = false;
    double range = 0;  // of the colours; 0: by what is shown
};

/// Something for the window or its owner to do.
enum class WindowAct { none, quit, save_picture, save_film, record_film };

class Viewer {
  public:
    Viewer();
    /// Takes an event. Commands are appended to commands().
    void take(const ViewerInput& input);
    /// Shows a state; the first one of a scene places camera and tools.
    void show(State state);
    /// The state that is shown; null before the first one.
    const State& state() const { return state_; }
    /// Commands since the last call.
    std::vector<Command> take_commands();
    /// The next thing that the window is to do, and its file; `none` after the last.
    std::pair<WindowAct, std::string> take_act();
    /// Shows a line to the user, beside those of the simulation.
    void notify(const std::string& text);
    const std::string& notice() const { return notice_; }
    std::uint64_t notices() const { return notices_; }
    /// Position of the pointer, pixels.
    std::pair<double, double> pointer() const { return {x_, y_}; }
    /// The file that is being opened; empty: none.
    const std::string& opening() const { return opening_; }
    /// Tells whether the state is a frame of a run that is played back.
    bool shows_run() const { return state_ && state_->run_frames > 0; }
    bool is_button_down() const { return drag_ != Drag::none; }
    /// Step of the timeline to show in place of the newest state.
    std::optional<std::int64_t> scrubbed() const { return scrubbed_; }
    /// The field that the display needs.
    Field field() const;
    ToolContext context() const;
    geometry::Box bounds() const;
    bool is_playing() const { return playing_; }
    /// Scenes do not place the camera from then on.
    void set_camera(const OrbitCamera& camera) {
        camera_ = camera;
        keeps_camera_ = true;
    }
    /// The value of a setting by the name that `set` events have. Throws InputError for an unknown one.
    double setting(const std::string& name) const;
    /// Names of all settings that are kept between sessions.
    static std::vector<std::string> kept_settings();

    const OrbitCamera& camera() const { return camera_; }
    const ViewSize& size() const { return size_; }
    const Tools& tools() const { return tools_; }
    const Display& display() const { return display_; }

  private:
    struct Slot;
    void press(const ViewerInput& input);
    void six_axis(const ViewerInput& input);
    void move(const ViewerInput& input);
    void wheel(const ViewerInput& input);
    void key(const ViewerInput& input);
    void act(const std::string& name, const std::string& text);
    void set(const std::string& name, double value);
    bool set_own(const std::string& name, double value);
    bool select_by_key(const std::string& name);
    void send(CommandKind kind, double value = 0, const std::string& name = {});
    void update_field();
    void place_camera();
    static const std::vector<Slot>& slots();

    OrbitCamera camera_;
    ViewSize size_;
    Tools tools_;
    Display display_;
    State state_;
    std::vector<Command> commands_;
    std::deque<std::pair<WindowAct, std::string>> acts_;
    std::string notice_;
    std::uint64_t notices_ = 0;
    std::string opening_;
    std::pair<std::uint64_t, std::uint64_t> before_opening_;  // scene and notices
    std::optional<std::int64_t> scrubbed_;
    enum class Drag { none, tool, orbit, pan } drag_ = Drag::none;
    double x_ = 0, y_ = 0;
    bool playing_ = false, keeps_camera_ = false;
    std::string title_;  // of the scene that the camera was placed for
    double speed_ = 1;
    std::uint64_t scene_ = 0;
};

}  // namespace splitcubes::view
