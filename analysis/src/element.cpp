#include "element.hpp"

#include "bf/base/names.hpp"
#include "bf/run/run.hpp"
#include "named.hpp"

namespace bf::analysis {

Element find_element(const Diagram& d, const std::string& name) {
    const SignalFinder finder(d);
    const auto [end, whole, element] = named(name, [&](const std::string& path) {
        const Node::End signal = finder.find(path);
        return signal.node >= 0 ? signal : find_state(d, path);
    });
    if (end.node < 0) {
        std::vector<std::string> known;
        for (const auto& signal : finder.all()) known.push_back(signal.path);
        for (const auto& node : d.nodes) {
            known.push_back(node.path);
            for (const auto& slot : node.block->resolution().slots)
                if (is_state(slot.role)) known.push_back(node.path + "." + slot.name);
        }
        throw RunError("the model has no signal or state '" + whole + "'" + did_you_mean(whole, known));
    }
    const Slot& slot = d.slot(end);
    if (slot.type != Type::float64 && slot.type != Type::float32)
        throw RunError("'" + whole + "' is of type " + bf::name(slot.type) +
                       ", which does not change by little; choose a signal of real numbers");
    const int count = slot.size.count();
    const auto meant = elements(d, {end, whole, element});
    if (meant.size() != 1)
        throw RunError(
            "'" + whole + "' has " + std::to_string(count) + (count == 1 ? " element" : " elements") +
            (element.empty() ? "; name one of them, as '" + whole + "[1]'" : ", and not " + element));
    const std::string unit = slot.unit.text == any_unit.text ? "" : std::string(slot.unit.text);
    return {end, meant[0], count == 1 ? whole : whole + d.element_text(end, meant[0]), unit};
}

} // namespace bf::analysis
