#include "campaign.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>
#include <mutex>
#include <stdexcept>
#include <thread>

namespace splitcubes::torture {

namespace {

namespace fs = std::filesystem;

std::string limits_text(const Limits& limits) {
    std::string out = "blades " + std::to_string(limits.max_blades) + ", phyxels " +
                      std::to_string(limits.max_phyxels) + ", models " + std::to_string(limits.models.size());
    for (const std::string& name : limits.without) out += ", without " + name;
    return out;
}

// The lines of earlier runs, by seed. A line that was cut off is forgotten.
class Report {
  public:
    Report(const fs::path& file, const std::string& limits) : file_(file) {
        std::ifstream in(file);
        for (std::string line; std::getline(in, line);) {
            const Json json = Json::parse(line, nullptr, false);
            if (json.is_discarded() || !json.contains("seed")) continue;
            if (json.at("limits") != limits)
                throw std::runtime_error(file.string() + ": is of other limits (" +
                                         json.at("limits").get<std::string>() +
                                         "); give the same ones, or another --work");
            lines_[json["seed"].get<std::uint64_t>()] = json;
        }
        std::string text;
        for (const auto& [seed, json] : lines_) text += json.dump() + "\n";
        std::ofstream(file) << text;
    }

    bool has(std::uint64_t seed) const { return lines_.contains(seed); }
    void add(std::uint64_t seed, const Json& json) {
        lines_[seed] = json;
        std::ofstream(file_, std::ios::app) << json.dump() << std::endl;
    }
    const std::map<std::uint64_t, Json>& lines() const { return lines_; }

  private:
    fs::path file_;
    std::map<std::uint64_t, Json> lines_;
};

struct Outcome {
    Json json;
    std::string line;
    bool holds = false;
};

Json features_of(const Json& scene) {
    const Json& body = scene["bodies"][0];
    const Json& material = body["material"];
    Json out = {{"bodies", scene["bodies"].size()},
                {"blades", scene["tools"].size()},
                {"explicit", scene["solver"]["kind"] == "explicit"},
                {"model", material["model"]},
                {"youngs_modulus", material["youngs_modulus"]},
                {"time_step", scene["time_step"]},
                {"contact", scene["contact"]["pieces"]}};
    for (const char* name : {"ground", "colliders", "constraints", "handles"})
        out[name] = scene.contains(name);
    for (const char* name : {"plasticity", "tearing"}) out[name] = material.contains(name);
    return out;
}

Outcome run_seed(const Campaign& campaign, std::uint64_t seed) {
    const fs::path folder = campaign.work / std::to_string(seed);
    const GeneratedScene scene = make_scene(seed, campaign.limits);
    write_scene(scene, folder);
    const Trial trial = run_trial(campaign.program, folder, campaign.process);
    Outcome out;
    out.holds = trial.verdict.holds();
    const std::string verdict = trial.refused() ? "refused" : out.holds ? "holds" : "fails";
    out.json = {{"seed", seed},
                {"limits", limits_text(campaign.limits)},
                {"verdict", verdict},
                {"seconds", trial.ended.seconds},
                {"features", features_of(scene.scene)},
                {"laws", to_json(trial.verdict)}};
    std::array<char, 64> begin;
    std::snprintf(begin.data(), begin.size(), "seed %llu %s %.1f s: ", static_cast<unsigned long long>(seed),
                  verdict.c_str(), trial.ended.seconds);
    out.line = begin.data() + text_of(trial.verdict);
    const bool stays = campaign.keep == Keep::all || (campaign.keep == Keep::failed && !out.holds);
    if (!stays) fs::remove_all(folder);
    return out;
}

// Prints the counts of the campaign's seeds, in this run and in earlier ones. Returns whether all hold.
bool print_summary(const Campaign& campaign, const Report& report) {
    std::size_t count = 0, held = 0, row = 0, longest = 0, refused = 0;
    std::map<std::string, std::size_t> measured, broken;
    for (const auto& [seed, json] : report.lines()) {
        if (seed < campaign.first || seed > campaign.last) continue;
        ++count;
        const bool holds = json["verdict"] == "holds";
        held += holds;
        refused += json["verdict"] == "refused";
        row = holds ? row + 1 : 0;
        longest = std::max(longest, row);
        for (const auto& [name, law] : json["laws"].items()) {
            ++measured[name];
            broken[name] += law["broken"].get<bool>();
        }
    }
    std::printf("\n%zu scenes: %zu hold, %zu fail, %zu refused; %zu in a row\n", count, held,
                count - held - refused, refused, longest);
    std::printf("%-20s %9s %9s\n", "law", "measured", "broken");
    for (const LawText& text : law_texts)
        std::printf("%-20s %9zu %9zu\n", text.name, measured[text.name], broken[text.name]);
    return held == count;
}

}  // namespace

bool run_campaign(const Campaign& campaign) {
    fs::create_directories(campaign.work);
    Report report(campaign.work / "report.jsonl", limits_text(campaign.limits));
    std::vector<std::uint64_t> seeds;
    for (std::uint64_t seed = campaign.first; seed <= campaign.last; ++seed)
        if (!report.has(seed)) seeds.push_back(seed);
    std::atomic<std::size_t> next = 0;
    std::mutex mutex;
    std::string failure;
    const auto work = [&] {
        for (std::size_t k = next++; k < seeds.size(); k = next++) {
            try {
                const Outcome outcome = run_seed(campaign, seeds[k]);
                const std::lock_guard lock(mutex);
                std::printf("%s\n", outcome.line.c_str());
                std::fflush(stdout);
                report.add(seeds[k], outcome.json);
            } catch (const std::exception& error) {
                const std::lock_guard lock(mutex);
                failure = error.what();
                next = seeds.size();
            }
        }
    };
    std::vector<std::thread> threads;
    for (int k = 0; k < campaign.jobs; ++k) threads.emplace_back(work);
    for (std::thread& thread : threads) thread.join();
    if (!failure.empty()) throw std::runtime_error(failure);
    return print_summary(campaign, report);
}

}  // namespace splitcubes::torture
