// Sessions of the viewer without a window: events in, states out, so many steps a frame.
#pragma once

#include <splitcubes/view/simulation_loop.h>
#include <splitcubes/view/viewer.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

namespace splitcubes::view_tests {

using namespace splitcubes::view;

/// A new folder that is removed at the end. Tests run side by side in several processes.
struct TemporaryFolder {
    std::filesystem::path path;

    explicit TemporaryFolder(const std::string& name) {
        std::string pattern =
            (std::filesystem::temp_directory_path() / ("splitcubes-view-" + name + "-XXXXXX")).string();
        if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
        path = pattern;
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
};

/// A block of 0.2 x 0.2 x 0.1 m on a table, coarse enough for quick tests. more: keys of the scene behind a
/// comma.
inline std::filesystem::path write_block_scene(const std::filesystem::path& folder,
                                               const std::string& more = "", int cells = 16,
                                               int phyxels = 150) {
    const std::filesystem::path file = folder / "block.json";
    std::ofstream(file)
        << R"({"name": "Block", "frames": 10, "ground": {"height": 0}, "contact": {"pieces": true},
  "bodies": [{"name": "block", "shape": {"box": {"size": [0.2, 0.2, 0.1]}},
              "placement": {"position": [0, 0, 0.05]}, "cells": )"
        << cells << R"(, "phyxel_count": )" << phyxels << R"(,
              "material": {"youngs_modulus": 30000, "mass_damping": 2, "stiffness_damping": 0.005,
                           "cutting_resistance": 20}}])"
        << more << "}";
    return file;
}

/// Events by hand; each frame plays `steps` steps.
struct HandSession {
    SimulationLoop loop;
    Viewer viewer;

    explicit HandSession(const std::filesystem::path& file, const EngineSettings& settings = {.threads = 2})
        : loop(settings) {
        loop.open(file);
        viewer.show(loop.publish());
        OrbitCamera camera;
        camera.look({0.35, -0.35, 0.4}, {0, 0, 0.05});
        viewer.set_camera(camera);
        frame(0);
    }
    PublishedState state() const { return *viewer.state(); }
    void frame(int steps = 1) {
        loop.take(viewer.take_commands());
        for (int k = 0; k < steps; ++k)
            if (loop.is_playing() || loop.single_steps() > 0) loop.step();
        viewer.show(loop.publish());
    }
    void run(int frames) {
        for (int k = 0; k < frames; ++k) frame();
    }
    void key(const std::string& name, unsigned modifiers = 0) {
        viewer.take({.kind = InputKind::key, .modifiers = modifiers, .name = name});
        frame(0);
    }
    void set(const std::string& name, double value) {
        viewer.take({.kind = InputKind::set, .name = name, .value = value});
        frame(0);
    }
    void act(const std::string& name, const std::string& text = {}) {
        viewer.take({.kind = InputKind::act, .name = name, .text = text});
        frame(0);
    }
    Vec3 pixels(const Vec3& world) const { return viewer.camera().project(world, viewer.size()); }
    void press(const Vec3& world) { at(InputKind::press, world); }
    void move(const Vec3& world) { at(InputKind::move, world); }
    void release(const Vec3& world) { at(InputKind::release, world); }
    /// Draws a line in so many frames, with `samples` events a frame.
    void drag(const Vec3& from, const Vec3& to, int frames = 10, int samples = 3) {
        press(from);
        frame();
        for (int k = 1; k <= frames * samples; ++k) {
            move(from + (to - from) * k / (frames * samples));
            if (k % samples == 0) frame();
        }
        release(to);
        run(3);
    }
    std::size_t cut_triangles() const {
        std::size_t out = 0;
        for (const BodyState& body : viewer.state()->bodies)
            for (std::size_t t = 0; t < body.topology->origins.size(); ++t)
                out += body.topology->origins[t] == SurfaceOrigin::cut &&
                       body.topology->triangles[3 * t] != body.topology->triangles[3 * t + 1];
        return out;
    }
    std::size_t pieces() const { return viewer.state()->bodies[0].pieces; }
    std::uint64_t hash() { return loop.engine()->state_hash(); }

  private:
    void at(InputKind kind, const Vec3& world) {
        const Vec3 p = pixels(world);
        viewer.take({.kind = kind, .x = p.x(), .y = p.y()});
    }
};

}  // namespace splitcubes::view_tests
