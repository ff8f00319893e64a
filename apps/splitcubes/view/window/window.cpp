#include "window.h"

#include "drawing_threads.h"
#include "gallery_panel.h"
#include "interface_style.h"
#include "panels.h"
#include "space_mouse.h"

#include <splitcubes/core/error.h>
#include <splitcubes/core/input_errors.h>
#include <splitcubes/render/image.h>
#include <splitcubes/view/draw/film_maker.h>
#include <splitcubes/view/kept_settings.h>
#include <splitcubes/view/simulation_loop.h>
#include <splitcubes/view/step_history.h>

#include <epoxy/gl.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <functional>
#include <iostream>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

namespace splitcubes::view {

namespace {

constexpr std::size_t timeline_bytes = std::size_t{256} << 20;
constexpr double idle_wait = 0.05;  // s, for events while nothing moves
constexpr int idle_frames = 4;      // that are drawn after the last change
// s, from frame to frame: at least so much, and where simulated time lags behind.
constexpr double shortest_frame = 1.0 / 60, shortest_lagging_frame = 1.0 / 22;
constexpr double lagging = 0.98;  // of the speed that is wished for

std::string glfw_problem() {
    if (std::getenv("DISPLAY") == nullptr) return "DISPLAY is not set";
    const char* text = nullptr;
    glfwGetError(&text);
    return text != nullptr ? printable(text, 200) : "unknown reason";
}

/// GLFW and its window, with a context of OpenGL.
class GlfwWindow : public gl::Context {
  public:
    GlfwWindow(int width, int height) {
        if (glfwInit() != GLFW_TRUE)
            throw JobError("no window: there is no display (" + glfw_problem() +
                           "); start it in a desktop session, or use --replay-input without one");
        glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
        glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
        glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
        glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
        glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
        window_ = glfwCreateWindow(width, height, "Splitcubes", nullptr, nullptr);
        if (window_ == nullptr) {
            const std::string problem = glfw_problem();
            glfwTerminate();
            throw JobError("no window: OpenGL 3.3 cannot start (" + problem +
                           "); install the display's driver");
        }
        make_current();
        glfwSwapInterval(1);
    }
    ~GlfwWindow() override {
        glfwDestroyWindow(window_);
        glfwTerminate();
    }
    GlfwWindow(const GlfwWindow&) = delete;
    GlfwWindow& operator=(const GlfwWindow&) = delete;
    void make_current() const override { glfwMakeContextCurrent(window_); }
    GLFWwindow* get() const { return window_; }
    float scale() const {
        float x = 1, y = 1;
        glfwGetWindowContentScale(window_, &x, &y);
        return x > 0 ? x : 1;
    }

  private:
    GLFWwindow* window_ = nullptr;
};

/// ImGui in a window.
struct Interface {
    explicit Interface(const GlfwWindow& window) {
        IMGUI_CHECKVERSION();
        ImGui::CreateContext();
        set_interface_style(window.scale());
        ImGui_ImplGlfw_InitForOpenGL(window.get(), true);
        ImGui_ImplOpenGL3_Init("#version 330 core");
    }
    ~Interface() {
        ImGui_ImplOpenGL3_Shutdown();
        ImGui_ImplGlfw_Shutdown();
        ImGui::DestroyContext();
    }
    Interface(const Interface&) = delete;
    Interface& operator=(const Interface&) = delete;
};

/// A button over a panel.
struct PanelClick {
    double x, y;  // pixels
    int button;
    bool is_down;
};

/// Events as they come, each with its own time: ImGui would keep the last position of a frame only.
struct EventQueue {
    std::vector<ViewerInput> events;
    std::function<bool(double, double)> is_covered;  // by a panel
    std::deque<PanelClick> clicks;
    bool clicks_panel = false;  // the last press was over a panel
    double x = 0, y = 0;
    unsigned modifiers = 0;

    static EventQueue& of(GLFWwindow* window) {
        return *static_cast<EventQueue*>(glfwGetWindowUserPointer(window));
    }
    void add(InputKind kind, const std::string& name = {}, double value = 0, Button button = Button::left) {
        events.push_back({.kind = kind,
                          .time = glfwGetTime(),
                          .x = x,
                          .y = y,
                          .button = button,
                          .modifiers = modifiers,
                          .name = name,
                          .value = value});
    }
};

unsigned modifiers_of(int mods) {
    return ((mods & GLFW_MOD_SHIFT) != 0 ? shift_key : 0U) |
           ((mods & GLFW_MOD_CONTROL) != 0 ? control_key : 0U) | ((mods & GLFW_MOD_ALT) != 0 ? alt_key : 0U);
}

std::string key_name(int key, int scancode) {
    switch (key) {
        case GLFW_KEY_SPACE:
            return "space";
        case GLFW_KEY_TAB:
            return "tab";
        case GLFW_KEY_ESCAPE:
            return "escape";
        case GLFW_KEY_F1:
            return "f1";
        case GLFW_KEY_F11:
            return "f11";
        case GLFW_KEY_F12:
            return "f12";
        case GLFW_KEY_EQUAL:
        case GLFW_KEY_KP_ADD:
            return "+";
        case GLFW_KEY_KP_SUBTRACT:
            return "-";
        default:
            break;
    }
    const char* name = glfwGetKeyName(key, scancode);
    return name != nullptr ? name : "";
}

void on_move(GLFWwindow* window, double x, double y) {
    EventQueue& queue = EventQueue::of(window);
    queue.x = x;
    queue.y = y;
    queue.add(InputKind::move);
}

// A button that is let go is let go everywhere: the pointer may have come over a panel meanwhile.
void on_button(GLFWwindow* window, int button, int action, int mods) {
    EventQueue& queue = EventQueue::of(window);
    queue.modifiers = modifiers_of(mods);
    if (button > GLFW_MOUSE_BUTTON_MIDDLE) return;
    if (action == GLFW_PRESS) queue.clicks_panel = queue.is_covered(queue.x, queue.y);
    if (queue.clicks_panel) queue.clicks.push_back({queue.x, queue.y, button, action == GLFW_PRESS});
    if (queue.clicks_panel && action == GLFW_PRESS) return;
    const Button which = button == GLFW_MOUSE_BUTTON_RIGHT    ? Button::right
                         : button == GLFW_MOUSE_BUTTON_MIDDLE ? Button::middle
                                                              : Button::left;
    queue.add(action == GLFW_PRESS ? InputKind::press : InputKind::release, {}, 0, which);
}

void on_wheel(GLFWwindow* window, double, double notches) {
    EventQueue& queue = EventQueue::of(window);
    if (!queue.is_covered(queue.x, queue.y)) queue.add(InputKind::wheel, {}, notches);
}

void on_key(GLFWwindow* window, int key, int scancode, int action, int mods) {
    EventQueue& queue = EventQueue::of(window);
    queue.modifiers = modifiers_of(mods);
    if (action == GLFW_RELEASE || ImGui::GetIO().WantTextInput) return;
    const std::string name = key_name(key, scancode);
    // Keys that move something by a little repeat while they are held; others do not.
    const bool repeats =
        name.size() == 1 && std::string_view("qweasd+-.").find(name) != std::string_view::npos;
    if (!name.empty() && (action == GLFW_PRESS || repeats)) queue.add(InputKind::key, name);
}

void on_drop(GLFWwindow* window, int count, const char** files) {
    if (count < 1) return;
    EventQueue& queue = EventQueue::of(window);
    queue.add(InputKind::act, "open");
    queue.events.back().text = files[0];
}

/// Frames and simulated time since the simulation plays.
struct Pace {
    double wall = 0, simulated = 0;  // s
    int frames = 0;
    double last_wall = -1, last_time = 0;

    void count(const PublishedState& state, double now) {
        const double time = state.time - last_time;
        if (last_wall >= 0 && state.playing && time >= 0) {
            wall += now - last_wall;
            simulated += time;
            ++frames;
        }
        last_wall = state.playing ? now : -1;
        last_time = state.time;
    }
    double frames_per_second() const { return wall > 0 ? frames / wall : 0; }
    double real_time_factor() const { return wall > 0 ? simulated / wall : 0; }
};

/// One session of the window.
class Session {
  public:
    explicit Session(const WindowSettings& settings);
    ~Session();
    int run();

  private:
    void listen();
    void take_events();
    void take(const ViewerInput& input);
    void send_commands(double time);
    void show_state();
    void require_opened(const PublishedState& newest) const;
    void draw();
    void draw_panels();
    void wait_for_next_frame(double begin);
    void carry_out_acts();
    std::pair<int, int> framebuffer_size() const;
    void save_picture(const std::string& file);
    void save_film(const std::string& file);
    void record_film(const std::string& file);
    Quality film_quality() const {
        return moving_.quality() == Quality::fine ? Quality::fine : Quality::quick;
    }
    void go_on_with_film();
    bool is_idle() const;
    void count_frame(double begin, double drawn);

    WindowSettings settings_;
    GlfwWindow window_;
    DrawingThreads drawing_;
    EventQueue queue_;
    std::optional<Interface> interface_;
    Viewer viewer_;
    SimulationThread simulation_;
    StateRenderer renderer_;
    Panels panels_;
    GalleryPanel gallery_;
    FilmMaker film_;
    SpaceMouse space_mouse_;
    StepHistory history_;
    Latencies latencies_;
    std::ofstream record_;
    int frame_ = 0, still_frames_ = 0;
    bool quits_ = false;
    double last_poll_ = 0;
    Pace pace_;
    QualityControl moving_;              // of pictures while things move
    std::optional<Quality> last_drawn_;  // of the last picture; none: the gallery
    double frame_ms_ = 0, interface_ms_ = 0, opengl_seconds_ = 0;
};

Session::Session(const WindowSettings& settings)
    : settings_(settings),
      window_(settings.width, settings.height),
      simulation_({.threads = drawing_.threads_left(settings.threads)}, timeline_bytes),
      renderer_(window_),
      gallery_(window_, true),
      film_(window_) {
    drawing_.give_way();
    listen();
    interface_.emplace(window_);
    if (!settings.record_input.empty()) {
        record_.open(settings.record_input);
        if (!record_) throw InputError(settings.record_input.string(), "cannot be written");
    }
    load_settings(settings_file(), viewer_);
    if (!settings.file.empty())
        take({.kind = InputKind::act, .name = "open", .text = settings.file.string()});
}

Session::~Session() {
    if (film_.is_making() || film_.is_recording()) std::cout << film_.stop() << '\n';
    gallery_.close();
    save_settings(settings_file(), viewer_);
}

// Before ImGui's own callbacks, which then call these.
void Session::listen() {
    queue_.is_covered = [this](double x, double y) {
        const bool is_popup =
            ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopupId | ImGuiPopupFlags_AnyPopupLevel);
        return shows_gallery(viewer_) || is_popup || panels_.covers(x, y);
    };
    glfwSetWindowUserPointer(window_.get(), &queue_);
    glfwSetCursorPosCallback(window_.get(), on_move);
    glfwSetMouseButtonCallback(window_.get(), on_button);
    glfwSetScrollCallback(window_.get(), on_wheel);
    glfwSetKeyCallback(window_.get(), on_key);
    glfwSetDropCallback(window_.get(), on_drop);
}

void Session::take(const ViewerInput& input) {
    try {
        viewer_.take(input);
    } catch (const InputError& error) {
        std::cerr << error.what() << '\n';
    }
    if (record_.is_open()) {
        ViewerInput recorded = input;
        recorded.frame = frame_;
        record_ << input_line(recorded) << '\n';
    }
    send_commands(input.time);
}

void Session::send_commands(double time) {
    for (Command& command : viewer_.take_commands()) {
        const std::uint64_t number = simulation_.send(std::move(command));
        if (time > 0) latencies_.sent(number, time);
    }
}

void Session::take_events() {
    int width = 0, height = 0;
    glfwGetWindowSize(window_.get(), &width, &height);
    if (width > 0 && (width != static_cast<int>(viewer_.size().width) ||
                      height != static_cast<int>(viewer_.size().height)))
        take({.kind = InputKind::resize, .x = static_cast<double>(width), .y = static_cast<double>(height)});
    std::vector<ViewerInput> events;
    events.swap(queue_.events);
    const double now = glfwGetTime();
    space_mouse_.poll(queue_.x, queue_.y, now - last_poll_, events);
    last_poll_ = now;
    if (!events.empty()) still_frames_ = 0;
    for (const ViewerInput& event : events) take(event);
}

// A file that the command line names is in order, or the program ends as other commands do.
void Session::require_opened(const PublishedState& newest) const {
    if (settings_.file.empty() || newest.scene > 0 || newest.notice.empty()) return;
    std::vector<InputError> errors;
    std::istringstream text(newest.notice);
    for (std::string line; std::getline(text, line);) {
        const std::size_t colon = line.find(": ");
        if (colon == std::string::npos)
            errors.emplace_back(settings_.file.string(), line);
        else
            errors.emplace_back(line.substr(0, colon), line.substr(colon + 2));
    }
    throw InputErrors(errors);
}

void Session::show_state() {
    State newest = simulation_.newest();
    if (!newest) return;
    require_opened(*newest);
    history_.add(*newest);
    const auto scrubbed = viewer_.scrubbed();
    const State past = scrubbed ? simulation_.timeline().at(*scrubbed) : nullptr;
    const State& shown = past ? past : newest;
    if (viewer_.state() != shown) still_frames_ = 0;
    viewer_.show(shown);
    send_commands(0);
}

void Session::draw_panels() {
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    // ImGui would take the pointer from where it is now: one that has gone on clicks elsewhere.
    if (!queue_.clicks.empty()) {
        const PanelClick& click = queue_.clicks.front();
        ImGuiIO& io = ImGui::GetIO();
        io.MousePos = {static_cast<float>(click.x), static_cast<float>(click.y)};
        io.MouseDown[click.button] = click.is_down;
        queue_.clicks.pop_front();
        still_frames_ = 0;
    }
    ImGui::NewFrame();
    std::vector<ViewerInput> changes;
    std::string film;
    if (film_.is_making())
        film = "Film: " + std::to_string(film_.done()) + " of " + std::to_string(film_.total()) + " pictures";
    if (film_.is_recording())
        film = "Filming: " + std::to_string(film_.done()) + " pictures.  F11 ends the film.";
    if (shows_gallery(viewer_)) {
        gallery_.draw(viewer_, changes);
        panels_.draw_help(viewer_);
        if (gallery_.is_busy()) still_frames_ = 0;
    } else {
        gallery_.close();
        panels_.draw(viewer_,
                     {.history = history_,
                      .latencies = latencies_,
                      .legend = renderer_.legend(),
                      .timeline = simulation_.timeline().range(),
                      .frame_ms = frame_ms_,
                      .interface_ms = interface_ms_,
                      .seconds = glfwGetTime(),
                      .labels = renderer_.labels(),
                      .quality = std::string(quality_names[static_cast<std::size_t>(moving_.quality())]),
                      .film = film,
                      .is_recording = film_.is_recording(),
                      .has_space_mouse = space_mouse_.is_there()},
                     changes);
    }
    for (ViewerInput& change : changes) {
        change.time = glfwGetTime();
        take(change);
        still_frames_ = 0;
    }
    ImGui::Render();
}

void Session::draw() {
    draw_panels();
    const double begin = glfwGetTime();
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_.get(), &width, &height);
    const bool shows_picture = width > 0 && height > 0 && !shows_gallery(viewer_);
    last_drawn_.reset();
    if (shows_picture) {
        last_drawn_ = still_frames_ < idle_frames ? moving_.quality() : Quality::fine;
        renderer_.draw(viewer_, width, height, 0, *last_drawn_, picture_area(viewer_, width, height));
    } else {
        glBindFramebuffer(GL_FRAMEBUFFER, 0);
        glClearColor(0.92F, 0.93F, 0.94F, 1);
        glClear(GL_COLOR_BUFFER_BIT);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, width, height);
    if (shows_picture) fill_behind_panels(viewer_, width, height);
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    glFinish();
    opengl_seconds_ = glfwGetTime() - begin;
}

// More pictures than a display shows would take time from the simulation.
void Session::wait_for_next_frame(double begin) {
    const State& state = viewer_.state();
    const bool lags = state && state->playing && state->real_time_factor > 0 &&
                      state->real_time_factor < lagging * state->speed;
    const double rest = begin + (lags ? shortest_lagging_frame : shortest_frame) - glfwGetTime();
    if (rest > 0) std::this_thread::sleep_for(std::chrono::duration<double>(rest));
}

std::pair<int, int> Session::framebuffer_size() const {
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_.get(), &width, &height);
    return {width, height};
}

void Session::save_picture(const std::string& file) {
    if (!viewer_.state() || viewer_.state()->bodies.empty()) return;
    const auto [width, height] = framebuffer_size();
    const std::string name = file.empty() ? "splitcubes-" + std::to_string(frame_) + ".png" : file;
    try {
        render::write_png(name, renderer_.picture(viewer_, width, height));
        std::cout << name << '\n';
        viewer_.notify("saved " + name);
    } catch (const std::exception& error) {
        std::cerr << error.what() << '\n';
        viewer_.notify(error.what());
    }
}

void Session::save_film(const std::string& file) {
    const auto [width, height] = framebuffer_size();
    const std::string problem =
        film_.make(file.empty() ? "splitcubes-film.mp4" : file, simulation_.timeline().states(), viewer_,
                   width, height, film_quality());
    if (!problem.empty()) viewer_.notify(problem);
}

void Session::record_film(const std::string& file) {
    if (film_.is_recording()) {
        viewer_.notify(film_.stop());
        std::cout << viewer_.notice() << '\n';
        return;
    }
    const auto [width, height] = framebuffer_size();
    std::string name = file;
    for (int k = 1; name.empty() || (file.empty() && std::filesystem::exists(name)); ++k)
        name = "splitcubes-film-" + std::to_string(k) + ".mp4";
    const std::string problem = film_.record(name, viewer_, width, height, film_quality());
    if (!problem.empty()) viewer_.notify(problem);
}

// A picture of the film a picture of the window: neither waits for the other.
void Session::go_on_with_film() {
    film_.observe(viewer_);
    if (const std::string end = film_.advance(); !end.empty()) {
        viewer_.notify(end);
        std::cout << end << '\n';
    }
    if (film_.is_making()) still_frames_ = 0;
}

void Session::carry_out_acts() {
    for (auto [act, text] = viewer_.take_act(); act != WindowAct::none;
         std::tie(act, text) = viewer_.take_act()) {
        still_frames_ = 0;
        if (act == WindowAct::quit) quits_ = true;
        if (act == WindowAct::save_picture) save_picture(text);
        if (act == WindowAct::save_film) save_film(text);
        if (act == WindowAct::record_film) record_film(text);
    }
}

bool Session::is_idle() const {
    return still_frames_ > idle_frames && settings_.frames == 0;
}

void Session::count_frame(double begin, double drawn) {
    constexpr double memory = 0.9;  // of the mean
    interface_ms_ = memory * interface_ms_ + (1 - memory) * 1e3 * (drawn - begin - opengl_seconds_);
    frame_ms_ = memory * frame_ms_ + (1 - memory) * 1e3 * (glfwGetTime() - begin);
}

int Session::run() {
    while (glfwWindowShouldClose(window_.get()) == GLFW_FALSE) {
        is_idle() ? glfwWaitEventsTimeout(idle_wait) : glfwPollEvents();
        const double begin = glfwGetTime();
        take_events();
        show_state();
        ++still_frames_;
        carry_out_acts();
        if (quits_ || settings_.is_interrupted()) break;
        if (is_idle()) continue;
        draw();
        const double drawn = glfwGetTime();
        go_on_with_film();
        glfwSwapBuffers(window_.get());
        if (State newest = simulation_.newest()) pace_.count(*newest, glfwGetTime());
        if (viewer_.state()) latencies_.shown(viewer_.state()->commands, glfwGetTime());
        count_frame(begin, drawn);
        if (last_drawn_) moving_.drawn(*last_drawn_, glfwGetTime() - begin, glfwGetTime());
        wait_for_next_frame(begin);
        if (++frame_ == settings_.frames) break;
    }
    if (!settings_.screenshot.empty()) save_picture(settings_.screenshot.string());
    const Spread latency = latencies_.spread();
    if (settings_.frames > 0)
        std::printf(
            "%d frames, %.1f ms a frame, %.1f ms outside OpenGL, input to picture %.0f ms, worst %.0f ms; "
            "while playing %.1f frames a second, simulated time at %.3f of real time, quality: %s\n",
            frame_, frame_ms_, interface_ms_, latency.median, latency.worst, pace_.frames_per_second(),
            pace_.real_time_factor(), quality_names[static_cast<std::size_t>(moving_.quality())].data());
    return settings_.is_interrupted() ? 1 : 0;
}

}  // namespace

int run_window(const WindowSettings& settings) {
    return Session(settings).run();
}

}  // namespace splitcubes::view
