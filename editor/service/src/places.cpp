#include "places.hpp"

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
        }
        for (const auto& connection : system.connections)
            for (const auto& to : connection.to) add(path, to.text(), to.where, connection.from.text());
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
