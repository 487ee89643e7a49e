// Messages of other programs: JSON, CDR (OMG, DDSI-RTPS 2.5, clause 10: PLAIN_CDR of version 1) with the
// message definitions of ROS 2 (https://design.ros2.org/articles/legacy_interface_definition.html), and those
// of ROS 1 (http://wiki.ros.org/msg), whose fields follow one another without gaps.
#include "foreign.hpp"

#include "bf/base/numbers.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <vector>

namespace bf::recording {
namespace {

std::string joined(const std::string& path, const std::string& name) {
    return path.empty() ? name : path + "." + name;
}

// ---- JSON ----

class JsonDecoder final : public Decoder {
  public:
    void decode(Bytes message, const Visit& visit) const override {
        const auto* const text = reinterpret_cast<const char*>(message.data());
        const Json json = Json::parse(text, text + message.size(), nullptr, false);
        if (!json.is_object()) throw Malformed("is no JSON object");
        walk(json, "", 0, visit);
    }

  private:
    using Json = nlohmann::json;

    static std::optional<double> number_of(const Json& json) {
        if (json.is_boolean()) return json.get<bool>() ? 1 : 0;
        if (json.is_number()) return json.get<double>();
        return {};
    }

    static void walk(const Json& json, const std::string& path, int depth, const Visit& visit) {
        if (depth > deepest) throw Malformed("is nested too deeply");
        if (const auto number = number_of(json)) return visit(path, {&*number, 1});
        if (json.is_object())
            for (const auto& [name, value] : json.items()) walk(value, joined(path, name), depth + 1, visit);
        if (!json.is_array() || json.empty()) return;
        std::vector<double> row;
        for (const auto& item : json)
            if (const auto number = number_of(item)) row.push_back(*number);
        if (row.size() == json.size()) return visit(path, row);
        for (std::size_t i = 0; i < std::min(json.size(), most_parts); ++i)
            walk(json[i], path + "[" + std::to_string(i + 1) + "]", depth + 1, visit);
    }
};

// ---- ROS ----

enum class Ros { one, two };

enum class Primitive {
    boolean,
    uint8,
    int8,
    uint16,
    int16,
    uint32,
    int32,
    uint64,
    int64,
    float32,
    float64,
    text
};

constexpr std::size_t sizes[] = {1, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8, 1}; ///< in the order of Primitive

std::optional<Primitive> primitive_of(std::string_view name, Ros ros) {
    if (ros == Ros::one && name == "byte") return Primitive::int8;
    static constexpr std::pair<std::string_view, Primitive> all[] = {
        {"bool", Primitive::boolean},    {"byte", Primitive::uint8},    {"char", Primitive::uint8},
        {"uint8", Primitive::uint8},     {"int8", Primitive::int8},     {"uint16", Primitive::uint16},
        {"int16", Primitive::int16},     {"uint32", Primitive::uint32}, {"int32", Primitive::int32},
        {"uint64", Primitive::uint64},   {"int64", Primitive::int64},   {"float32", Primitive::float32},
        {"float64", Primitive::float64}, {"string", Primitive::text}};
    for (const auto& [known, primitive] : all)
        if (name == known) return primitive;
    return {};
}

struct Field {
    std::string name;
    std::optional<Primitive> primitive;
    int type = -1; ///< of a message, its number
    enum class Kind { one, fixed, sequence } kind = Kind::one;
    std::size_t count = 1; ///< of a fixed array
};

struct Type {
    std::string name; ///< "geometry_msgs/Twist"
    std::vector<Field> fields;
};

/// "geometry_msgs/msg/Twist" as "geometry_msgs/Twist".
std::string short_name(std::string_view name) {
    std::string text(name);
    if (const auto at = text.find("/msg/"); at != text.npos) text.erase(at, 4);
    return text;
}

/// Reads a message by its types.
class RosReader {
  public:
    RosReader(Bytes message, Ros ros) : message_(message), is_aligned_(ros == Ros::two) {
        if (ros == Ros::one) return;
        if (message.size() < 4) throw Malformed("has no CDR header");
        const auto kind = std::to_integer<int>(message[0]) << 8 | std::to_integer<int>(message[1]);
        if (kind != 0 && kind != 1) throw Malformed("is in another CDR than the plain one of version 1");
        is_swapped_ = kind == 0; // big-endian
        at_ = 4;
    }

    double number(Primitive primitive) {
        switch (primitive) {
        case Primitive::boolean: return get<std::uint8_t>() != 0;
        case Primitive::uint8: return get<std::uint8_t>();
        case Primitive::int8: return get<std::int8_t>();
        case Primitive::uint16: return get<std::uint16_t>();
        case Primitive::int16: return get<std::int16_t>();
        case Primitive::uint32: return get<std::uint32_t>();
        case Primitive::int32: return get<std::int32_t>();
        case Primitive::uint64: return static_cast<double>(get<std::uint64_t>());
        case Primitive::int64: return static_cast<double>(get<std::int64_t>());
        case Primitive::float32: return get<float>();
        case Primitive::float64: return get<double>();
        case Primitive::text: skip(get<std::uint32_t>()); return 0;
        }
        return 0;
    }
    /// How many elements of at least so many bytes follow.
    std::size_t count(std::size_t bytes) {
        const std::size_t count = get<std::uint32_t>();
        if (count > most_elements || count * bytes > message_.size() - at_)
            throw Malformed("has an array that is longer than the message");
        return count;
    }

    /// A message in a message, which may have no field at all.
    void enter() {
        if (++entered_ > most_elements) throw Malformed("has more messages in it than can be looked at");
    }

  private:
    template <class T> T get() {
        if (is_aligned_) at_ += (sizeof(T) - (at_ - 4) % sizeof(T)) % sizeof(T); // from behind the header on
        if (at_ + sizeof(T) > message_.size()) throw Malformed("ends before its last field");
        std::array<std::byte, sizeof(T)> bytes;
        std::copy_n(message_.begin() + static_cast<std::ptrdiff_t>(at_), sizeof(T), bytes.begin());
        if (is_swapped_) std::ranges::reverse(bytes);
        at_ += sizeof(T);
        T value;
        std::memcpy(&value, bytes.data(), sizeof value);
        return value;
    }
    void skip(std::size_t count) {
        if (count > message_.size() - at_) throw Malformed("ends within a text");
        at_ += count;
    }

    Bytes message_;
    std::size_t at_ = 0, entered_ = 0;
    bool is_swapped_ = false;
    const bool is_aligned_;
};

class RosDecoder final : public Decoder {
  public:
    RosDecoder(std::string_view name, std::string_view schema, Ros ros) : ros_(ros) {
        // Definitions of other types follow, each behind a line of '=' and one with its name.
        types_.push_back({short_name(name), {}});
        const auto add_time = [&](const char* type, Primitive sec, const char* nanoseconds, Primitive nsec) {
            types_.push_back(
                {type,
                 {{"sec", sec, -1, Field::Kind::one, 1}, {nanoseconds, nsec, -1, Field::Kind::one, 1}}});
        };
        if (ros == Ros::two) {
            add_time("builtin_interfaces/Time", Primitive::int32, "nanosec", Primitive::uint32);
            add_time("builtin_interfaces/Duration", Primitive::int32, "nanosec", Primitive::uint32);
        } else {
            add_time("time", Primitive::uint32, "nsec", Primitive::uint32);
            add_time("duration", Primitive::int32, "nsec", Primitive::int32);
        }
        std::vector<std::pair<std::size_t, std::vector<std::string>>> texts{{0, {}}};
        std::istringstream lines{std::string(schema)};
        for (std::string line; std::getline(lines, line);) {
            if (!line.empty() && line.back() == '\r') line.pop_back();
            if (line.starts_with("MSG: ")) {
                const std::string other = short_name(std::string_view(line).substr(5));
                const auto known = std::ranges::find(types_, other, &Type::name);
                const auto index = static_cast<std::size_t>(known - types_.begin());
                if (known == types_.end()) types_.push_back({other, {}});
                types_[index].fields.clear();
                texts.push_back({index, {}});
            } else if (!line.starts_with("====")) {
                texts.back().second.push_back(line);
            }
        }
        for (const auto& [type, definition] : texts)
            for (const auto& line : definition) add_field(type, line);
        std::vector<bool> is_known(types_.size());
        for (std::size_t i = 0; i < types_.size(); ++i) require_end(i, 0, is_known);
    }

    void decode(Bytes message, const Visit& visit) const override {
        RosReader reader(message, ros_);
        read(reader, 0, "", visit);
    }

  private:
    void add_field(std::size_t type, std::string line) {
        const auto hash = line.find('#');
        if (hash != line.npos) line.resize(hash);
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
        if (name.find('=') != name.npos || (first != rest.npos && rest[first] == '=')) return;
        Field field{name, {}, -1, Field::Kind::one, 1};
        std::string base = kind;
        if (kind.ends_with(']')) {
            const auto open = kind.rfind('[');
            if (open == kind.npos) throw Malformed("the schema has no type '" + kind + "'");
            base = kind.substr(0, open);
            const std::string inside = kind.substr(open + 1, kind.size() - open - 2);
            field.kind =
                inside.empty() || inside.starts_with("<=") ? Field::Kind::sequence : Field::Kind::fixed;
            if (field.kind == Field::Kind::fixed) {
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
            if (const auto found = std::ranges::find(types_, known, &Type::name); found != types_.end())
                return static_cast<int>(found - types_.begin());
        throw Malformed("the schema does not say what '" + name + "' is");
    }

    /// Types that hold themselves have no end. Each is looked at once.
    void require_end(std::size_t type, int depth, std::vector<bool>& is_known) const {
        if (depth > deepest) throw Malformed("the types of the schema are nested too deeply");
        for (const Field& field : types_[type].fields)
            if (field.type >= 0 && !is_known[static_cast<std::size_t>(field.type)])
                require_end(static_cast<std::size_t>(field.type), depth + 1, is_known);
        is_known[type] = true;
    }

    void read(RosReader& reader, std::size_t type, const std::string& path, const Visit& visit) const {
        reader.enter();
        for (const Field& field : types_[type].fields) {
            const std::string name = joined(path, field.name);
            const std::size_t bytes = field.primitive ? sizes[static_cast<std::size_t>(*field.primitive)] : 1;
            const std::size_t count = field.kind == Field::Kind::sequence ? reader.count(bytes) : field.count;
            if (!field.primitive) {
                static const Visit nothing = [](const std::string&, std::span<const double>) {};
                for (std::size_t i = 0; i < count; ++i)
                    read(reader, static_cast<std::size_t>(field.type),
                         field.kind == Field::Kind::one ? name : name + "[" + std::to_string(i + 1) + "]",
                         i < most_parts ? visit : nothing);
                continue;
            }
            std::vector<double> values;
            for (std::size_t i = 0; i < count; ++i) values.push_back(reader.number(*field.primitive));
            if (*field.primitive != Primitive::text && !values.empty()) visit(name, values);
        }
    }

    const Ros ros_;
    std::vector<Type> types_; ///< the message's own first
};

} // namespace

std::unique_ptr<Decoder> make_decoder(std::string_view message_encoding, std::string_view schema_encoding,
                                      std::string_view schema_name, std::string_view schema) {
    if (message_encoding == "json") return std::make_unique<JsonDecoder>();
    if (message_encoding == "cdr" && schema_encoding == "ros2msg")
        return std::make_unique<RosDecoder>(schema_name, schema, Ros::two);
    if (message_encoding == "ros1" && schema_encoding == "ros1msg")
        return std::make_unique<RosDecoder>(schema_name, schema, Ros::one);
    if (message_encoding == "protobuf" && schema_encoding == "protobuf")
        return make_protobuf_decoder(schema_name, schema);
    throw Malformed(
        "messages in '" + std::string(message_encoding) + "' with a schema in '" +
        std::string(schema_encoding) +
        "' are not read; 'json', 'cdr' with 'ros2msg', 'ros1' with 'ros1msg', and 'protobuf' are");
}

} // namespace bf::recording
