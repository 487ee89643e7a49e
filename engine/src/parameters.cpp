// Parameters of a running simulation.
#include "machine.hpp"

#include "bf/base/names.hpp"
#include "bf/core/resolve.hpp"

#include <algorithm>
#include <cstdio>

namespace bf {

ParameterChange Simulation::prepare(const std::vector<ParameterValue>& changes) {
    ParameterChange result;
    for (const auto& [path, values] : changes) {
        const auto [node, slot] = diagram_.find_parameter(path);
        if (node < 0) {
            std::vector<std::string> names;
            for (const auto& parameter : parameters()) names.push_back(parameter.path);
            throw RunError("there is no parameter '" + path + "'" + did_you_mean(path, names) +
                           "; parameters are called block.parameter");
        }
        const Slot& s = diagram_.slot({node, slot});
        char wrong_count[256];
        if (kernels::is_wrong_count("parameter", path.c_str(), s.size.count(),
                                    static_cast<int>(values.size()), wrong_count, sizeof wrong_count))
            throw RunError(wrong_count);
        if (const auto wrong = outside_limits(s, values, path); !wrong.empty()) throw RunError(wrong);
        auto* const at = static_cast<std::byte*>(context_.data(node, slot));
        if (std::any_of(result.parts.begin(), result.parts.end(),
                        [&](const auto& part) { return part.at == at; }))
            throw RunError("parameter '" + path + "' is given twice; give it once");
        result.parts.push_back({at, std::vector<std::byte>(static_cast<std::size_t>(s.size.count()) *
                                                           static_cast<std::size_t>(bytes(s.type)))});
        write_values(result.parts.back().bytes.data(), s.type, s.size.count(), values);
        const Resolution& r = diagram_.nodes[static_cast<std::size_t>(node)].block->resolution();
        for (int i = 0; i < static_cast<int>(r.slots.size()); ++i)
            if (const int least = r.slots[static_cast<std::size_t>(i)].at_least;
                least >= 0 && (i == slot || least == slot))
                result.ordered.push_back({node, i});
    }
    return result;
}

bool Simulation::is_in_order(ParameterChange& change) const noexcept {
    return std::none_of(change.ordered.begin(), change.ordered.end(), [&](const auto& place) {
        const auto& node = diagram_.nodes[static_cast<std::size_t>(place.node)];
        const Resolution& r = node.block->resolution();
        const auto value = [&](int slot, int i) {
            return read_value(context_.data(place.node, slot), r.slots[static_cast<std::size_t>(slot)].type,
                              i);
        };
        char path[160];
        std::snprintf(path, sizeof path, "%.100s.%.40s", node.path.c_str(),
                      r.slots[static_cast<std::size_t>(place.slot)].name.c_str());
        return is_below_another(r, place.slot, value, path, change.refusal, sizeof change.refusal);
    });
}

Status Simulation::apply(ParameterChange& change) noexcept {
    const auto swap = [&] {
        for (auto& part : change.parts) std::swap_ranges(part.bytes.begin(), part.bytes.end(), part.at);
    };
    must_restart_ = true;
    const Status before = status_;
    const int node_before = failed_node_;
    Status failed = Status::failure("a parameter is below the one that it must be at least");
    swap();
    const bool is_refused =
        kernels::keep_or_restore([&] { return is_in_order(change) ? nullptr : change.refusal; },
                                 [&] {
                                     const bool is_defined = machine_->run(machine_->constants);
                                     if (!is_defined) failed = status_;
                                     return is_defined ? nullptr : "a constant is not defined";
                                 },
                                 swap);
    if (!is_refused) return ok;
    status_ = before;
    failed_node_ = node_before;
    return failed;
}

Tuning& Simulation::tuning() const {
    if (!tuning_) tuning_ = std::make_unique<Tuning>(diagram_);
    return *tuning_;
}

namespace {

NamedValues named(const std::vector<ParameterValue>& values) {
    NamedValues all;
    for (const auto& [path, elements] : values) all.emplace_back(path, elements);
    return all;
}

} // namespace

std::vector<ParameterValue> Simulation::variables() const {
    std::vector<ParameterValue> all;
    for (auto& variable : tuning().variables()) all.push_back({variable.path, std::move(variable.values)});
    return all;
}

std::vector<ParameterValue> Simulation::follow(const std::vector<ParameterValue>& asked) const {
    std::vector<ParameterValue> all;
    for (auto& [name, values] : tuning().follow(named(asked))) all.push_back({name, std::move(values)});
    return all;
}

void Simulation::accept(const std::vector<ParameterValue>& asked) { tuning().accept(named(asked)); }

} // namespace bf
