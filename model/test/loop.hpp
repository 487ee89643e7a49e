#pragma once

#include "bf/model/builder.hpp"
#include "bf/model/edit.hpp"

#include <string>
#include <vector>

namespace bf::model {

/// A plant with a controller in a subsystem, drawn and recorded.
inline Model drawn_loop() {
    Builder m{"loop"};
    m.step("T")
        .record({"plant.y", "controller.pd.u", "controller"})
        .plot("Position", {"plant", "controller.*"});
    m.variable("T", 0.001);
    m.variable("k", "3.5*T");
    const End plant = m.add("plant", "StateSpace", {{"A", "[0 1; -k 0]"}, {"name", "'k'"}});
    SystemBuilder controller = m.enabled_subsystem("controller");
    const End q = controller.input("q"), tau = controller.output("tau");
    const End pd = controller.add("pd", "PD", {{"Kp", "10*k"}, {"filter", "s.k + k'"}});
    controller.connect(q, pd["q"]);
    controller.connect(pd, tau);
    const End on = m.add("on", "Constant", {{"value", 0.1}});
    m.connect(plant["y"], {controller["q"], m.add("scope", "Scope")});
    m.connect(controller["tau"], plant["u"]);
    m.connect(on, controller["enable"]);
    Model model = m.build();
    model.layout.blocks = {{.path = "plant", .at = {1, 2}}, {.path = "controller.pd", .at = {3, 4}}};
    model.layout.wires = {{.path = "plant.u", .points = {{5, 6}}},
                          {.path = "controller.pd.q", .points = {{7, 8}}}};
    model.layout.notes = {{.name = "n", .text = "note", .system = "controller", .at = {9, 10}}};
    return model;
}

/// "from -> to, to" of each connection of the system.
inline std::vector<std::string> wires(const Model& model, const std::string& system = "") {
    std::vector<std::string> lines;
    const System& in = system.empty() ? model.root : *find(model, system)->content();
    for (const Connection& connection : in.connections) {
        std::string line = connection.from.text() + " ->";
        for (const Endpoint& end : connection.to) line += " " + end.text();
        lines.push_back(line);
    }
    return lines;
}

template <typename Items> std::vector<std::string> paths(const Items& items) {
    std::vector<std::string> all;
    for (const auto& item : items) all.push_back(item.path);
    return all;
}

using Texts = std::vector<std::string>;

} // namespace bf::model
