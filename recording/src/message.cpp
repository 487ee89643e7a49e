#include "bf/recording/message.hpp"

#include "format.hpp"

namespace bf::recording {

namespace {

const char* ros_type(ElementType type) {
    static constexpr const char* names[] = {"float64", "float32", "int8",   "uint8", "int16",
                                            "uint16",  "int32",   "uint32", "bool"};
    return names[static_cast<std::size_t>(type)];
}

} // namespace

std::string topic_of(std::string_view name) {
    std::string topic = name.front() == '/' ? "" : "/";
    for (const char c : name) topic += c == '.' ? '/' : c;
    return topic;
}

std::string message_type(const ChannelInfo& info) {
    std::string name = name_of(info.type);
    name[0] = static_cast<char>(name[0] - 'a' + 'A');
    if (info.is_matrix)
        name += std::to_string(info.rows) + "x" + std::to_string(info.cols);
    else if (info.rows > 1)
        name += std::to_string(info.rows);
    return "bf_msgs/msg/" + name;
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
