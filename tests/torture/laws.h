// The laws that every run must obey, with their bounds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace splitcubes::torture {

enum class Law : std::uint8_t {
    ended,
    time,
    complete,
    closed,
    manifold,
    mass,
    momentum,
    angular_momentum,
    energy,
    speed,
    ground,
    colliders,
    rest_volume,
    rest_piece_volume,
    piece_volume,
};

struct LawText {
    Law law;
    const char* name;
    double bound;  // a run breaks the law where a value is above it
    const char* unit;
    const char* sentence;
};

inline constexpr std::size_t law_count = 15;
inline constexpr std::array<LawText, law_count> law_texts = {{
    {Law::ended, "ended", 0, "", "The program ends by itself, with exit code 0."},
    {Law::time, "time", 1, "of the limit", "The program ends within the time limit."},
    {Law::complete, "complete", 0, "", "Each frame and each row is written and holds finite numbers only."},
    {Law::closed, "closed", 0, "edges", "Each edge of a triangle is passed once in each direction."},
    {Law::manifold, "manifold", 0, "vertices", "The triangles around each vertex form one fan."},
    {Law::mass, "mass", 1e-8, "of the mass", "The mass never changes."},
    {Law::momentum, "momentum", 1e-6, "of the momentum",
     "In a step in which nothing holds or touches the bodies, only gravity changes the momentum."},
    {Law::angular_momentum, "angular_momentum", 1e-6, "of the angular momentum",
     "In such a step without gravity, the angular momentum does not change."},
    {Law::energy, "energy", 0.02, "of the energy put in",
     "Energy less the work of gravity, holds and handles never rises above what it was before."},
    {Law::speed, "speed", 4, "of the speed put in",
     "No phyxel is several times as fast as supports, gravity and stored energy can make it."},
    {Law::ground, "ground", 0.2, "cells", "No vertex is deeper in the ground."},
    {Law::colliders, "colliders", 0.2, "cells", "No vertex is deeper in a collider."},
    {Law::rest_volume, "rest_volume", 5e-3, "of the volume",
     "Cuts change the volume at rest only where they meet the boundary."},
    {Law::rest_piece_volume, "rest_piece_volume", 0, "cubic cells",
     "No piece has a negative volume at rest (value: its opposite)."},
    {Law::piece_volume, "piece_volume", 0, "cubic cells",
     "No piece has a negative volume as it is deformed (value: its opposite)."},
}};

constexpr const LawText& text_of(Law law) {
    return law_texts[static_cast<std::size_t>(law)];
}

inline std::optional<Law> law_of(std::string_view name) {
    for (const LawText& text : law_texts)
        if (name == text.name) return text.law;
    return std::nullopt;
}

/// The worst value of a law in a run.
struct Finding {
    bool measured = false;
    double worst = -std::numeric_limits<double>::infinity();
    int frame = -1;    // of the worst value
    std::string note;  // on the worst value; of a law that is not measured, the reason
};

/// The findings of a run, law by law.
struct Verdict {
    std::array<Finding, law_count> findings;

    Finding& of(Law law) { return findings[static_cast<std::size_t>(law)]; }
    const Finding& of(Law law) const { return findings[static_cast<std::size_t>(law)]; }
    /// Takes a value into account; a value that is not a number counts as infinite.
    void measure(Law law, double value, int frame, const std::string& note = {}) {
        Finding& finding = of(law);
        finding.measured = true;
        if (value != value) value = std::numeric_limits<double>::infinity();
        if (value <= finding.worst) return;
        finding.worst = value;
        finding.frame = frame;
        finding.note = note;
    }
    bool breaks(Law law) const { return of(law).measured && of(law).worst > text_of(law).bound; }
    bool holds() const {
        for (const LawText& text : law_texts)
            if (breaks(text.law)) return false;
        return true;
    }
};

}  // namespace splitcubes::torture
