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

std::vector<model::Fix> inserted_before(const model::Model& model, const std::string& path,
                                        const std::vector<std::string>& inputs, std::string title,
                                        model::Block block) {
    const auto [system, name] = model::split_last(path);
    const model::System* const content = model::find_system(model, system);
    if (!content) return {};
    const std::string wanted = block.name;
    op::Batch batch;
    int n = 1;
    for (const auto& connection : content->connections)
        for (const auto& to : connection.to) {
            const bool is_meant = to.port.empty() || std::ranges::find(inputs, to.port) != inputs.end();
            if (to.block != name || !is_meant) continue;
            for (bool is_first = true; is_first || content->is_taken(block.name); is_first = false, ++n)
                block.name = n == 1 ? wanted : wanted + std::to_string(n);
            batch.operations.emplace_back(op::Disconnect{system, connection.from.text(), to.text()});
            batch.operations.emplace_back(op::Add{system, block});
            batch.operations.emplace_back(op::Connect{system, connection.from.text(), block.name});
            batch.operations.emplace_back(op::Connect{system, block.name, to.text()});
        }
    if (batch.operations.empty()) return {};
    return {fix(std::move(title), batch)};
}

} // namespace bf::elaboration
