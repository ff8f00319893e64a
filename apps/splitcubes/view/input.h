// Input of the viewer as events that can be recorded and replayed.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace splitcubes::view {

enum class InputKind {
    move,      // of the pointer to x, y
    press,     // of a button
    release,   // of a button
    wheel,     // by `value` notches, away from the user
    key,       // `name` is pressed
    set,       // the parameter or setting `name` becomes `value`
    act,       // the action `name`, with `text` as its file
    resize,    // of the picture to x, y
    six_axis,  // motion of a device with six axes, `axes`
};

enum class Button { left, right, middle };

/// Modifier keys that are held, bits.
enum Modifier : unsigned { shift_key = 1, control_key = 2, alt_key = 4 };

/// One event. Positions are pixels of the picture from its upper left corner.
struct ViewerInput {
    InputKind kind = InputKind::move;
    int frame = 0;        // drawn frame before which it comes, for recordings
    double time = 0;      // s, by the clock of the window
    double x = 0, y = 0;  // pixels
    Button button = Button::left;
    unsigned modifiers = 0;  // Modifier bits
    std::string name{};      // of a key ("a", "1", "space", "left"), a parameter, an action
    double value = 0;
    std::string text{};
    /// Axes of a device that has six: shift to the right, up and towards the user as shares of the view's
    /// distance, and turn about these directions, rad.
    std::array<double, 6> axes{};
};

/// One line of JSON, and back. Throws InputError(where, ...) for anything else.
std::string input_line(const ViewerInput& input);
ViewerInput input_of_line(const std::string& line, const std::string& where);

/// Reads a file of such lines, by increasing frame. Empty lines and lines that begin with // are skipped.
/// Throws InputError with file and line.
std::vector<ViewerInput> read_inputs(const std::filesystem::path& file);

}  // namespace splitcubes::view
