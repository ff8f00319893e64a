#include <splitcubes/body/step_report.h>

#include <iterator>

namespace splitcubes::body {

void ToolForce::add_force(const Isometry& tool, const Vec3& point, const Vec3& added) {
    force += added;
    torque += (point - tool.translation()).cross(added);
}

std::string flag_text(std::uint32_t flags) {
    static constexpr const char* names[] = {"inverted",       "not_converged",  "non_finite",
                                            "frame_fallback", "rank_deficient", "energy_excess",
                                            "took_implicit"};
    std::string out;
    for (std::uint32_t k = 0; k < std::size(names); ++k) {
        if (!(flags >> k & 1U)) continue;
        if (!out.empty()) out += '|';
        out += names[k];
    }
    return out.empty() ? "-" : out;
}

}  // namespace splitcubes::body
