#include "types.hpp"

#include <algorithm>
#include <boost/uuid/detail/md5.hpp>
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>

namespace bf::ros1 {

namespace {

namespace fs = std::filesystem;
using middleware::nearest;
using recording::RosField;
using recording::RosPrimitive;
using recording::RosType;

/// Calls f with a number of the type.
template <class F> void with_number(RosPrimitive type, F&& f) {
    switch (type) {
    case RosPrimitive::boolean: return f(bool{});
    case RosPrimitive::uint8: return f(std::uint8_t{});
    case RosPrimitive::int8: return f(std::int8_t{});
    case RosPrimitive::uint16: return f(std::uint16_t{});
    case RosPrimitive::int16: return f(std::int16_t{});
    case RosPrimitive::uint32: return f(std::uint32_t{});
    case RosPrimitive::int32: return f(std::int32_t{});
    case RosPrimitive::uint64: return f(std::uint64_t{});
    case RosPrimitive::int64: return f(std::int64_t{});
    case RosPrimitive::float32: return f(float{});
    default: return f(double{});
    }
}

template <class T> T get(const std::uint8_t* from) {
    if constexpr (std::is_same_v<T, bool>) {
        return *from != 0;
    } else {
        T value;
        std::memcpy(&value, from, sizeof value);
        return value;
    }
}
template <class T> void put(std::vector<std::uint8_t>& bytes, T value) {
    const auto* from = reinterpret_cast<const std::uint8_t*>(&value);
    bytes.insert(bytes.end(), from, from + sizeof value);
}

/// Takes bytes off the front of a message.
class Front {
  public:
    explicit Front(Bytes bytes) : bytes_(bytes) {}
    Bytes take(std::size_t count) {
        if (count > bytes_.size()) throw std::runtime_error("it ends before its last field");
        const Bytes taken = bytes_.first(count);
        bytes_ = bytes_.subspan(count);
        return taken;
    }
    /// How many follow, each of so many bytes at least.
    std::size_t count(std::size_t bytes) {
        const std::size_t count = get<std::uint32_t>(take(sizeof(std::uint32_t)).data());
        if (count > bytes_.size() / std::max<std::size_t>(bytes, 1))
            throw std::runtime_error("it has " + std::to_string(count) + " elements where " +
                                     std::to_string(bytes_.size()) + " bytes are left");
        return count;
    }
    Bytes rest() const { return bytes_; }
    void go_to(Bytes rest) { bytes_ = rest; }

  private:
    Bytes bytes_;
};

/// A field, by its place among the values of a message.
class ValueField final : public Field {
  public:
    ValueField(std::string path, Kind kind, int size, bool is_scalar, std::size_t index, RosPrimitive type)
        : Field(std::move(path), kind, size, is_scalar), index_(index), type_(type) {}

    std::size_t length(const void* message) const override {
        return kind == Kind::sequence ? value(message).count : static_cast<std::size_t>(size);
    }
    void read(const void* message, double* values, std::size_t count) const override {
        const auto& its = value(message);
        if (kind == Kind::time) {
            const auto* second = its.bytes.data() + 4;
            values[0] = type_ == RosPrimitive::int32
                            ? get<std::int32_t>(its.bytes.data()) + get<std::int32_t>(second) / 1e9
                            : get<std::uint32_t>(its.bytes.data()) + get<std::uint32_t>(second) / 1e9;
            return;
        }
        count = std::min(count, length(message));
        with_number(type_, [&](auto number) {
            using T = decltype(number);
            for (std::size_t i = 0; i < count; ++i)
                values[i] = static_cast<double>(get<T>(its.bytes.data() + i * sizeof(T)));
        });
    }
    void write(void* message, const double* values, std::size_t count) const override {
        auto& its = value(message);
        its.own.clear();
        if (kind == Kind::time && type_ == RosPrimitive::int32) {
            const auto time = middleware::split_time<std::int32_t>(values[0]);
            put(its.own, time.first);
            put(its.own, time.second);
        } else if (kind == Kind::time) {
            const auto time = middleware::split_time<std::uint32_t>(values[0]);
            put(its.own, time.first);
            put(its.own, time.second);
        } else {
            with_number(type_, [&](auto number) {
                using T = decltype(number);
                for (std::size_t i = 0; i < count; ++i) put(its.own, nearest<T>(values[i]));
            });
            its.count = count;
        }
        its.bytes = its.own;
    }
    std::string text(const void* message) const override {
        const auto& bytes = value(message).bytes;
        return {bytes.begin(), bytes.end()};
    }
    void write(void* message, const std::vector<std::string>& texts) const override {
        auto& its = value(message);
        its.own.clear();
        for (const auto& text : texts) {
            if (kind == Kind::texts) put(its.own, static_cast<std::uint32_t>(text.size()));
            its.own.insert(its.own.end(), text.begin(), text.end());
            if (kind == Kind::text) break;
        }
        its.count = texts.size();
        its.bytes = its.own;
    }

  private:
    const Message::Value& value(const void* message) const {
        return static_cast<const Message*>(message)->values[index_];
    }
    Message::Value& value(void* message) const { return static_cast<Message*>(message)->values[index_]; }
    std::size_t index_;
    RosPrimitive type_;
};

/// Two to four real numbers of a message of geometry, such as x, y and z.
bool is_vector(const RosType& type) {
    return type.name.starts_with("geometry_msgs/") && type.fields.size() >= 2 && type.fields.size() <= 4 &&
           std::ranges::all_of(type.fields, [&](const RosField& field) {
               return field.kind == RosField::Kind::one && field.primitive == type.fields[0].primitive &&
                      (field.primitive == RosPrimitive::float64 || field.primitive == RosPrimitive::float32);
           });
}
bool is_time(const RosType& type) { return type.name == "time" || type.name == "duration"; }

/// A value that nobody looks at.
void skip(Front& front, const RosField& field, const std::vector<RosType>& types) {
    const std::size_t least = field.primitive ? recording::bytes_of(*field.primitive) : 0;
    const std::size_t count = field.kind == RosField::Kind::sequence ? front.count(least) : field.count;
    if (field.primitive && *field.primitive != RosPrimitive::text) {
        front.take(count * least);
        return;
    }
    for (std::size_t i = 0; i < count; ++i) {
        if (field.primitive) {
            front.take(front.count(1));
            continue;
        }
        const std::size_t left = front.rest().size();
        for (const auto& its : types[static_cast<std::size_t>(field.type)].fields) skip(front, its, types);
        if (left == front.rest().size()) return; // messages of nothing
    }
}
/// Zeros, no texts, no elements.
void put_nothing(std::vector<std::uint8_t>& bytes, const RosField& field, const std::vector<RosType>& types) {
    if (field.kind == RosField::Kind::sequence) return put(bytes, std::uint32_t{0});
    for (std::size_t i = 0; i < field.count; ++i)
        if (field.primitive)
            bytes.resize(bytes.size() + recording::bytes_of(*field.primitive));
        else
            for (const auto& its : types[static_cast<std::size_t>(field.type)].fields)
                put_nothing(bytes, its, types);
}

// ---- files

std::vector<fs::path> folders() {
    std::vector<fs::path> all;
    const auto add = [&](const char* variable, const char* under) {
        const char* value = std::getenv(variable);
        std::istringstream paths(value ? value : "");
        for (std::string path; std::getline(paths, path, ':');)
            if (!path.empty()) all.push_back(fs::path(path) / under);
    };
    add("ROS_PACKAGE_PATH", "");
    add("CMAKE_PREFIX_PATH", "share");
    all.emplace_back("/usr/share");
    return all;
}

/// Of a kind such as msg. Nothing: there is no such file.
std::optional<std::string> file_of(const std::string& package, const std::string& kind,
                                   const std::string& type) {
    for (const auto& folder : folders())
        for (const auto& its : {folder / package, folder}) {
            if (its.filename() != package && (its / "").parent_path().filename() != package) continue;
            std::ifstream file(its / kind / (type + "." + kind));
            if (file) return std::string(std::istreambuf_iterator<char>(file), {});
        }
    return {};
}
std::string message_file(const std::string& package, const std::string& type) {
    return file_of(package, "msg", type).value_or("");
}
std::string searched() {
    std::string all;
    for (const auto& folder : folders()) all += (all.empty() ? "" : ", ") + folder.string();
    return all;
}

struct Name {
    /// Of "sensor_msgs/Imu" or "sensor_msgs/msg/Imu". No other text may reach files.
    explicit Name(const std::string& text, const std::string& kind = "msg") {
        const auto first = text.find('/'), last = text.rfind('/');
        const auto is_name = [](const std::string& word) {
            return !word.empty() && std::isalpha(static_cast<unsigned char>(word.front())) &&
                   std::ranges::all_of(word, [](unsigned char c) { return std::isalnum(c) || c == '_'; });
        };
        if (first != text.npos) {
            package = text.substr(0, first);
            type = text.substr(last + 1);
        }
        if (!is_name(package) || !is_name(type) ||
            (first != last && text.substr(first, last - first) != "/" + kind))
            throw std::runtime_error("'" + text + "' is no type of " +
                                     (kind == "msg"
                                          ? "message; write package/Type, such as sensor_msgs/Imu"
                                          : "service; write package/Type, such as std_srvs/SetBool"));
    }
    std::string whole() const { return package + "/" + type; }
    std::string package, type;
};

/// Of the type, and behind it those that it has in it.
std::string whole_definition(const Name& name, const std::string& text) {
    std::string all = text;
    std::set<std::string> known{name.whole()};
    std::vector<std::pair<std::string, std::string>> left{{name.package, text}};
    while (!left.empty()) {
        const auto [package, its] = left.back();
        left.pop_back();
        std::istringstream lines(its);
        for (std::string line; std::getline(lines, line);) {
            std::string word;
            std::istringstream(line.substr(0, line.find('#'))) >> word;
            word = word.substr(0, word.find('['));
            if (word == "Header") word = "std_msgs/Header";
            const auto slash = word.find('/');
            const std::string of = slash == word.npos ? package : word.substr(0, slash);
            const std::string type = slash == word.npos ? word : word.substr(slash + 1);
            const std::string other = of + "/" + type;
            const std::string definition = type.empty() ? "" : message_file(of, type);
            if (definition.empty() || !known.insert(other).second) continue;
            all += "\n" + std::string(80, '=') + "\nMSG: " + other + "\n" + definition;
            left.emplace_back(of, definition);
        }
    }
    return all;
}

/// MD5, in hexadecimal digits.
std::string digest(const std::string& text) {
    boost::uuids::detail::md5 md5;
    md5.process_bytes(text.data(), text.size());
    boost::uuids::detail::md5::digest_type words;
    md5.get_digest(words);
    std::string hex;
    for (const auto word : words)
        for (int bit = 28; bit >= 0; bit -= 4) hex += "0123456789abcdef"[word >> bit & 15];
    return hex;
}

} // namespace

std::shared_ptr<const MessageType> MessageType::find(const std::string& text) {
    const Name name(text);
    const std::string definition = message_file(name.package, name.type);
    if (definition.empty())
        throw std::runtime_error("there is no message " + name.whole() + " in " + searched() +
                                 "; install its package, or say by ROS_PACKAGE_PATH where it is");
    return std::make_shared<MessageType>(name.whole(), whole_definition(name, definition));
}

MessageType::MessageType(const std::string& name, std::string definition)
    : definition_(std::move(definition)),
      types_(recording::read_ros_definition(name, definition_, recording::Ros::one)) {
    name_ = name;
    md5_ = digest(normal_form());
    look_into(types_[0], "");
}

void MessageType::look_into(const RosType& type, const std::string& prefix) {
    using Kind = Field::Kind;
    for (const auto& its : type.fields) {
        const std::string path = prefix + its.name;
        const RosType* inner = its.primitive ? nullptr : &types_[static_cast<std::size_t>(its.type)];
        const auto add = [&](Kind kind, std::size_t size, bool is_scalar, RosPrimitive primitive,
                             std::size_t bytes) {
            parts_.push_back({&its, static_cast<int>(fields_.size()), bytes});
            fields_.push_back(std::make_unique<ValueField>(path, kind, static_cast<int>(size), is_scalar,
                                                           fields_.size(), primitive));
        };
        const bool is_one = its.kind == RosField::Kind::one;
        if (inner != nullptr && is_one && is_time(*inner)) {
            add(Kind::time, 1, true, *inner->fields[0].primitive, 8);
        } else if (inner != nullptr && is_one && is_vector(*inner)) {
            const auto primitive = *inner->fields[0].primitive;
            add(Kind::numbers, inner->fields.size(), false, primitive, recording::bytes_of(primitive));
        } else if (inner != nullptr && is_one) {
            look_into(*inner, path + ".");
        } else if (inner != nullptr && its.kind == RosField::Kind::sequence) {
            parts_.push_back({&its, -1, 0});
            lists_.push_back(path);
        } else if (inner != nullptr ||
                   (*its.primitive == RosPrimitive::text && its.kind == RosField::Kind::fixed)) {
            parts_.push_back({&its, -1, 0});
        } else if (*its.primitive == RosPrimitive::text) {
            add(is_one ? Kind::text : Kind::texts, 1, false, *its.primitive, 0);
        } else {
            const bool is_sequence = its.kind == RosField::Kind::sequence;
            add(is_sequence ? Kind::sequence : Kind::numbers, is_sequence ? 0 : its.count, is_one,
                *its.primitive, recording::bytes_of(*its.primitive));
        }
    }
}

std::string MessageType::normal_form(const RosType& type) const {
    std::string text;
    const auto add = [&](const std::string& line) { text += (text.empty() ? "" : "\n") + line; };
    for (const auto& constant : type.constants) add(constant);
    for (const auto& field : type.fields) {
        const auto* inner = field.primitive ? nullptr : &types_[static_cast<std::size_t>(field.type)];
        add((inner == nullptr || is_time(*inner) ? field.written : digest(normal_form(*inner))) + " " +
            field.name);
    }
    return text;
}

std::shared_ptr<void> MessageType::make() const {
    auto message = std::make_shared<Message>();
    message->values.resize(fields_.size());
    for (std::size_t i = 0; i < fields_.size(); ++i) {
        void* const its = message.get();
        const auto& field = *fields_[i];
        if (is_number(field)) {
            const std::vector<double> zeros(static_cast<std::size_t>(field.size));
            field.write(its, zeros.data(), zeros.size());
        } else {
            field.write(its, std::vector<std::string>());
        }
    }
    return message;
}

const Message::Value& MessageType::value(const Message& message, const std::string& path) const {
    const auto found = std::ranges::find(fields_, path, [](const auto& field) { return field->path; });
    return message.values[static_cast<std::size_t>(found - fields_.begin())];
}

void MessageType::decode(Bytes bytes, Message& message) const {
    if (const Bytes rest = decode_first(bytes, message); !rest.empty())
        throw std::runtime_error("it has " + std::to_string(rest.size()) + " bytes behind its last field");
}

Bytes MessageType::decode_first(Bytes bytes, Message& message) const {
    message.bytes = bytes;
    Front front(bytes);
    message.lists.clear();
    for (const auto& part : parts_) {
        if (part.field < 0) {
            const Bytes from = front.rest();
            skip(front, *part.its, types_);
            if (!part.its->primitive && part.its->kind == RosField::Kind::sequence)
                message.lists.push_back(from.first(from.size() - front.rest().size()));
            continue;
        }
        const Field& field = *fields_[static_cast<std::size_t>(part.field)];
        auto& value = message.values[static_cast<std::size_t>(part.field)];
        switch (field.kind) {
        case Field::Kind::text: value.bytes = front.take(front.count(1)); break;
        case Field::Kind::texts: {
            const Bytes from = front.rest();
            skip(front, *part.its, types_);
            value.bytes = from.first(from.size() - front.rest().size()).subspan(4);
            value.count = get<std::uint32_t>(from.data());
            break;
        }
        default:
            value.count = field.kind == Field::Kind::sequence ? front.count(part.bytes)
                                                              : static_cast<std::size_t>(field.size);
            value.bytes = front.take(value.count * part.bytes);
        }
    }
    return front.rest();
}

void MessageType::each(const Message& message, const std::string& path, const MessageType& its,
                       const std::function<void(const Message&)>& take) const {
    const auto found = std::ranges::find(lists_, path) - lists_.begin();
    Bytes left = message.lists.at(static_cast<std::size_t>(found));
    const auto element = std::static_pointer_cast<Message>(its.make());
    const auto count = Front(left).count(0);
    left = left.subspan(sizeof(std::uint32_t));
    for (std::size_t i = 0; i < count; ++i) {
        left = its.decode_first(left, *element);
        take(*element);
    }
    if (!left.empty()) throw std::runtime_error("'" + path + "' is no list of " + its.name());
}

ServiceType ServiceType::find(const std::string& text) {
    const Name name(text, "srv");
    const auto file = file_of(name.package, "srv", name.type);
    if (!file)
        throw std::runtime_error("there is no service " + name.whole() + " in " + searched() +
                                 "; install its package, or say by ROS_PACKAGE_PATH where it is");
    std::string parts[2]; // divided by a line of three dashes
    std::istringstream lines(*file);
    int part = 0;
    for (std::string line; std::getline(lines, line);)
        if (part == 0 && line.starts_with("---"))
            part = 1;
        else
            parts[part] += line + "\n";
    const auto type_of = [&](const char* suffix, const std::string& definition) {
        return std::make_shared<const MessageType>(name.whole() + suffix, whole_definition(name, definition));
    };
    ServiceType type{name.whole(), "", type_of("Request", parts[0]), type_of("Response", parts[1])};
    type.md5 = digest(type.request->normal_form() + type.response->normal_form());
    return type;
}

std::vector<std::string> texts_of(const Message::Value& value) {
    std::vector<std::string> texts;
    Front front(value.bytes);
    for (std::size_t i = 0; i < value.count; ++i) {
        const Bytes text = front.take(front.count(1));
        texts.emplace_back(text.begin(), text.end());
    }
    return texts;
}

void MessageType::encode(const Message& message, std::vector<std::uint8_t>& bytes) const {
    for (const auto& part : parts_) {
        if (part.field < 0) {
            put_nothing(bytes, *part.its, types_);
            continue;
        }
        const auto kind = fields_[static_cast<std::size_t>(part.field)]->kind;
        const auto& value = message.values[static_cast<std::size_t>(part.field)];
        if (kind == Field::Kind::text) put(bytes, static_cast<std::uint32_t>(value.bytes.size()));
        if (kind == Field::Kind::texts || kind == Field::Kind::sequence)
            put(bytes, static_cast<std::uint32_t>(value.count));
        bytes.insert(bytes.end(), value.bytes.begin(), value.bytes.end());
    }
}

} // namespace bf::ros1
