#include "types.hpp"

#include "messages.hpp"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <filesystem>
#include <new>
#include <rosidl_typesupport_introspection_c/field_types.h>
#include <sstream>
#include <stdexcept>

namespace bf::ros2 {

namespace {

namespace fs = std::filesystem;
using Members = rosidl_typesupport_introspection_c__MessageMembers;
using Member = rosidl_typesupport_introspection_c__MessageMember;

constexpr std::uint8_t string_type = rosidl_typesupport_introspection_c__ROS_TYPE_STRING,
                       wide_string_type = rosidl_typesupport_introspection_c__ROS_TYPE_WSTRING,
                       message_type = rosidl_typesupport_introspection_c__ROS_TYPE_MESSAGE;

/// Calls f with a number of the type.
template <class F> auto with_number(std::uint8_t type, F&& f) {
    switch (type) {
    case rosidl_typesupport_introspection_c__ROS_TYPE_FLOAT: return f(float{});
    case rosidl_typesupport_introspection_c__ROS_TYPE_LONG_DOUBLE: return f(0.0L);
    case rosidl_typesupport_introspection_c__ROS_TYPE_WCHAR: return f(char16_t{});
    case rosidl_typesupport_introspection_c__ROS_TYPE_BOOLEAN: return f(bool{});
    case rosidl_typesupport_introspection_c__ROS_TYPE_CHAR:
    case rosidl_typesupport_introspection_c__ROS_TYPE_OCTET:
    case rosidl_typesupport_introspection_c__ROS_TYPE_UINT8: return f(std::uint8_t{});
    case rosidl_typesupport_introspection_c__ROS_TYPE_INT8: return f(std::int8_t{});
    case rosidl_typesupport_introspection_c__ROS_TYPE_UINT16: return f(std::uint16_t{});
    case rosidl_typesupport_introspection_c__ROS_TYPE_INT16: return f(std::int16_t{});
    case rosidl_typesupport_introspection_c__ROS_TYPE_UINT32: return f(std::uint32_t{});
    case rosidl_typesupport_introspection_c__ROS_TYPE_INT32: return f(std::int32_t{});
    case rosidl_typesupport_introspection_c__ROS_TYPE_UINT64: return f(std::uint64_t{});
    case rosidl_typesupport_introspection_c__ROS_TYPE_INT64: return f(std::int64_t{});
    default: return f(0.0);
    }
}

const Members& members_of(const Member& member) {
    return *static_cast<const Members*>(member.members_->data);
}

bool is_of(const Members& members, const char* name_space, const char* name) {
    return std::strcmp(members.message_namespace_, name_space) == 0 &&
           std::strcmp(members.message_name_, name) == 0;
}
bool is_time(const Members& members) {
    return is_of(members, "builtin_interfaces__msg", "Time") ||
           is_of(members, "builtin_interfaces__msg", "Duration");
}
/// Two to four real numbers of a message of geometry, such as x, y and z.
bool is_vector(const Members& members) {
    return std::strcmp(members.message_namespace_, "geometry_msgs__msg") == 0 && members.member_count_ >= 2 &&
           members.member_count_ <= 4 &&
           std::all_of(members.members_, members.members_ + members.member_count_, [&](const Member& m) {
               return m.type_id_ <= rosidl_typesupport_introspection_c__ROS_TYPE_DOUBLE && !m.is_array_ &&
                      m.type_id_ == members.members_[0].type_id_;
           });
}

/// A field of a message, looked into at run time.
class MemberField final : public Field {
  public:
    MemberField(const std::string& its_path, const Member& its, std::size_t at)
        : Field(its_path, Kind::numbers, 1, false), type(its.type_id_), parts{at}, member(&its) {}

    std::uint8_t type;              ///< of numbers
    std::vector<std::size_t> parts; ///< where they are in a message; one: all follow each other

    std::size_t length(const void* message) const override {
        if (kind != Kind::sequence) return static_cast<std::size_t>(size);
        return member->size_function(static_cast<const char*>(message) + parts[0]);
    }

    void read(const void* message, double* values, std::size_t count) const override {
        const auto* base = static_cast<const char*>(message);
        if (kind == Kind::time) {
            std::int32_t seconds = 0;
            std::uint32_t nanoseconds = 0;
            std::memcpy(&seconds, base + parts[0], sizeof seconds);
            std::memcpy(&nanoseconds, base + parts[0] + sizeof seconds, sizeof nanoseconds);
            values[0] = seconds + nanoseconds / 1e9;
            return;
        }
        count = std::min(count, length(message));
        const void* first = base + parts[0];
        if (kind == Kind::sequence) first = count > 0 ? member->get_const_function(first, 0) : nullptr;
        with_number(type, [&](auto number) {
            using T = decltype(number);
            for (std::size_t i = 0; i < count; ++i) {
                const void* from =
                    parts.size() > 1 ? base + parts[i] : static_cast<const char*>(first) + i * sizeof(T);
                values[i] = static_cast<double>(*static_cast<const T*>(from));
            }
        });
    }

    void write(void* message, const double* values, std::size_t count) const override {
        auto* base = static_cast<char*>(message);
        if (kind == Kind::time) {
            const auto [seconds, nanoseconds] = middleware::split_time<std::int32_t>(values[0]);
            std::memcpy(base + parts[0], &seconds, sizeof seconds);
            std::memcpy(base + parts[0] + sizeof seconds, &nanoseconds, sizeof nanoseconds);
            return;
        }
        void* first = base + parts[0];
        if (kind == Kind::sequence) {
            if (member->size_function(first) != count && !member->resize_function(first, count))
                throw std::bad_alloc();
            first = count > 0 ? member->get_function(first, 0) : nullptr;
        }
        with_number(type, [&](auto number) {
            using T = decltype(number);
            for (std::size_t i = 0; i < count; ++i) {
                void* to = parts.size() > 1 ? base + parts[i] : static_cast<char*>(first) + i * sizeof(T);
                *static_cast<T*>(to) = middleware::nearest<T>(values[i]);
            }
        });
    }

    std::string text(const void* message) const override {
        return messages::text(
            *reinterpret_cast<const rosidl_runtime_c__String*>(static_cast<const char*>(message) + parts[0]));
    }

    void write(void* message, const std::vector<std::string>& texts) const override {
        void* at = static_cast<char*>(message) + parts[0];
        const auto assign = [](void* to, const std::string& text) {
            messages::assign(*static_cast<rosidl_runtime_c__String*>(to), text);
        };
        if (kind == Kind::text) {
            assign(at, texts.empty() ? "" : texts.front());
            return;
        }
        if (!member->resize_function(at, texts.size())) throw std::bad_alloc();
        for (std::size_t i = 0; i < texts.size(); ++i) assign(member->get_function(at, i), texts[i]);
    }

  private:
    const Member* member; ///< of sequences and texts
};

/// The parts of "sensor_msgs/msg/Imu" that name libraries and symbols, which no other text may reach.
struct Name {
    explicit Name(const std::string& text, const char* usual_kind = "msg") {
        std::vector<std::string> parts;
        std::istringstream words(text);
        for (std::string part; std::getline(words, part, '/');) parts.push_back(part);
        if (parts.size() == 2) parts.insert(parts.begin() + 1, usual_kind);
        const auto is_name = [](const std::string& word) {
            return !word.empty() && std::isalpha(static_cast<unsigned char>(word.front())) &&
                   std::all_of(word.begin(), word.end(),
                               [](unsigned char c) { return std::isalnum(c) || c == '_'; });
        };
        const std::string usual = usual_kind;
        if (parts.size() != 3 || !std::all_of(parts.begin(), parts.end(), is_name) || text.back() == '/')
            throw std::runtime_error(
                "'" + text + "' is no type of " +
                (usual == "msg"   ? "message; write package/msg/Type, such as sensor_msgs/msg/Imu"
                 : usual == "srv" ? "service; write package/srv/Type, such as std_srvs/srv/SetBool"
                                  : "action; write package/action/Type, such as "
                                    "control_msgs/action/FollowJointTrajectory"));
        package = parts[0];
        kind = parts[1];
        type = parts[2];
    }
    std::string package, kind, type;
};

std::vector<fs::path> prefixes() {
    std::vector<fs::path> all;
    if (const char* path = std::getenv("AMENT_PREFIX_PATH")) {
        std::istringstream folders(path);
        for (std::string folder; std::getline(folders, folder, ':');)
            if (!folder.empty()) all.emplace_back(folder);
    }
    all.emplace_back(BF_ROS2_PREFIX);
    return all;
}

/// Stays open: messages are made of it as long as the program runs.
void* open_library(const std::string& package, const char* support) {
    const std::string file = "lib" + package + "__" + support + ".so";
    for (const auto& prefix : prefixes())
        if (void* library = dlopen((prefix / "lib" / file).c_str(), RTLD_NOW | RTLD_LOCAL)) return library;
    return dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL); // in a package of bf deploy they are its own
}

/// `what` is a message, a service or an action.
template <class Support> const Support* support_of(const Name& name, const char* kind, const char* what) {
    void* library = open_library(name.package, kind);
    if (library == nullptr) {
        std::string searched;
        for (const auto& prefix : prefixes()) searched += (searched.empty() ? "" : ", ") + prefix.string();
        throw std::runtime_error("there is no package of messages '" + name.package + "' in " + searched +
                                 "; install it, or say by AMENT_PREFIX_PATH where it is");
    }
    const std::string symbol = std::string(kind) + "__get_" + what + "_type_support_handle__" + name.package +
                               "__" + name.kind + "__" + name.type;
    auto* get = reinterpret_cast<const Support* (*)()>(dlsym(library, symbol.c_str()));
    if (get == nullptr)
        throw std::runtime_error("the package '" + name.package + "' has no " + what + " '" + name.kind +
                                 "/" + name.type + "'; correct the type");
    return get();
}

} // namespace

std::shared_ptr<const MessageType> MessageType::find(const std::string& text) {
    const Name name(text);
    auto type = std::make_shared<MessageType>();
    type->name_ = name.package + "/" + name.kind + "/" + name.type;
    using Support = rosidl_message_type_support_t;
    const auto* looked_into = support_of<Support>(name, "rosidl_typesupport_introspection_c", "message");
    // ROS 2 opens this one by its name alone, and finds it where it is open already.
    open_library(name.package, "rosidl_typesupport_fastrtps_c");
    type->memory_.support = support_of<Support>(name, "rosidl_typesupport_c", "message");
    const auto* members = static_cast<const Members*>(looked_into->data);
    type->memory_.make = [members]() -> std::shared_ptr<void> {
        void* message = std::calloc(1, std::max<std::size_t>(members->size_of_, 1));
        if (message == nullptr) throw std::bad_alloc();
        members->init_function(message, ROSIDL_RUNTIME_C_MSG_INIT_ALL);
        return {message, [members](void* made) {
                    members->fini_function(made);
                    std::free(made);
                }};
    };
    type->look_into(*members, "", 0);
    return type;
}

void MessageType::look_into(const Members& members, const std::string& prefix, std::size_t offset) {
    for (std::size_t i = 0; i < members.member_count_; ++i) {
        const Member& m = members.members_[i];
        if (std::strcmp(m.name_, "structure_needs_at_least_one_member") == 0) continue; // it has none
        const std::size_t at = offset + m.offset_;
        auto field = std::make_unique<MemberField>(prefix + m.name_, m, at);
        if (m.type_id_ == message_type) {
            const Members& its = members_of(m);
            if (m.is_array_) continue;
            if (is_time(its)) {
                field->kind = Field::Kind::time;
                field->is_scalar = true;
            } else if (is_vector(its)) {
                field->size = static_cast<int>(its.member_count_);
                field->type = its.members_[0].type_id_;
                field->parts.clear();
                for (std::size_t k = 0; k < its.member_count_; ++k)
                    field->parts.push_back(at + its.members_[k].offset_);
            } else {
                look_into(its, field->path + ".", at);
                continue;
            }
        } else if (m.type_id_ == string_type) {
            if (m.is_array_ && m.array_size_ > 0 && !m.is_upper_bound_) continue; // so many, no less
            field->kind = m.is_array_ ? Field::Kind::texts : Field::Kind::text;
        } else if (m.type_id_ == wide_string_type) {
            continue;
        } else if (m.is_array_) {
            const bool is_fixed = m.array_size_ > 0 && !m.is_upper_bound_;
            field->kind = is_fixed ? Field::Kind::numbers : Field::Kind::sequence;
            field->size = static_cast<int>(m.array_size_);
        } else {
            field->is_scalar = true;
        }
        fields_.push_back(std::move(field));
    }
}

ServiceType ServiceType::find(const std::string& text) {
    const Name name(text, "srv");
    ServiceType type;
    type.support = support_of<rosidl_service_type_support_t>(name, "rosidl_typesupport_c", "service");
    const std::string whole = name.package + "/" + name.kind + "/" + name.type;
    type.request = MessageType::find(whole + "_Request");
    type.response = MessageType::find(whole + "_Response");
    return type;
}

ActionType ActionType::find(const std::string& text) {
    const Name name(text, "action");
    const std::string whole = name.package + "/" + name.kind + "/" + name.type;
    // A type that is none is called as it was written, and not as what is made of it.
    support_of<rosidl_action_type_support_t>(name, "rosidl_typesupport_c", "action");
    return {.goal = ServiceType::find(whole + "_SendGoal"),
            .result = ServiceType::find(whole + "_GetResult"),
            .cancel = ServiceType::find("action_msgs/srv/CancelGoal"),
            .feedback = MessageType::find(whole + "_FeedbackMessage"),
            .status = MessageType::find("action_msgs/msg/GoalStatusArray")};
}

} // namespace bf::ros2
