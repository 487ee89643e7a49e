#include "channel.hpp"

#include "bf/base/names.hpp"
#include "differential.hpp"
#include "named.hpp"

#include <algorithm>
#include <numeric>

namespace bf::analysis {

Channel whole(const Diagram& d, const Node::End& end) {
    Channel channel{end, std::vector<int>(static_cast<std::size_t>(d.slot(end).size.count()))};
    std::iota(channel.elements.begin(), channel.elements.end(), 0);
    return channel;
}

std::string name(const Diagram& d, const Channel& channel, int element) {
    const std::string text = channel.name.empty() ? d.end_path(channel.end) : channel.name;
    return d.slot(channel.end).size.count() == 1 ? text : text + d.element_text(channel.end, element);
}

Channel ChannelFinder::find(const std::string& name) const {
    const auto its = named(name, [&](const std::string& path) {
        const auto signal = signals_.find(path);
        return signal.node >= 0 ? signal : find_state(d_, path);
    });
    if (its.end.node < 0) {
        std::vector<std::string> names;
        for (const auto& one : signals_.all()) names.push_back(one.path);
        for (const auto& node : d_.nodes) names.push_back(node.path);
        throw RunError("the model has no signal or state '" + its.path + "'" + did_you_mean(its.path, names));
    }
    const Slot& slot = d_.slot(its.end);
    if (!is_real(slot.type))
        throw RunError("'" + its.path + "' is of type " + bf::name(slot.type) +
                       ", which does not change by little; choose a signal of real numbers");
    const auto found = elements(d_, its);
    if (its.element.empty() || !found.empty()) return {its.end, found, its.path};
    const int count = slot.size.count();
    if (count == 1) throw RunError("'" + its.path + "' has a single element, and not " + its.element);
    std::string known;
    for (int i = 0; i < std::min(count, 6); ++i) known += (i ? ", " : "") + d_.element_text(its.end, i);
    throw RunError("'" + its.path + "' has no element " + its.element + "; it has " + std::to_string(count) +
                   ": " + known + (count > 6 ? ", ..." : ""));
}

std::vector<Channel> ChannelFinder::find(const std::vector<std::string>& names) const {
    std::vector<Channel> found;
    for (const auto& name : names) found.push_back(find(name));
    return found;
}

std::vector<Channel> ChannelFinder::of_root(const std::vector<SignalName>& ports, const std::string& what,
                                            const std::string& option) const {
    std::vector<Channel> found;
    for (const auto& port : ports)
        if (is_real(d_.slot(port.end).type)) {
            found.push_back(whole(d_, port.end));
            found.back().name = port.path;
        }
    if (found.empty())
        throw RunError("the model has no " + what + " at its root that is a real number; name signals with " +
                       option);
    return found;
}

} // namespace bf::analysis
