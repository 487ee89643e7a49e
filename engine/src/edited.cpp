// What of a run stays when its model is edited, besides its state.
#include "bf/engine/handover.hpp"

#include "bf/base/numbers.hpp"
#include "succession.hpp"

#include <algorithm>

namespace bf {

namespace {

/// What a model gives a variable or a parameter, as text; empty: it has no such. `numbers`: see numbers_now.
std::string given(const Diagram& diagram, const std::string& name, const std::vector<int>& numbers = {}) {
    for (const auto& definition : diagram.definitions)
        if (definition.kind == Definition::Kind::variable && definition.path == name)
            return definition.value.to_text();
    const Node::End parameter = diagram.find_parameter(name);
    if (parameter.node < 0) return "";
    std::string text = "given";
    for (const double x : diagram.slot(parameter).initial)
        text += " " + number_text(number_now(numbers, x).value_or(0));
    return text;
}

} // namespace

bool is_same_run(const Diagram& a, const Diagram& b) {
    if (fingerprint(a) != fingerprint(b) || a.stop != b.stop ||
        a.refuses_non_finite != b.refuses_non_finite ||
        a.solver.relative_tolerance != b.solver.relative_tolerance ||
        a.solver.absolute_tolerance != b.solver.absolute_tolerance || a.solver.max_step != b.solver.max_step)
        return false;
    // Of the same fingerprint they have the same nodes and slots.
    for (std::size_t n = 0; n < a.nodes.size(); ++n) {
        const auto &one = a.nodes[n].block->resolution().slots, &other = b.nodes[n].block->resolution().slots;
        const auto is_same = [](const Slot& x, const Slot& y) { return x.initial == y.initial; };
        if (a.nodes[n].arguments != b.nodes[n].arguments || !std::ranges::equal(one, other, is_same))
            return false;
    }
    const auto names_the_same = [](const SignalName& x, const SignalName& y) {
        return x.path == y.path && x.end.node == y.end.node && x.end.slot == y.end.slot;
    };
    if (!std::ranges::equal(a.aliases, b.aliases, names_the_same))
        return false; // names of signals, by which these are asked for
    const auto is_same = [](const Definition& x, const Definition& y) {
        return x.path == y.path && x.text == y.text;
    };
    return std::ranges::equal(a.definitions, b.definitions, is_same); // a change follows them
}

std::vector<std::string> unclear(const Diagram& from, const Diagram& to) {
    std::vector<std::string> sentences;
    for (const auto& [one, two] : exchanged(from, to))
        sentences.push_back("'" + one + "' and '" + two +
                            "' look as if they had exchanged their names in the file: their states stay with "
                            "the names; rename the blocks in the page, and the states go along");
    return sentences;
}

std::vector<ParameterValue> still_asked(const Diagram& from, const Diagram& to,
                                        const std::vector<ParameterValue>& asked,
                                        const PathSince& path_since) {
    const SamePath is_same = [&](const auto& before, const auto& now) { return path_since(before) == now; };
    std::vector<ParameterValue> still;
    for (const ParameterValue& value : asked) {
        const auto path = path_since(value.path);
        if (!path && from.find_parameter(value.path).node >= 0) continue; // its block is gone
        ParameterValue now{path && !given(to, *path).empty() ? *path : value.path, {}};
        const Node::End was = from.find_parameter(value.path), is = to.find_parameter(now.path);
        std::vector<int> numbers;
        if (was.node >= 0 && is.node >= 0) numbers = numbers_now(from, was, to, is, is_same);
        const std::string text = given(from, value.path, numbers);
        if (text.empty() || text != given(to, now.path)) continue;
        for (const double x : value.values)
            if (const auto number = number_now(numbers, x)) now.values.push_back(*number);
        if (now.values.size() == value.values.size()) still.push_back(std::move(now));
    }
    return still;
}

std::vector<ParameterValue> set_again(Run& run, const std::vector<ParameterValue>& asked) {
    std::vector<ParameterValue> set;
    for (const auto& value : asked) try {
            ParameterChange change = run.prepare(run.follow({value}));
            if (!run.apply(change)) continue;
            run.accept({value});
            set.push_back(value);
        } catch (const std::runtime_error&) { // the edited model does not take it any more
        }
    return set;
}

} // namespace bf
