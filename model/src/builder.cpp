#include "bf/model/builder.hpp"

#include "bf/base/numbers.hpp"
#include "bf/model/check.hpp"

#include <cmath>

namespace bf::model {
namespace {

std::string shortest(double number) {
    if (std::isnan(number)) return "NaN";
    if (std::isinf(number)) return number > 0 ? "Inf" : "-Inf";
    return number_text(number);
}

std::vector<Signal> to_signals(std::initializer_list<std::string> paths) {
    std::vector<Signal> signals;
    for (const std::string& path : paths) signals.push_back({.path = path});
    return signals;
}

} // namespace

Value::Value(double number) : text(shortest(number)) {}

Block& SystemBuilder::new_block(std::string name) {
    return system_->blocks.emplace_back(Block{.name = std::move(name)});
}

End SystemBuilder::add(std::string name, std::string type, Settings settings) {
    Block& block = new_block(name);
    block.type = std::move(type);
    for (const auto& [setting, value] : settings)
        block.settings.push_back({.name = setting, .value = {.text = value.text}});
    return {std::move(name)};
}

SystemBuilder SystemBuilder::subsystem(std::string name) {
    Block& block = new_block(name);
    block.system = std::make_unique<System>();
    return {*block.system, std::move(name)};
}

SystemBuilder SystemBuilder::enabled_subsystem(std::string name, States states) {
    SystemBuilder inner = subsystem(std::move(name));
    inner.system_->execution = Execution::enabled;
    inner.system_->states = states;
    return inner;
}

SystemBuilder SystemBuilder::atomic_subsystem(std::string name, std::string period) {
    SystemBuilder inner = subsystem(std::move(name));
    inner.system_->execution = Execution::atomic;
    if (!period.empty()) system_->blocks.back().period = Expression{.text = std::move(period)};
    return inner;
}

End SystemBuilder::input(std::string name) {
    system_->inputs.push_back({.name = name});
    return {.block = {}, .port = std::move(name)};
}

End SystemBuilder::output(std::string name) {
    system_->outputs.push_back({.name = name});
    return {.block = {}, .port = std::move(name)};
}

void SystemBuilder::variable(std::string name, Value value, VariableOptions options) {
    const auto expression = [](std::optional<Value>& limit) {
        return limit ? std::optional(Expression{.text = std::move(limit->text)}) : std::nullopt;
    };
    system_->variables.push_back({.name = std::move(name),
                                  .value = {.text = std::move(value.text)},
                                  .minimum = expression(options.minimum),
                                  .above = expression(options.above),
                                  .maximum = expression(options.maximum),
                                  .unit = std::move(options.unit),
                                  .doc = std::move(options.doc)});
}

void SystemBuilder::connect(const End& from, std::initializer_list<End> to) {
    Connection connection{.from = {from.block, from.port}, .to = {}};
    for (const End& end : to) connection.to.push_back({.block = end.block, .port = end.port});
    system_->connections.push_back(std::move(connection));
}

Builder::Builder(std::string name) : Builder(std::make_unique<Model>(Model{.name = std::move(name)})) {}

Builder::Builder(std::unique_ptr<Model> model) : SystemBuilder(model->root, {}), model_(std::move(model)) {}

Builder& Builder::step(Value period) {
    model_->step = Expression{.text = std::move(period.text)};
    return *this;
}

Builder& Builder::solver(std::string method) {
    model_->solver = Expression{.text = std::move(method)};
    return *this;
}

Builder& Builder::stop(Value duration) {
    model_->stop = Expression{.text = std::move(duration.text)};
    return *this;
}

Builder& Builder::record(std::initializer_list<std::string> signal_paths) {
    for (Signal& signal : to_signals(signal_paths)) model_->record.push_back(std::move(signal));
    return *this;
}

Builder& Builder::plot(std::string title, std::initializer_list<std::string> signal_paths) {
    model_->plots.push_back({.title = std::move(title), .signals = to_signals(signal_paths)});
    return *this;
}

Builder& Builder::plugin(std::string name) {
    model_->plugins.push_back({.name = std::move(name)});
    return *this;
}

Model Builder::build() {
    if (std::vector<Diagnostic> wrong = check(*model_); !wrong.empty()) throw Errors(std::move(wrong));
    Model built = std::move(*model_);
    *model_ = Model{};
    return built;
}

} // namespace bf::model
