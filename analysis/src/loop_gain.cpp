#include "bf/analysis/loop_gain.hpp"

#include "bf/analysis/linearize.hpp"
#include "bf/analysis/response.hpp"
#include "named.hpp"

#include <algorithm>

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
    // A state moves when the input, or another one that moves, is in its equation.
    std::vector<bool> moves(static_cast<std::size_t>(system.A.rows()));
    for (bool goes_on = true; goes_on;) {
        goes_on = false;
        for (Eigen::Index i = 0; i < system.A.rows(); ++i) {
            if (moves[static_cast<std::size_t>(i)]) continue;
            bool its = !system.B.row(i).isZero(0);
            for (Eigen::Index k = 0; k < system.A.rows(); ++k)
                its = its || (moves[static_cast<std::size_t>(k)] && system.A(i, k) != 0);
            moves[static_cast<std::size_t>(i)] = its;
            goes_on = goes_on || its;
        }
    }
    std::vector<bool> all;
    for (Eigen::Index o = 0; o < system.D.rows(); ++o) {
        bool its = !system.D.row(o).isZero(0);
        for (Eigen::Index k = 0; k < system.A.rows(); ++k)
            its = its || (moves[static_cast<std::size_t>(k)] && system.C(o, k) != 0);
        all.push_back(its);
    }
    return all;
}

/// Blocks that follow after these, or stand before them, over wires.
std::vector<bool> reached(const Diagram& d, int from, bool backwards) {
    std::vector<bool> all(d.nodes.size());
    std::vector<int> left{from};
    while (!left.empty()) {
        const int n = left.back();
        left.pop_back();
        const auto see = [&](int other) {
            if (other < 0 || all[static_cast<std::size_t>(other)]) return;
            all[static_cast<std::size_t>(other)] = true;
            left.push_back(other);
        };
        if (backwards)
            for (const auto& source : d.nodes[static_cast<std::size_t>(n)].sources) see(source.node);
        else
            for (int other = 0; other < static_cast<int>(d.nodes.size()); ++other)
                for (const auto& source : d.nodes[static_cast<std::size_t>(other)].sources)
                    if (source.node == n) see(other);
    }
    return all;
}

} // namespace

std::string why_nothing_returns(Simulation& run, const std::string& signal,
                                const std::vector<std::string>& open) {
    const Diagram& d = run.diagram();
    const std::string begin = "nothing comes back to '" + signal + "': ";
    const SignalFinder finder(d);
    const auto cut = named(signal, [&](const std::string& path) { return finder.find(path); }).end;
    if (cut.node < 0) return begin + "no path leads from it to itself";
    const auto before = reached(d, cut.node, true), after = reached(d, cut.node, false);
    if (!before[static_cast<std::size_t>(cut.node)]) return begin + "no path leads from it to itself";
    // Which signals of blocks on the way change by what is added?
    LinearizeOptions options{.from = {signal}, .to = {}, .open = open};
    options.open.push_back(signal);
    std::vector<int> nodes;
    for (const auto& one : finder.all()) {
        const auto n = static_cast<std::size_t>(one.end.node);
        const Slot& slot = d.slot(one.end);
        if (!before[n] || !after[n] || slot.type != Type::float64) continue;
        options.to.push_back(one.path);
        nodes.push_back(one.end.node);
    }
    std::vector<bool> moves(d.nodes.size());
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
                if (changes[row]) moves[static_cast<std::size_t>(nodes[i])] = true;
        held = system.held;
    } catch (const RunError& error) {
        return begin + error.what();
    }
    std::vector<std::string> stops;
    for (std::size_t n = 0; n < d.nodes.size(); ++n) {
        if (!before[n] || !after[n] || moves[n]) continue;
        const auto& sources = d.nodes[n].sources;
        if (!std::any_of(sources.begin(), sources.end(), [&](const auto& source) {
                return source.node == cut.node ||
                       (source.node >= 0 && moves[static_cast<std::size_t>(source.node)]);
            }))
            continue;
        // "controller: it is disabled" tells more of what is in it.
        for (const auto& text : held)
            if (const auto owner = text.substr(0, text.find(':'));
                d.nodes[n].path == owner || d.nodes[n].path.starts_with(owner + "."))
                return begin + text;
        stops.push_back("'" + d.nodes[n].path + "'");
    }
    if (stops.empty()) return begin + "what is open lies in the loop";
    std::string all;
    for (const auto& one : stops) all += (all.empty() ? "" : ", ") + one;
    return begin + all + (stops.size() == 1 ? " passes" : " pass") +
           " no small change on; it stands at a limit, has steps, or its gain is 0: choose an operating "
           "point at which it does not, or measure the loop in simulation";
}

} // namespace bf::analysis
