// Energy, momentum and speed of a run against what its scene puts in.
#pragma once

#include "laws.h"
#include "metrics_table.h"
#include "obstacles.h"
#include "topology.h"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace splitcubes::torture {

/// Gravity, holds, handles and obstacles: all that acts on the bodies of a scene from outside.
class Surroundings {
  public:
    explicit Surroundings(const nlohmann::ordered_json& scene);

    double time_step() const { return time_step_; }
    const Vec3& gravity() const { return gravity_; }
    const std::vector<Obstacle>& obstacles() const { return obstacles_; }
    bool has_moving_obstacles() const;
    bool is_held(double time) const;
    bool is_pulled(double time) const;  // by a handle
    bool is_damped() const { return damped_; }
    /// Displacement of everything that is held within a step; false where holds move differently or turn.
    bool hold_displacement(double from, double until, Vec3& out) const;
    /// The speed that velocities at the start and things that move can give, m/s. radius: of the bodies.
    double speed_put_in(double radius) const;

  private:
    struct Interval {
        double from, until;
        Motion motion;
    };
    double time_step_ = 1.0 / 60;
    Vec3 gravity_{0, 0, -9.81};
    std::vector<Obstacle> obstacles_;
    std::vector<Interval> holds_, handles_;
    double velocity_ = 0, spin_ = 0;  // largest of the bodies
    bool damped_ = false;
};

/// Adds up a run, step by step; row k of the table is frame k + 1.
class Ledger {
  public:
    Ledger(const Surroundings& surroundings, const MetricsTable& table, double cell_size);

    /// The pieces of the next frame, in order from frame 0.
    void add_frame(const std::vector<PieceMeasure>& pieces, Verdict& verdict);

  private:
    struct Moment {
        double value = 0;      // J, minus the potential energy of gravity
        double allowance = 0;  // J, how uncertain it is
        bool known = true;
    };
    bool is_free(std::size_t row) const;
    Moment moment_of(const std::vector<PieceMeasure>& pieces) const;
    double work_of_gravity(std::size_t row, const Moment& before, const Moment& now) const;
    bool work_of_holds(std::size_t row, double& work) const;
    void measure_momentum(std::size_t row, Verdict& verdict) const;
    void measure_energy(std::size_t row, const Moment& before, const Moment& now, Verdict& verdict);
    void measure_speed(std::size_t row, Verdict& verdict);
    std::string circumstances(std::size_t row) const;

    const Surroundings& surroundings_;
    const MetricsTable& table_;
    double cell_size_, mass_ = 0, radius_ = 0;
    std::size_t frame_ = 0;
    Moment moment_;
    bool has_potential_ = false;  // the table has the potential energy of gravity
    bool running_ = false;        // since the work was last unknown
    double work_ = 0;             // J, all so far
    double put_in_ = 0;           // J, energy at first and all positive work
    double lowest_ = 0;           // J, energy less work
    double allowance_ = 0;        // J, at the lowest
    double stored_ = 0;           // J, largest elastic energy so far
    double pulled_ = 0;           // J, positive work of handles so far
};

}  // namespace splitcubes::torture
