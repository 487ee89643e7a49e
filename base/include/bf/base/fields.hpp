// The members of a struct, listed once: what compares, reads, writes or describes any struct follows from the
// list.
#pragma once

#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace bf {

/// The words for the values of an enumeration, in their order.
using Words = std::vector<std::string>;

/// A member; `spelling` is how a file writes it, without meaning for what it says.
template <typename Owner, typename Member> struct Field {
    const char* name;
    Member Owner::*member;
    bool spelling = false;
    const Words* words = nullptr; ///< of an enumeration
};

template <typename Owner, typename Member> constexpr auto has(const char* name, Member Owner::*member) {
    return std::tuple(Field<Owner, Member>{name, member});
}
template <typename Owner, typename Member>
auto one_of(const char* name, Member Owner::*member, const Words& words) {
    return std::tuple(Field<Owner, Member>{name, member, false, &words});
}
template <typename Owner, typename Member> constexpr auto spelt(const char* name, Member Owner::*member) {
    return std::tuple(Field<Owner, Member>{name, member, true});
}

/// Specialised by BF_FIELDS, in namespace bf: BF_FIELDS(Point, has("x", &T::x), has("y", &T::y)).
template <typename T> struct Fields;
template <typename T>
concept Listed = requires {
    Fields<T>::all();
};

// NOLINTBEGIN(bugprone-macro-parentheses)
#define BF_FIELDS(Type, ...)                                                                                 \
    template <> struct Fields<Type> {                                                                        \
        using T = Type;                                                                                      \
        static constexpr const char* name = #Type; /* "model::Point" */                                      \
        static auto all() { return std::tuple_cat(__VA_ARGS__); }                                            \
    };
// NOLINTEND(bugprone-macro-parentheses)

/// Calls `visit(field)` for each member of T.
template <typename T, typename Visit> void for_each_field(Visit&& visit) {
    std::apply([&](const auto&... field) { (visit(field), ...); }, Fields<T>::all());
}

template <typename T> constexpr bool is_optional = false;
template <typename T> constexpr bool is_optional<std::optional<T>> = true;
template <typename T> constexpr bool is_vector = false;
template <typename T> constexpr bool is_vector<std::vector<T>> = true;

} // namespace bf
