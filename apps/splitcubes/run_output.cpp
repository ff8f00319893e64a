#include "run_output.h"

#include "links.h"

#include <splitcubes/body/body.h>
#include <splitcubes/core/error.h>
#include <splitcubes/core/stopwatch.h>
#include <splitcubes/geometry/mesh_check.h>
#include <splitcubes/io/atomic_file.h>
#include <splitcubes/io/write_mesh.h>
#include <splitcubes/scene/played_scene.h>
#include <splitcubes/scene/resolve.h>

#ifdef SPLITCUBES_WITH_RENDER
#include "pictures.h"

#include <splitcubes/render/image.h>
#endif

#include <cstdio>
#include <cstdlib>
#include <sstream>

namespace splitcubes::app {

namespace fs = std::filesystem;

namespace {

std::string frame_name(int frame) {
    char name[16];
    std::snprintf(name, sizeof name, "%06d", frame);
    return name;
}

const char* extension(scene::SurfaceFormat format) {
    switch (format) {
        case scene::SurfaceFormat::obj:
            return ".obj";
        case scene::SurfaceFormat::stl:
            return ".stl";
        case scene::SurfaceFormat::glb:
            return ".glb";
        case scene::SurfaceFormat::ply:
            break;
    }
    return ".ply";
}

}  // namespace

bool RunOutput::is_stale(const std::string& name, int past) {
    // Both are replaced atomically: the old one remains until the new one is complete.
    if (name == "scene.json" || name == "checkpoint.bin") return false;
    if (past < 0 || name == "summary.json") return true;
    const std::string stem = fs::path(name).stem().string();
    const bool is_frame =
        name.find('/') != name.npos && stem.size() >= 6 && stem.find_first_not_of("0123456789") == stem.npos;
    return is_frame && std::atoi(stem.c_str()) > past;
}

struct RunOutput::Pictures {
#ifdef SPLITCUBES_WITH_RENDER
    Pictures(const RunScene& scene, const geometry::Box& first) : maker(scene, {first}) {}
    PictureMaker maker;
#endif
};

RunOutput::RunOutput(OutputFolder& folder, const scene::SceneDescription& description,
                     const body::World& world, const scene::Course& course,
                     const std::vector<io::Model>& models, const Past& past)
    : folder_(folder), description_(description), course_(course), surfaces_(world, models, description) {
    write_json(folder_.add("scene.json"), scene::resolved_scene(description_, folder_.path()));
    if (description_.output.format == scene::SurfaceFormat::ply ||
        description_.output.format == scene::SurfaceFormat::obj)
        surfaces_.write_images(folder_.path() / "surface", [&](const fs::path& file) {
            folder_.add("surface/" + file.filename().string());
        });
    if (past.frame >= 0) {
        metrics_ = past.metrics;
        flags_.add_table(past.metrics);
        return;
    }
    metrics_ = "frame,time";
    for (const char* name : body::stage_names) metrics_ += std::string(",") + name + "_ms";
    metrics_ +=
        ",step_ms,phyxels,pairs,cut_edges,new_cut_edges,torn_edges,surface_cells,triangles,pieces,disks,mass,"
        "momentum_x,"
        "momentum_y,momentum_z,angular_momentum_x,angular_momentum_y,angular_momentum_z,kinetic_energy,"
        "elastic_energy,contact_energy,potential_energy,hold_work,handle_work,top_speed,solver_iterations,"
        "substeps,contacts,energy_"
        "excess_pieces,"
        "retries,"
        "energy_removed,flags";
    for (const body::Tool& tool : world.tools())
        for (const char* what : {"force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z", "area"})
            metrics_ += "," + tool.blade.name() + "_" + what;
    for (const auto& body : world.bodies())
        for (const body::Handle& handle : body->handles())
            for (const char* what : {"force_x", "force_y", "force_z"})
                metrics_ += "," + handle.name + "_" + what;
    metrics_ += "\n";
}

RunOutput::~RunOutput() = default;

void RunOutput::add_metrics(const body::StepReport& r, int frame) {
    flags_.add(r.flags, r.solver.energy_removed, r.totals.kinetic_energy + r.totals.elastic_energy);
    std::ostringstream row;
    row.imbue(std::locale::classic());
    row.precision(9);
    row << frame << ',' << r.time;
    for (std::size_t k = 0; k < body::stage_count; ++k) {
        row << ',' << 1e3 * r.seconds[k];
        seconds_.stages[k] += r.seconds[k];
    }
    row << ',' << 1e3 * r.total_seconds() << ',' << r.totals.phyxels << ',' << r.totals.pairs << ','
        << r.totals.cut_edges << ',' << r.counts.new_cut_edges << ',' << r.counts.torn_edges << ','
        << r.totals.surface_cells << ',' << r.totals.triangles << ',' << r.totals.pieces << ','
        << r.counts.disks << ',' << r.totals.mass;
    for (const Vec3& v : {r.totals.momentum, r.totals.angular_momentum})
        for (int k = 0; k < 3; ++k) row << ',' << v[k];
    row << ',' << r.totals.kinetic_energy << ',' << r.totals.elastic_energy << ',' << r.totals.contact_energy
        << ',' << r.totals.potential_energy << ',' << r.work.holds << ',' << r.work.handles << ','
        << r.totals.top_speed << ',' << r.solver.iterations << ',' << r.solver.substeps << ','
        << r.counts.contacts << ',' << r.solver.energy_excess_pieces << ',' << r.solver.retries << ','
        << r.solver.energy_removed << ',' << body::flag_text(r.flags);
    const auto add = [&](const Vec3& v) { row << ',' << v[0] << ',' << v[1] << ',' << v[2]; };
    for (const body::ToolForce& tool : r.tools) {
        add(tool.force);
        add(tool.torque);
        row << ',' << tool.area;
    }
    for (const Vec3& force : r.handle_forces) add(force);
    row << '\n';
    metrics_ += row.str();
}

void RunOutput::write_tables(int frame) const {
    io::write_file(folder_.add("metrics.csv"), metrics_);
    if (course_.depends_on_state())
        write_json(
            folder_.add("scene_as_run.json"),
            scene::resolved_scene(scene::played_scene(description_, course_, 0, frame), folder_.path()));
}

void RunOutput::write_frame(const body::World& world, const body::StepReport& report, int frame) {
    Stopwatch watch;
    if (frame > 0) add_metrics(report, frame);
    if (frame % description_.output.every_nth_frame == 0) {
        const geometry::SurfaceMesh surface = surfaces_.now(world);
        const std::string name = frame_name(frame);
        const std::string file = "surface/" + name + extension(description_.output.format);
        if (description_.output.format == scene::SurfaceFormat::obj) folder_.add("surface/" + name + ".mtl");
        io::write_mesh(folder_.add(file), surface);
        if (description_.output.links) write_links(folder_.add("links/" + name + ".ply"), links_of(world));
#ifdef SPLITCUBES_WITH_RENDER
        if (description_.output.pictures) {
            if (!pictures_)
                pictures_ = std::make_unique<Pictures>(RunScene{description_}, surface.mesh.bounds());
            if (course_.depends_on_state())
                pictures_->maker.follow(scene::played_scene(description_, course_, frame, frame));
            render::write_png(folder_.add("pictures/" + name + ".png"),
                              pictures_->maker.draw(surface, frame * description_.time_step));
        }
#else
        if (description_.output.pictures) throw JobError("pictures: this program was built without OpenGL");
#endif
    }
    seconds_.write += watch.seconds();
    // The table is rewritten as a whole, so not after every frame of a long run.
    if (frame % 50 == 0) write_tables(frame);
}

Json RunOutput::body_report(const body::Body& body) const {
    Json out = surface_report(body.grid(), body.surface(), body.pieces(), body.solidify_report(),
                              body.surface_mesh());
    out["name"] = body.name();
    out["phyxels"] = body.phyxels().size();
    out["phyxel_spacing"] = body.phyxel_spacing();
    double mass = 0;
    for (const double m : body.phyxels().mass) mass += m;
    out["mass"] = mass;
    return out;
}

void RunOutput::finish(const body::World& world, int frames, bool interrupted) {
    write_tables(frames);
    Json summary;
    summary["scene"] = description_.name;
    summary["version"] = SPLITCUBES_VERSION;
    summary["threads"] = world.parallel().thread_count();
    summary["frames"] = frames;
    summary["interrupted"] = interrupted;
    summary["time"] = world.time();
    summary["state_hash"] = world.state_hash().text();
    summary["flags"] = flags_.json();
    summary["idle_tools"] = idle_tools_;
    // Totals over all bodies under the same keys as in the report of a surface.
    Json bodies = Json::array();
    for (const auto& body : world.bodies()) bodies.push_back(body_report(*body));
    for (const char* key : {"nodes_inside", "cut_edges", "surface_cells", "vertices", "triangles",
                            "lost_thin_edges", "gap_edges", "phyxels"}) {
        std::size_t total = 0;
        for (const Json& body : bodies) total += body[key].get<std::size_t>();
        summary[key] = total;
    }
    summary["pieces"] = Json::array();
    double volume = 0, mass = 0;
    bool closed = true, manifold = true;
    for (const Json& body : bodies) {
        for (const Json& piece : body["pieces"]) summary["pieces"].push_back(piece);
        volume += body["volume"].get<double>();
        mass += body["mass"].get<double>();
        closed = closed && body["closed"].get<bool>();
        manifold = manifold && body["manifold"].get<bool>();
    }
    summary["volume"] = volume;
    summary["mass"] = mass;
    summary["closed"] = closed;
    summary["manifold"] = manifold;
    summary["bodies"] = bodies;
    Json seconds = {{"setup", seconds_.setup}, {"simulate", seconds_.simulate}, {"write", seconds_.write}};
    for (std::size_t k = 0; k < body::stage_count; ++k) seconds[body::stage_names[k]] = seconds_.stages[k];
    summary["seconds"] = seconds;
    write_json(folder_.add("summary.json"), summary);
}

}  // namespace splitcubes::app
