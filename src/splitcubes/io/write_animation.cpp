#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>
#include <splitcubes/io/gltf_builder.h>
#include <splitcubes/io/write_animation.h>
#include <splitcubes/io/write_mesh.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace splitcubes::io {

struct AnimationWriter::Impl {
    std::filesystem::path path;
    GltfBuilder builder;
    std::vector<double> times;       // of the frames, s
    std::vector<std::size_t> nodes;  // of the frames; npos: a frame without triangles
    OrderedJson channels = OrderedJson::array(), samplers = OrderedJson::array();

    static constexpr std::size_t npos = static_cast<std::size_t>(-1);

    explicit Impl(std::filesystem::path to) : path(std::move(to)), builder(path.string()) {
        builder.json()["nodes"] = OrderedJson::array();
    }

    std::size_t add_node(OrderedJson node) {
        builder.json()["nodes"].push_back(std::move(node));
        return builder.json()["nodes"].size() - 1;
    }

    std::size_t add_numbers(const std::vector<float>& values, std::size_t width, const char* type) {
        const std::size_t offset = builder.binary().size();
        for (const float value : values) put_number(builder.binary(), value);
        return builder.add_accessor(offset, target_none, type_float, values.size() / width, type);
    }

    // The specification wants the bounds of times.
    std::size_t add_times(const std::vector<double>& at) {
        std::vector<float> values;
        for (const double t : at) {
            values.push_back(static_cast<float>(t));
            // Times that single precision does not tell apart still increase.
            if (values.size() > 1 && values.back() <= values[values.size() - 2])
                values.back() = std::nextafter(values[values.size() - 2], 1e30F);
        }
        const std::size_t accessor = add_numbers(values, 1, "SCALAR");
        builder.json()["accessors"][accessor]["min"] = OrderedJson::array({values.front()});
        builder.json()["accessors"][accessor]["max"] = OrderedJson::array({values.back()});
        return accessor;
    }

    void add_channel(std::size_t node, const char* what, const char* interpolation, std::size_t input,
                     std::size_t output) {
        samplers.push_back({{"input", input}, {"interpolation", interpolation}, {"output", output}});
        channels.push_back({{"sampler", samplers.size() - 1}, {"target", {{"node", node}, {"path", what}}}});
    }

    // Of the k-th frame: one from its time to that of the next one, else zero.
    void add_visibility(std::size_t k) {
        std::vector<double> at;
        std::vector<float> scale;
        const auto add = [&](double time, float value) {
            at.push_back(time);
            scale.insert(scale.end(), 3, value);
        };
        if (k > 0) add(times.front(), 0);
        add(times[k], 1);
        if (k + 1 < times.size()) add(times[k + 1], 0);
        const std::size_t input = add_times(at);
        add_channel(nodes[k], "scale", "STEP", input, add_numbers(scale, 3, "VEC3"));
    }
};

AnimationWriter::AnimationWriter(std::filesystem::path path)
    : impl_(std::make_unique<Impl>(std::move(path))) {
    check_file_target(impl_->path);
}

AnimationWriter::~AnimationWriter() = default;

void AnimationWriter::add_frame(double time, const geometry::SurfaceMesh& surface) {
    if (!impl_->times.empty() && !(time > impl_->times.back()))
        throw InputError(impl_->path.string(), "frames do not follow each other in time",
                         "give each its own, later time");
    check_surface(surface, impl_->path.string());
    impl_->times.push_back(time);
    if (surface.mesh.triangles.empty()) {
        impl_->nodes.push_back(Impl::npos);
        return;
    }
    std::vector<geometry::Material> materials = surface.attributes.materials;
    for (geometry::Material& material : materials)
        if (!material.image) material.texture = texture_from(impl_->path.parent_path(), material.texture);
    const std::string name = "frame " + std::to_string(impl_->times.size() - 1);
    const std::size_t mesh = add_gltf_surface(impl_->builder, surface, materials, name);
    impl_->nodes.push_back(impl_->add_node({{"name", name}, {"mesh", mesh}}));
}

void AnimationWriter::add_solid(const std::string& name, const geometry::TriangleMesh& mesh,
                                const geometry::Material& material, const std::vector<double>& times,
                                const std::vector<Isometry>& frames) {
    if (mesh.triangles.empty() || times.empty() || times.size() != frames.size()) return;
    geometry::SurfaceMesh surface;
    surface.mesh = mesh;
    surface.attributes.materials = {material};
    surface.attributes.triangle_material.assign(mesh.triangles.size(), 0);
    check_surface(surface, impl_->path.string());
    // The axes of glTF from those of everything else.
    Mat3 axes;
    axes << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    std::vector<float> positions, rotations;
    Quat last = Quat::Identity();
    for (const Isometry& frame : frames) {
        Quat turn(Mat3(axes * frame.linear() * axes.transpose()));
        turn.normalize();
        if (turn.dot(last) < 0) turn.coeffs() = -turn.coeffs();
        last = turn;
        for (const double value : gltf_from_own(frame.translation()))
            positions.push_back(to_float(value, impl_->path.string()));
        for (const double value : turn.coeffs()) rotations.push_back(static_cast<float>(value));
    }
    const auto first = [](const std::vector<float>& values, std::ptrdiff_t count) {
        return OrderedJson(std::vector<float>(values.begin(), values.begin() + count));
    };
    const std::size_t index = add_gltf_surface(impl_->builder, surface, surface.attributes.materials, name);
    const std::size_t node = impl_->add_node({{"name", name},
                                              {"mesh", index},
                                              {"translation", first(positions, 3)},
                                              {"rotation", first(rotations, 4)}});
    if (times.size() < 2) return;
    const std::size_t input = impl_->add_times(times);
    impl_->add_channel(node, "translation", "LINEAR", input, impl_->add_numbers(positions, 3, "VEC3"));
    impl_->add_channel(node, "rotation", "LINEAR", input, impl_->add_numbers(rotations, 4, "VEC4"));
}

void AnimationWriter::finish() {
    if (impl_->times.empty())
        throw InputError(impl_->path.string(), "there is no frame to write", "give a run with frames");
    OrderedJson& json = impl_->builder.json();
    if (impl_->times.size() > 1)
        for (std::size_t k = 0; k < impl_->times.size(); ++k) {
            if (impl_->nodes[k] == Impl::npos) continue;
            // Programs that do not animate show the first frame.
            if (k > 0) json["nodes"][impl_->nodes[k]]["scale"] = {0, 0, 0};
            impl_->add_visibility(k);
        }
    OrderedJson roots = OrderedJson::array();
    for (std::size_t n = 0; n < json["nodes"].size(); ++n) roots.push_back(n);
    if (roots.empty()) {
        json.erase("nodes");
        json["scenes"] = OrderedJson::array({OrderedJson::object()});
    } else {
        json["scenes"] = OrderedJson::array({{{"nodes", std::move(roots)}}});
    }
    if (!impl_->channels.empty())
        json["animations"] = OrderedJson::array(
            {{{"name", "run"}, {"channels", impl_->channels}, {"samplers", impl_->samplers}}});
    if (!impl_->builder.binary().empty())
        json["buffers"] = OrderedJson::array({{{"byteLength", impl_->builder.binary().size()}}});
    write_file(impl_->path, impl_->builder.container());
}

}  // namespace splitcubes::io
