#include "named.hpp"

#include <numeric>

namespace bf::analysis {

Node::End origin(const Diagram& d, const Node::End& end) {
    const auto& sources = d.nodes[static_cast<std::size_t>(end.node)].sources;
    const auto s = static_cast<std::size_t>(end.slot);
    const bool is_wired = d.slot(end).role == Role::input && s < sources.size() && sources[s].node >= 0;
    return is_wired ? sources[s] : end;
}

bool is_written(const Diagram& d, int node, Phase phase, const Call::Reference& operand) {
    if (!operand.is_written || operand.source != Call::Source::slot) return operand.is_written;
    const Role role = d.slot({node, operand.slot}).role;
    if (phase != Phase::output || role == Role::workspace) return role == Role::workspace;
    // Rules count an output right behind their target among the targets, also where it is one that a rule
    // before them wrote, which they read.
    bool is_there = false;
    for (const Call& rule : d.nodes[static_cast<std::size_t>(node)].block->declaration().output_rules) {
        for (std::size_t k = 0; k < rule.operands.size(); ++k)
            if (&rule.operands[k] == &operand) return k == 0 || !is_there;
        is_there |= rule.writes(operand.slot);
    }
    return true;
}

Node::End find_state(const Diagram& d, const std::string& path) {
    for (int n = 0; n < static_cast<int>(d.nodes.size()); ++n) {
        const auto& node = d.nodes[static_cast<std::size_t>(n)];
        if (!path.starts_with(node.path + ".")) continue;
        const auto& slots = node.block->resolution().slots;
        for (int s = 0; s < static_cast<int>(slots.size()); ++s)
            if (const auto& slot = slots[static_cast<std::size_t>(s)];
                is_state(slot.role) && path == node.path + "." + slot.name)
                return {n, s};
    }
    return {};
}

Named named(const std::string& name, const std::function<Node::End(const std::string&)>& look) {
    const Node::End whole = look(name);
    const auto bracket = name.find('[');
    if (whole.node >= 0 || bracket == name.npos) return {whole, name, ""};
    const auto path = name.substr(0, bracket);
    return {look(path), path, name.substr(bracket)};
}

std::vector<int> elements(const Diagram& d, const Named& named) {
    const int count = d.slot(named.end).size.count();
    std::vector<int> all(static_cast<std::size_t>(count));
    std::iota(all.begin(), all.end(), 0);
    if (named.element.empty()) return all;
    for (const int i : all)
        if (named.element == "[" + std::to_string(i + 1) + "]" ||
            (count > 1 && named.element == d.element_text(named.end, i)))
            return {i};
    return {};
}

} // namespace bf::analysis
