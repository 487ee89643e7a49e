#include "comments.hpp"

#include <algorithm>
#include <map>

namespace bf::formats {
namespace {

using model::Comments;
using model::Location;

/// All items of a model that carry comments.
class Anchors {
  public:
    struct Anchor {
        int line, column;
        Comments* comments;
    };

    explicit Anchors(model::Model& model) {
        add_all(model.keys);
        add_all(model.plugins);
        add_system(model.root);
        add_all(model.record);
        for (model::Panel& panel : model.plots) {
            add(panel);
            add_all(panel.signals);
        }
        add_all(model.layout.keys);
        add_all(model.layout.blocks);
        add_all(model.layout.wires);
        add_all(model.layout.notes);
        for (model::Display& display : model.layout.displays) {
            add(display);
            add_all(display.signals);
        }
        std::ranges::sort(all, {}, [](const Anchor& a) { return std::pair(a.line, a.column); });
    }

    std::vector<Anchor> all;

    /// The first anchor on a line after `line`.
    auto after(int line) { return std::ranges::upper_bound(all, line, {}, &Anchor::line); }

    /// The first of the anchors on `line`, or else the last one before it; null if there is none.
    Comments* on(int line) {
        const auto here = std::ranges::lower_bound(all, line, {}, &Anchor::line);
        if (here != all.end() && here->line == line) return here->comments;
        return here == all.begin() ? nullptr : std::prev(here)->comments;
    }

  private:
    template <typename Item> void add(Item& item) {
        all.push_back({item.where.line, item.where.column, &item.comments});
    }
    template <typename Items> void add_all(Items& items) {
        for (auto& item : items) add(item);
    }
    void add_variables(std::vector<model::Variable>& variables) {
        for (model::Variable& variable : variables) {
            add(variable);
            add_variables(variable.fields);
        }
    }
    void add_system(model::System& system) {
        add_all(system.inputs);
        add_all(system.outputs);
        add_variables(system.enumerations);
        add_variables(system.variables);
        for (model::Block& block : system.blocks) {
            add(block);
            add_all(block.keys);
            if (block.reference) add_variables(block.reference->with);
            if (block.system) add_system(*block.system);
        }
        for (model::Connection& connection : system.connections) {
            add(connection);
            if (connection.to.size() > 1) add_all(connection.to);
        }
        add_all(system.signals);
    }
};

/// Whether ascending positions lie in one of the extents.
class ExtentCursor {
  public:
    explicit ExtentCursor(std::vector<std::pair<std::size_t, std::size_t>>& extents) : extents_(extents) {
        std::ranges::sort(extents_);
    }
    bool contains(std::size_t position) {
        while (next_ < extents_.size() && extents_[next_].second <= position) ++next_;
        return next_ < extents_.size() && extents_[next_].first <= position;
    }

  private:
    std::vector<std::pair<std::size_t, std::size_t>>& extents_;
    std::size_t next_ = 0;
};

void add_line(std::vector<std::string>& lines, std::string text) {
    if (text.empty() && !lines.empty() && lines.back().empty()) return; // one blank line is enough
    lines.push_back(std::move(text));
}

std::string right_trimmed(std::string_view text) {
    return std::string(text.substr(0, text.find_last_not_of(" \t") + 1));
}

} // namespace

void attach_comments(model::Model& model, const Source& source,
                     std::vector<std::pair<std::size_t, std::size_t>> quoted,
                     const std::vector<LineRange>& values) {
    Anchors anchors(model);
    ExtentCursor quotes(quoted);
    std::map<int, int> value_of_line; // last line -> first line of the values over several lines
    for (const LineRange& value : values)
        if (value.last > value.first) value_of_line[value.last] = value.first;
    /// The line with the item to which a comment on `number` belongs, if that is inside a value; else 0.
    auto item_line = [&](int number) {
        const auto value = value_of_line.lower_bound(number);
        return value != value_of_line.end() && value->second < number ? value->second : 0;
    };

    for (int number = 1; number <= source.line_count(); ++number) {
        const std::string_view line = source.line(number);
        const std::size_t start = source.line_starts[number - 1], first = line.find_first_not_of(" \t");
        const int inside = item_line(number);
        if (first == line.npos || line[first] == '#') {
            if (quotes.contains(start + (first == line.npos ? 0 : first))) continue;
            const std::string text = first == line.npos ? "" : right_trimmed(line.substr(first));
            const auto next = anchors.after(number);
            Comments* owner = inside                      ? anchors.on(inside)
                              : next != anchors.all.end() ? next->comments
                                                          : nullptr;
            if (!(inside && text.empty())) add_line(owner ? owner->before : model.end, text);
            continue;
        }
        for (std::size_t hash = line.find(" #"); hash != line.npos; hash = line.find(" #", hash + 1)) {
            if (quotes.contains(start + hash + 1)) continue;
            const std::size_t blanks = line.find_last_not_of(" \t", hash) + 1;
            Comments* owner = anchors.on(inside ? inside : number);
            if (!owner)
                add_line(model.end, right_trimmed(line.substr(hash + 1)));
            else if (owner->trailing.empty())
                owner->trailing = right_trimmed(line.substr(blanks));
            else
                add_line(owner->before, right_trimmed(line.substr(hash + 1)));
            break;
        }
    }
    if (!anchors.all.empty()) {
        std::vector<std::string>& top = anchors.all.front().comments->before;
        if (!top.empty() && top.front().empty()) top.erase(top.begin());
    }
    while (!model.end.empty() && model.end.back().empty()) model.end.pop_back();
}

} // namespace bf::formats
