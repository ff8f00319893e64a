// Computes the cases of `splitcubes bench validation` with linear and quadratic tetrahedra, on meshes with as
// many free nodes as the cases have free phyxels: bench_tetrahedra FILE.json
#include "cases.h"

#include <splitcubes/core/atomic_file.h>
#include <splitcubes/core/error.h>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <iostream>

namespace splitcubes::tetrahedra {

namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Outcome& outcome) {
    return {{"elements", outcome.elements},     {"nodes", outcome.nodes},
            {"free_nodes", outcome.free_nodes}, {"measured", outcome.measured},
            {"expected", outcome.expected},     {"error", outcome.error()}};
}

void print(const Case& item, const char* order, const Outcome& outcome) {
    const std::string across = item.across == 0 ? "fine" : std::to_string(item.across);
    std::printf("| %-18s | %6s | %9s | %5d | %5zu | %10.4g | %10.4g | %+7.1f |\n", item.test.c_str(),
                across.c_str(), order, item.free_phyxels, outcome.free_nodes, outcome.measured,
                outcome.expected, 100 * outcome.error());
    std::fflush(stdout);
}

void run(const std::string& path) {
    check_file_target(path);
    std::printf("| test | across | tetrahedra | wanted | free nodes | measured | expected | error %% |\n");
    std::printf("|---|---|---|---|---|---|---|---|\n");
    Json points = Json::array(), fine = Json::array();
    for (const Case& item : validation_cases()) {
        Json point = {{"test", item.test}, {"unit", item.unit}};
        if (item.across == 0) {
            const Outcome outcome = item.run(Order::quadratic, item.free_phyxels);
            print(item, "quadratic", outcome);
            point.update(json_of(outcome));
            fine.push_back(point);
            continue;
        }
        point["across"] = item.across;
        for (const auto& [name, order] :
             {std::pair{"linear", Order::linear}, {"quadratic", Order::quadratic}}) {
            const Outcome outcome = item.run(order, item.free_phyxels);
            print(item, name, outcome);
            point[name] = json_of(outcome);
        }
        points.push_back(point);
    }
    const Json json = {{"bench", "tetrahedra"}, {"points", points}, {"fine", fine}};
    write_file(path, json.dump(1) + '\n');
}

}  // namespace

}  // namespace splitcubes::tetrahedra

int main(int argc, char** argv) {
    try {
        if (argc != 2)
            throw splitcubes::InputError("arguments", "there are " + std::to_string(argc - 1),
                                         "give one, the JSON file to write");
        splitcubes::tetrahedra::run(argv[1]);
        return 0;
    } catch (const splitcubes::InputError& error) {
        std::cerr << "bench_tetrahedra: " << error.what() << '\n';
        return 2;
    } catch (const std::exception& error) {
        std::cerr << "bench_tetrahedra: " << error.what() << '\n';
        return 1;
    }
}
