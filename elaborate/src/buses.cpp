// The signals of buses, which are groups of wires.
#include "stages.hpp"

#include <algorithm>

namespace bf::elaboration {

std::optional<std::string> below(const std::string& path, const std::string& name) {
    if (path == name) return "";
    if (path.starts_with(name + ".")) return path.substr(name.size() + 1);
    return {};
}

std::vector<std::string> signals_of(const Elaboration& e, const Scope& scope, const Scope::Driver& wire,
                                    std::size_t hops) {
    const std::vector<std::string> no_bus{""};
    if (!wire.from || wire.port < 0 || wire.item.node >= 0 || hops == 0) return no_bus;
    const auto port = static_cast<std::size_t>(wire.port);
    if (const Scope* inner = wire.item.scope)
        return inner->parts.empty() ? signals_of(e, *inner, inner->outputs[port], hops - 1) : no_bus;
    if (wire.item.bus < 0)
        return scope.parent ? signals_of(e, *scope.parent, scope.inputs[port], hops - 1) : no_bus;
    const Bus& bus = e.buses[static_cast<std::size_t>(wire.item.bus)];
    std::vector<std::string> found;
    if (bus.kind == Bus::Kind::creator) {
        for (std::size_t i = 0; i < bus.names.size(); ++i)
            for (const auto& path : signals_of(e, *bus.scope, bus.drivers[i], hops - 1))
                found.push_back(path.empty() ? bus.names[i] : bus.names[i] + "." + path);
        return found;
    }
    const auto all = signals_of(e, *bus.scope, bus.drivers.back(), hops - 1);
    if (bus.kind == Bus::Kind::assignment) return all;
    for (const auto& path : all)
        if (const auto rest = below(path, bus.names[port])) found.push_back(*rest);
    return found;
}

void check_assignments(Elaboration& e, std::size_t hops) {
    for (const auto& bus : e.buses) {
        if (bus.kind != Bus::Kind::assignment || !bus.drivers.back().from) continue;
        const auto known = signals_of(e, *bus.scope, bus.drivers.back(), hops);
        std::string list;
        for (const auto& path : known) list += (list.empty() ? "" : ", ") + path;
        for (const auto& name : bus.names)
            if (std::none_of(known.begin(), known.end(),
                             [&](const auto& path) { return below(path, name).has_value(); }))
                e.report.add(bus.where, bus.path,
                             "the bus has no signal '" + name + "'" + did_you_mean(name, known),
                             list.empty() ? "connect a BusCreator" : "its signals: " + list);
    }
}

} // namespace bf::elaboration
