// The signals of buses, which are groups of wires.
#include "stages.hpp"

namespace bf::elaboration {

const Scope::Driver* Bus::find(std::string& path) const {
    for (std::size_t end = path.find('.');; end = path.find('.', end + 1)) {
        if (const auto place = places.find(path.substr(0, end)); place != places.end()) {
            path.erase(0, end == std::string::npos ? end : end + 1);
            return &drivers[place->second];
        }
        if (end == std::string::npos) return nullptr;
    }
}

std::vector<std::string> signals_of(const Elaboration& e, const Scope& scope, const Scope::Driver& wire,
                                    std::size_t hops, std::string below) {
    const std::vector<std::string> no_bus(below.empty() ? 1 : 0);
    if (!wire.from || wire.port < 0 || hops == 0) return no_bus;
    if (wire.item.node >= 0) {
        const auto merge = e.merges.find(wire.item.node);
        if (merge == e.merges.end()) return no_bus;
        return signals_of(e, *merge->second.scope, merge->second.drivers.front(), hops - 1, std::move(below));
    }
    const auto port = static_cast<std::size_t>(wire.port);
    if (const Scope* front = wire.item.scope) {
        const Scope& inner = front->parts.empty() ? *front : *front->parts.front();
        return signals_of(e, inner, inner.outputs[port], hops - 1, std::move(below));
    }
    if (wire.item.bus < 0)
        return scope.parent ? signals_of(e, *scope.parent, scope.inputs[port], hops - 1, std::move(below))
                            : no_bus;
    const Bus& bus = e.buses[static_cast<std::size_t>(wire.item.bus)];
    if (bus.kind == Bus::Kind::selector) below = bus.names[port] + (below.empty() ? "" : "." + below);
    if (bus.kind != Bus::Kind::creator)
        return signals_of(e, *bus.scope, bus.drivers.back(), hops - 1, std::move(below));
    std::vector<std::string> found;
    if (!below.empty()) {
        const auto* driver = bus.find(below);
        return driver ? signals_of(e, *bus.scope, *driver, hops - 1, std::move(below)) : found;
    }
    for (std::size_t i = 0; i < bus.names.size(); ++i)
        for (const auto& path : signals_of(e, *bus.scope, bus.drivers[i], hops - 1))
            found.push_back(path.empty() ? bus.names[i] : bus.names[i] + "." + path);
    return found;
}

void split_merges(Elaboration& e, std::size_t hops) {
    for (auto& [first, merge] : e.merges) {
        const std::string path = e.node(first).path;
        const int output = e.resolution(first).find("y", Role::output);
        for (const auto& element : signals_of(e, *merge.scope, merge.drivers.front(), hops)) {
            if (element.empty()) break;
            int node = first;
            if (!merge.signals.empty()) {
                const DiagramNode& one = e.node(first);
                DiagramNode other;
                other.block = e.registry.find(one.type).make(one.arguments);
                other.arguments = one.arguments;
                other.sources.resize(one.sources.size());
                other.type = one.type;
                other.condition = one.condition;
                other.loop = one.loop;
                other.where = one.where;
                node = static_cast<int>(e.diagram.nodes.size());
                e.sample_times.push_back(e.sample_times[static_cast<std::size_t>(first)]);
                e.diagram.nodes.push_back(std::move(other));
                merge.scope->nodes.push_back(node);
            }
            e.node(node).path = path + "." + element;
            merge.signals[element] = {node, output};
        }
        if (merge.signals.empty()) continue;
        for (std::size_t i = 1; i < merge.drivers.size(); ++i)
            for (const auto& element : signals_of(e, *merge.scope, merge.drivers[i], hops))
                if (!element.empty() && !merge.signals.contains(element))
                    e.report.add(e.node(first).where, path,
                                 "the bus of input " + std::to_string(i + 1) + " has a signal '" + element +
                                     "', that of the first has none",
                                 "merge buses of the same signals");
    }
}

void report_missing(Elaboration& e, const model::Location& where, const std::string& path,
                    const std::string& name, const std::vector<std::string>& known) {
    e.report.add(where, path,
                 "the bus has no signal '" + name + "'" + e.report.suggestion(name, [&] { return known; }),
                 known.empty() ? "connect a BusCreator" : "its signals: " + name_list(known));
}

void check_assignments(Elaboration& e, std::size_t hops) {
    for (const auto& bus : e.buses) {
        if (bus.kind != Bus::Kind::assignment || !bus.drivers.back().from) continue;
        const auto known = signals_of(e, *bus.scope, bus.drivers.back(), hops);
        for (const auto& name : bus.names)
            if (signals_of(e, *bus.scope, bus.drivers.back(), hops, name).empty())
                report_missing(e, bus.where, bus.path, name, known);
    }
}

} // namespace bf::elaboration
