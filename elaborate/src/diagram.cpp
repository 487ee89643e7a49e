#include "bf/elaborate/diagram.hpp"

namespace bf {

std::vector<Node> Diagram::context_nodes() const {
    std::vector<Node> list;
    list.reserve(nodes.size());
    for (const auto& node : nodes)
        list.push_back({node.block.get(), node.methods, node.sources, node.providers, node.rate});
    return list;
}

int Diagram::find_node(const std::string& path) const {
    for (std::size_t n = 0; n < nodes.size(); ++n)
        if (nodes[n].path == path) return static_cast<int>(n);
    return -1;
}

std::vector<SignalName> Diagram::signals() const {
    std::vector<SignalName> all;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        if (nodes[n].type == "Outport") continue; // known by its alias
        const auto& slots = nodes[n].block->declaration().slots;
        for (std::size_t i = 0; i < slots.size(); ++i)
            if (slots[i].role == Role::output)
                all.push_back(
                    {nodes[n].path + "." + slots[i].name, {static_cast<int>(n), static_cast<int>(i)}});
    }
    all.insert(all.end(), aliases.begin(), aliases.end());
    return all;
}

std::vector<SignalName> Diagram::match_signals(const std::string& pattern) const {
    const bool is_glob = pattern.ends_with('*');
    const std::string prefix = is_glob ? pattern.substr(0, pattern.size() - 1) : pattern;
    std::vector<SignalName> found, children;
    for (const auto& signal : signals()) {
        if (is_glob ? signal.path.starts_with(prefix) : signal.path == prefix) found.push_back(signal);
        if (signal.path.starts_with(prefix + ".") &&
            signal.path.find('.', prefix.size() + 1) == std::string::npos)
            children.push_back({prefix, signal.end});
    }
    if (is_glob || !found.empty()) return found;
    if (children.size() == 1) return children; // a block or subsystem with one output
    // A sink, or one of its inputs, is seen through what drives it; a state through its memory.
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        if (!prefix.starts_with(nodes[n].path)) continue;
        const auto& slots = nodes[n].block->declaration().slots;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            const bool is_named = nodes[n].path + "." + slots[i].name == prefix;
            if (slots[i].role == Role::discrete_state && is_named)
                return {{prefix, {static_cast<int>(n), static_cast<int>(i)}}};
            if (slots[i].role == Role::input && nodes[n].sources[i].node >= 0 &&
                (is_named || nodes[n].path == prefix))
                return {{prefix, nodes[n].sources[i]}};
        }
    }
    return {};
}

Node::End Diagram::find_signal(const std::string& path) const {
    const auto found = match_signals(path);
    return found.empty() || path.ends_with('*') ? Node::End{} : found.front().end;
}

} // namespace bf
