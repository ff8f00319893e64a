#include <splitcubes/core/error.h>
#include <splitcubes/core/memory.h>
#include <splitcubes/core/plain_number.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#if defined(__unix__)
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace splitcubes {

namespace fs = std::filesystem;

namespace {

constexpr double unlimited = std::numeric_limits<double>::infinity();

// Returns the number in a file; unlimited if the file holds none.
double number_in(const fs::path& file) {
    std::ifstream in(file);
    double value = 0;
    return in >> value ? value : unlimited;
}

// Returns the entry `name` of a file with lines "name: value kB".
double kilobytes_of(const char* file, const std::string& name) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);)
        if (line.rfind(name + ':', 0) == 0) return 1024 * std::stod(line.substr(name.size() + 1));
    return unlimited;
}

// Returns the bytes that a control group leaves; its inactive page cache counts as free.
double left_in_group(const fs::path& folder, const char* limit_name, const char* used_name) {
    const double limit = number_in(folder / limit_name), used = number_in(folder / used_name);
    if (!std::isfinite(limit) || !std::isfinite(used)) return unlimited;
    double cache = 0;
    std::ifstream in(folder / "memory.stat");
    for (std::string name, value; in >> name >> value;)
        if (name == "inactive_file" || name == "total_inactive_file") cache = std::stod(value);
    return std::max(0.0, limit - used + cache);
}

// Returns the minimum over the control groups of the process and their ancestors.
double left_in_groups() {
    double left = unlimited;
    std::ifstream in("/proc/self/cgroup");
    for (std::string line; std::getline(in, line);) {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == std::string::npos) continue;
        const std::string kinds = line.substr(first + 1, second - first - 1);
        const bool unified = kinds.empty();
        if (!unified && kinds.find("memory") == std::string::npos) continue;
        const fs::path root = unified ? "/sys/fs/cgroup" : "/sys/fs/cgroup/memory";
        for (fs::path group = line.substr(second + 1);; group = group.parent_path()) {
            const fs::path folder = root / group.relative_path();
            left = std::min(
                left, unified ? left_in_group(folder, "memory.max", "memory.current")
                              : left_in_group(folder, "memory.limit_in_bytes", "memory.usage_in_bytes"));
            if (!group.has_relative_path()) break;
        }
    }
    return left;
}

double left_of_limits() {
    double left = unlimited;
#if defined(__unix__)
    const auto apply_limit = [&](auto kind, const char* used_name) {
        rlimit limit{};
        if (getrlimit(kind, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
        const double used = kilobytes_of("/proc/self/status", used_name);
        if (std::isfinite(used))
            left = std::min(left, std::max(0.0, static_cast<double>(limit.rlim_cur) - used));
    };
    apply_limit(RLIMIT_AS, "VmSize");
    apply_limit(RLIMIT_DATA, "VmData");
#endif
    return left;
}

}  // namespace

double available_memory() {
    return std::min({kilobytes_of("/proc/meminfo", "MemAvailable"), left_in_groups(), left_of_limits()});
}

void require_memory(const std::string& where, double needed, const std::string& remedy, double available) {
    if (!(needed > available)) return;
    throw InputError(
        where, "needs about " + bytes_text(needed) + " of memory, " + bytes_text(available) + " are free",
        remedy);
}

std::string bytes_text(double bytes) {
    constexpr std::array<const char*, 6> units{"B", "kB", "MB", "GB", "TB", "PB"};
    std::size_t unit = 0;
    for (; bytes >= 999.5 && unit + 1 < units.size(); ++unit) bytes /= 1000;
    return plain_number(bytes, bytes >= 100 ? 3 : 2) + ' ' + units[unit];
}

}  // namespace splitcubes
