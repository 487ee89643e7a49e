#include "bf/recording/ros_definition.hpp"

#include "bf/base/numbers.hpp"
#include "foreign.hpp"

#include <algorithm>
#include <sstream>
#include <utility>

namespace bf::recording {
namespace {

std::optional<RosPrimitive> primitive_of(std::string_view name, Ros ros) {
    if (ros == Ros::one && name == "byte") return RosPrimitive::int8;
    static constexpr std::pair<std::string_view, RosPrimitive> all[] = {
        {"bool", RosPrimitive::boolean},    {"byte", RosPrimitive::uint8},
        {"char", RosPrimitive::uint8},      {"uint8", RosPrimitive::uint8},
        {"int8", RosPrimitive::int8},       {"uint16", RosPrimitive::uint16},
        {"int16", RosPrimitive::int16},     {"uint32", RosPrimitive::uint32},
        {"int32", RosPrimitive::int32},     {"uint64", RosPrimitive::uint64},
        {"int64", RosPrimitive::int64},     {"float32", RosPrimitive::float32},
        {"float64", RosPrimitive::float64}, {"string", RosPrimitive::text}};
    for (const auto& [known, primitive] : all)
        if (name == known) return primitive;
    return {};
}

/// "geometry_msgs/msg/Twist" as "geometry_msgs/Twist".
std::string short_name(std::string_view name) {
    std::string text(name);
    if (const auto at = text.find("/msg/"); at != text.npos) text.erase(at, 4);
    return text;
}

std::string trimmed(const std::string& text) {
    const auto first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
    return first == text.npos ? "" : text.substr(first, last - first + 1);
}

class Definition {
  public:
    Definition(std::string_view name, std::string_view schema, Ros ros) : ros_(ros) {
        // Definitions of other types follow, each behind a line of '=' and one with its name.
        types_.push_back({short_name(name)});
        const auto add_time = [&](const char* type, RosPrimitive sec, const char* nanoseconds,
                                  RosPrimitive nsec) {
            types_.push_back(
                {type, {{.name = "sec", .primitive = sec}, {.name = nanoseconds, .primitive = nsec}}});
        };
        if (ros == Ros::two) {
            add_time("builtin_interfaces/Time", RosPrimitive::int32, "nanosec", RosPrimitive::uint32);
            add_time("builtin_interfaces/Duration", RosPrimitive::int32, "nanosec", RosPrimitive::uint32);
        } else {
            add_time("time", RosPrimitive::uint32, "nsec", RosPrimitive::uint32);
            add_time("duration", RosPrimitive::int32, "nsec", RosPrimitive::int32);
        }
        std::vector<std::pair<std::size_t, std::vector<std::string>>> texts{{0, {}}};
        std::istringstream lines{std::string(schema)};
        for (std::string line; std::getline(lines, line);) {
            if (!line.empty() && line.back() == '\r') line.pop_back();
            if (line.starts_with("MSG: ")) {
                const std::string other = short_name(std::string_view(line).substr(5));
                const auto known = std::ranges::find(types_, other, &RosType::name);
                const auto index = static_cast<std::size_t>(known - types_.begin());
                if (known == types_.end()) types_.push_back({other});
                types_[index] = {other};
                texts.push_back({index, {}});
            } else if (!line.starts_with("====")) {
                texts.back().second.push_back(line);
            }
        }
        for (const auto& [type, definition] : texts)
            for (const auto& line : definition) add_field(type, line);
        std::vector<int> heights(types_.size());
        for (std::size_t i = 0; i < types_.size(); ++i) height(i, 0, heights);
    }
    std::vector<RosType> take() { return std::move(types_); }

  private:
    void add_field(std::size_t type, const std::string& whole_line) {
        const std::string line = whole_line.substr(0, whole_line.find('#'));
        std::istringstream words(line);
        std::string kind, name;
        if (!(words >> kind >> name)) {
            if (!kind.empty())
                throw Malformed("the schema has the line '" + kind + "', which declares nothing");
            return;
        }
        std::string rest;
        std::getline(words, rest);
        const auto first = rest.find_first_not_of(" \t");
        // A constant takes no place: "int32 X=3", "int32 X = 3"; a default does not begin with '='.
        if (name.find('=') != name.npos || (first != rest.npos && rest[first] == '=')) {
            const std::string& from =
                kind == "string" ? whole_line : line; // a text goes to the end of the line
            const auto begin = from.find(kind) + kind.size(), equals = from.find('=');
            types_[type].constants.push_back(kind + " " + trimmed(from.substr(begin, equals - begin)) + "=" +
                                             trimmed(from.substr(equals + 1)));
            return;
        }
        RosField field{.name = name, .written = kind};
        std::string base = kind;
        if (kind.ends_with(']')) {
            const auto open = kind.rfind('[');
            if (open == kind.npos) throw Malformed("the schema has no type '" + kind + "'");
            base = kind.substr(0, open);
            const std::string inside = kind.substr(open + 1, kind.size() - open - 2);
            field.kind =
                inside.empty() || inside.starts_with("<=") ? RosField::Kind::sequence : RosField::Kind::fixed;
            if (field.kind == RosField::Kind::fixed) {
                const auto count = number_of<std::size_t>(inside);
                if (!count || *count > most_elements)
                    throw Malformed("the schema has no array '" + kind + "'");
                field.count = *count;
            }
        }
        if (const auto bound = base.find("<="); bound != base.npos) base.resize(bound); // string<=10
        field.primitive = primitive_of(base, ros_);
        if (!field.primitive) field.type = find_type(types_[type].name, base);
        types_[type].fields.push_back(std::move(field));
    }

    int find_type(const std::string& from, const std::string& name) const {
        const std::string package = from.substr(0, from.find('/'));
        const std::string whole = name.find('/') == name.npos ? package + "/" + name : short_name(name);
        for (const std::string& known : {whole, (ros_ == Ros::two ? "builtin_interfaces/" : "") + name,
                                         name == "Header" ? "std_msgs/Header" : whole})
            if (const auto found = std::ranges::find(types_, known, &RosType::name); found != types_.end())
                return static_cast<int>(found - types_.begin());
        throw Malformed("the schema does not say what '" + name + "' is");
    }

    /// How many types are nested in that one, which is nested in `depth` others, itself included. Those that
    /// hold themselves have no end. Each is looked at once: `heights` has what is known, and 0.
    int height(std::size_t type, int depth, std::vector<int>& heights) const {
        const auto refuse_below = [](int level) {
            if (level > deepest) throw Malformed("the types of the schema are nested too deeply");
        };
        if (heights[type] == 0) {
            refuse_below(depth);
            int below = 0;
            for (const RosField& field : types_[type].fields)
                if (field.type >= 0)
                    below = std::max(below, height(static_cast<std::size_t>(field.type), depth + 1, heights));
            heights[type] = 1 + below;
        }
        refuse_below(depth + heights[type] - 1);
        return heights[type];
    }

    const Ros ros_;
    std::vector<RosType> types_; ///< the message's own first
};

} // namespace

std::size_t bytes_of(RosPrimitive primitive) noexcept {
    constexpr std::size_t sizes[] = {1, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8, 4}; // in the order of RosPrimitive
    return sizes[static_cast<std::size_t>(primitive)];
}

std::vector<RosType> read_ros_definition(std::string_view name, std::string_view text, Ros ros) {
    return Definition(name, text, ros).take();
}

} // namespace bf::recording
