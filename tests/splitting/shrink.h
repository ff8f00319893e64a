// Shrinking of failing cases: fewest nodes and cuts, simplest numbers, printed as code for a test.
#pragma once

#include "splitting/cut_case.h"

#include <algorithm>
#include <functional>
#include <iomanip>
#include <limits>
#include <sstream>
#include <string>

namespace splitcubes::splitting::cases {

/// Removes as many items as possible while `fails` stays true: no single item of the result can be removed.
/// Delta debugging (Zeller and Hildebrandt 2002): halves are tried first, then ever smaller parts.
/// fails(items) must hold.
template <class Item, class Fails>
std::vector<Item> shrink(std::vector<Item> items, const Fails& fails) {
    std::size_t parts = 2;
    while (!items.empty()) {
        const std::size_t length = (items.size() + parts - 1) / parts;
        bool smaller = false;
        for (std::size_t begin = 0; begin < items.size() && !smaller; begin += length) {
            std::vector<Item> rest = items;
            rest.erase(rest.begin() + static_cast<long>(begin),
                       rest.begin() + static_cast<long>(std::min(items.size(), begin + length)));
            if (!fails(rest)) continue;
            items = std::move(rest);
            smaller = true;
        }
        if (smaller)
            parts = std::max<std::size_t>(parts - 1, 2);
        else if (length <= 1)
            break;
        else
            parts = std::min(2 * parts, items.size());
    }
    return items;
}

using Fails = std::function<bool(const CutCase&)>;

/// Returns a minimal case that still fails: no cut and no node can be removed, and parameters, normals and
/// cut indices are simple if they do not matter.
inline CutCase shrink_case(CutCase c, const Fails& fails) {
    for (std::size_t before = 0; before != c.cuts.size() + c.inside.size() + 1;) {
        before = c.cuts.size() + c.inside.size() + 1;
        c.cuts = shrink(c.cuts, [&](const std::vector<EdgeCut>& cuts) {
            return fails({c.node_count, c.inside, cuts});
        });
        c.inside = shrink(c.inside, [&](const std::vector<Vec3i>& inside) {
            return fails({c.node_count, inside, c.cuts});
        });
    }
    for (std::size_t i = 0; i < c.cuts.size(); ++i) {
        const auto try_change = [&](const auto& change) {
            CutCase plainer = c;
            change(plainer.cuts[i]);
            if (fails(plainer)) c = plainer;
        };
        try_change([](EdgeCut& e) { e.parameter = 0.5; });
        try_change([](EdgeCut& e) { e.normal = Vec3::Zero(); });
        try_change([](EdgeCut& e) { e.cut = std::min(e.cut, 0); });
    }
    return c;
}

/// Returns C++ code of the case, to the last bit.
inline std::string as_code(const CutCase& c) {
    std::ostringstream out;
    out << std::setprecision(std::numeric_limits<double>::max_digits10);
    const auto triple = [&](const auto& v) { out << '{' << v[0] << ", " << v[1] << ", " << v[2] << '}'; };
    out << "const CutCase found{";
    triple(c.node_count);
    out << ", {";
    for (const Vec3i& n : c.inside) {
        out << (&n == c.inside.data() ? "" : ", ");
        triple(n);
    }
    out << "}, {";
    for (const EdgeCut& e : c.cuts) {
        out << (&e == c.cuts.data() ? "" : ",") << "\n    {{";
        triple(e.edge.node);
        out << ", " << e.edge.axis << "}, " << e.parameter << ", ";
        triple(e.normal);
        out << ", " << e.cut << '}';
    }
    out << "}};\n";
    return out.str();
}

/// Returns the message for a failing assertion: the minimal case and why it fails. trouble: returns the fault
/// of a case, empty if there is none.
inline std::string shrunk_report(const CutCase& c,
                                 const std::function<std::string(const CutCase&)>& trouble) {
    const CutCase minimal = shrink_case(c, [&](const CutCase& some) { return !trouble(some).empty(); });
    return trouble(minimal) + "; shrunk to " + std::to_string(minimal.cuts.size()) + " cuts and " +
           std::to_string(minimal.inside.size()) + " nodes:\n" + as_code(minimal);
}

}  // namespace splitcubes::splitting::cases
