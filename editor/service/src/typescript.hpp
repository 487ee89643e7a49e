#pragma once

#include "fields.hpp"

#include <map>
#include <string>
#include <type_traits>

namespace bf::service {

// What is the same for all types.
std::string typescript_list(const std::string& item);
std::string typescript_choice(const Words& words);
void add_typescript_member(std::string& members, const std::string& owner, const std::string& name,
                           const std::string& type);
/// With what the declarations say of it and of its members, as comments.
std::string typescript_interface(const std::string& name, const std::string& members);

/// How TypeScript calls T; `types` gets the declarations of it and of all it is made of, by their name.
/// Members that a request may leave out are there all the same: the page says what it means.
template <class T>
std::string typescript_of(std::map<std::string, std::string>& types, const Words* words = nullptr) {
    if constexpr (is_optional<T>) {
        return typescript_of<typename T::value_type>(types, words) + " | null";
    } else if constexpr (is_vector<T>) {
        return typescript_list(typescript_of<typename T::value_type>(types, words));
    } else if constexpr (std::is_enum_v<T>) {
        return typescript_choice(*words);
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
            add_typescript_member(members, name, field.name, typescript_of<Member>(types, field.words));
        });
        types[name] = typescript_interface(name, members);
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
