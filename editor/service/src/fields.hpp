#pragma once

#include "bf/base/fields.hpp"
#include "bf/model/choices.hpp"
#include "bf/service/protocol.hpp"
#include "bf/view/theme.hpp"

/// The members of what is said between page and service, listed once: JSON and TypeScript follow from the
/// lists.
namespace bf {

namespace words {

inline const Words style = [] {
    Words all;
    for (const auto& ink : editor::theme) all.emplace_back(editor::name(ink.style)); // in order
    return all;
}();
inline const Words align = {"start", "middle", "end"};
inline const Words shape = {"polygon", "line", "curve", "ellipse", "text", "image"};
inline const Words element = {"block", "subsystem", "chart", "state", "input", "output", "wire", "note"};
inline const Words role = {"argument", "parameter", "property"};
inline const Words running = {"none", "paused", "running", "ended", "failed"};
inline const Words show = {"sizes", "types", "rates", "units"};
inline const Words shape_kind = {"mesh", "sphere", "box", "cylinder", "capsule", "ellipsoid"};
inline const Words language = {"cpp", "c"};
inline const Words action = {"start", "pause", "step",   "stop",  "to",
                             "pace",  "until", "branch", "adopt", "emergency_stop"};

} // namespace words

BF_FIELDS(editor::Point, has("x", &T::x), has("y", &T::y))
BF_FIELDS(editor::Rectangle, has("x", &T::x), has("y", &T::y), has("width", &T::width),
          has("height", &T::height))
BF_FIELDS(editor::Shape, one_of("kind", &T::kind, words::shape), one_of("style", &T::style, words::style),
          has("points", &T::points), has("text", &T::text), has("size", &T::size),
          one_of("align", &T::align, words::align))
BF_FIELDS(editor::Port, has("name", &T::name), has("is_output", &T::is_output), has("is_wired", &T::is_wired),
          has("at", &T::at), has("about", &T::about), has("signal", &T::signal))
BF_FIELDS(editor::Kept, has("plot", &T::plot), has("entry", &T::entry))
BF_FIELDS(editor::DrawnSignal, has("path", &T::path), has("name", &T::name), has("kept", &T::kept))
BF_FIELDS(model::Fix, has("title", &T::title), has("operation", &T::operation))
BF_FIELDS(editor::Mark, has("message", &T::message), has("remedy", &T::remedy), has("fixes", &T::fixes))
BF_FIELDS(editor::Element, one_of("kind", &T::kind, words::element), has("path", &T::path),
          has("from", &T::from), has("to", &T::to), has("corners", &T::corners),
          has("as_labels", &T::as_labels), has("signal", &T::signal), has("bounds", &T::bounds),
          has("shapes", &T::shapes), has("ports", &T::ports), has("title", &T::title),
          has("description", &T::description), has("image", &T::image), has("marks", &T::marks),
          has("rate", &T::rate), has("state", &T::state), has("has_inside", &T::has_inside))
BF_FIELDS(editor::Drawing, has("system", &T::system), has("bounds", &T::bounds),
          has("elements", &T::elements), has("signals", &T::signals), has("rates", &T::rates),
          has("active", &T::active))

BF_FIELDS(service::Diagnostic, has("file", &T::file), has("line", &T::line), has("column", &T::column),
          has("path", &T::path), has("message", &T::message), has("remedy", &T::remedy),
          has("fixes", &T::fixes), has("is_open", &T::is_open))
BF_FIELDS(service::PanelInfo, has("name", &T::name), one_of("shows", &T::shows, model::choices::shows),
          has("signals", &T::signals), has("is_kept", &T::is_kept))
BF_FIELDS(service::NamedValue, has("value", &T::value), has("name", &T::name))
BF_FIELDS(service::DocumentState, has("file", &T::file), has("revision", &T::revision),
          has("can_undo", &T::can_undo), has("can_redo", &T::can_redo), has("is_checked", &T::is_checked),
          has("is_saved", &T::is_saved), has("diagnostics", &T::diagnostics), has("failure", &T::failure),
          has("collision", &T::collision), has("panels", &T::panels), has("plots", &T::plots))
BF_FIELDS(service::LibraryPort, has("name", &T::name), has("doc", &T::doc))
BF_FIELDS(service::LibraryBlock, has("name", &T::name), has("group", &T::group), has("doc", &T::doc),
          has("inputs", &T::inputs), has("outputs", &T::outputs))
BF_FIELDS(service::SettingField, has("name", &T::name), one_of("role", &T::role, words::role),
          has("text", &T::text), has("initial", &T::initial), has("value", &T::value), has("unit", &T::unit),
          has("doc", &T::doc), has("choices", &T::choices), has("names", &T::names), has("least", &T::least),
          has("greatest", &T::greatest), has("is_whole", &T::is_whole))
BF_FIELDS(service::Inspection, has("path", &T::path), has("title", &T::title), has("type", &T::type),
          has("doc", &T::doc), has("fields", &T::fields))
BF_FIELDS(service::Parameters, has("blocks", &T::blocks))
BF_FIELDS(service::VariableField, has("system", &T::system), has("name", &T::name), has("text", &T::text),
          has("value", &T::value), has("unit", &T::unit), has("doc", &T::doc), has("limits", &T::limits),
          has("minimum", &T::minimum), has("above", &T::above), has("maximum", &T::maximum),
          has("least", &T::least), has("greatest", &T::greatest), has("mistake", &T::mistake),
          has("used_by", &T::used_by))
BF_FIELDS(service::BranchInfo, has("index", &T::index), has("parent", &T::parent), has("from", &T::from),
          has("reached", &T::reached), has("cause", &T::cause))
BF_FIELDS(service::RunEdit, has("refusal", &T::refusal), has("lost", &T::lost), has("begun", &T::begun),
          has("unclear", &T::unclear))
BF_FIELDS(service::TimingRow, has("from_us", &T::from_us), has("to_us", &T::to_us), has("count", &T::count),
          has("per_us", &T::per_us))
BF_FIELDS(service::TimingSummary, has("p50", &T::p50), has("p99", &T::p99), has("p99_9", &T::p99_9),
          has("p99_99", &T::p99_99), has("worst", &T::worst), has("rows", &T::rows))
BF_FIELDS(service::TimingMisses, has("computation", &T::computation), has("interruption", &T::interruption),
          has("wakeup", &T::wakeup), has("backlog", &T::backlog))
BF_FIELDS(service::Timing, has("state", &T::state), has("end", &T::end), has("time", &T::time),
          has("period_us", &T::period_us), has("steps", &T::steps), has("wake_up_us", &T::wake_up_us),
          has("step_us", &T::step_us), has("response_us", &T::response_us),
          has("deviation_us", &T::deviation_us), has("deviation_of_the_period", &T::deviation_of_the_period),
          has("missed", &T::missed), has("missed_by_cause", &T::missed_by_cause), has("skipped", &T::skipped),
          has("degraded", &T::degraded))
BF_FIELDS(service::LiveEntry, has("number", &T::number), has("clock", &T::clock), has("time", &T::time),
          has("who", &T::who), has("what", &T::what), has("page", &T::page))
BF_FIELDS(service::LiveProgram, has("name", &T::name), has("refusal", &T::refusal),
          has("edit_refusal", &T::edit_refusal), has("message", &T::message))
BF_FIELDS(service::LiveReport, has("timing", &T::timing), has("log", &T::log))
BF_FIELDS(service::Tune, has("name", &T::name), has("values", &T::values))
BF_FIELDS(service::RunState, one_of("state", &T::state, words::running), has("time", &T::time),
          has("step", &T::step), has("stop", &T::stop), has("factor", &T::factor),
          has("reached", &T::reached), has("is_current", &T::is_current), has("message", &T::message),
          has("branch", &T::branch), has("branches", &T::branches), has("edit", &T::edit),
          has("live", &T::live), has("tuned", &T::tuned), has("recorded", &T::recorded))
BF_FIELDS(service::SignalInfo, has("index", &T::index), has("path", &T::path), has("elements", &T::elements),
          has("names", &T::names), has("unit", &T::unit), has("rows", &T::rows),
          has("is_continuous", &T::is_continuous), has("values", &T::values))

BF_FIELDS(service::Nothing, std::tuple<>())
BF_FIELDS(service::Hello, has("protocol", &T::protocol))
BF_FIELDS(service::Welcome, has("version", &T::version), has("files", &T::files), has("page", &T::page),
          has("document", &T::document), has("run", &T::run), has("live", &T::live))
BF_FIELDS(service::Open, has("file", &T::file))
BF_FIELDS(service::LibraryList, has("blocks", &T::blocks))
BF_FIELDS(service::Moved, has("path", &T::path), has("to", &T::to), has("size", &T::size))
BF_FIELDS(service::Bent, has("path", &T::path), has("points", &T::points))
BF_FIELDS(service::Draw, has("system", &T::system), one_of("show", &T::show, words::show),
          has("moved", &T::moved), has("moved_notes", &T::moved_notes), has("bent", &T::bent),
          has("marks_open", &T::marks_open))
BF_FIELDS(service::Compare, has("file", &T::file), has("system", &T::system))
BF_FIELDS(service::Difference, has("path", &T::path), has("system", &T::system), has("text", &T::text))
BF_FIELDS(service::ModelComparison, has("differences", &T::differences), has("drawing", &T::drawing))
BF_FIELDS(service::Inspect, has("path", &T::path))
BF_FIELDS(service::BlockType, has("type", &T::type))
BF_FIELDS(service::Edit, has("operation", &T::operation))
BF_FIELDS(service::InSystem, has("system", &T::system))
BF_FIELDS(service::Evaluate, has("path", &T::path), has("name", &T::name), has("text", &T::text))
BF_FIELDS(service::Evaluated, has("value", &T::value), has("error", &T::error))
BF_FIELDS(service::Find, has("text", &T::text))
BF_FIELDS(service::Hit, has("path", &T::path), has("what", &T::what), has("text", &T::text))
BF_FIELDS(service::Hits, has("hits", &T::hits))
BF_FIELDS(service::Variables, has("variables", &T::variables))
BF_FIELDS(service::Copy, has("system", &T::system), has("names", &T::names))
BF_FIELDS(service::Text, has("text", &T::text))
BF_FIELDS(service::TextPlace, has("system", &T::system), has("path", &T::path), has("from", &T::from),
          has("line", &T::line), has("column", &T::column), has("last", &T::last))
BF_FIELDS(service::FileText, has("file", &T::file), has("text", &T::text), has("places", &T::places),
          has("diagnostics", &T::diagnostics))
BF_FIELDS(service::Rewrite, has("file", &T::file), has("text", &T::text), has("before", &T::before))
BF_FIELDS(service::Rewritten, has("document", &T::document), has("is_outdated", &T::is_outdated),
          has("diagnostics", &T::diagnostics))
BF_FIELDS(service::Paste, has("system", &T::system), has("text", &T::text), has("at", &T::at))
BF_FIELDS(service::RunCommand, one_of("action", &T::action, words::action), has("time", &T::time),
          has("factor", &T::factor), has("branch", &T::branch), has("event", &T::event))
BF_FIELDS(service::PlotPanel, has("title", &T::title), has("signals", &T::signals))
BF_FIELDS(service::Signals, has("signals", &T::signals), has("plots", &T::plots), has("unknown", &T::unknown))
BF_FIELDS(service::Watch, has("paths", &T::paths), has("branches", &T::branches))
BF_FIELDS(service::Refine, has("from", &T::from), has("to", &T::to))
BF_FIELDS(service::SceneShape, one_of("kind", &T::kind, words::shape_kind), has("body", &T::body),
          has("mesh", &T::mesh), has("pose", &T::pose), has("size", &T::size), has("colour", &T::colour))
BF_FIELDS(service::SceneWorld, has("path", &T::path), has("bodies", &T::bodies), has("shapes", &T::shapes),
          has("feet", &T::feet), has("has_floor", &T::has_floor), has("start", &T::start),
          has("disturbance", &T::disturbance))
BF_FIELDS(service::RecordingNumber, has("number", &T::number))
BF_FIELDS(service::Recorded, has("number", &T::number), has("file", &T::file), has("signals", &T::signals),
          has("defect", &T::defect), has("end", &T::end), has("failure", &T::failure))
BF_FIELDS(service::FileList, has("files", &T::files))
BF_FIELDS(service::Generate, one_of("language", &T::language, words::language))
BF_FIELDS(service::TextFile, has("name", &T::name), has("text", &T::text))
BF_FIELDS(service::CodePlace, has("path", &T::path), has("file", &T::file), has("first", &T::first),
          has("last", &T::last))
BF_FIELDS(service::GeneratedCode, has("files", &T::files), has("places", &T::places))
BF_FIELDS(service::BlockTime, has("path", &T::path), has("seconds", &T::seconds), has("calls", &T::calls))
BF_FIELDS(service::Times, has("blocks", &T::blocks))
BF_FIELDS(service::Look, has("is_wanted", &T::is_wanted))
BF_FIELDS(service::Scene, has("number", &T::number), has("worlds", &T::worlds), has("failure", &T::failure))

} // namespace bf
