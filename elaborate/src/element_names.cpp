// The elements of some vectors have names, e.g. those of the joints. They go with the elements along the
// wires and through the blocks that keep them apart.
#include "stages.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <numeric>

namespace bf::elaboration {

namespace {

using Names = std::vector<std::string>;
/// Stands for a name of an element where two names meet.
const std::string contradiction = "\n"; // is_usable refuses it

/// Could the name be mistaken for a number, or for more than a name where signals are chosen or listed?
bool is_usable(const std::string& name) {
    const auto is_digit = [](unsigned char c) { return std::isdigit(c) != 0; };
    const auto is_wrong = [](unsigned char c) { return c < ' ' || c == '[' || c == ']' || c == ','; };
    return !std::all_of(name.begin(), name.end(), is_digit) &&
           std::none_of(name.begin(), name.end(), is_wrong);
}

class Naming {
  public:
    explicit Naming(Elaboration& e) : e_(e) {
        for (const auto& node : e_.diagram.nodes) {
            first_.push_back(static_cast<int>(names_.size()));
            names_.resize(names_.size() + node.block->resolution().slots.size());
        }
    }

    void run() {
        std::vector<int> named;
        for (int n = 0; n < count(); ++n)
            for (int s = 0; s < slots(n); ++s)
                if (auto names = e_.node(n).block->declaration().element_names(s); !names.empty()) {
                    names_[at(n, s)] = std::move(names);
                    named.push_back(first_[static_cast<std::size_t>(n)] + s);
                }
        if (named.empty()) return;
        find_links();
        // First to what is computed from them. What is still without a name, such as a reference, is called
        // as what it is used for.
        settled_ = names_;
        spread(named, false);
        for (int n = 0; n < count(); ++n)
            for (int s = 0; s < slots(n); ++s) check_order(n, s);
        settled_ = names_;
        for (std::size_t v = 0; v < names_.size(); ++v)
            if (!names_[v].empty()) named.push_back(static_cast<int>(v));
        spread(named, true);
        for (int n = 0; n < count(); ++n)
            for (int s = 0; s < slots(n); ++s) keep(n, s);
    }

  private:
    /// Element first + i of vector `to` is element picked[i], or i, of vector `from`.
    struct Link {
        int from, to, first;
        const std::vector<int>* picked;
    };

    int count() const { return static_cast<int>(e_.diagram.nodes.size()); }
    int slots(int n) const { return static_cast<int>(e_.resolution(n).slots.size()); }
    std::size_t at(int n, int s) const {
        return static_cast<std::size_t>(first_[static_cast<std::size_t>(n)] + s);
    }
    const Slot& slot(int n, int s) const { return e_.resolution(n).slots[static_cast<std::size_t>(s)]; }

    void link(const Node::End& from, const Node::End& to, int first = 0,
              const std::vector<int>* picked = nullptr) {
        const Size &a = slot(from.node, from.slot).size, &b = slot(to.node, to.slot).size;
        const int length = picked && !picked->empty() ? static_cast<int>(picked->size()) : a.rows;
        if (a.cols != 1 || b.cols != 1 || first + length > b.rows) return;
        const int number = static_cast<int>(links_.size());
        links_.push_back({static_cast<int>(at(from.node, from.slot)), static_cast<int>(at(to.node, to.slot)),
                          first, picked && !picked->empty() ? picked : nullptr});
        leaving_[static_cast<std::size_t>(links_.back().from)].push_back(number);
        entering_[static_cast<std::size_t>(links_.back().to)].push_back(number);
        sizes_[static_cast<std::size_t>(links_.back().from)] = a.rows;
        sizes_[static_cast<std::size_t>(links_.back().to)] = b.rows;
    }

    void find_links() {
        leaving_.resize(names_.size());
        entering_.resize(names_.size());
        sizes_.resize(names_.size());
        for (int n = 0; n < count(); ++n) {
            const auto& d = e_.resolution(n);
            for (int s = 0; s < slots(n); ++s)
                if (const auto& from = e_.node(n).sources[static_cast<std::size_t>(s)]; from.node >= 0)
                    link(from, {n, s});
            for (const auto& same : d.same_elements)
                if (same.from >= 0 && same.to >= 0)
                    link({n, same.from}, {n, same.to}, same.first, &same.picked);
            for (int to = 0; to < slots(n); ++to)
                for (int from = 0; from < slots(n) && is_computed(slot(n, to)); ++from)
                    if (from != to && (!is_computed(slot(n, from)) || slot(n, to).role == Role::output) &&
                        have_one_shape(slot(n, from), slot(n, to)))
                        link({n, from}, {n, to});
        }
    }
    static bool is_computed(const Slot& s) { return s.role != Role::input && s.role != Role::parameter; }
    static bool have_one_shape(const Slot& a, const Slot& b) {
        if (a.shape.symbol >= 0 || b.shape.symbol >= 0) return a.shape.symbol == b.shape.symbol;
        return a.shape.rows.dim >= 0 && a.shape.rows.dim == b.shape.rows.dim &&
               a.shape.rows.plus == b.shape.rows.plus;
    }

    /// Hands names on until nothing new is learned: along the links, and against them too where `backward`.
    void spread(std::vector<int> pending, bool backward) {
        const auto tell = [&](int v, int element, const std::string& name) {
            auto& names = names_[static_cast<std::size_t>(v)];
            const auto i = static_cast<std::size_t>(element);
            const auto& settled = settled_[static_cast<std::size_t>(v)];
            if (name.empty() || (!settled.empty() && !settled[i].empty())) return false;
            if (names.empty()) names.resize(static_cast<std::size_t>(sizes_[static_cast<std::size_t>(v)]));
            if (names[i] == name || names[i] == contradiction) return false;
            names[i] = names[i].empty() ? name : contradiction;
            return true;
        };
        const auto take = [&](const Link& link, bool against) {
            const auto size = link.picked
                                  ? link.picked->size()
                                  : static_cast<std::size_t>(sizes_[static_cast<std::size_t>(link.from)]);
            bool is_news = false;
            for (std::size_t i = 0; i < size; ++i) {
                const int source = link.picked ? (*link.picked)[i] : static_cast<int>(i);
                const int target = link.first + static_cast<int>(i);
                const auto& known = names_[static_cast<std::size_t>(against ? link.to : link.from)];
                const std::string name =
                    known.empty() ? "" : known[static_cast<std::size_t>(against ? target : source)];
                is_news = tell(against ? link.from : link.to, against ? source : target, name) || is_news;
            }
            if (is_news) pending.push_back(against ? link.from : link.to);
        };
        while (!pending.empty()) {
            const auto v = static_cast<std::size_t>(pending.back());
            pending.pop_back();
            for (const int l : leaving_[v]) take(links_[static_cast<std::size_t>(l)], false);
            for (const int l : entering_[v])
                if (backward) take(links_[static_cast<std::size_t>(l)], true);
        }
    }

    /// Elements that a block knows by name do not arrive in another order.
    void check_order(int n, int s) {
        const auto& from = e_.node(n).sources[static_cast<std::size_t>(s)];
        if (from.node < 0) return;
        const Names wanted = e_.node(n).block->declaration().element_names(s),
                    &given = names_[at(from.node, from.slot)];
        if (wanted == given || !std::is_permutation(wanted.begin(), wanted.end(), given.begin(), given.end()))
            return;
        const auto [w, g] = std::mismatch(wanted.begin(), wanted.end(), given.begin());
        const std::string number = std::to_string(w - wanted.begin() + 1);
        e_.report.add(e_.node(n).where, e_.node(n).path,
                      "element " + number + " of input '" + slot(n, s).name + "' is '" + *w +
                          "', but that of " + e_.diagram.end_path(from) + " is '" + *g +
                          "': both have the same elements in another order",
                      "give both blocks one order, or put a Selector in between");
    }

    /// What occurs twice in a vector names neither element.
    void keep(int n, int s) {
        Names names = std::move(names_[at(n, s)]);
        std::map<std::string, int> times;
        for (const auto& name : names) ++times[name];
        bool has_any = false;
        for (auto& name : names) {
            if (times[name] > 1 || !is_usable(name)) name.clear();
            has_any = has_any || !name.empty();
        }
        if (has_any) e_.node(n).element_names[s] = std::move(names);
    }

    Elaboration& e_;
    std::vector<int> first_; ///< by node, the number of its first slot
    std::vector<Names> names_, settled_;
    std::vector<Link> links_;
    std::vector<std::vector<int>> leaving_, entering_;
    std::vector<int> sizes_; ///< of vectors that are linked
};

} // namespace

void name_elements(Elaboration& e) { Naming(e).run(); }

} // namespace bf::elaboration
