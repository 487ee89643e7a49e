// Names that two blocks of one diagram seem to have exchanged in another one.
#include "bf/engine/handover.hpp"

#include "bf/base/names.hpp"

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <set>
#include <string_view>
#include <unordered_map>

namespace bf {

namespace {

/// Two paths, and all under them, take each other's place.
struct Exchange {
    std::string one, other;

    std::string operator()(const std::string& path) const {
        for (const auto& [from, to] : {std::pair(&one, &other), std::pair(&other, &one)})
            if (const auto rest = rest_under(path, *from)) return *to + *rest;
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

std::uint64_t hash(std::string_view text) { return std::hash<std::string_view>()(text); }
/// Of two numbers in their order (the finaliser of SplitMix64).
std::uint64_t mixed(std::uint64_t a, std::uint64_t b) {
    std::uint64_t x = a * 0x9e3779b97f4a7c15u + b;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

/// What two paths may have exchanged: one of their names, or the whole paths, where they differ in more.
struct Part {
    std::size_t begin = 0, end = 0;
    bool is_whole = false;
};
std::vector<Part> names_of(const std::string& path) {
    std::vector<Part> names;
    for (std::size_t begin = 0; begin <= path.size(); begin = names.back().end + 1)
        names.push_back({begin, std::min(path.find('.', begin), path.size())});
    return names;
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
        for (std::size_t n = 0; n < diagram.nodes.size(); ++n) {
            what_.push_back(what(static_cast<int>(n)));
            const auto inputs = std::ranges::count_if(diagram.nodes[n].sources,
                                                      [](const auto& from) { return from.node >= 0; });
            wires_.push_back(static_cast<std::size_t>(inputs) + readers_[n].size());
        }
    }

    const DiagramNode& node(int n) const { return diagram_.nodes[static_cast<std::size_t>(n)]; }

    /// Calls `visit` with each wire: its end here, and the path and the end of the neighbour.
    template <class Visit> void each_wire(int n, const Visit& visit) const {
        const auto& own = slots(node(n));
        for (std::size_t i = 0; i < node(n).sources.size(); ++i)
            if (const auto& from = node(n).sources[i]; from.node >= 0)
                visit(own[i].name, node(from.node).path, slot_of(from));
        for (const auto& [output, path, input] : readers_[static_cast<std::size_t>(n)])
            visit(output, *path, input);
    }

    /// Values of parameters and states, and wires, with the neighbours called as `name` says.
    template <class Name> auto look(int n, const Name& name) const {
        std::multiset<std::pair<std::string, std::string>> wires;
        each_wire(n, [&](const std::string& own, const std::string& path, const std::string& other) {
            wires.emplace(own, name(path) + " " + other);
        });
        return std::tuple(node(n).type, values(n), wires);
    }

    /// Of all that two blocks have in common where their paths have exchanged those parts: equal where that
    /// is equal, and else hardly ever.
    std::uint64_t signature(int n, const Part& part) const {
        const std::string& path = node(n).path;
        const std::string_view own = std::string_view(path).substr(0, part.end);
        std::uint64_t wires = 0; // in any order
        each_wire(n, [&](const std::string& here, const std::string& other, const std::string& there) {
            const bool is_own =
                other.starts_with(own) && (other.size() == part.end || other[part.end] == '.');
            wires += mixed(mixed(hash(here), hash(there)),
                           mixed(is_own, hash(std::string_view(other).substr(is_own ? part.end : 0))));
        });
        const std::uint64_t place = mixed(hash(own.substr(0, part.begin)), hash(path.substr(part.end)));
        return mixed(mixed(what_[static_cast<std::size_t>(n)], wires), mixed(place, part.is_whole));
    }

    std::size_t wires(int n) const { return wires_[static_cast<std::size_t>(n)]; }

  private:
    struct Reader {
        std::string output;
        const std::string* path;
        std::string input;
    };
    static const std::vector<Slot>& slots(const DiagramNode& node) { return node.block->resolution().slots; }
    const std::string& slot_of(const Node::End& end) const { return diagram_.slot(end).name; }

    std::vector<std::vector<double>> values(int n) const {
        std::vector<std::vector<double>> all;
        for (const Slot& slot : slots(node(n)))
            if (slot.role == Role::parameter || is_state(slot.role)) all.push_back(slot.initial);
        return all;
    }

    /// Of its type, arguments and values.
    std::uint64_t what(int n) const {
        std::uint64_t sum = hash(node(n).type);
        const auto add = [&](std::uint64_t part) { sum = mixed(sum, part); };
        for (const auto& [name, value] : node(n).arguments) {
            add(hash(name));
            add(hash(value.text));
            for (const auto& text : value.texts) add(hash(text));
            for (const double x : value.data) add(std::hash<double>()(x));
        }
        for (const auto& list : values(n))
            for (const double x : list) add(std::hash<double>()(x));
        return sum;
    }

    const Diagram& diagram_;
    std::vector<std::vector<Reader>> readers_; ///< by node
    std::vector<std::uint64_t> what_;          ///< by node
    std::vector<std::size_t> wires_;           ///< by node
};

} // namespace

std::vector<std::pair<std::string, std::string>> exchanged(const Diagram& from, const Diagram& to) {
    const Wired before(from), after(to);
    struct Pair {
        int before, after;
        bool is_found = false;
    };
    const auto is_same = [&](int one, int other, const auto& name) {
        return before.node(one).arguments == after.node(other).arguments &&
               before.look(one, name) == after.look(other, std::identity());
    };
    std::unordered_map<std::string_view, int> known;
    for (std::size_t n = 0; n < from.nodes.size(); ++n)
        known.emplace(from.nodes[n].path, static_cast<int>(n));
    std::vector<Pair> changed;
    std::unordered_map<std::string_view, std::size_t> by_path;
    for (std::size_t n = 0; n < to.nodes.size(); ++n) {
        const auto& slots = to.nodes[n].block->resolution().slots;
        const auto same = known.find(to.nodes[n].path);
        if (same == known.end() ||
            std::ranges::none_of(slots, [](const Slot& slot) { return is_state(slot.role); }))
            continue;
        const Pair pair{same->second, static_cast<int>(n)};
        if (is_same(pair.before, pair.after, std::identity())) continue;
        by_path.emplace(to.nodes[n].path, changed.size());
        changed.push_back(pair);
    }
    const auto path = [&](const Pair& one) -> const std::string& { return before.node(one.before).path; };
    std::set<std::pair<std::string, std::string>> found;
    const auto note = [&](Pair& one, Pair& other, const Exchange& exchange) {
        if (!is_same(one.before, other.after, exchange) || !is_same(other.before, one.after, exchange))
            return;
        one.is_found = other.is_found = true;
        found.insert(std::minmax(exchange.one, exchange.other));
    };

    // Blocks that are wired to each other, or stand in subsystems that are, call each other otherwise
    // afterwards; all others are found by what stays the same. Each of many equal ones is paired with one
    // other.
    for (std::size_t i = 0; i < changed.size(); ++i)
        before.each_wire(changed[i].before, [&](const auto&, const std::string& neighbour, const auto&) {
            const std::string& own = path(changed[i]);
            const auto differs =
                std::mismatch(own.begin(), own.end(), neighbour.begin(), neighbour.end()).first - own.begin();
            const std::size_t begin = own.substr(0, static_cast<std::size_t>(differs)).rfind('.') + 1;
            const std::size_t end = std::min(own.find('.', begin), own.size());
            const std::string beside = neighbour.substr(0, neighbour.find('.', begin)) + own.substr(end);
            for (const std::string& candidate : std::set<std::string>{neighbour, beside}) {
                const auto other = by_path.find(candidate);
                if (other == by_path.end() || other->second == i) continue;
                Pair &one = changed[i], &two = changed[other->second];
                if (before.wires(one.before) == after.wires(two.after) &&
                    before.wires(two.before) == after.wires(one.after))
                    note(one, two, exchange_of(own, candidate));
            }
        });
    for (const bool is_whole : {false, true}) {
        struct Waiting {
            std::size_t pair;
            Part part;
        };
        std::map<std::pair<std::uint64_t, std::uint64_t>, std::deque<Waiting>> waiting;
        for (std::size_t i = 0; i < changed.size(); ++i) {
            Pair& one = changed[i];
            if (is_whole && one.is_found) continue;
            for (const Part& part :
                 is_whole ? std::vector<Part>{{0, path(one).size(), true}} : names_of(path(one))) {
                const std::uint64_t was = before.signature(one.before, part),
                                    is = after.signature(one.after, part);
                const auto others = waiting.find({is, was});
                if (others == waiting.end() || others->second.empty()) {
                    waiting[{was, is}].push_back({i, part});
                    continue;
                }
                const auto [j, other_part] = others->second.front();
                others->second.pop_front();
                note(changed[j], one,
                     {path(changed[j]).substr(0, other_part.end), path(one).substr(0, part.end)});
            }
        }
    }
    return {found.begin(), found.end()};
}

} // namespace bf
