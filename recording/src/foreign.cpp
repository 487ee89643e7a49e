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

    double number(RosPrimitive primitive) {
        switch (primitive) {
        case RosPrimitive::boolean: return get<std::uint8_t>() != 0;
        case RosPrimitive::uint8: return get<std::uint8_t>();
        case RosPrimitive::int8: return get<std::int8_t>();
        case RosPrimitive::uint16: return get<std::uint16_t>();
        case RosPrimitive::int16: return get<std::int16_t>();
        case RosPrimitive::uint32: return get<std::uint32_t>();
        case RosPrimitive::int32: return get<std::int32_t>();
        case RosPrimitive::uint64: return static_cast<double>(get<std::uint64_t>());
        case RosPrimitive::int64: return static_cast<double>(get<std::int64_t>());
        case RosPrimitive::float32: return get<float>();
        case RosPrimitive::float64: return get<double>();
        case RosPrimitive::text: skip(get<std::uint32_t>()); return 0;
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
    RosDecoder(std::string_view name, std::string_view schema, Ros ros)
        : ros_(ros), types_(read_ros_definition(name, schema, ros)) {}

    void decode(Bytes message, const Visit& visit) const override {
        RosReader reader(message, ros_);
        read(reader, 0, "", visit);
    }

  private:
    void read(RosReader& reader, std::size_t type, const std::string& path, const Visit& visit) const {
        reader.enter();
        for (const RosField& field : types_[type].fields) {
            const std::string name = joined(path, field.name);
            const std::size_t bytes = field.primitive ? bytes_of(*field.primitive) : 1;
            const std::size_t count =
                field.kind == RosField::Kind::sequence ? reader.count(bytes) : field.count;
            if (!field.primitive) {
                static const Visit nothing = [](const std::string&, std::span<const double>) {};
                for (std::size_t i = 0; i < count; ++i)
                    read(reader, static_cast<std::size_t>(field.type),
                         field.kind == RosField::Kind::one ? name : name + "[" + std::to_string(i + 1) + "]",
                         i < most_parts ? visit : nothing);
                continue;
            }
            std::vector<double> values;
            for (std::size_t i = 0; i < count; ++i) values.push_back(reader.number(*field.primitive));
            if (*field.primitive != RosPrimitive::text && !values.empty()) visit(name, values);
        }
    }

    const Ros ros_;
    const std::vector<RosType> types_; ///< the message's own first
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
