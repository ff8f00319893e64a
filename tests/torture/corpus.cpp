#include "corpus.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>

namespace splitcubes::torture {

namespace {

namespace fs = std::filesystem;

std::vector<std::string> cells_of(const std::string& line) {
    std::vector<std::string> out;
    std::istringstream in(line.substr(1));
    for (std::string cell; std::getline(in, cell, '|');) {
        const std::size_t from = cell.find_first_not_of(" `"), until = cell.find_last_not_of(" `");
        out.push_back(from == std::string::npos ? "" : cell.substr(from, until - from + 1));
    }
    return out;
}

void check_row(const fs::path& folder, const CorpusRow& row) {
    const std::string where = (folder / "README.md").string() + ": " + row.scene + ": ";
    if (!fs::exists(folder / (row.scene + ".json")))
        throw std::runtime_error(where + "there is no such scene");
    if (row.status != "holds" && row.status != "fails")
        throw std::runtime_error(where + "the status is neither holds nor fails (" + row.status + ")");
    if (!law_of(row.law)) throw std::runtime_error(where + "there is no such law (" + row.law + ")");
}

}  // namespace

std::vector<CorpusRow> read_corpus(const fs::path& folder) {
    std::vector<CorpusRow> out;
    std::set<std::string> named;
    std::ifstream in(folder / "README.md");
    for (std::string line; std::getline(in, line);) {
        if (line.rfind("| `", 0) != 0) continue;
        const std::vector<std::string> cells = cells_of(line);
        if (cells.size() < 6)
            throw std::runtime_error((folder / "README.md").string() + ": a row has six cells: " + line);
        out.push_back({cells[0], cells[1], cells[2], cells[5]});
        check_row(folder, out.back());
        named.insert(cells[0]);
    }
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.path().extension() == ".json" && !named.contains(entry.path().stem().string()))
            throw std::runtime_error(entry.path().string() + ": has no row in README.md");
    return out;
}

bool run_corpus(const fs::path& folder, const std::string& status, const fs::path& program,
                const fs::path& work, const ProcessLimits& limits) {
    bool as_said = true;
    std::size_t count = 0;
    for (const CorpusRow& row : read_corpus(folder)) {
        if (row.status != status) continue;
        ++count;
        const fs::path scene = work / row.scene;
        fs::remove_all(scene);
        fs::create_directories(scene);
        fs::copy(folder / (row.scene + ".json"), scene / "scene.json");
        for (const auto& entry : fs::directory_iterator(folder))
            if (entry.path().extension() == ".obj") fs::copy(entry.path(), scene / entry.path().filename());
        const Verdict verdict = run_trial(program, scene, limits).verdict;
        const bool right = status == "holds" ? verdict.holds() : verdict.breaks(*law_of(row.law));
        std::printf("%s %s, %s: %s\n", row.scene.c_str(), verdict.holds() ? "holds" : "fails",
                    right ? "as the table says" : "NOT as the table says", text_of(verdict).c_str());
        as_said = as_said && right;
    }
    if (count == 0) throw std::runtime_error(folder.string() + ": no scene has the status " + status);
    return as_said;
}

}  // namespace splitcubes::torture
