#include "bf/analysis/loop_gain.hpp"

#include "bf/analysis/linearize.hpp"
#include "bf/analysis/response.hpp"
#include "named.hpp"

#include <algorithm>
#include <iterator>
#include <set>

namespace bf::analysis {

LinearSystem loop_gain(Simulation& run, const std::string& signal, const std::vector<std::string>& open) {
    LinearizeOptions options{.from = {signal}, .to = {signal}, .open = open};
    options.open.push_back(signal);
    auto system = linearize(run, options);
    if (system.inputs.size() != 1)
        throw RunError("'" + signal + "' has " + std::to_string(system.inputs.size()) +
                       " elements; name one of them, as '" + signal + "[1]'");
    return negative(std::move(system));
}

bool is_nothing(const LinearSystem& system) {
    return system.D.isZero(0) && (system.C.isZero(0) || system.B.isZero(0));
}

namespace {

/// Outputs that change with the input.
std::vector<bool> changing(const LinearSystem& system) {
    std::set<int> first;
    for (Eigen::Index i = 0; i < system.B.rows(); ++i)
        if (!system.B.row(i).isZero(0)) first.insert(static_cast<int>(i));
    const auto moving = reached(std::move(first), [&](int k, auto&& go) {
        for (Eigen::Index i = 0; i < system.A.rows(); ++i)
            if (system.A(i, k) != 0) go(static_cast<int>(i));
    });
    std::vector<bool> all;
    for (Eigen::Index o = 0; o < system.D.rows(); ++o)
        all.push_back(!system.D.row(o).isZero(0) ||
                      std::ranges::any_of(moving, [&](int k) { return system.C(o, k) != 0; }));
    return all;
}

/// Blocks on loops over wires through that one.
std::set<int> on_loops(const Diagram& d, int through) {
    std::vector<std::vector<int>> readers(d.nodes.size()), sources(d.nodes.size());
    for (std::size_t n = 0; n < d.nodes.size(); ++n)
        for (const auto& source : d.nodes[n].sources)
            if (source.node >= 0) {
                readers[static_cast<std::size_t>(source.node)].push_back(static_cast<int>(n));
                sources[n].push_back(source.node);
            }
    const auto along = [through](const auto& next) {
        const auto& first = next[static_cast<std::size_t>(through)];
        return reached({first.begin(), first.end()}, [&](int n, auto&& go) {
            for (const int other : next[static_cast<std::size_t>(n)]) go(other);
        });
    };
    std::set<int> both;
    std::ranges::set_intersection(along(readers), along(sources), std::inserter(both, both.end()));
    return both;
}

} // namespace

std::string why_nothing_returns(Simulation& run, const std::string& signal,
                                const std::vector<std::string>& open) {
    const Diagram& d = run.diagram();
    const std::string begin = "nothing comes back to '" + signal + "': ";
    const SignalFinder finder(d);
    const auto cut = named(signal, [&](const std::string& path) { return finder.find(path); }).end;
    if (cut.node < 0) return begin + "no path leads from it to itself";
    const auto on_loop = on_loops(d, cut.node);
    if (on_loop.empty()) return begin + "no path leads from it to itself";
    // Which signals of blocks on the way change by what is added?
    LinearizeOptions options{.from = {signal}, .to = {}, .open = open};
    options.open.push_back(signal);
    std::vector<int> nodes;
    for (const auto& one : finder.all()) {
        if (!on_loop.contains(one.end.node) || d.slot(one.end).type != Type::float64) continue;
        options.to.push_back(one.path);
        nodes.push_back(one.end.node);
    }
    std::set<int> moving;
    std::vector<std::string> held;
    try {
        const auto system = linearize(run, options);
        const auto changes = changing(system);
        std::size_t row = 0;
        for (std::size_t i = 0; i < options.to.size(); ++i)
            for (; row < changes.size() && system.outputs[row].starts_with(options.to[i]) &&
                   (system.outputs[row].size() == options.to[i].size() ||
                    system.outputs[row][options.to[i].size()] == '[');
                 ++row)
                if (changes[row]) moving.insert(nodes[i]);
        held = system.held;
    } catch (const RunError& error) {
        return begin + error.what();
    }
    std::vector<std::string> stops;
    for (const int n : on_loop) {
        const DiagramNode& node = d.nodes[static_cast<std::size_t>(n)];
        if (moving.contains(n) || std::ranges::none_of(node.sources, [&](const auto& source) {
                return source.node == cut.node || moving.contains(source.node);
            }))
            continue;
        // "controller: it is disabled" tells more of what is in it.
        for (const auto& text : held)
            if (const auto owner = text.substr(0, text.find(':'));
                node.path == owner || node.path.starts_with(owner + "."))
                return begin + text;
        stops.push_back("'" + node.path + "'");
    }
    if (stops.empty()) return begin + "what is open lies in the loop";
    std::string all;
    for (const auto& one : stops) all += (all.empty() ? "" : ", ") + one;
    return begin + all + (stops.size() == 1 ? " passes" : " pass") +
           " no small change on; it stands at a limit, has steps, or its gain is 0: choose an operating "
           "point at which it does not, or measure the loop in simulation";
}

} // namespace bf::analysis
