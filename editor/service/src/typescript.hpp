#pragma once

#include "fields.hpp"

#include <map>
#include <string>
#include <type_traits>

namespace bf::service {

/// What the declaration of a type or of its member says, as a comment of TypeScript; empty: nothing.
std::string typescript_comment(const std::string& type, const std::string& member = {},
                               const std::string& indent = {});
/// How TypeScript calls T; `types` gets the declarations of it and of all it is made of, by their name.
/// Members that a request may leave out are there all the same: the page says what it means.
template <class T>
std::string typescript_of(std::map<std::string, std::string>& types, const Words* words = nullptr) {
    if constexpr (is_optional<T>) {
        return typescript_of<typename T::value_type>(types, words) + " | null";
    } else if constexpr (is_vector<T>) {
        const std::string item = typescript_of<typename T::value_type>(types, words);
        return item.find(' ') == std::string::npos ? item + "[]" : "(" + item + ")[]";
    } else if constexpr (std::is_enum_v<T>) {
        std::string all;
        for (const auto& word : *words) all += (all.empty() ? "\"" : " | \"") + word + "\"";
        return all;
    } else if constexpr (std::is_same_v<T, Nothing>) {
        return "Record<string, never>";
    } else if constexpr (Listed<T>) {
        std::string name = Fields<T>::name;
        name.erase(0, name.rfind(':') + 1);
        if (types.contains(name)) return name;
        std::string members;
        types[name] = {};
        for_each_field<T>([&](const auto& field) {
            using Member = std::remove_cvref_t<decltype(std::declval<T>().*field.member)>;
            members += typescript_comment(name, field.name, "  ");
            members +=
                "  " + std::string(field.name) + ": " + typescript_of<Member>(types, field.words) + ";\n";
        });
        types[name] = typescript_comment(name) + "export interface " + name + " {\n" + members + "}\n";
        return name;
    } else if constexpr (std::is_same_v<T, OperationText>) {
        return "object";
    } else if constexpr (std::is_same_v<T, std::string>) {
        return "string";
    } else if constexpr (std::is_same_v<T, bool>) {
        return "boolean";
    } else {
        return "number";
    }
}

/// The whole protocol: declarations by the names of their types, and a line for each method.
std::string typescript_protocol(std::map<std::string, std::string> types, const std::string& methods);

} // namespace bf::service
