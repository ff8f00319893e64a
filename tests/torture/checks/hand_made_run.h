// Runs that are made by hand, of a box in free fall or moved by a support, to be spoilt in one way each.
#pragma once

#include "torture/checker.h"
#include "torture/surface_file.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace splitcubes::torture {

/// A folder that is removed again.
class TemporaryFolder {
  public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

struct HandMadeRun {
    nlohmann::ordered_json scene;
    std::vector<std::map<std::string, double>> rows;  // of the metrics, by column
    std::vector<Surface> surfaces;                    // one more than rows

    /// Writes the files of scene and run, and checks them.
    Verdict check() const;
    void write(const std::filesystem::path& folder) const;
};

/// A box of 0.1 m and 1 kg that falls freely from 1 m, or flies without gravity.
HandMadeRun falling_box(const Vec3& gravity = {0, 0, -9.81});

/// The same box, all of it held by a support that moves with a constant acceleration.
HandMadeRun carried_box(double acceleration);

/// A box between two corners, its positions at rest included.
Surface box_surface(const Vec3& low, const Vec3& high, int piece = 0);
void append(Surface& surface, const Surface& other);

}  // namespace splitcubes::torture
