// A course in checkpoints.
#include <splitcubes/core/state_stream.h>
#include <splitcubes/math/state_numbers.h>
#include <splitcubes/scene/course.h>
#include <splitcubes/scene/tuning.h>

#include <cstdint>

namespace splitcubes::scene {

namespace {

using Rows = Eigen::Matrix<double, 3, 4>;
constexpr const char* bad_time = "a time out of range";

void save_part(StateWriter& writer, const Isometry& frame) {
    const Rows rows = frame.matrix().topRows<3>();
    write_numbers(writer, rows);
}

void load_part(StateReader& reader, Isometry& frame) {
    Rows rows;
    read_numbers(reader, rows, "a frame that is none");
    frame = Isometry::Identity();
    frame.matrix().topRows<3>() = rows;
    require_state(is_rotation(frame.linear(), 1e-6), "a frame that is none");
}

void save_part(StateWriter& writer, double time) {
    writer.add(time);
}

void load_part(StateReader& reader, double& time) {
    time = reader.number<double>(-tuning::course::max_time, tuning::course::max_time, bad_time);
}

void save_part(StateWriter& writer, const std::pair<double, Isometry>& value) {
    save_part(writer, value.first);
    save_part(writer, value.second);
}

void load_part(StateReader& reader, std::pair<double, Isometry>& value) {
    load_part(reader, value.first);
    load_part(reader, value.second);
}

template <class T>
void save_part(StateWriter& writer, const std::optional<T>& value) {
    writer.add(std::uint8_t{value.has_value()});
    if (value) save_part(writer, *value);
}

template <class T>
void load_part(StateReader& reader, std::optional<T>& value) {
    value.reset();
    if (reader.number<std::uint8_t>(0, 1, "a mark that there is not") == 1)
        load_part(reader, value.emplace());
}

}  // namespace

void Course::save(StateWriter& writer) const {
    const auto clock = [&](const Clock& one) {
        save_part(writer, one.started);
        save_part(writer, one.ended);
    };
    for (const Clock& one : tools_) clock(one);
    for (const Clock& one : colliders_) clock(one);
    for (const std::vector<Hold>* holds : {&constraints_, &handles_})
        for (const Hold& hold : *holds) {
            clock(hold.clock);
            save_part(writer, hold.grip);
            save_part(writer, hold.base);
        }
    for (const SampledMotion& motion : material_) {
        writer.add(std::uint64_t{motion.times().size()});
        for (std::size_t k = 0; k < motion.times().size(); ++k)
            save_part(writer, std::pair(motion.times()[k], motion.frames()[k]));
    }
}

void Course::load(StateReader& reader) {
    const auto clock = [&](Clock& one) {
        load_part(reader, one.started);
        load_part(reader, one.ended);
    };
    for (Clock& one : tools_) clock(one);
    for (Clock& one : colliders_) clock(one);
    for (std::vector<Hold>* holds : {&constraints_, &handles_})
        for (Hold& hold : *holds) {
            clock(hold.clock);
            load_part(reader, hold.grip);
            load_part(reader, hold.base);
        }
    for (SampledMotion& motion : material_) {
        const std::size_t count = reader.count(13 * sizeof(double));
        require_state(count > 0, "a path without a pose");
        motion = {};
        for (std::size_t k = 0; k < count; ++k) {
            std::pair<double, Isometry> sample;
            load_part(reader, sample);
            require_state(k == 0 || sample.first > motion.times().back(), bad_time);
            motion.add(sample.first, sample.second);
        }
    }
}

}  // namespace splitcubes::scene
