#pragma once

#include "fields.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <type_traits>
#include <utility>

/// What the protocol declares as JSON, with all members; what comes from a page is taken only as declared.
namespace bf::service {

using Json = nlohmann::ordered_json;

/// What a page sent that is not as the protocol has it.
struct ProtocolError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

template <class T> Json to_json(const T& value, const Words* words = nullptr) {
    if constexpr (is_optional<T>) {
        return value ? to_json(*value, words) : Json();
    } else if constexpr (is_vector<T>) {
        Json list = Json::array();
        for (const auto& item : value) list.push_back(to_json(item, words));
        return list;
    } else if constexpr (std::is_enum_v<T>) {
        return words->at(static_cast<std::size_t>(value));
    } else if constexpr (Listed<T>) {
        Json object = Json::object();
        for_each_field<T>(
            [&](const auto& field) { object[field.name] = to_json(value.*field.member, field.words); });
        return object;
    } else {
        return value;
    }
}

/// Throws ProtocolError, which names the member and what it takes. Members that may be left out have their
/// usual value.
template <class T>
void from_json(const Json& json, T& value, const std::string& member = "params",
               const Words* words = nullptr) {
    const auto refuse = [&](const std::string& expected) {
        throw ProtocolError("'" + member + "' takes " + expected + ", not " +
                            json.dump(-1, ' ', true, Json::error_handler_t::replace).substr(0, 60));
    };
    if constexpr (is_optional<T>) {
        value.reset();
        if (!json.is_null()) from_json(json, value.emplace(), member, words);
    } else if constexpr (is_vector<T>) {
        if (!json.is_array()) refuse("a list");
        value.clear();
        for (const auto& item : json) from_json(item, value.emplace_back(), member, words);
    } else if constexpr (std::is_enum_v<T>) {
        const auto found =
            std::find(words->begin(), words->end(), json.is_string() ? json.get<std::string>() : "");
        std::string all;
        for (const auto& word : *words) all += (all.empty() ? "one of " : ", ") + word;
        if (found == words->end()) refuse(all);
        value = static_cast<T>(found - words->begin());
    } else if constexpr (Listed<T>) {
        if (!json.is_object()) refuse("an object");
        std::size_t known = 0;
        for_each_field<T>([&](const auto& field) {
            const auto at = json.find(field.name);
            if (at == json.end()) return;
            ++known;
            from_json(*at, value.*field.member, field.name, field.words);
        });
        if (known != json.size()) refuse("only what the protocol declares");
    } else if constexpr (std::is_same_v<T, OperationText>) {
        value.json = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    } else if constexpr (std::is_same_v<T, std::string>) {
        if (!json.is_string()) refuse("a text");
        value = json.get<std::string>();
    } else if constexpr (std::is_same_v<T, bool>) {
        if (!json.is_boolean()) refuse("true or false");
        value = json.get<bool>();
    } else if constexpr (std::is_same_v<T, double>) {
        if (!json.is_number()) refuse("a number");
        value = json.get<double>();
    } else {
        if (!json.is_number_integer()) refuse("a whole number");
        const bool fits = json.is_number_unsigned() ? std::in_range<T>(json.get<std::uint64_t>())
                                                    : std::in_range<T>(json.get<std::int64_t>());
        if (!fits) refuse("a number that is not so large");
        value = json.get<T>();
    }
}

} // namespace bf::service
