// Names that two blocks of one diagram seem to have exchanged in another one.
#include "bf/engine/handover.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>

namespace bf {

namespace {

/// Two paths, and all under them, take each other's place.
struct Exchange {
    std::string one, other;

    std::string operator()(const std::string& path) const {
        for (const auto& [from, to] : {std::pair(&one, &other), std::pair(&other, &one)})
            if (path.starts_with(*from) && (path.size() == from->size() || path[from->size()] == '.'))
                return *to + path.substr(from->size());
        return path;
    }
};

/// Of paths that differ in one name, the parts up to there.
Exchange exchange_of(const std::string& a, const std::string& b) {
    const auto dots = [](const std::string& path) { return std::ranges::count(path, '.'); };
    std::size_t begin = 0;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()) && a[i] == b[i]; ++i)
        if (a[i] == '.') begin = i + 1;
    const std::size_t end_a = std::min(a.find('.', begin), a.size()),
                      end_b = std::min(b.find('.', begin), b.size());
    const bool is_one_name = dots(a) == dots(b) && a.substr(end_a) == b.substr(end_b);
    return is_one_name ? Exchange{a.substr(0, end_a), b.substr(0, end_b)} : Exchange{a, b};
}

/// A diagram with who reads what.
class Wired {
  public:
    explicit Wired(const Diagram& diagram) : diagram_(diagram), readers_(diagram.nodes.size()) {
        for (const auto& node : diagram.nodes)
            for (std::size_t i = 0; i < node.sources.size(); ++i)
                if (const auto& from = node.sources[i]; from.node >= 0)
                    readers_[static_cast<std::size_t>(from.node)].push_back(
                        {slot_of(from), &node.path, slots(node)[i].name});
    }

    const DiagramNode& node(int n) const { return diagram_.nodes[static_cast<std::size_t>(n)]; }

    /// Arguments, values and wires of a node, with its neighbours called as `name` says.
    template <class Name> auto look(int n, const Name& name) const {
        std::vector<std::vector<double>> values;
        std::multiset<std::pair<std::string, std::string>> wires;
        const auto& own = slots(node(n));
        for (std::size_t i = 0; i < own.size(); ++i) {
            if (own[i].role == Role::parameter || is_state(own[i].role)) values.push_back(own[i].initial);
            if (i >= node(n).sources.size()) continue;
            if (const auto& from = node(n).sources[i]; from.node >= 0)
                wires.emplace(own[i].name, name(node(from.node).path) + " " + slot_of(from));
        }
        for (const auto& [output, path, input] : readers_[static_cast<std::size_t>(n)])
            wires.emplace(output, name(*path) + " " + input);
        return std::tuple(node(n).type, values, wires);
    }

  private:
    struct Reader {
        std::string output;
        const std::string* path;
        std::string input;
    };
    static const std::vector<Slot>& slots(const DiagramNode& node) { return node.block->resolution().slots; }
    std::string slot_of(const Node::End& end) const { return diagram_.slot(end).name; }

    const Diagram& diagram_;
    std::vector<std::vector<Reader>> readers_; ///< by node
};

} // namespace

std::vector<std::pair<std::string, std::string>> exchanged(const Diagram& from, const Diagram& to) {
    const Wired before(from), after(to);
    struct Pair {
        int before, after;
    };
    const auto is_same = [&](int one, int other, const auto& name) {
        return before.node(one).arguments == after.node(other).arguments &&
               before.look(one, name) == after.look(other, std::identity());
    };
    std::map<std::string_view, int> known;
    for (std::size_t n = 0; n < from.nodes.size(); ++n)
        known.emplace(from.nodes[n].path, static_cast<int>(n));
    std::vector<Pair> changed;
    for (std::size_t n = 0; n < to.nodes.size(); ++n) {
        const auto& slots = to.nodes[n].block->resolution().slots;
        const auto same = known.find(to.nodes[n].path);
        if (same == known.end() ||
            std::ranges::none_of(slots, [](const Slot& slot) { return is_state(slot.role); }))
            continue;
        const Pair pair{same->second, static_cast<int>(n)};
        if (!is_same(pair.before, pair.after, std::identity())) changed.push_back(pair);
    }
    std::set<std::pair<std::string, std::string>> found;
    for (const Pair& one : changed)
        for (const Pair& other : changed) {
            const std::string &a = before.node(one.before).path, &b = before.node(other.before).path;
            if (!(a < b) || before.node(one.before).type != before.node(other.before).type) continue;
            const Exchange exchange = exchange_of(a, b);
            if (is_same(one.before, other.after, exchange) && is_same(other.before, one.after, exchange))
                found.emplace(exchange.one, exchange.other);
        }
    return {found.begin(), found.end()};
}

} // namespace bf
