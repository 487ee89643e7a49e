#include "bf/model/compare.hpp"

#include "bf/model/edit.hpp"
#include "bf/model/operation.hpp"
#include "fields.hpp"

#include <algorithm>
#include <set>

namespace bf::model {
namespace {

using Kind = Distinction::Kind;

/// Members that are said in one line.
template <typename T>
constexpr bool is_said = std::is_same_v<T, std::string> || std::is_same_v<T, bool> || std::is_enum_v<T> ||
                         std::is_same_v<T, Expression>;
template <typename T> constexpr bool is_said<std::optional<T>> = is_said<T>;

template <typename T> std::string said(const T& value, const Words* words) {
    if constexpr (is_optional<T>)
        return value ? said(*value, words) : "";
    else if constexpr (std::is_same_v<T, Expression>)
        return value.matlab();
    else if constexpr (std::is_same_v<T, bool>)
        return value ? "true" : "false";
    else if constexpr (std::is_enum_v<T>)
        return words->at(static_cast<std::size_t>(value));
    else
        return value;
}

/// Items of lists that are matched by name: what they are called, and what is said of one that is new or
/// gone.
const std::string& name_of(const Panel& item) { return item.title; }
template <typename Item>
requires requires(Item item) { item.path; }
const std::string& name_of(const Item& item) { return item.path; }
template <typename Item> const std::string& name_of(const Item& item) { return item.name; }

std::string said(const Variable& item);
std::string said(const NamedSignal& item) { return item.of.text(); }
std::string said(const Setting& item) { return item.value.matlab(); }
std::string said(const Port& item) { return item.shape ? item.shape->matlab() : ""; }
std::string said(const Note& item) { return item.text; }
std::string said(const Signal&) { return ""; }
std::string said(const Plugin&) { return ""; }
template <typename Item> std::string said_of_all(const std::vector<Item>& list) {
    std::string text;
    for (const Item& item : list)
        text += (text.empty() ? "" : ", ") + name_of(item) + (said(item).empty() ? "" : ": " + said(item));
    return text;
}
std::string said(const Variable& item) {
    return item.fields.empty() ? item.value.matlab() : "{" + said_of_all(item.fields) + "}";
}
std::string said(const Panel& item) { return said_of_all(item.signals); }

std::string said(const Block& block) {
    return block.is_library_block() ? block.type : block.reference ? block.reference->file : "subsystem";
}

std::string counted(std::size_t number, const std::string& noun) {
    return std::to_string(number) + " " + noun + (number == 1 ? "" : "s");
}

/// The same with what it holds.
std::string summary(const Block& block) {
    if (block.system) return "subsystem of " + counted(block.system->blocks.size(), "block");
    return said(block) + (block.settings.empty() ? "" : " {" + said_of_all(block.settings) + "}");
}

template <typename Item> const Item* find_named(const std::vector<Item>& list, const std::string& name) {
    const auto found =
        std::find_if(list.begin(), list.end(), [&](const Item& item) { return name_of(item) == name; });
    return found == list.end() ? nullptr : &*found;
}

/// The names in `list` that `other` has too, in order.
template <typename Item>
std::vector<std::string> common(const std::vector<Item>& list, const std::vector<Item>& other) {
    std::vector<std::string> names;
    for (const Item& item : list)
        if (find_named(other, name_of(item))) names.push_back(name_of(item));
    return names;
}

/// How many items are not the same in both.
template <typename Item> std::size_t differing(const std::vector<Item>& a, const std::vector<Item>& b) {
    const auto others = [](const std::vector<Item>& list, const std::vector<Item>& in, bool counts_changed) {
        return std::count_if(list.begin(), list.end(), [&](const Item& item) {
            const Item* const other = find_named(in, name_of(item));
            return !other || (counts_changed && !are_equal(*other, item, false));
        });
    };
    return static_cast<std::size_t>(others(a, b, true) + others(b, a, false));
}

/// One wire: the input it leads to, and where it comes from.
using Wire = std::pair<std::string, std::string>;

std::vector<Wire> wires_of(const System& system) {
    std::vector<Wire> wires;
    for (const Connection& connection : system.connections)
        for (const Endpoint& to : connection.to) wires.emplace_back(to.text(), connection.from.text());
    return wires;
}

class Comparison {
  public:
    std::vector<Distinction> found;

    void compare(const Model& a, const Model& b) {
        compare_members("", "", a, b);
        compare_items("", "plugin", a.plugins, b.plugins);
        compare_system("", a.root, b.root);
        compare_items("", "recorded signal", a.record, b.record);
        compare_items("", "plot", a.plots, b.plots);
        compare_items("", "note", a.layout.notes, b.layout.notes);
        const std::size_t moved = differing(a.layout.blocks, b.layout.blocks) +
                                  differing(a.layout.wires, b.layout.wires) +
                                  differing(a.layout.notes, b.layout.notes);
        if (moved) add(Kind::changed, "", "layout in " + counted(moved, "place"), "", "");
    }

  private:
    void add(Kind kind, const std::string& path, const std::string& what, const std::string& before,
             const std::string& after) {
        add_in(split_last(path).first, kind, path, what, before, after);
    }
    void add_in(const std::string& system, Kind kind, const std::string& path, const std::string& what,
                const std::string& before, const std::string& after) {
        found.push_back({kind, path, system, what, before, after});
    }

    /// The members of `item` (of the block or system at `path` itself, if empty) that are no lists.
    template <typename T>
    void compare_members(const std::string& path, const std::string& item, const T& a, const T& b) {
        for_each_field<T>([&](const auto& field) {
            using Member = std::remove_cvref_t<decltype(a.*field.member)>;
            if constexpr (is_said<Member>) {
                if (field.spelling || are_equal(a.*field.member, b.*field.member, false)) return;
                const std::string member = field.name;
                const std::string what = item.empty()        ? member
                                         : member == "value" ? item
                                                             : item + ": " + member;
                add(Kind::changed, path, what, said(a.*field.member, field.words),
                    said(b.*field.member, field.words));
            }
        });
    }

    /// Lists of named items, called `noun`.
    template <typename Item>
    void compare_items(const std::string& path, const std::string& noun, const std::vector<Item>& a,
                       const std::vector<Item>& b) {
        for (const Item& item : a)
            if (!find_named(b, name_of(item)))
                add(Kind::removed, path, noun + " " + name_of(item), said(item), "");
        for (const Item& item : b) {
            const std::string what = noun + " " + name_of(item);
            const Item* const before = find_named(a, name_of(item));
            if (!before) {
                add(Kind::added, path, what, "", said(item));
            } else if constexpr (std::is_same_v<Item, Setting> || std::is_same_v<Item, NamedSignal>) {
                if (!are_equal(*before, item, false))
                    add(Kind::changed, path, what, said(*before), said(item));
            } else {
                compare_members(path, what, *before, item);
            }
            if constexpr (std::is_same_v<Item, Variable>)
                if (before) compare_items(path, what + "'s field", before->fields, item.fields);
            if constexpr (std::is_same_v<Item, Panel>)
                if (before && !are_equal(before->signals, item.signals, false))
                    add(Kind::changed, path, what, said(*before), said(item));
        }
        if constexpr (!std::is_same_v<Item, Setting>) compare_order(path, noun, a, b);
    }

    template <typename Item>
    void compare_order(const std::string& path, const std::string& noun, const std::vector<Item>& a,
                       const std::vector<Item>& b) {
        const auto before = common(a, b), after = common(b, a);
        const auto listed = [](const std::vector<std::string>& names) {
            std::string text;
            for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
            return text;
        };
        if (before != after) add(Kind::changed, path, "order of each " + noun, listed(before), listed(after));
    }

    void compare_ports(const std::string& system, const std::string& noun, const std::vector<Port>& a,
                       const std::vector<Port>& b) {
        for (const Port& port : a)
            if (!find_named(b, port.name))
                add_in(system, Kind::removed, joined(system, port.name), noun, said(port), "");
        for (const Port& port : b)
            if (const Port* const before = find_named(a, port.name))
                compare_members(joined(system, port.name), "", *before, port);
            else
                add_in(system, Kind::added, joined(system, port.name), noun, "", said(port));
        compare_order(system, noun, a, b);
    }

    void compare_system(const std::string& path, const System& a, const System& b) {
        compare_members(path, "", a, b);
        compare_ports(path, "input", a.inputs, b.inputs);
        compare_ports(path, "output", a.outputs, b.outputs);
        compare_items(path, "enumeration", a.enumerations, b.enumerations);
        compare_items(path, "variable", a.variables, b.variables);
        for (const Block& block : a.blocks)
            if (!b.find_block(block.name))
                add(Kind::removed, joined(path, block.name), "", summary(block), "");
        for (const Block& block : b.blocks) {
            const std::string inside = joined(path, block.name);
            if (const Block* before = a.find_block(block.name))
                compare_block(inside, *before, block);
            else
                add(Kind::added, inside, "", "", summary(block));
        }
        compare_order(path, "block", a.blocks, b.blocks);
        compare_wires(path, wires_of(a), wires_of(b));
        compare_items(path, "signal", a.signals, b.signals);
    }

    void compare_block(const std::string& path, const Block& a, const Block& b) {
        compare_members(path, "", a, b);
        const bool is_other_kind =
            a.is_library_block() != b.is_library_block() || bool(a.reference) != bool(b.reference);
        if (is_other_kind || (b.reference && a.reference->file != b.reference->file))
            add(Kind::changed, path, "block", said(a), said(b));
        compare_items(path, "setting", a.settings, b.settings);
        if (a.reference && b.reference) {
            compare_items(path, "variable", a.reference->with, b.reference->with);
            if (a.reference->model == b.reference->model) return;
        }
        if (a.content() && b.content()) compare_system(path, *a.content(), *b.content());
    }

    void compare_wires(const std::string& path, const std::vector<Wire>& a, const std::vector<Wire>& b) {
        const std::set<Wire> before(a.begin(), a.end()), after(b.begin(), b.end());
        for (const Wire& wire : a)
            if (!after.contains(wire))
                add_in(path, Kind::removed, joined(path, wire.first), "wire", wire.second, "");
        for (const Wire& wire : b)
            if (!before.contains(wire))
                add_in(path, Kind::added, joined(path, wire.first), "wire", "", wire.second);
    }
};

/// Renames blocks of `before` that `after` has under another name, within the subsystem at `path`.
void follow_renames(Model& before, const Model& after, const std::string& path,
                    std::vector<Distinction>& found) {
    const System* const now = find_system(after, path);
    if (!find_system(before, path)) return;
    const auto rename = [&](std::string old, const std::string& name) {
        edit(before, operations::Rename{joined(path, old), name});
        found.push_back({Kind::renamed, joined(path, name), path, "", old, name});
    };
    const auto lacking = [](const System& system, const System& other) {
        std::vector<const Block*> blocks;
        for (const Block& block : system.blocks)
            if (!other.find_block(block.name)) blocks.push_back(&block);
        return blocks;
    };
    for (const Block* block : lacking(*now, *find_system(before, path)))
        for (const Block* gone : lacking(*find_system(before, path), *now)) {
            Block old = *gone;
            old.name = block->name;
            if (old == *block) {
                rename(gone->name, block->name);
                break;
            }
        }
    const auto gone = lacking(*find_system(before, path), *now),
               come = lacking(*now, *find_system(before, path));
    if (gone.size() == 1 && come.size() == 1 && said(*gone[0]) == said(*come[0]))
        rename(gone[0]->name, come[0]->name);
    for (const Block& block : now->blocks)
        if (block.system) follow_renames(before, after, joined(path, block.name), found);
}

} // namespace

std::vector<Distinction> compare(const Model& before, const Model& after) {
    Comparison comparison;
    Model renamed = before;
    try {
        follow_renames(renamed, after, "", comparison.found);
    } catch (const Errors&) { // a broken model may refuse a name
        renamed = before;
        comparison.found.clear();
    }
    comparison.compare(renamed, after);
    return std::move(comparison.found);
}

std::string earlier_path(std::string path, const std::vector<Distinction>& distinctions) {
    for (auto d = distinctions.rbegin(); d != distinctions.rend();
         ++d) // inner blocks come after those around
        if (d->kind == Kind::renamed && (path + ".").starts_with(d->path + "."))
            path.replace(0, d->path.size(), joined(d->system, d->before));
    return path;
}

std::string text_of(const Distinction& d) {
    constexpr char signs[] = {'+', '-', '~', '~'}; // in the order of Kind
    std::string text = std::string(1, signs[static_cast<int>(d.kind)]) + " " + d.path;
    const auto append = [&](const std::string& between, const std::string& more) {
        if (!more.empty()) text += (text.size() == 2 ? "" : between) + more;
    };
    if (d.kind == Kind::renamed) return text + ": renamed from " + d.before;
    append(": ", d.what);
    if (d.kind != Kind::changed)
        append(d.what == "wire" ? " from " : ": ", d.before + d.after);
    else if (!d.before.empty() || !d.after.empty())
        append(": ", (d.before.empty() ? "none" : d.before) + " -> " + (d.after.empty() ? "none" : d.after));
    return text;
}

} // namespace bf::model
