// Looks of things of a scene; plain data like description.h.
#pragma once

#include <splitcubes/geometry/finish.h>
#include <splitcubes/scene/shapes.h>

#include <optional>
#include <string_view>
#include <variant>
#include <vector>

namespace splitcubes::scene {

/// Finishes of a body; what is not set is drawn as the mesh says, or in standard colours.
struct AppearanceDescription {
    std::optional<geometry::Finish> surface;  // of the faces that the mesh had
    std::optional<geometry::Finish> cut;      // of the faces that cuts made; when not said: `surface`
    bool empty() const { return !surface && !cut; }
    bool operator==(const AppearanceDescription&) const = default;
};

/// Returns the finish of a name; null: there is none.
const geometry::Finish* finish_of_kind(std::string_view kind);
const std::vector<std::string_view>& finish_kind_names();

// Solids that are drawn in place of a tool's cutting edges. Lengths that are not set follow from the edge.

enum class BladeKind { knife, scalpel, scissors };
enum class Grip { start, end };  // of the edge

/// A blade behind the edge, with a handle at one end of it.
struct BladeInstrument {
    BladeKind kind = BladeKind::knife;
    std::optional<double> height;     // m, from the edge to the back
    std::optional<double> thickness;  // m, of the back
    std::optional<double> handle;     // m, its length; 0: none
    std::optional<Grip> grip;         // none: the end that moves less, else the higher one
    std::optional<Vec3> back;         // own frame, from the edge to the back; none: against the motion
    bool operator==(const BladeInstrument&) const = default;
};
/// A round wire along the edge.
struct WireInstrument {
    std::optional<double> radius;  // m
    bool grips = true;             // at its ends
    bool operator==(const WireInstrument&) const = default;
};
/// A bowl; the edge is the front of its rim.
struct SpoonInstrument {
    std::optional<double> depth;      // m, of the bowl behind the rim
    std::optional<double> thickness;  // m
    std::optional<double> handle;     // m, its length; 0: none
    std::optional<Vec3> back;         // as of a blade
    bool operator==(const SpoonInstrument&) const = default;
};
/// A mesh in the tool's own frame.
struct MeshInstrument {
    MeshShape mesh;
    PlacementDescription placement;
    bool operator==(const MeshInstrument&) const = default;
};
using InstrumentDescription = std::variant<BladeInstrument, WireInstrument, SpoonInstrument, MeshInstrument>;

/// Things that are drawn besides bodies and colliders.
struct DisplayDescription {
    bool tools = true;
    bool handles = true;  // rods from regions that are pulled to where they are pulled
    bool held = true;     // hatching of regions that are held or pulled
    bool operator==(const DisplayDescription&) const = default;
};

}  // namespace splitcubes::scene
