#include "shrink.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <numeric>
#include <sstream>
#include <stdexcept>

namespace splitcubes::torture {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json read_scene(const fs::path& folder) {
    std::ifstream in(folder / "scene.json");
    if (!in) throw std::runtime_error((folder / "scene.json").string() + ": cannot be read");
    return Json::parse(in, nullptr, true, true);
}

// Tries scenes in a folder of their own.
class Trials {
  public:
    Trials(const Shrink& shrink) : shrink_(shrink), folder_(shrink.folder / "shrunk"), left_(shrink.trials) {
        fs::remove_all(folder_);
        fs::create_directories(folder_);
        for (const auto& entry : fs::directory_iterator(shrink.folder))
            if (entry.is_regular_file()) fs::copy(entry.path(), folder_ / entry.path().filename());
    }

    Verdict verdict(const Json& scene) {
        std::ofstream(folder_ / "scene.json") << scene.dump(1) << "\n";
        --left_;
        const Trial trial = run_trial(shrink_.program, folder_, shrink_.process);
        refused_ = trial.refused();
        return trial.verdict;
    }
    bool breaks(const Json& scene, Law law) {
        if (left_ <= 0) return false;
        return verdict(scene).breaks(law) && !refused_;
    }
    bool over() const { return left_ <= 0; }

  private:
    const Shrink& shrink_;
    fs::path folder_;
    int left_;
    bool refused_ = false;
};

Law first_broken(const Verdict& verdict) {
    for (const LawText& text : law_texts)
        if (verdict.breaks(text.law)) return text.law;
    throw std::runtime_error("the scene breaks no law");
}

using Change = std::function<void(Json&)>;

void erase(Json& json, const char* key) {
    if (json.is_object()) json.erase(key);
}

Change without(const char* key) {
    return [key](Json& scene) { erase(scene, key); };
}

Change of_bodies(const std::function<void(Json&)>& change) {
    return [change](Json& scene) {
        for (Json& body : scene["bodies"]) change(body);
    };
}

Change without_of_bodies(const char* key) {
    return of_bodies([key](Json& body) { erase(body, key); });
}

Change without_of_materials(const char* key) {
    return of_bodies([key](Json& body) {
        if (body.contains("material")) erase(body["material"], key);
    });
}

void keep_first_body(Json& scene) {
    if (scene["bodies"].size() < 2) return;
    const Json name = scene["bodies"][0]["name"];
    scene["bodies"] = Json::array({scene["bodies"][0]});
    for (const char* key : {"constraints", "handles"}) {
        if (!scene.contains(key)) continue;
        Json kept = Json::array();
        for (const Json& item : scene[key])
            if (item["body"] == name) kept.push_back(item);
        scene[key] = kept;
    }
    for (Json& tool : scene["tools"]) erase(tool, "bodies");
}

// A box in place of a mesh, of the same size.
void make_box(Json& body, const fs::path& folder) {
    if (!body["shape"].contains("mesh")) return;
    std::ifstream in(folder / body["shape"]["mesh"]["file"].get<std::string>());
    std::array<double, 3> low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
    for (std::string line; std::getline(in, line);) {
        std::istringstream words(line);
        std::string kind;
        words >> kind;
        if (kind != "v") continue;
        for (std::size_t k = 0; k < 3; ++k) {
            double x = 0;
            words >> x;
            low[k] = std::min(low[k], x);
            high[k] = std::max(high[k], x);
        }
    }
    Json size, center;
    for (std::size_t k = 0; k < 3; ++k) {
        size.push_back(high[k] - low[k]);
        center.push_back((high[k] + low[k]) / 2);
    }
    body["shape"] = {{"box", {{"size", size}}}};
    body["placement"] = {{"position", center}};
}

void coarser(Json& body) {
    for (const char* key : {"cell_size", "phyxel_spacing"})
        if (body.contains(key)) body[key] = body[key].get<double>() * 1.2;
}

// Leaves out keyframes after the last frame.
void keep_early_keyframes(Json& scene) {
    if (!scene.contains("frames") || !scene["frames"].is_number()) return;
    const double end = scene["frames"].get<int>() * scene.value("time_step", 1.0 / 60);
    for (const char* key : {"constraints", "colliders", "handles"}) {
        if (!scene.contains(key)) continue;
        for (Json& item : scene[key]) {
            if (!item.contains("keyframes")) continue;
            Json kept = Json::array();
            for (const Json& frame : item["keyframes"]) {
                kept.push_back(frame);
                if (frame["time"].get<double>() > end) break;
            }
            item["keyframes"] = kept;
        }
    }
}

// Ordered by how much simpler a scene becomes.
std::vector<Change> changes(const fs::path& folder) {
    std::vector<Change> out = {keep_first_body, of_bodies([folder](Json& body) { make_box(body, folder); })};
    for (const char* key : {"handles", "colliders", "constraints", "ground", "contact", "solver"})
        out.push_back(without(key));
    for (const char* key : {"velocity", "angular_velocity"}) out.push_back(without_of_bodies(key));
    for (const char* key :
         {"tearing", "plasticity", "mass_damping", "stiffness_damping", "cutting_resistance",
          "volume_stiffness", "model", "poisson_ratio", "youngs_modulus"})
        out.push_back(without_of_materials(key));
    out.emplace_back([](Json& scene) { scene["gravity"] = {0, 0, 0}; });
    out.push_back(without("gravity"));
    out.push_back(without("time_step"));
    for (const char* key : {"bodies", "side", "friction"})
        out.emplace_back([key](Json& scene) {
            for (Json& tool : scene["tools"]) erase(tool, key);
        });
    for (const char* key : {"solver", "contact"})
        out.emplace_back([key](Json& scene) {
            if (!scene.contains(key)) return;
            erase(scene[key], "integrator");
            erase(scene[key], "friction");
        });
    out.emplace_back([](Json& scene) { scene["constraints"][0]["kind"] = "hold"; });
    out.push_back(of_bodies(coarser));
    return out;
}

Json with_tools(const Json& scene, const std::vector<std::size_t>& chosen) {
    Json out = scene;
    out["tools"] = Json::array();
    for (const std::size_t k : chosen) out["tools"].push_back(scene["tools"][k]);
    return out;
}

}  // namespace

std::vector<std::size_t> smallest_failing(std::size_t count,
                                          const std::function<bool(const std::vector<std::size_t>&)>& fails) {
    std::vector<std::size_t> left(count);
    std::iota(left.begin(), left.end(), 0);
    if (count == 0 || fails({})) return {};
    for (std::size_t parts = 2; left.size() > 1;) {
        bool smaller = false;
        for (std::size_t part = 0; part < parts && !smaller; ++part) {
            const std::size_t from = part * left.size() / parts, until = (part + 1) * left.size() / parts;
            const auto at = [&](std::size_t k) { return left.begin() + static_cast<std::ptrdiff_t>(k); };
            const std::vector<std::size_t> inside(at(from), at(until));
            std::vector<std::size_t> outside(left.begin(), at(from));
            outside.insert(outside.end(), at(until), left.end());
            smaller = true;
            if (inside.size() < left.size() && fails(inside)) {
                left = inside;
                parts = 2;
            } else if (parts > 2 && !outside.empty() && fails(outside)) {
                left = outside;
                parts = std::max<std::size_t>(parts - 1, 2);
            } else {
                smaller = false;
            }
        }
        if (smaller) continue;
        if (parts >= left.size()) break;
        parts = std::min(2 * parts, left.size());
    }
    return left;
}

void shrink_scene(const Shrink& shrink) {
    Trials trials(shrink);
    Json scene = read_scene(shrink.folder);
    const Verdict verdict = trials.verdict(scene);
    const Law law = shrink.law ? *shrink.law : first_broken(verdict);
    if (!verdict.breaks(law))
        throw std::runtime_error(std::string("the scene does not break the law ") + text_of(law).name);
    const auto keep_if_it_fails = [&](Json changed) {
        if (changed == scene || !trials.breaks(changed, law)) return;
        scene = std::move(changed);
    };
    const auto end_at = [&](int frame) {
        Json shorter = scene;
        if (frame > 0 && scene.contains("frames")) shorter["frames"] = frame;
        keep_if_it_fails(shorter);
    };
    end_at(verdict.of(law).frame);
    const std::size_t tools = scene.contains("tools") ? scene["tools"].size() : 0;
    const Json all = scene;
    scene = with_tools(all, smallest_failing(tools, [&](const std::vector<std::size_t>& chosen) {
                           return trials.breaks(with_tools(all, chosen), law);
                       }));
    for (const Change& change : changes(shrink.folder)) {
        Json changed = scene;
        change(changed);
        keep_if_it_fails(changed);
    }
    end_at(trials.verdict(scene).of(law).frame);
    keep_early_keyframes(scene);
    const Verdict last = trials.verdict(scene);
    std::printf("%s: %zu of %zu blades%s; %s\n", text_of(law).name, scene["tools"].size(), tools,
                trials.over() ? ", stopped at the limit of trials" : "", text_of(last).c_str());
}

}  // namespace splitcubes::torture
