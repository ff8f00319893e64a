// splitcubes_torture: random scenes, and whether runs of them obey the laws.
#include "campaign.h"
#include "checker.h"
#include "corpus.h"
#include "generator.h"
#include "shrink.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <map>
#include <stdexcept>

namespace splitcubes::torture {

namespace {

namespace fs = std::filesystem;

constexpr const char* usage =
    "usage: splitcubes_torture COMMAND\n"
    "  make --seed S --out DIR                      writes a random scene and its meshes\n"
    "  check DIR RUN                                checks RUN, a run of DIR/scene.json\n"
    "  run --seeds A..B --program FILE --work DIR   makes, runs and checks scenes; goes on where it stopped\n"
    "      [--jobs N] [--time-limit S] [--memory GIB] [--keep all|failed|none] [--again]\n"
    "  shrink DIR --program FILE                    the smallest scene that breaks the same law, in "
    "DIR/shrunk\n"
    "      [--law NAME] [--trials N] [--time-limit S] [--memory GIB]\n"
    "  corpus DIR --program FILE --work DIR         runs the scenes of a corpus that hold, and says whether "
    "they do\n"
    "      [--status holds|fails] [--time-limit S] [--memory GIB]\n"
    "  laws                                         lists the laws and their bounds\n"
    "make and run: [--without FEATURE...] [--blades-at-most N] [--phyxels-at-most N] [--models DIR...]\n"
    "Exit codes: 0 all laws hold, 1 one is broken, 2 wrong usage.\n";

struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Words of the command line: positional ones, and lists by option.
class Words {
  public:
    Words(int count, char** words) {
        std::string option;
        for (int k = 2; k < count; ++k) {
            const std::string word = words[k];
            if (word.rfind("--", 0) == 0) {
                option = word.substr(2);
                options_[option];
            } else if (option.empty()) {
                positional_.push_back(word);
            } else {
                options_[option].push_back(word);
            }
        }
    }

    void allow(std::size_t positional, const std::vector<std::string>& options) const {
        if (positional_.size() != positional)
            throw UsageError(std::to_string(positional_.size()) + " folders are named, not " +
                             std::to_string(positional));
        for (const auto& [name, values] : options_)
            if (std::find(options.begin(), options.end(), name) == options.end())
                throw UsageError("--" + name + ": is no option of this command");
    }
    const std::string& positional(std::size_t k) const { return positional_[k]; }
    std::vector<std::string> list(const std::string& option) const {
        const auto found = options_.find(option);
        return found == options_.end() ? std::vector<std::string>{} : found->second;
    }
    std::string one(const std::string& option, const std::string& otherwise = {}) const {
        const auto found = options_.find(option);
        if (found == options_.end() && !otherwise.empty()) return otherwise;
        if (found == options_.end() || found->second.size() != 1)
            throw UsageError("--" + option + ": takes one value");
        return found->second[0];
    }
    bool has(const std::string& option) const { return options_.contains(option); }
    template <class T>
    T number(const std::string& option, T otherwise, T lowest) const {
        if (!options_.contains(option)) return otherwise;
        return parsed<T>(option, one(option), lowest);
    }
    template <class T>
    static T parsed(const std::string& option, const std::string& word, T lowest) {
        T out{};
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out);
        if (error != std::errc() || end != word.data() + word.size() || out < lowest)
            throw UsageError("--" + option + ": is no number of at least " + std::to_string(lowest) + " (" +
                             word + ")");
        return out;
    }

  private:
    std::vector<std::string> positional_;
    std::map<std::string, std::vector<std::string>> options_;
};

Limits limits_of(const Words& words) {
    Limits out;
    const std::vector<std::string>& known = feature_names();
    for (const std::string& name : words.list("without")) {
        if (std::find(known.begin(), known.end(), name) == known.end()) {
            std::string all;
            for (const std::string& other : known) all += " " + other;
            throw UsageError("--without: no such feature (" + name + "); there are" + all);
        }
        out.without.insert(name);
    }
    out.max_blades = words.number("blades-at-most", out.max_blades, 0);
    out.max_phyxels = words.number("phyxels-at-most", out.max_phyxels, 400);
    std::vector<std::string> folders = words.list("models");
    if (!words.has("models")) folders = {SPLITCUBES_MODEL_FOLDER};
    for (const std::string& folder : folders) {
        std::vector<fs::path> found;
        for (const auto& entry : fs::directory_iterator(folder))
            if (entry.path().extension() == ".obj" && entry.path().stem() != "sheet")
                found.push_back(entry.path());
        std::sort(found.begin(), found.end());
        out.models.insert(out.models.end(), found.begin(), found.end());
    }
    return out;
}

ProcessLimits process_of(const Words& words) {
    ProcessLimits out;
    out.seconds = words.number("time-limit", out.seconds, 0.1);
    out.memory_gib = words.number("memory", out.memory_gib, 0.0);
    return out;
}

int make(const Words& words) {
    words.allow(0, {"seed", "out", "without", "blades-at-most", "phyxels-at-most", "models"});
    const auto seed = Words::parsed<std::uint64_t>("seed", words.one("seed"), 0);
    write_scene(make_scene(seed, limits_of(words)), words.one("out"));
    return 0;
}

int check(const Words& words) {
    words.allow(2, {});
    const Verdict verdict = check_run(words.positional(0), words.positional(1));
    std::printf("%s: %s\n", verdict.holds() ? "holds" : "fails", text_of(verdict).c_str());
    return verdict.holds() ? 0 : 1;
}

int run(const Words& words) {
    words.allow(0, {"seeds", "program", "work", "jobs", "time-limit", "memory", "keep", "again", "without",
                    "blades-at-most", "phyxels-at-most", "models"});
    Campaign campaign;
    const std::string seeds = words.one("seeds");
    const std::size_t dots = seeds.find("..");
    if (dots == std::string::npos) throw UsageError("--seeds: is no range like 1..100 (" + seeds + ")");
    campaign.first = Words::parsed<std::uint64_t>("seeds", seeds.substr(0, dots), 0);
    campaign.last = Words::parsed<std::uint64_t>("seeds", seeds.substr(dots + 2), campaign.first);
    campaign.program = fs::absolute(words.one("program"));
    campaign.work = fs::absolute(words.one("work"));
    campaign.jobs = words.number("jobs", 1, 1);
    campaign.limits = limits_of(words);
    campaign.process = process_of(words);
    const std::string keep = words.one("keep", "failed");
    if (keep != "all" && keep != "failed" && keep != "none")
        throw UsageError("--keep: is neither all, failed nor none (" + keep + ")");
    campaign.keep = keep == "all" ? Keep::all : keep == "none" ? Keep::none : Keep::failed;
    if (words.has("again")) fs::remove(campaign.work / "report.jsonl");
    return run_campaign(campaign) ? 0 : 1;
}

int shrink(const Words& words) {
    words.allow(1, {"program", "law", "trials", "time-limit", "memory"});
    Shrink out;
    out.folder = fs::absolute(words.positional(0));
    out.program = fs::absolute(words.one("program"));
    if (words.has("law")) {
        out.law = law_of(words.one("law"));
        if (!out.law) throw UsageError("--law: no such law (" + words.one("law") + "); `laws` lists them");
    }
    out.trials = words.number("trials", out.trials, 2);
    out.process = process_of(words);
    shrink_scene(out);
    return 0;
}

int corpus(const Words& words) {
    words.allow(1, {"program", "work", "status", "time-limit", "memory"});
    const std::string status = words.one("status", "holds");
    if (status != "holds" && status != "fails")
        throw UsageError("--status: is neither holds nor fails (" + status + ")");
    const bool as_said = run_corpus(words.positional(0), status, fs::absolute(words.one("program")),
                                    fs::absolute(words.one("work")), process_of(words));
    return as_said ? 0 : 1;
}

int list_laws() {
    for (const LawText& text : law_texts)
        std::printf("%-18s %8.3g %-24s %s\n", text.name, text.bound, text.unit, text.sentence);
    return 0;
}

int command(int count, char** words) {
    const std::string name = count > 1 ? words[1] : "";
    const Words rest(count, words);
    if (name == "make") return make(rest);
    if (name == "check") return check(rest);
    if (name == "run") return run(rest);
    if (name == "shrink") return shrink(rest);
    if (name == "corpus") return corpus(rest);
    if (name == "laws") return list_laws();
    throw UsageError(name.empty() ? "a command is missing" : "no such command (" + name + ")");
}

}  // namespace

}  // namespace splitcubes::torture

int main(int count, char** words) {
    try {
        return splitcubes::torture::command(count, words);
    } catch (const splitcubes::torture::UsageError& error) {
        std::fprintf(stderr, "splitcubes_torture: %s\n%s", error.what(), splitcubes::torture::usage);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "splitcubes_torture: %s\n", error.what());
    }
    return 2;
}
