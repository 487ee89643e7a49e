#pragma once

#include "bf/model/model.hpp"

#include <initializer_list>
#include <optional>
#include <string>
#include <utility>

namespace bf::model {

/// A value in C++: MATLAB text, a number or a truth value.
struct Value {
    Value(std::string expression) : text(std::move(expression)) {}
    Value(const char* expression) : text(expression) {}
    Value(double number); ///< shortest text that reads back as the same number
    Value(int number) : text(std::to_string(number)) {}
    Value(bool truth) : text(truth ? "true" : "false") {}

    std::string text;
};

/// What a variable may be (every element x has minimum ≤ x, above < x and x ≤ maximum), and what it is.
struct VariableOptions {
    std::optional<Value> minimum = {}, above = {}, maximum = {};
    std::string unit = {}, doc = {};
};

using Settings = std::initializer_list<std::pair<std::string, Value>>;

/// An end of a connection: a block (its only port), a block's port `block["port"]`, or an own input or
/// output.
struct End {
    std::string block;
    std::string port = {};

    End operator[](std::string port_name) const { return {block, std::move(port_name)}; }
};

/// Writes one subsystem. It is a handle: copies write the same subsystem, for as long as the Builder lives.
class SystemBuilder {
  public:
    SystemBuilder(System& system, std::string name) : system_(&system), name_(std::move(name)) {}

    End add(std::string name, std::string type, Settings settings = {});
    SystemBuilder subsystem(std::string name);
    SystemBuilder enabled_subsystem(std::string name, States states = States::held);
    /// A subsystem that runs as one block; `period` in s, or empty to inherit.
    SystemBuilder atomic_subsystem(std::string name, std::string period = {});

    End input(std::string name);
    End output(std::string name);
    void variable(std::string name, Value value, VariableOptions options = {});

    void connect(const End& from, std::initializer_list<End> to);
    void connect(const End& from, const End& to) { connect(from, {to}); }

    /// The subsystem as a block of the system around it.
    operator End() const { return {name_}; }
    End operator[](std::string port) const { return {name_, std::move(port)}; }

  private:
    Block& new_block(std::string name);

    System* system_;
    std::string name_;
};

/// Writes a model:
///
///     Builder m{"loop"};
///     End error = m.add("error", "Sum", {{"signs", "+-"}});
///     End plant = m.add("plant", "StateSpace", {{"A", "[0 1; -k 0]"}});
///     m.variable("k", 3.5, {.minimum = 0, .unit = "N/m"});
///     m.connect(error, plant["u"]);
///     Model model = m.build();
class Builder : public SystemBuilder {
  public:
    explicit Builder(std::string name);

    Builder& step(Value period);
    Builder& stop(Value duration);
    Builder& solver(std::string method);
    Builder& record(std::initializer_list<std::string> signal_paths);
    Builder& plot(std::string title, std::initializer_list<std::string> signal_paths);
    Builder& plugin(std::string name);

    /// Hands the model over; the builder is empty afterwards. Throws Errors with all that check() finds.
    Model build();

  private:
    explicit Builder(std::unique_ptr<Model> model);

    std::unique_ptr<Model> model_;
};

} // namespace bf::model
