#pragma once

#include "bf/model/choices.hpp"
#include "bf/model/operation.hpp"

#include <tuple>

/// The members of the document's types, each with its name, listed once: comparison, JSON, patches and
/// settings of any member follow from the lists.
namespace bf::model {

/// A member; `spelling` is how a file writes it, without meaning for the model.
template <typename Owner, typename Member> struct Field {
    const char* name;
    Member Owner::*member;
    bool spelling = false;
    const choices::Words* words = nullptr; ///< of an enumeration
};

template <typename Owner, typename Member> constexpr auto has(const char* name, Member Owner::*member) {
    return std::tuple(Field<Owner, Member>{name, member});
}
template <typename Owner, typename Member>
auto one_of(const char* name, Member Owner::*member, const choices::Words& words) {
    return std::tuple(Field<Owner, Member>{name, member, false, &words});
}
template <typename Owner, typename Member> constexpr auto spelt(const char* name, Member Owner::*member) {
    return std::tuple(Field<Owner, Member>{name, member, true});
}
/// The two members that items of a document have.
template <typename Owner> constexpr auto place() {
    return std::tuple_cat(spelt("comments", &Owner::comments), spelt("where", &Owner::where));
}

template <typename T> struct Fields;
template <typename T>
concept Listed = requires {
    Fields<T>::all();
};

// NOLINTBEGIN(bugprone-macro-parentheses)
#define BF_FIELDS(Type, ...)                                                                                 \
    template <> struct Fields<Type> {                                                                        \
        using T = Type;                                                                                      \
        static auto all() { return std::tuple_cat(__VA_ARGS__); }                                            \
    };
// NOLINTEND(bugprone-macro-parentheses)

BF_FIELDS(Comments, has("before", &T::before), has("trailing", &T::trailing))
BF_FIELDS(Location, has("line", &T::line), has("column", &T::column))
BF_FIELDS(Expression, has("text", &T::text), one_of("quotes", &T::quotes, choices::quotes),
          spelt("spelling", &T::spelling), spelt("where", &T::where))
BF_FIELDS(Key, has("name", &T::name), place<T>())
BF_FIELDS(Port, has("name", &T::name), has("shape", &T::shape), has("type", &T::type), has("unit", &T::unit),
          has("doc", &T::doc), one_of("when_disabled", &T::when_disabled, choices::held_or_reset),
          has("each", &T::each), has("initial", &T::initial), place<T>())
BF_FIELDS(Endpoint, has("block", &T::block), has("port", &T::port), place<T>())
BF_FIELDS(Connection, has("from", &T::from), has("to", &T::to), place<T>())
BF_FIELDS(Setting, has("name", &T::name), has("value", &T::value), spelt("where", &T::where))
BF_FIELDS(Variable, has("name", &T::name), has("value", &T::value), has("minimum", &T::minimum),
          has("above", &T::above), has("maximum", &T::maximum), has("unit", &T::unit), has("doc", &T::doc),
          has("fields", &T::fields), place<T>())
BF_FIELDS(Reference, has("file", &T::file), has("with", &T::with), spelt("where", &T::where))
BF_FIELDS(Block, has("name", &T::name), has("type", &T::type), has("reference", &T::reference),
          has("system", &T::system), has("doc", &T::doc), has("when", &T::when), has("period", &T::period),
          has("offset", &T::offset), has("settings", &T::settings), spelt("keys", &T::keys), place<T>(),
          spelt("type_where", &T::type_where))
BF_FIELDS(System, one_of("execution", &T::execution, choices::executions),
          one_of("states", &T::states, choices::held_or_reset),
          one_of("trigger", &T::trigger, choices::triggers), one_of("reset", &T::reset, choices::resets),
          has("iterations", &T::iterations), has("inputs", &T::inputs), has("outputs", &T::outputs),
          has("enumerations", &T::enumerations), has("variables", &T::variables), has("blocks", &T::blocks),
          has("connections", &T::connections))
BF_FIELDS(Signal, has("path", &T::path), place<T>())
BF_FIELDS(Panel, has("title", &T::title), has("signals", &T::signals), place<T>())
BF_FIELDS(Plugin, has("name", &T::name), place<T>())
BF_FIELDS(Point, has("x", &T::x), has("y", &T::y))
BF_FIELDS(Placement, has("path", &T::path), has("at", &T::at), has("size", &T::size),
          has("flipped", &T::flipped), place<T>())
BF_FIELDS(Bends, has("path", &T::path), has("points", &T::points), place<T>())
BF_FIELDS(Note, has("name", &T::name), has("text", &T::text), has("system", &T::system), has("at", &T::at),
          has("size", &T::size), place<T>())
BF_FIELDS(Layout, has("blocks", &T::blocks), has("wires", &T::wires), has("notes", &T::notes),
          spelt("keys", &T::keys))
BF_FIELDS(Model, has("name", &T::name), has("doc", &T::doc), has("plugins", &T::plugins),
          has("step", &T::step), has("stop", &T::stop), has("solver", &T::solver),
          has("relative_tolerance", &T::relative_tolerance),
          has("absolute_tolerance", &T::absolute_tolerance), has("max_step", &T::max_step),
          one_of("algebraic_loops", &T::algebraic_loops, choices::algebraic_loops),
          one_of("rate_transitions", &T::rate_transitions, choices::rate_transitions),
          one_of("non_finite", &T::non_finite, choices::non_finite), has("root", &T::root),
          has("record_all", &T::record_all), has("record", &T::record), has("plots", &T::plots),
          has("layout", &T::layout), spelt("keys", &T::keys), spelt("end", &T::end),
          spelt("where", &T::where))

BF_FIELDS(operations::Add, has("system", &T::system), has("block", &T::block), has("index", &T::index),
          has("at", &T::at))
BF_FIELDS(operations::Remove, has("path", &T::path))
BF_FIELDS(operations::Rename, has("path", &T::path), has("name", &T::name))
BF_FIELDS(operations::Reorder, has("path", &T::path), has("index", &T::index))
BF_FIELDS(operations::Connect, has("system", &T::system), has("from", &T::from), has("to", &T::to))
BF_FIELDS(operations::Disconnect, has("system", &T::system), has("from", &T::from), has("to", &T::to))
BF_FIELDS(operations::Set, has("path", &T::path), has("name", &T::name), has("value", &T::value))
BF_FIELDS(operations::AddPort, has("system", &T::system), has("port", &T::port),
          has("is_output", &T::is_output), has("index", &T::index))
BF_FIELDS(operations::SetVariable, has("system", &T::system), has("name", &T::name),
          has("variable", &T::variable))
BF_FIELDS(operations::RenameVariable, has("system", &T::system), has("name", &T::name), has("to", &T::to))
BF_FIELDS(operations::Move, has("path", &T::path), has("to", &T::to))
BF_FIELDS(operations::Resize, has("path", &T::path), has("size", &T::size))
BF_FIELDS(operations::Flip, has("path", &T::path))
BF_FIELDS(operations::Bend, has("path", &T::path), has("points", &T::points))
BF_FIELDS(operations::Annotate, has("name", &T::name), has("note", &T::note))
BF_FIELDS(operations::Group, has("system", &T::system), has("blocks", &T::blocks), has("name", &T::name))
BF_FIELDS(operations::Dissolve, has("path", &T::path))
BF_FIELDS(operations::Inline, has("path", &T::path))
BF_FIELDS(operations::Extract, has("path", &T::path), has("file", &T::file))
BF_FIELDS(operations::Record, has("path", &T::path), has("is_recorded", &T::is_recorded))
BF_FIELDS(operations::Plot, has("title", &T::title), has("signals", &T::signals))
BF_FIELDS(Change, has("at", &T::at), has("removed", &T::removed), has("value", &T::value))
BF_FIELDS(operations::Patch, has("changes", &T::changes))
BF_FIELDS(operations::Batch, has("operations", &T::operations))

#undef BF_FIELDS

/// Calls `visit(field)` for each member of T.
template <typename T, typename Visit> void for_each_field(Visit&& visit) {
    std::apply([&](const auto&... field) { (visit(field), ...); }, Fields<T>::all());
}

template <typename T> constexpr bool is_optional = false;
template <typename T> constexpr bool is_optional<std::optional<T>> = true;
template <typename T> constexpr bool is_vector = false;
template <typename T> constexpr bool is_vector<std::vector<T>> = true;

/// Whether two values are equal, by meaning or, with `spelling`, in every detail.
template <typename T> bool are_equal(const T& a, const T& b, bool spelling) {
    if constexpr (std::is_same_v<T, Expression>) {
        if (!spelling) return a.matlab() == b.matlab();
    }
    if constexpr (std::is_same_v<T, OwnSystem>) {
        return bool(a) == bool(b) && (!a || are_equal(*a, *b, spelling));
    } else if constexpr (std::is_same_v<T, Operation>) {
        return a.index() == b.index() &&
               std::visit([&]<typename Known>(
                              const Known& known) { return are_equal(known, std::get<Known>(b), spelling); },
                          a);
    } else if constexpr (is_optional<T>) {
        return a.has_value() == b.has_value() && (!a || are_equal(*a, *b, spelling));
    } else if constexpr (is_vector<T>) {
        return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                          [&](const auto& x, const auto& y) { return are_equal(x, y, spelling); });
    } else if constexpr (std::is_same_v<T, Reference>) {
        const bool same_model = a.model == b.model ||
                                (!spelling && a.model && b.model && are_equal(*a.model, *b.model, spelling));
        return same_model && a.file == b.file && are_equal(a.with, b.with, spelling);
    } else if constexpr (Listed<T>) {
        bool equal = true;
        for_each_field<T>([&](const auto& field) {
            equal = equal &&
                    ((field.spelling && !spelling) || are_equal(a.*field.member, b.*field.member, spelling));
        });
        return equal;
    } else {
        return a == b;
    }
}

} // namespace bf::model
