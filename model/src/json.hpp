#pragma once

#include "fields.hpp"

#include <functional>
#include <nlohmann/json.hpp>

/// The document's types as JSON: an object of the members that have not their usual value; an expression that
/// is nothing but text, as that text.
namespace bf::model {

using Json = nlohmann::ordered_json;

[[noreturn]] void refuse_json(const std::string& member, const std::string& expected);

/// What JSON leaves to its surroundings.
struct JsonContext {
    std::shared_ptr<const std::string> file = {}; ///< to which places refer; places elsewhere are left out
    std::map<std::string, std::shared_ptr<const Model>>* files =
        nullptr; ///< collects referenced models, or has them
    int depth = 0;
};

/// One member of an object, and where in the whole it is.
struct MemberOfJson {
    const std::string& name;
    const Json& value;
    const std::string path;

    bool is_called(const char* other) const { return name == other; }
};
/// Calls `read` for each member of an object; refuses those of which it says false.
void read_members(const Json& json, JsonContext& context, const std::string& path,
                  const std::function<bool(const MemberOfJson&)>& read);
/// The number of the word. Refuses what is none.
std::size_t choice_from_json(const Json& json, const Words& words, const std::string& member);

Json variant_to_json(const Operation& operation, JsonContext& context);
Operation variant_from_json(const Json& json, JsonContext& context);

/// In the file to which places refer?
inline bool is_here(const Location& where, const JsonContext& context) {
    return where && where.file == context.file;
}

template <typename T>
Json value_to_json(const T& value, JsonContext& context, const choices::Words* words = nullptr) {
    if constexpr (is_optional<T>) {
        return value ? value_to_json(*value, context, words) : Json();
    } else if constexpr (std::is_same_v<T, OwnSystem>) {
        return value ? value_to_json(*value, context) : Json();
    } else if constexpr (std::is_same_v<T, Operation>) {
        return variant_to_json(value, context);
    } else if constexpr (std::is_enum_v<T>) {
        return words->at(static_cast<std::size_t>(value));
    } else if constexpr (is_vector<T>) {
        Json list = Json::array();
        for (const auto& item : value) list.push_back(value_to_json(item, context));
        return list;
    } else if constexpr (Listed<T>) {
        static const T usual{};
        Json object = Json::object();
        if constexpr (std::is_same_v<T, Location>)
            if (!is_here(value, context)) return object;
        for_each_field<T>([&](const auto& field) {
            const auto& member = value.*field.member;
            using Member = std::remove_cvref_t<decltype(member)>;
            if constexpr (std::is_same_v<Member, Location>)
                if (!is_here(member, context)) return;
            if (!are_equal(member, usual.*field.member, true))
                object[field.name] = value_to_json(member, context, field.words);
        });
        if constexpr (std::is_same_v<T, Reference>)
            if (context.files && value.model) context.files->emplace(value.file, value.model);
        if constexpr (std::is_same_v<T, Expression>)
            if (object.size() == 1 && object.contains("text")) return object["text"];
        return object;
    } else {
        return value;
    }
}

template <typename T>
void value_from_json(const Json& json, T& value, JsonContext& context, const std::string& member,
                     const choices::Words* words = nullptr) {
    if constexpr (is_optional<T>) {
        value.reset();
        if (!json.is_null()) value_from_json(json, value.emplace(), context, member, words);
    } else if constexpr (std::is_same_v<T, OwnSystem>) {
        value = json.is_null() ? OwnSystem() : OwnSystem(std::make_unique<System>());
        if (value) value_from_json(json, *value, context, member);
    } else if constexpr (std::is_same_v<T, Operation>) {
        value = variant_from_json(json, context);
    } else if constexpr (std::is_enum_v<T>) {
        value = static_cast<T>(choice_from_json(json, *words, member));
    } else if constexpr (is_vector<T>) {
        if (!json.is_array()) refuse_json(member, "a list");
        value.clear();
        for (const auto& item : json) value_from_json(item, value.emplace_back(), context, member);
    } else if constexpr (Listed<T>) {
        if constexpr (std::is_same_v<T, Expression>)
            if (json.is_string()) {
                value = Expression{.text = json.get<std::string>()};
                return;
            }
        value = T{};
        read_members(json, context, member, [&](const MemberOfJson& given) {
            bool is_known = false;
            for_each_field<T>([&](const auto& field) {
                if (!given.is_called(field.name)) return;
                is_known = true;
                value_from_json(given.value, value.*field.member, context, given.path, field.words);
            });
            return is_known;
        });
        if constexpr (std::is_same_v<T, Location>) value.file = context.file;
        if constexpr (std::is_same_v<T, Reference>) {
            if (context.files && context.files->contains(value.file))
                value.model = context.files->at(value.file);
        }
    } else if constexpr (std::is_same_v<T, std::string>) {
        if (!json.is_string()) refuse_json(member, "a text");
        value = json.get<std::string>();
    } else if constexpr (std::is_same_v<T, bool>) {
        if (!json.is_boolean()) refuse_json(member, "true or false");
        value = json.get<bool>();
    } else if constexpr (std::is_same_v<T, double>) {
        if (!json.is_number()) refuse_json(member, "a number");
        value = json.get<double>();
    } else {
        if (!json.is_number_integer() || json < 0 || json > std::numeric_limits<int>::max())
            refuse_json(member, "a whole number, not negative");
        value = json.get<T>();
    }
}

/// Throws Errors where the patch does not fit the model.
void apply_patch(Model& model, const operations::Patch& patch);

} // namespace bf::model
