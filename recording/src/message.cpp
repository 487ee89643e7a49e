#include "bf/recording/message.hpp"

#include "format.hpp"

#include <algorithm>
#include <charconv>

namespace bf::recording {

namespace {

const char* ros_type(ElementType type) {
    static constexpr const char* names[] = {"float64", "float32", "int8",   "uint8", "int16",
                                            "uint16",  "int32",   "uint32", "bool"};
    return names[static_cast<std::size_t>(type)];
}

const std::string package = "bf_msgs/msg/";

/// "Double", "Uint8"
std::string message_name(ElementType type) {
    std::string name = name_of(type);
    name[0] = static_cast<char>(name[0] - 'a' + 'A');
    return name;
}

} // namespace

std::string topic_of(std::string_view name) {
    std::string topic = name.front() == '/' ? "" : "/";
    for (const char c : name) topic += c == '.' ? '/' : c;
    return topic;
}

std::string signal_of(std::string_view topic) {
    std::string name(topic.substr(topic.starts_with('/')));
    std::replace(name.begin(), name.end(), '/', '.');
    return name;
}

std::string message_type(const ChannelInfo& info) {
    std::string name = package + message_name(info.type);
    if (info.is_matrix)
        name += std::to_string(info.rows) + "x" + std::to_string(info.cols);
    else if (info.rows > 1)
        name += std::to_string(info.rows);
    return name;
}

std::optional<ChannelInfo> channel_of(std::string_view message_type) {
    for (int i = 0; i <= static_cast<int>(ElementType::Boolean); ++i) { // no name begins with another one
        ChannelInfo info{.type = static_cast<ElementType>(i)};
        const std::string name = package + message_name(info.type);
        if (!message_type.starts_with(name)) continue;
        const char *at = message_type.data() + name.size(), *const end =
                                                                message_type.data() + message_type.size();
        const auto read = [&](std::uint32_t& number) {
            const auto [rest, error] = std::from_chars(at, end, number);
            at = rest;
            return error == std::errc();
        };
        if (at != end && !read(info.rows)) return {};
        info.is_matrix = at != end && *at == 'x';
        if (info.is_matrix && (++at, !read(info.cols))) return {};
        return at == end ? std::optional(info) : std::nullopt;
    }
    return {};
}

std::string message_definition(const ChannelInfo& info) {
    const bool scalar = info.elements() == 1 && !info.is_matrix;
    return std::string("float64 time\n") + ros_type(info.type) +
           (scalar ? "" : "[" + std::to_string(info.elements()) + "]") + " value\n";
}

void write_message_prefix(std::byte* to, double time) noexcept {
    std::memcpy(to, cdr_le.data(), cdr_le.size());
    std::memcpy(to + cdr_le.size(), &time, sizeof time);
}

} // namespace bf::recording
