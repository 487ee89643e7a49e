#include "places.hpp"

#include "bf/model/chart.hpp"
#include "bf/model/edit.hpp"

#include <algorithm>
#include <string_view>
#include <tuple>

namespace bf::service {

namespace {

class PlaceFinder {
  public:
    explicit PlaceFinder(std::string_view text) {
        for (std::size_t begin = 0; begin < text.size();) {
            const std::size_t end = std::min(text.find('\n', begin), text.size());
            lines_.push_back(text.substr(begin, end - begin));
            begin = end + 1;
        }
    }

    void look_into(const model::System& system, const std::string& path) {
        for (const auto* ports : {&system.inputs, &system.outputs})
            for (const auto& port : *ports) add(path, port.name, port.where);
        for (const auto& block : system.blocks) {
            add(path, block.name, block.where);
            if (block.system) look_into(*block.system, model::joined(path, block.name));
            if (model::has_chart(block) && block.find_setting(model::chart_setting))
                look_into_chart(block.where, model::joined(path, block.name));
        }
        for (const auto& connection : system.connections)
            for (const auto& to : connection.to) add(path, to.text(), to.where, connection.from.text());
    }

    /// States that stand on lines of their own, and their transitions there or in one line.
    void look_into_chart(const model::Location& where, const std::string& machine) {
        struct Key {
            int indent;
            std::string name;
            int count = 0; ///< of its items
        };
        std::vector<Key> keys;
        // The path of the state that the keys lead into, behind `chart` and `states` or `regions` each.
        const auto state = [&] {
            std::string path;
            for (std::size_t i = 2; i < keys.size(); i += 2)
                if (keys[i - 1].name == "states" || keys[i - 1].name == "regions")
                    path = model::joined(path, keys[i].name);
            return path;
        };
        const auto add_transition = [&](int number, int column, int at) {
            const auto [around, name] = model::split_last(model::joined(machine, state()));
            places_.push_back({around, model::joined(model::joined(around, name), std::to_string(number)),
                               name, at, column, column > 1 ? at : last_line(at)});
        };
        if (where.line < 1 || where.line > static_cast<int>(lines_.size())) return;
        for (int n = where.line + 1; n <= last_line(where.line); ++n) {
            const int its = indent(n);
            const std::string_view rest = line(n).substr(static_cast<std::size_t>(its));
            if (rest.empty() || rest[0] == '#') continue;
            const bool is_item = rest.starts_with("- ");
            while (!keys.empty() && (keys.back().indent > its || (keys.back().indent == its && !is_item)))
                keys.pop_back();
            if (is_item) {
                if (!keys.empty() && keys.back().name == "transitions")
                    add_transition(++keys.back().count, 1, n);
                continue;
            }
            keys.push_back({its, std::string(rest.substr(0, rest.find(':')))});
            if (keys[0].name != "chart") {
                keys.pop_back();
                continue;
            }
            const bool is_state =
                keys.size() % 2 == 1 && keys.size() > 1 &&
                (keys[keys.size() - 2].name == "states" || keys[keys.size() - 2].name == "regions");
            if (is_state) {
                const auto [around, name] = model::split_last(model::joined(machine, state()));
                places_.push_back({around, model::joined(around, name), "", n, 1, last_line(n)});
            }
            const std::size_t list = rest.find("transitions: [");
            if (list == rest.npos || !(is_state || (list == 0 && keys.size() % 2 == 0))) continue;
            int depth = 0, number = 0;
            for (std::size_t at = list + 13; at < rest.size() && (at == list + 13 || depth > 0); ++at) {
                if (rest[at] == '{' && depth == 1)
                    add_transition(++number, its + static_cast<int>(at) + 1, n);
                depth += (rest[at] == '[' || rest[at] == '{') - (rest[at] == ']' || rest[at] == '}');
            }
        }
    }

    std::vector<TextPlace> places() {
        std::ranges::stable_sort(places_, {},
                                 [](const TextPlace& p) { return std::tuple(p.line, p.column, -p.last); });
        return std::move(places_);
    }

  private:
    void add(const std::string& system, const std::string& name, const model::Location& where,
             std::string from = {}) {
        if (where.line < 1 || where.line > static_cast<int>(lines_.size())) return;
        const int column = indent(where.line) + 1;
        const bool is_first = column == where.column; // else it stands in brackets
        places_.push_back({system, model::joined(system, name), std::move(from), where.line,
                           is_first ? 1 : where.column, is_first ? last_line(where.line) : where.line});
    }

    std::string_view line(int number) const { return lines_[static_cast<std::size_t>(number - 1)]; }
    int indent(int number) const {
        return static_cast<int>(std::min(line(number).find_first_not_of(' '), line(number).size()));
    }
    /// A block of YAML goes on as long as lines are indented more than its first one.
    int last_line(int first) const {
        int last = first;
        for (int next = first + 1; next <= static_cast<int>(lines_.size()); ++next) {
            const std::string_view rest = line(next).substr(static_cast<std::size_t>(indent(next)));
            const bool is_empty = rest.empty() || rest[0] == '#' || rest[0] == '\r';
            if (!is_empty && indent(next) <= indent(first)) break;
            if (!is_empty) last = next;
        }
        return last;
    }

    std::vector<std::string_view> lines_;
    std::vector<TextPlace> places_;
};

} // namespace

std::vector<TextPlace> places_in(const model::Model& model, const std::string& system) {
    if (!model.source) return {};
    PlaceFinder finder(*model.source);
    finder.look_into(model.root, system);
    return finder.places();
}

} // namespace bf::service
