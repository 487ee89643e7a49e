#pragma once

#include "bf/base/fields.hpp"
#include "bf/model/choices.hpp"
#include "bf/model/operation.hpp"

/// The members of the document's types, listed once: comparison, JSON, patches and settings of any member
/// follow from the lists.
namespace bf {

/// The two members that items of a document have.
template <typename Owner> constexpr auto place() {
    return std::tuple_cat(spelt("comments", &Owner::comments), spelt("where", &Owner::where));
}

BF_FIELDS(model::Comments, has("before", &T::before), has("trailing", &T::trailing))
BF_FIELDS(model::Location, has("line", &T::line), has("column", &T::column))
BF_FIELDS(model::Expression, has("text", &T::text), one_of("quotes", &T::quotes, model::choices::quotes),
          spelt("spelling", &T::spelling), spelt("where", &T::where), spelt("rows", &T::rows))
BF_FIELDS(model::Key, has("name", &T::name), place<T>())
BF_FIELDS(model::Port, has("name", &T::name), has("shape", &T::shape), has("type", &T::type),
          has("unit", &T::unit), has("doc", &T::doc),
          one_of("when_disabled", &T::when_disabled, model::choices::held_or_reset), has("each", &T::each),
          has("initial", &T::initial), place<T>())
BF_FIELDS(model::Endpoint, has("block", &T::block), has("port", &T::port), place<T>())
BF_FIELDS(model::Connection, has("from", &T::from), has("to", &T::to), place<T>())
BF_FIELDS(model::NamedSignal, has("name", &T::name), has("of", &T::of), place<T>())
BF_FIELDS(model::Setting, has("name", &T::name), has("value", &T::value), spelt("where", &T::where))
BF_FIELDS(model::Variable, has("name", &T::name), has("value", &T::value), has("minimum", &T::minimum),
          has("above", &T::above), has("maximum", &T::maximum), has("unit", &T::unit), has("doc", &T::doc),
          has("fields", &T::fields), place<T>())
BF_FIELDS(model::Reference, has("file", &T::file), has("with", &T::with), spelt("where", &T::where))
BF_FIELDS(model::Block, has("name", &T::name), has("type", &T::type), has("reference", &T::reference),
          has("system", &T::system), has("doc", &T::doc), has("when", &T::when), has("period", &T::period),
          has("offset", &T::offset), has("settings", &T::settings), spelt("keys", &T::keys), place<T>(),
          spelt("type_where", &T::type_where))
BF_FIELDS(model::System, one_of("execution", &T::execution, model::choices::executions),
          one_of("states", &T::states, model::choices::held_or_reset),
          one_of("trigger", &T::trigger, model::choices::triggers),
          one_of("reset", &T::reset, model::choices::resets), has("iterations", &T::iterations),
          has("icon", &T::icon), has("inputs", &T::inputs), has("outputs", &T::outputs),
          has("enumerations", &T::enumerations), has("variables", &T::variables), has("blocks", &T::blocks),
          has("connections", &T::connections), has("signals", &T::signals))
BF_FIELDS(model::Signal, has("path", &T::path), place<T>())
BF_FIELDS(model::Panel, has("title", &T::title), has("signals", &T::signals), place<T>())
BF_FIELDS(model::Plugin, has("name", &T::name), place<T>())
BF_FIELDS(model::Point, has("x", &T::x), has("y", &T::y))
BF_FIELDS(model::PortSide, has("port", &T::port), one_of("side", &T::side, model::choices::sides))
BF_FIELDS(model::Placement, has("path", &T::path), has("at", &T::at), has("size", &T::size),
          has("flipped", &T::flipped), one_of("rotated", &T::rotated, model::choices::rotations),
          has("sides", &T::sides), place<T>())
BF_FIELDS(model::Bends, has("path", &T::path), has("points", &T::points), has("as_labels", &T::as_labels),
          place<T>())
BF_FIELDS(model::Note, has("name", &T::name), has("text", &T::text), has("image", &T::image),
          has("system", &T::system), has("at", &T::at), has("size", &T::size), place<T>())
BF_FIELDS(model::Display, has("name", &T::name), one_of("shows", &T::shows, model::choices::shows),
          has("signals", &T::signals), place<T>())
BF_FIELDS(model::Layout, has("blocks", &T::blocks), has("wires", &T::wires), has("notes", &T::notes),
          has("displays", &T::displays), spelt("keys", &T::keys))
BF_FIELDS(model::Model, has("name", &T::name), has("doc", &T::doc), has("plugins", &T::plugins),
          has("step", &T::step), has("stop", &T::stop), has("solver", &T::solver),
          has("relative_tolerance", &T::relative_tolerance),
          has("absolute_tolerance", &T::absolute_tolerance), has("max_step", &T::max_step),
          one_of("algebraic_loops", &T::algebraic_loops, model::choices::algebraic_loops),
          one_of("rate_transitions", &T::rate_transitions, model::choices::rate_transitions),
          one_of("non_finite", &T::non_finite, model::choices::non_finite), has("root", &T::root),
          has("record_all", &T::record_all), has("record", &T::record), has("plots", &T::plots),
          has("layout", &T::layout), spelt("keys", &T::keys), spelt("end", &T::end),
          spelt("where", &T::where))

BF_FIELDS(model::operations::Add, has("system", &T::system), has("block", &T::block), has("index", &T::index),
          has("at", &T::at))
BF_FIELDS(model::operations::Remove, has("path", &T::path))
BF_FIELDS(model::operations::Rename, has("path", &T::path), has("name", &T::name))
BF_FIELDS(model::operations::Reorder, has("path", &T::path), has("index", &T::index))
BF_FIELDS(model::operations::Connect, has("system", &T::system), has("from", &T::from), has("to", &T::to))
BF_FIELDS(model::operations::Disconnect, has("system", &T::system), has("from", &T::from), has("to", &T::to))
BF_FIELDS(model::operations::NameSignal, has("system", &T::system), has("from", &T::from),
          has("name", &T::name))
BF_FIELDS(model::operations::Set, has("path", &T::path), has("name", &T::name), has("value", &T::value))
BF_FIELDS(model::operations::AddPort, has("system", &T::system), has("port", &T::port),
          has("is_output", &T::is_output), has("index", &T::index))
BF_FIELDS(model::operations::SetVariable, has("system", &T::system), has("name", &T::name),
          has("variable", &T::variable))
BF_FIELDS(model::operations::RenameVariable, has("system", &T::system), has("name", &T::name),
          has("to", &T::to))
BF_FIELDS(model::operations::Move, has("path", &T::path), has("to", &T::to))
BF_FIELDS(model::operations::Resize, has("path", &T::path), has("size", &T::size))
BF_FIELDS(model::operations::Flip, has("path", &T::path))
BF_FIELDS(model::operations::Rotate, has("path", &T::path))
BF_FIELDS(model::operations::PlacePort, has("path", &T::path), has("port", &T::port),
          one_of("side", &T::side, model::choices::sides))
BF_FIELDS(model::operations::Bend, has("path", &T::path), has("points", &T::points))
BF_FIELDS(model::operations::Label, has("path", &T::path), has("is_there", &T::is_there))
BF_FIELDS(model::operations::Annotate, has("name", &T::name), has("note", &T::note))
BF_FIELDS(model::operations::Group, has("system", &T::system), has("blocks", &T::blocks),
          has("name", &T::name))
BF_FIELDS(model::operations::Dissolve, has("path", &T::path))
BF_FIELDS(model::operations::Inline, has("path", &T::path))
BF_FIELDS(model::operations::Extract, has("path", &T::path), has("file", &T::file))
BF_FIELDS(model::operations::Record, has("path", &T::path), has("is_recorded", &T::is_recorded),
          has("plot", &T::plot))
BF_FIELDS(model::operations::Plot, has("title", &T::title), has("signals", &T::signals))
BF_FIELDS(model::operations::Watch, has("name", &T::name), has("display", &T::display))
BF_FIELDS(model::Change, has("at", &T::at), has("removed", &T::removed), has("value", &T::value))
BF_FIELDS(model::Moved, has("from", &T::from), has("to", &T::to))
BF_FIELDS(model::operations::Patch, has("changes", &T::changes), has("moved", &T::moved))
BF_FIELDS(model::operations::Batch, has("operations", &T::operations))

} // namespace bf

namespace bf::model {

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
