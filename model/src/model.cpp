#include "bf/model/model.hpp"

#include "bf/base/escape.hpp"

#include <algorithm>

namespace bf::model {

std::vector<std::string_view> control_ports(const System& system) {
    std::vector<std::string_view> ports;
    const Execution e = system.execution;
    if (e == Execution::enabled || e == Execution::enabled_and_triggered) ports.push_back(enable_port);
    if (e == Execution::triggered || e == Execution::enabled_and_triggered) ports.push_back(trigger_port);
    if (system.reset && e != Execution::for_each) ports.push_back(reset_port);
    if (e == Execution::for_loop && !system.iterations) ports.push_back(iterations_port);
    return ports;
}
namespace {

template <typename Items> auto* find_named(Items& items, std::string_view name) {
    auto found = std::ranges::find_if(items, [&](const auto& item) { return item.name == name; });
    return found == items.end() ? nullptr : &*found;
}

std::string join_lines(const std::vector<Diagnostic>& diagnostics) {
    constexpr std::size_t most = 100;
    const std::size_t shown = std::min(most, diagnostics.size());
    std::string text;
    for (std::size_t i = 0; i < shown; ++i) text += (i > 0 ? "\n" : "") + diagnostics[i].text();
    if (shown < diagnostics.size()) text += "\nand " + std::to_string(diagnostics.size() - shown) + " more";
    return text;
}

} // namespace

std::string Location::text() const {
    if (line == 0) return {};
    return (file ? *file + ":" : "") + std::to_string(line) + ":" + std::to_string(column);
}

std::string Diagnostic::text() const {
    std::string text = where.text();
    if (!path.empty()) text += (text.empty() ? "" : ": ") + escape::shortened(path);
    text += (text.empty() ? "" : ": ") + escape::shortened(message);
    return remedy.empty() ? text : text + "; " + escape::shortened(remedy);
}

Errors::Errors(std::vector<Diagnostic> diagnostics)
    : diagnostics_(std::move(diagnostics)), text_(join_lines(diagnostics_)) {}

std::string Expression::matlab() const {
    if (quotes != Quotes::single) return text;
    std::string literal = "'";
    for (char c : text) literal.append(c == '\'' ? 2 : 1, c);
    return literal + "'";
}

std::string Endpoint::text() const {
    return block.empty() || port.empty() ? block + port : block + "." + port;
}

OwnSystem::OwnSystem(std::unique_ptr<System> system) : system_(std::move(system)) {}
OwnSystem::OwnSystem(const OwnSystem& other)
    : system_(other.system_ ? std::make_unique<System>(*other.system_) : nullptr) {}
OwnSystem::OwnSystem(OwnSystem&& other) noexcept = default;
OwnSystem& OwnSystem::operator=(OwnSystem other) noexcept {
    system_.swap(other.system_);
    return *this;
}
OwnSystem::~OwnSystem() = default;

const System* Block::content() const {
    if (reference) return reference->model ? &reference->model->root : nullptr;
    return system.get();
}

const Setting* Block::find_setting(std::string_view setting) const { return find_named(settings, setting); }

const Block* System::find_block(std::string_view block) const { return find_named(blocks, block); }
Block* System::find_block(std::string_view block) { return find_named(blocks, block); }
const Port* System::find_input(std::string_view port) const { return find_named(inputs, port); }
const Port* System::find_output(std::string_view port) const { return find_named(outputs, port); }
const NamedSignal* System::find_signal(std::string_view signal) const { return find_named(signals, signal); }
bool System::is_taken(std::string_view name) const {
    return find_block(name) || find_input(name) || find_output(name) || find_signal(name);
}

} // namespace bf::model
