#include "bf/elaborate/diagram.hpp"

#include "bf/base/elements.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace bf {

std::string Definition::about() const {
    std::string text = doc;
    if (!uses.empty()) text += (text.empty() ? "= " : "; = ") + this->text;
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text;
}

std::vector<Node> Diagram::context_nodes() const {
    std::vector<Node> list;
    list.reserve(nodes.size());
    for (const auto& node : nodes)
        list.push_back({node.block.get(), node.methods, node.sources, node.providers, node.rate});
    return list;
}

const std::vector<std::string>& Diagram::element_names(const Node::End& end) const {
    static const std::vector<std::string> none;
    const auto& names = nodes[static_cast<std::size_t>(end.node)].element_names;
    const auto found = names.find(end.slot);
    return found == names.end() ? none : found->second;
}

std::string Diagram::element_lines(const Node::End& end) const {
    return bf::element_lines(element_names(end));
}

std::string Diagram::element_text(const Node::End& end, int i) const {
    const Size& size = slot(end).size;
    return bf::element_text(size.rows, size.cols, i, element_names(end));
}

int Diagram::find_node(const std::string& path) const {
    for (std::size_t n = 0; n < nodes.size(); ++n)
        if (nodes[n].path == path) return static_cast<int>(n);
    return -1;
}

Node::End Diagram::find_parameter(const std::string& path) const {
    const auto dot = path.rfind('.');
    const int node = dot == path.npos ? -1 : find_node(path.substr(0, dot));
    if (node < 0) return {};
    const auto& declaration = nodes[static_cast<std::size_t>(node)].block->declaration();
    const int slot = declaration.find(path.substr(dot + 1), Role::parameter);
    return slot < 0 ? Node::End() : Node::End{node, slot};
}

std::vector<SignalName> Diagram::signals() const {
    std::vector<char> is_outlet(nodes.size());
    for (const auto& condition : conditions)
        for (const auto& outlet : condition.outlets) is_outlet[static_cast<std::size_t>(outlet.end.node)] = 1;
    std::vector<SignalName> all;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        if (is_outlet[n]) continue; // known by its alias
        const auto& slots = nodes[n].block->resolution().slots;
        for (std::size_t i = 0; i < slots.size(); ++i)
            if (slots[i].role == Role::output)
                all.push_back(
                    {nodes[n].path + "." + slots[i].name, {static_cast<int>(n), static_cast<int>(i)}});
    }
    all.insert(all.end(), aliases.begin(), aliases.end());
    return all;
}

std::vector<SignalName> Diagram::recorded() const {
    std::vector<SignalName> all = record;
    for (const auto& panel : plots) all.insert(all.end(), panel.signals.begin(), panel.signals.end());
    return all.empty() ? signals() : all;
}

std::vector<SignalName> Diagram::checks() const {
    std::vector<SignalName> all;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        const auto& slots = nodes[n].block->resolution().slots;
        const auto count =
            std::count_if(slots.begin(), slots.end(), [](const Slot& s) { return s.reported; });
        const std::string name = nodes[n].path.substr(nodes[n].path.rfind('.') + 1);
        for (std::size_t i = 0; i < slots.size(); ++i)
            if (slots[i].reported)
                all.push_back({slots[i].name == "value" || count == 1 ? name : name + "." + slots[i].name,
                               {static_cast<int>(n), static_cast<int>(i)}});
    }
    return all;
}

std::vector<char> Diagram::needed_inside_a_step() const {
    std::vector<int> pending;
    std::vector<char> is_needed(nodes.size());
    const auto need = [&](int node) {
        if (node >= 0 && !std::exchange(is_needed[static_cast<std::size_t>(node)], 1))
            pending.push_back(node);
    };
    const auto need_all = [&](const std::vector<Segment>& segments) {
        for (const auto& segment : segments)
            for (const auto& activity : segment.activities) need(activity.node);
    };
    need_all(plan.derivatives);
    if (is_adaptive(solver.method)) need_all(plan.guards); // others look at guards at the base steps alone
    for (const auto& condition : conditions)
        for (const auto& signal : {condition.enable, condition.trigger, condition.reset}) need(signal.node);
    for (std::size_t n = 0; n < nodes.size(); ++n)
        if (nodes[n].condition > 0 || nodes[n].loop >= 0) need(static_cast<int>(n));
    while (!pending.empty()) {
        const auto& node = nodes[static_cast<std::size_t>(pending.back())];
        pending.pop_back();
        const auto& rate = rates[static_cast<std::size_t>(node.rate)];
        if (!rate.is_continuous && rate.trigger == 0) continue; // runs in no solver's step
        for (const auto& from : node.sources) need(from.node);
    }
    return is_needed;
}

namespace {

/// Does the text match a pattern in which '*' stands for any text?
bool matches(std::string_view text, std::string_view pattern) {
    std::size_t t = 0, p = 0, star = std::string_view::npos, resume = 0;
    while (t < text.size()) {
        if (p < pattern.size() && pattern[p] == '*') {
            star = p++;
            resume = t;
        } else if (p < pattern.size() && pattern[p] == text[t]) {
            ++p, ++t;
        } else if (star != std::string_view::npos) {
            p = star + 1; // let the last star take one more
            t = ++resume;
        } else {
            return false;
        }
    }
    return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

} // namespace

SignalFinder::SignalFinder(const Diagram& diagram) : diagram_(diagram), all_(diagram.signals()) {
    for (std::size_t i = 0; i < all_.size(); ++i) {
        const std::string_view path = all_[i].path;
        by_path_[path].push_back(i);
        if (const auto dot = path.rfind('.'); dot != path.npos) by_parent_[path.substr(0, dot)].push_back(i);
    }
}

const std::unordered_map<std::string, Node::End>& SignalFinder::hidden() const {
    if (hidden_) return *hidden_;
    auto& hidden = hidden_.emplace();
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n) {
        const auto& node = diagram_.nodes[n];
        const auto& slots = node.block->resolution().slots;
        const auto count = [&](Role role) { return std::ranges::count(slots, role, &Slot::role); };
        const bool is_plain_sink = count(Role::output) == 0 && count(Role::input) == 1;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            if (slots[i].role == Role::discrete_state)
                hidden.try_emplace(node.path + "." + slots[i].name,
                                   Node::End{static_cast<int>(n), static_cast<int>(i)});
            if (slots[i].role == Role::input && node.sources[i].node >= 0) {
                hidden.try_emplace(node.path + "." + slots[i].name, node.sources[i]);
                if (is_plain_sink) hidden.try_emplace(node.path, node.sources[i]);
            }
        }
    }
    return hidden;
}

std::vector<SignalName> SignalFinder::match(const std::string& pattern) const {
    std::vector<SignalName> found;
    if (pattern.find('*') != std::string::npos) {
        for (const auto& signal : all_)
            if (matches(signal.path, pattern)) found.push_back(signal);
        return found;
    }
    if (const auto same = by_path_.find(pattern); same != by_path_.end())
        for (const std::size_t i : same->second) found.push_back(all_[i]);
    if (!found.empty()) return found;
    // A block or subsystem with one output.
    if (const auto inside = by_parent_.find(pattern);
        inside != by_parent_.end() && inside->second.size() == 1)
        return {{pattern, all_[inside->second.front()].end}};
    if (const auto found_there = hidden().find(pattern); found_there != hidden().end())
        return {{pattern, found_there->second}};
    return {};
}

Node::End SignalFinder::find(const std::string& path) const {
    const auto found = match(path);
    return found.empty() || path.find('*') != std::string::npos ? Node::End{} : found.front().end;
}

std::vector<SignalName> Diagram::match_signals(const std::string& pattern) const {
    return SignalFinder(*this).match(pattern);
}

Node::End Diagram::find_signal(const std::string& path) const { return SignalFinder(*this).find(path); }

} // namespace bf
