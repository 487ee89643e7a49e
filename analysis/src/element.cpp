#include "element.hpp"

#include "bf/core/registry.hpp"
#include "bf/run/run.hpp"

namespace bf::analysis {

Element find_element(const Diagram& d, const std::string& name) {
    const SignalFinder finder(d);
    std::vector<SignalName> states;
    for (int n = 0; n < static_cast<int>(d.nodes.size()); ++n) {
        const auto& slots = d.nodes[static_cast<std::size_t>(n)].block->resolution().slots;
        for (int s = 0; s < static_cast<int>(slots.size()); ++s)
            if (is_state(slots[static_cast<std::size_t>(s)].role))
                states.push_back({d.end_path({n, s}), {n, s}});
    }
    const auto look = [&](const std::string& path) {
        Node::End end = finder.find(path);
        for (const auto& state : states)
            if (end.node < 0 && state.path == path) end = state.end;
        return end;
    };
    std::string whole = name, element;
    Node::End end = look(name);
    if (const auto bracket = name.find('['); end.node < 0 && bracket != std::string::npos) {
        whole = name.substr(0, bracket);
        element = name.substr(bracket);
        end = look(whole);
    }
    if (end.node < 0) {
        std::vector<std::string> known;
        for (const auto* all : {&finder.all(), static_cast<const std::vector<SignalName>*>(&states)})
            for (const auto& one : *all) known.push_back(one.path);
        for (const auto& node : d.nodes) known.push_back(node.path);
        throw RunError("the model has no signal or state '" + whole + "'" + did_you_mean(whole, known));
    }
    const Slot& slot = d.slot(end);
    if (slot.type != Type::float64 && slot.type != Type::float32)
        throw RunError("'" + whole + "' is of type " + bf::name(slot.type) +
                       ", which does not change by little; choose a signal of real numbers");
    const int count = slot.size.count();
    const std::string unit = slot.unit.text == any_unit.text ? "" : std::string(slot.unit.text);
    for (int e = 0; e < count; ++e) {
        const std::string text = d.element_text(end, e), number = "[" + std::to_string(e + 1) + "]";
        if (element.empty() ? count == 1 : element == text || element == number)
            return {end, e, count == 1 ? whole : whole + text, unit};
    }
    throw RunError("'" + whole + "' has " + std::to_string(count) + (count == 1 ? " element" : " elements") +
                   (element.empty() ? "; name one of them, as '" + whole + "[1]'" : ", and not " + element));
}

} // namespace bf::analysis
