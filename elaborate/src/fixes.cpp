#include "fixes.hpp"

#include "bf/model/edit.hpp"

#include <algorithm>

namespace bf::elaboration {

namespace op = model::operations;

model::Fix fix(std::string title, const model::Operation& operation) {
    return {std::move(title), model::to_json(operation)};
}

model::Fix renamed_setting(const std::string& path, const model::Setting& setting, const std::string& name) {
    return fix("Rename '" + setting.name + "' to '" + name + "'",
               op::Batch{{op::Set{path, setting.name}, op::Set{path, name, setting.value.matlab()}}});
}

model::Fix rewired(const std::string& system, const model::Endpoint& from, const model::Endpoint& to,
                   const std::string& new_from, const std::string& new_to) {
    return fix(
        "Connect '" + new_from + "' to '" + new_to + "'",
        op::Batch{{op::Disconnect{system, from.text(), to.text()}, op::Connect{system, new_from, new_to}}});
}

model::Fix named_anew(const std::string& system, const model::NamedSignal& signal,
                      const model::Endpoint& source) {
    return fix("Let '" + signal.name + "' be '" + source.text() + "'",
               op::NameSignal{system, source.text(), signal.name});
}

model::Fix renamed_signal(const model::Model& model, const std::string& path, const std::string& name) {
    op::Batch batch;
    if (std::ranges::find(model.record, path, &model::Signal::path) != model.record.end()) {
        batch.operations.emplace_back(op::Record{path, false});
        if (std::ranges::find(model.record, name, &model::Signal::path) == model.record.end())
            batch.operations.emplace_back(op::Record{name, true});
    }
    for (const auto& panel : model.plots) {
        std::vector<std::string> signals;
        for (const auto& signal : panel.signals) signals.push_back(signal.path == path ? name : signal.path);
        if (std::ranges::find(panel.signals, path, &model::Signal::path) != panel.signals.end())
            batch.operations.emplace_back(op::Plot{panel.title, std::move(signals)});
    }
    return fix("Show '" + name + "' instead", batch);
}

std::vector<model::Fix> inserted_transition(const model::Model& model, const std::string& path,
                                            const std::string& input, const std::string& period) {
    const auto [system, name] = model::split_last(path);
    const model::System* const content = model::find_system(model, system);
    if (!content) return {};
    std::string free = "transition";
    for (int n = 2; content->is_taken(free); ++n) free = "transition" + std::to_string(n);
    for (const auto& connection : content->connections)
        for (const auto& to : connection.to)
            if (to.block == name && (to.port.empty() || to.port == input)) {
                const model::Block block{
                    .name = free, .type = "RateTransition", .period = model::Expression{period}};
                return {
                    fix("Insert a RateTransition",
                        op::Batch{{op::Disconnect{system, connection.from.text(), to.text()},
                                   op::Add{system, block}, op::Connect{system, connection.from.text(), free},
                                   op::Connect{system, free, to.text()}}})};
            }
    return {};
}

} // namespace bf::elaboration
