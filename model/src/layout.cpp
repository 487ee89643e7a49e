// Operations on how the model is drawn, recorded and watched.
#include "bf/model/check.hpp"
#include "bf/model/suggest.hpp"
#include "editor.hpp"

#include <algorithm>

namespace bf::model {

using namespace operations;

Placement& Editor::placement(const std::string& path) {
    if (const auto [machine, name] = split_chart(model_, path); machine.empty())
        find_own(path);
    else if (nested_at(machine))
        on_nested(machine, [&, name = name](const Block& block) { NestedChart(block).require_state(name); });
    else
        static_cast<void>(state_of(chart_at(machine), machine, name));
    auto& blocks = model_.layout.blocks;
    const auto found = std::ranges::find(blocks, path, &Placement::path);
    return found != blocks.end() ? *found : blocks.emplace_back(Placement{.path = path});
}

void Editor::operator()(const Move& move) { placement(move.path).at = move.to; }

void Editor::operator()(const Resize& resize) { placement(resize.path).size = resize.size; }

void Editor::operator()(const Flip& flip) {
    Placement& drawn = placement(flip.path);
    drawn.flipped = !drawn.flipped;
}

void Editor::operator()(const Rotate& rotate) {
    Placement& drawn = placement(rotate.path);
    drawn.rotated = static_cast<Rotation>((static_cast<int>(drawn.rotated) + 1) % 4);
}

void Editor::operator()(const PlacePort& place) {
    if (place.port.empty())
        refuse({}, place.path, "'place_port' needs the name of a port", "give its 'port'");
    auto& sides = placement(place.path).sides;
    const auto found = std::ranges::find(sides, place.port, &PortSide::port);
    if (place.side || found == sides.end()) require_port(place.path, place.port);
    if (!place.side)
        std::erase_if(sides, [&](const PortSide& side) { return side.port == place.port; });
    else if (found != sides.end())
        found->side = *place.side;
    else
        sides.push_back({place.port, *place.side});
}

/// Ports of a block of a library are its declaration's matter.
void Editor::require_port(const std::string& path, const std::string& port) {
    if (const std::string machine = split_chart(model_, path).first; !machine.empty())
        refuse(chart_at(machine).where_states(), path, "a state has no ports", "bend its transitions");
    const Own own = find_own(path);
    if (!own.block) refuse({}, path, "this is a port, which has none itself", "name a block");
    const System* const content = own.block->content();
    if (!content) return;
    std::vector<std::string> known;
    for (const auto* ports : {&content->inputs, &content->outputs})
        for (std::string& name : names_of(*ports)) known.push_back(std::move(name));
    for (const std::string_view control : control_ports(*content)) known.emplace_back(control);
    if (std::ranges::find(known, port) == known.end())
        refuse(own.block->where, path, "there is no port '" + port + "'", name_remedy(port, known));
}

void Editor::require_wire(const std::string& path) {
    if (!systems_with_wire(model_, path).empty()) return;
    if (const auto [machine, name] = split_chart(model_, path); !machine.empty())
        refuse_transition(chart_at(machine), machine, name);
    std::vector<std::string> known;
    const std::string around = split_last(path).first;
    for (const std::string& system : {around, split_last(around).first})
        if (const System* const content = find_system(std::as_const(model_), system))
            for (const Connection& connection : content->connections)
                for (const Endpoint& end : connection.to) known.push_back(joined(system, end.text()));
    refuse({}, path, "no wire leads there", name_remedy(path, known));
}

void Editor::rename_side(const std::string& path, const std::string& port, const std::string& name) {
    for (Placement& drawn : model_.layout.blocks) {
        if (drawn.path != path) continue;
        for (PortSide& side : drawn.sides)
            if (side.port == port) side.port = name;
        std::erase_if(drawn.sides, [](const PortSide& side) { return side.port.empty(); });
    }
}

void Editor::draw_wire(Bends drawn, const char* operation) {
    auto& wires = model_.layout.wires;
    const auto found = std::ranges::find(wires, drawn.path, &Bends::path);
    if (drawn.path.empty())
        refuse({}, "", "'" + std::string(operation) + "' needs the end of a wire",
               "give its 'path', such as \"controller.pd.q\"");
    const bool is_usual = drawn.points.empty() && !drawn.as_labels;
    if (!is_usual || found == wires.end()) require_wire(drawn.path);
    if (is_usual) {
        if (found != wires.end()) wires.erase(found);
    } else if (found != wires.end()) {
        found->points = std::move(drawn.points);
        found->as_labels = drawn.as_labels;
    } else {
        wires.push_back(std::move(drawn));
    }
}

void Editor::operator()(const Bend& bend) { draw_wire({.path = bend.path, .points = bend.points}, "bend"); }

void Editor::operator()(const Label& label) {
    draw_wire({.path = label.path, .as_labels = label.is_there}, "label");
}

void Editor::operator()(const Annotate& annotate) {
    auto& notes = model_.layout.notes;
    const auto found = named(notes, annotate.name);
    if (!annotate.note) {
        if (found == notes.end())
            refuse({}, "", "there is no note '" + annotate.name + "'",
                   name_remedy(annotate.name, names_of(notes)));
        notes.erase(found);
        return;
    }
    Note note = *annotate.note;
    if (note.name.empty()) note.name = annotate.name;
    note.text = without_last_breaks(note.text);
    system_at(note.system);
    if (note.name != annotate.name && named(notes, note.name) != notes.end())
        refuse({}, "", "there is a note '" + note.name + "' already", "use another name");
    if (!is_name(note.name)) refuse({}, "", "'" + note.name + "' is no name for a note", "use a word");
    if (found == notes.end()) {
        notes.push_back(std::move(note));
        return;
    }
    note.where = found->where;
    note.comments = found->comments;
    if (!note.size) note.size = found->size;
    *found = std::move(note);
}

void Editor::operator()(const Record& record) {
    const auto is_it = [&](const Signal& signal) { return signal.path == record.path; };
    const auto panel = std::ranges::find(model_.plots, record.plot, &Panel::title);
    const bool is_plot = !record.plot.empty(), is_new = is_plot && panel == model_.plots.end();
    if (!record.is_recorded) {
        auto& signals = is_plot && !is_new ? panel->signals : model_.record;
        if (is_new || std::erase_if(signals, is_it) == 0)
            refuse({}, "",
                   "'" + record.path + "' is not " +
                       (is_plot ? "in the plot '" + record.plot + "'" : std::string("recorded")) +
                       " by itself",
                   "change the pattern, or `all`, by which it may be");
        if (is_plot && signals.empty()) model_.plots.erase(panel);
        return;
    }
    if (!is_plot && model_.record_all) return;
    auto& signals = !is_plot ? model_.record
                    : is_new ? model_.plots.emplace_back(Panel{.title = record.plot, .signals = {}}).signals
                             : panel->signals;
    if (std::ranges::none_of(signals, is_it)) signals.push_back({.path = record.path});
}

void Editor::operator()(const Plot& plot) {
    const auto found = std::ranges::find(model_.plots, plot.title, &Panel::title);
    if (!plot.signals) {
        if (found == model_.plots.end()) refuse({}, "", "there is no plot '" + plot.title + "'", "");
        model_.plots.erase(found);
        return;
    }
    if (plot.title.empty()) refuse({}, "", "a plot without title", "give it one");
    Panel& panel = found != model_.plots.end()
                       ? *found
                       : model_.plots.emplace_back(Panel{.title = plot.title, .signals = {}});
    std::vector<Signal> signals;
    for (const std::string& path : *plot.signals) {
        const auto known = std::ranges::find(panel.signals, path, &Signal::path);
        signals.push_back(known != panel.signals.end() ? *known : Signal{.path = path});
    }
    panel.signals = std::move(signals);
}

void Editor::operator()(const Watch& watch) {
    auto& displays = model_.layout.displays;
    const auto found = named(displays, watch.name);
    if (!watch.display) {
        if (found == displays.end())
            refuse({}, "", "there is no display '" + watch.name + "'",
                   name_remedy(watch.name, names_of(displays)));
        displays.erase(found);
        return;
    }
    Display display = *watch.display;
    if (display.name.empty()) display.name = watch.name;
    if (display.name.empty()) refuse({}, "", "a display without name", "give it one");
    if (display.name != watch.name && named(displays, display.name) != displays.end())
        refuse({}, "", "there is a display '" + display.name + "' already", "use another name");
    if (found == displays.end()) {
        displays.push_back(std::move(display));
        return;
    }
    display.where = found->where;
    display.comments = found->comments;
    for (Signal& signal : display.signals) {
        const auto known = std::ranges::find(found->signals, signal.path, &Signal::path);
        if (known != found->signals.end()) signal = *known;
    }
    *found = std::move(display);
}

} // namespace bf::model
