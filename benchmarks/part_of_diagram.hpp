// Some nodes of a diagram alone, fed with what the others gave in a run.
#pragma once

#include "bf/engine/simulation.hpp"

#include <cstddef>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

/// Stands for a block that does not run here. Those of its outputs that are read are inputs of the diagram.
class Recorded final : public bf::Block {
  public:
    Recorded(const bf::Resolution& from, const std::set<int>& read) {
        bf::detail::declared_by(*this).slots = from.declaration().slots;
        resolution().slots = from.slots;
        for (int i = 0; i < static_cast<int>(from.slots.size()); ++i) {
            auto& slot = resolution().slots[static_cast<std::size_t>(i)];
            slot.role = bf::Role::output;
            if (!read.contains(i)) slot.size = {0, 1, false};
        }
    }
};

/// Leaves the nodes that stay. Its inputs are called by the path of what gave them, without `prefix`.
inline void leave(bf::Diagram& d, const std::string& prefix,
                  const std::function<bool(const bf::DiagramNode&)>& is_left) {
    std::vector<std::set<int>> read(d.nodes.size());
    std::vector<bool> stays;
    for (const auto& node : d.nodes) stays.push_back(is_left(node));
    for (std::size_t n = 0; n < d.nodes.size(); ++n)
        for (const auto& from : d.nodes[n].sources)
            if (stays[n] && from.node >= 0 && !stays[static_cast<std::size_t>(from.node)])
                read[static_cast<std::size_t>(from.node)].insert(from.slot);
    for (std::size_t n = 0; n < d.nodes.size(); ++n) {
        if (stays[n]) continue;
        auto& node = d.nodes[n];
        node.block = std::make_unique<Recorded>(node.block->resolution(), read[n]);
        node.type = "Inport";
        node.methods = {};
        node.sources.assign(node.sources.size(), {});
        node.providers.clear();
        for (const int slot : read[n]) {
            const bf::Node::End end{static_cast<int>(n), slot};
            const std::string path = d.end_path(end);
            d.inputs.push_back({path.starts_with(prefix) ? path.substr(prefix.size()) : path, end});
        }
    }
    for (auto* segments : {&d.plan.outputs, &d.plan.updates})
        for (auto& segment : *segments)
            std::erase_if(segment.activities, [&](const bf::Activity& activity) {
                return !stays[static_cast<std::size_t>(activity.node)];
            });
    d.definitions.clear(); // they name parameters of blocks that do not run here
    d.plots.clear();
    d.record.clear();
}

/// The elements of signals, one after the other.
inline void append(const bf::Simulation& simulation, const std::vector<bf::SignalName>& signals,
                   std::vector<double>& to) {
    for (const auto& signal : signals) {
        const auto* data =
            static_cast<const double*>(simulation.context().data(signal.end.node, signal.end.slot));
        to.insert(to.end(), data, data + simulation.diagram().slot(signal.end).size.count());
    }
}

/// Their elements in each step.
struct Watch final : bf::Run::Observer {
    const std::vector<bf::SignalName>& signals;
    std::vector<double> values;
    explicit Watch(const std::vector<bf::SignalName>& s) : signals(s) {}
    void observe(const bf::Run& run) noexcept override {
        append(static_cast<const bf::Simulation&>(run), signals, values);
    }
};

/// Gives the inputs of a diagram their values of a step.
class Inputs {
  public:
    Inputs(bf::Simulation& run, const std::vector<double>& values) : values_(values) {
        for (const auto& input : run.diagram().inputs) {
            auto* data = static_cast<double*>(run.context().data(input.end.node, input.end.slot));
            for (int e = 0; e < run.diagram().slot(input.end).size.count(); ++e) places_.push_back(data + e);
        }
    }
    void set(std::size_t step) const {
        const double* from = values_.data() + step * places_.size();
        for (double* place : places_) *place = *from++;
    }

  private:
    const std::vector<double>& values_;
    std::vector<double*> places_;
};
