#include "ledger.h"

#include <algorithm>
#include <cmath>

namespace splitcubes::torture {

namespace {

using Json = nlohmann::ordered_json;

constexpr double never = std::numeric_limits<double>::infinity();
constexpr double least_speed = 0.1;      // m/s, that noise may have
constexpr double least_lift = 0.1;       // cells: lifting everything by it is energy that noise may have
constexpr double least_motion = 1e-3;    // m/s, as above
constexpr double least_momentum = 0.01;  // m/s times mass, below which momentum is noise

double number_or(const Json& json, const char* key, double otherwise) {
    return json.contains(key) && json[key].is_number() ? json[key].get<double>() : otherwise;
}

double sum_of_energies(const MetricsTable& table, std::size_t row) {
    return table.at(row, "kinetic_energy") + table.at(row, "elastic_energy") +
           table.at(row, "contact_energy");
}

}  // namespace

Surroundings::Surroundings(const Json& scene) {
    time_step_ = number_or(scene, "time_step", time_step_);
    if (scene.contains("gravity")) gravity_ = vector_of(scene["gravity"]);
    if (scene.contains("ground") && scene["ground"].is_object())
        obstacles_.push_back(Obstacle::ground(number_or(scene["ground"], "height", 0)));
    for (const Json& collider : scene.value("colliders", Json::array())) obstacles_.emplace_back(collider);
    const auto interval = [](const Json& json) {
        Interval out{number_or(json, "from_time", 0), number_or(json, "until_time", never), {}};
        const bool moves = json.contains("keyframes") && json.value("kind", "move") == "move";
        if (moves)
            out.motion = Motion(json["keyframes"],
                                json.contains("pivot") ? vector_of(json["pivot"]) : Vec3(Vec3::Zero()));
        return out;
    };
    for (const Json& hold : scene.value("constraints", Json::array())) holds_.push_back(interval(hold));
    for (const Json& handle : scene.value("handles", Json::array())) handles_.push_back(interval(handle));
    for (const Json& body : scene.at("bodies")) {
        if (body.contains("velocity")) velocity_ = std::max(velocity_, vector_of(body["velocity"]).norm());
        if (body.contains("angular_velocity"))
            spin_ = std::max(spin_, vector_of(body["angular_velocity"]).norm());
        damped_ = damped_ || number_or(body.value("material", Json::object()), "mass_damping", 0) > 0;
    }
}

bool Surroundings::has_moving_obstacles() const {
    return std::any_of(obstacles_.begin(), obstacles_.end(),
                       [](const Obstacle& obstacle) { return obstacle.motion().moves(); });
}

bool Surroundings::is_held(double time) const {
    return std::any_of(holds_.begin(), holds_.end(),
                       [&](const Interval& hold) { return hold.from <= time && time < hold.until; });
}

bool Surroundings::is_pulled(double time) const {
    return std::any_of(handles_.begin(), handles_.end(),
                       [&](const Interval& handle) { return handle.from <= time && time < handle.until; });
}

bool Surroundings::hold_displacement(double from, double until, Vec3& out) const {
    bool first = true;
    for (const Interval& hold : holds_) {
        if (hold.from > until || hold.until <= from) continue;
        if (hold.motion.turns()) return false;
        const Vec3 moved = hold.motion.at(until).translation() - hold.motion.at(from).translation();
        if (!first && (moved - out).norm() > 1e-12) return false;
        out = moved;
        first = false;
    }
    if (first) out.setZero();
    return true;
}

double Surroundings::speed_put_in(double radius) const {
    double moving = 0;
    for (const Obstacle& obstacle : obstacles_) moving = std::max(moving, obstacle.motion().top_speed());
    for (const Interval& hold : holds_) moving = std::max(moving, hold.motion.top_speed());
    for (const Interval& handle : handles_) moving = std::max(moving, handle.motion.top_speed());
    return velocity_ + spin_ * radius + moving;
}

Ledger::Ledger(const Surroundings& surroundings, const MetricsTable& table, double cell_size)
    : surroundings_(surroundings), table_(table), cell_size_(cell_size) {
    has_potential_ = table_.has("potential_energy");
    if (table_.size() > 0) mass_ = table_.at(0, "mass");
}

bool Ledger::is_free(std::size_t row) const {
    const double until = table_.at(row, "time"), from = until - surroundings_.time_step();
    return surroundings_.obstacles().empty() && !surroundings_.is_held(from) &&
           !surroundings_.is_held(until) && !surroundings_.is_pulled(from) && !surroundings_.is_damped();
}

// The mass of a piece is its share in the volume at rest. A fragment of a few cells has about that mass only.
Ledger::Moment Ledger::moment_of(const std::vector<PieceMeasure>& pieces) const {
    Moment out;
    const Vec3& g = surroundings_.gravity();
    if (g.norm() == 0 || pieces.empty()) return out;
    double volume = 0, square = 0;
    for (const PieceMeasure& piece : pieces) volume += piece.rest_volume;
    out.known = volume > 0 || pieces.size() == 1;
    for (const PieceMeasure& piece : pieces) {
        const double mass = pieces.size() == 1 ? mass_ : mass_ * piece.rest_volume / volume;
        out.value += mass * g.dot(piece.centre);
        double uncertain = std::abs(mass * g.dot(piece.centre - piece.affine_centre));
        const double cell = cell_size_ * cell_size_ * cell_size_;
        if (volume > 0 && piece.rest_volume < 8 * cell)
            uncertain += 0.5 * mass_ * cell / volume * std::abs(g.dot(piece.centre - pieces[0].centre));
        square += uncertain * uncertain;
    }
    out.allowance = std::sqrt(square);
    return out;
}

double Ledger::work_of_gravity(std::size_t row, const Moment& before, const Moment& now) const {
    const Vec3& g = surroundings_.gravity();
    if (has_potential_)
        return row == 0 ? 0 : table_.at(row - 1, "potential_energy") - table_.at(row, "potential_energy");
    if (row == 0 || !is_free(row)) return now.value - before.value;
    return 0.5 * surroundings_.time_step() *
           g.dot(table_.vector(row - 1, "momentum") + table_.vector(row, "momentum"));
}

// The force of holds follows from the momentum where nothing else acts from outside; else what the table
// lists is taken, if it lists it.
bool Ledger::work_of_holds(std::size_t row, double& work) const {
    const double dt = surroundings_.time_step(), until = table_.at(row, "time");
    Vec3 displacement;
    work = 0;
    if (!surroundings_.is_held(until - dt) && !surroundings_.is_held(until)) return true;
    const bool is_uniform = surroundings_.hold_displacement(until - dt, until, displacement);
    if (is_uniform && displacement.norm() == 0) return true;
    const bool touched = !surroundings_.obstacles().empty() &&
                         (table_.at(row, "contacts") > 0 || (row > 0 && table_.at(row - 1, "contacts") > 0));
    if (!is_uniform || row == 0 || touched || surroundings_.is_damped() ||
        surroundings_.is_pulled(until - dt)) {
        if (table_.has("hold_work")) work = table_.at(row, "hold_work");
        return table_.has("hold_work");
    }
    const Vec3 impulse = table_.vector(row, "momentum") - table_.vector(row - 1, "momentum") -
                         dt * mass_ * surroundings_.gravity();
    work = impulse.dot(displacement) / dt;
    return true;
}

std::string Ledger::circumstances(std::size_t row) const {
    std::string out;
    const auto add = [&](bool is, const char* word) {
        if (is) out += (out.empty() ? "" : " ") + std::string(word);
    };
    add(table_.at(row, "new_cut_edges") > 0, "cut");
    add(row > 0 && table_.at(row - 1, "new_cut_edges") > 0, "cut-before");
    add(table_.at(row, "torn_edges") > 0, "torn");
    add(table_.at(row, "contacts") > 0, "contacts");
    if (table_.flags(row) != "-") out += (out.empty() ? "" : " ") + table_.flags(row);
    return out;
}

void Ledger::measure_momentum(std::size_t row, Verdict& verdict) const {
    if (row == 0 || !is_free(row)) return;
    const Vec3 expected = surroundings_.time_step() * mass_ * surroundings_.gravity();
    const Vec3 now = table_.vector(row, "momentum"), change = now - table_.vector(row - 1, "momentum");
    const double scale = mass_ * std::max(least_momentum, table_.at(row, "top_speed"));
    const int frame = static_cast<int>(row) + 1;
    verdict.measure(Law::momentum, (change - expected).norm() / scale, frame, circumstances(row));
    if (surroundings_.gravity().norm() > 0) return;
    const Vec3 turn = table_.vector(row, "angular_momentum");
    const Vec3 turned = turn - table_.vector(row - 1, "angular_momentum");
    verdict.measure(Law::angular_momentum, turned.norm() / (turn.norm() + scale * radius_), frame,
                    circumstances(row));
}

void Ledger::measure_energy(std::size_t row, const Moment& before, const Moment& now, Verdict& verdict) {
    const double time = table_.at(row, "time"), energy = sum_of_energies(table_, row);
    double holds = 0;
    const bool pushed = surroundings_.has_moving_obstacles() && table_.at(row, "contacts") > 0;
    const bool pulled = surroundings_.is_pulled(time - surroundings_.time_step());
    const double handles = pulled && table_.has("handle_work") ? table_.at(row, "handle_work") : 0;
    const bool known = (now.known || has_potential_) && !pushed && work_of_holds(row, holds) &&
                       (!pulled || table_.has("handle_work"));
    const double gravity = work_of_gravity(row, before, now);
    const bool exact = has_potential_ || is_free(row);
    if (!known || !running_) {
        running_ = known;
        work_ = 0;
        put_in_ = energy;
        lowest_ = energy;
        allowance_ = exact ? 0 : now.allowance;
        return;
    }
    work_ += gravity + holds + handles;
    put_in_ += std::max(0.0, gravity) + std::max(0.0, holds) + std::max(0.0, handles);
    const double level = energy - work_, allowance = exact ? 0 : now.allowance;
    const double noise = mass_ * (least_lift * cell_size_ * surroundings_.gravity().norm() +
                                  0.5 * least_motion * least_motion);
    const double rise = level - lowest_ - std::max(allowance, allowance_);
    verdict.measure(Law::energy, rise / (put_in_ + noise), static_cast<int>(row) + 1, circumstances(row));
    if (level < lowest_) {
        lowest_ = level;
        allowance_ = allowance;
    }
}

// Stored energy counts as if half of it went into one direction of motion of all the mass, the work of
// handles as if a tenth of the mass had it: they may pull a part.
void Ledger::measure_speed(std::size_t row, Verdict& verdict) {
    stored_ = std::max(stored_, table_.at(row, "elastic_energy") + table_.at(row, "contact_energy"));
    if (table_.has("handle_work")) pulled_ += std::max(0.0, table_.at(row, "handle_work"));
    const double fallen = surroundings_.gravity().norm() * table_.at(row, "time");
    const double possible =
        surroundings_.speed_put_in(radius_) + fallen + std::sqrt((2 * stored_ + 20 * pulled_) / mass_);
    verdict.measure(Law::speed, table_.at(row, "top_speed") / (possible + least_speed),
                    static_cast<int>(row) + 1, circumstances(row));
}

void Ledger::add_frame(const std::vector<PieceMeasure>& pieces, Verdict& verdict) {
    const Moment before = moment_;
    moment_ = moment_of(pieces);
    if (frame_++ == 0) {
        for (const PieceMeasure& piece : pieces)
            radius_ = std::max(radius_, std::cbrt(std::abs(piece.volume)));
        return;
    }
    const std::size_t row = frame_ - 2;
    if (row >= table_.size()) return;
    verdict.measure(Law::mass, std::abs(table_.at(row, "mass") - mass_) / mass_, static_cast<int>(row) + 1);
    measure_momentum(row, verdict);
    measure_energy(row, before, moment_, verdict);
    measure_speed(row, verdict);
}

}  // namespace splitcubes::torture
