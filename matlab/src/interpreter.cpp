#include "bf/matlab/interpreter.hpp"

#include "bf/base/numbers.hpp"

#include "state.hpp"

#include <algorithm>

namespace bf::matlab {
namespace {

[[noreturn]] void refuse(const std::string& what) {
    throw Error(what + " is refused: this text is evaluated without access to files or the environment");
}

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view blanks = " \t\r\n";
    const std::size_t first = text.find_first_not_of(blanks);
    return first == std::string_view::npos ? std::string_view()
                                           : text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

} // namespace

std::string Host::read_script(const std::string& path) { refuse("run('" + path + "')"); }
std::optional<std::string> Host::find_function(const std::string&) { return std::nullopt; }
std::optional<Value> Host::call(const std::string&, const std::vector<Value>&) { return std::nullopt; }
void Host::add_path(const std::string& folder) { refuse("addpath('" + folder + "')"); }
std::string Host::environment(const std::string& variable) { refuse("getenv('" + variable + "')"); }
bool Host::exists(const std::string& path, const std::string& kind) {
    refuse("exist('" + path + "','" + kind + "')");
}
void Host::show(const std::string&) {}

std::optional<double> plain_number(std::string_view text) {
    text = trimmed(text);
    const std::size_t sign = !text.empty() && text[0] == '-';
    if (text.size() <= sign) return std::nullopt;
    const char first = text[sign];
    if (first != '.' && !(first >= '0' && first <= '9')) return std::nullopt;
    return number_of(text);
}

bool is_builtin(std::string_view name) { return builtins().contains(name); }

Interpreter::Interpreter(Host& host, const Limits& limits) : state_(std::make_unique<State>(host, limits)) {}
Interpreter::Interpreter()
    : Interpreter([]() -> Host& {
          static Host refusing; // has no state
          return refusing;
      }()) {}
Interpreter::~Interpreter() = default;
Interpreter::Interpreter(Interpreter&&) noexcept = default;

Value Interpreter::evaluate(std::string_view text, const Workspace& variables, const Location& start) {
    if (const std::optional<double> number = plain_number(text)) return *number;
    return evaluate(*parse_expression(text, start), variables);
}

Value Interpreter::evaluate(const Expression& expression, const Workspace& variables) {
    return state_->evaluate_top(expression, variables);
}

void Interpreter::run(std::string_view script, Workspace& variables, const Location& start) {
    run(parse_program(script, start), variables);
}

void Interpreter::run(const std::shared_ptr<const Program>& program, Workspace& variables) {
    state_->run_top(program, variables);
}

std::vector<Value> Interpreter::call(const std::shared_ptr<const Program>& program,
                                     std::vector<Value> arguments, int outputs) {
    return state_->call_top(program, std::move(arguments), outputs);
}

Value evaluate(std::string_view text, const Workspace& variables, const Location& start) {
    if (const std::optional<double> number = plain_number(text)) return *number;
    return Interpreter().evaluate(text, variables, start);
}

void Interpreter::State::reset() {
    budget_ = Budget(limits_.elements, limits_.work);
    depth_ = 0;
    index_ = nullptr;
}

Value Interpreter::State::evaluate_top(const Expression& expression, const Workspace& variables) {
    reset();
    Workspace own(&variables); // takes what a function such as `run` might assign
    Frame frame{&own, nullptr, nullptr, 0, {}, {}};
    const Entered entered(*this, frame);
    return evaluate(expression);
}

void Interpreter::State::run_top(const std::shared_ptr<const Program>& program, Workspace& variables) {
    reset();
    Frame frame{&variables, program, nullptr, 0, {}, {}};
    const Entered entered(*this, frame);
    execute(program->statements);
}

std::vector<Value> Interpreter::State::call_top(const std::shared_ptr<const Program>& program,
                                                std::vector<Value> arguments, int outputs) {
    reset();
    if (program->functions.empty()) throw Error("the file defines no function to call");
    return call_function(program, program->functions[0], std::move(arguments), outputs);
}

void Interpreter::State::run_script(const std::string& path) {
    const std::shared_ptr<const Program> program = parse_program(host.read_script(path), Location{path});
    const Level level(*this);
    Frame frame{frame_->variables, program, frame_->function, frame_->argument_count, {}, {}};
    const Entered entered(*this, frame);
    execute(program->statements);
}

std::shared_ptr<const Program> Interpreter::State::find_file(const std::string& name) {
    const auto known = files_.find(name);
    if (known != files_.end()) return known->second;
    std::shared_ptr<const Program> program;
    if (const std::optional<std::string> text = host.find_function(name)) {
        program = parse_program(*text, Location{name + ".m"});
        if (program->functions.empty()) throw Error("the file of '" + name + "' defines no function");
    }
    return files_[name] = program;
}

bool Interpreter::State::is_function(const std::string& name) {
    return (frame_->program && frame_->program->find(name)) || find_file(name) || is_builtin(name);
}

void Interpreter::State::unknown(const std::string& name) {
    const std::string what = "unknown variable or function '" + name + "'";
    if (!suggestions.take()) throw Error(what);
    std::vector<std::string_view> candidates = frame_->variables->names();
    if (frame_->program)
        for (const Function& function : frame_->program->functions) candidates.push_back(function.name);
    const std::size_t known = candidates.size();
    for (const auto& [builtin, entry] : builtins()) candidates.push_back(builtin);
    std::sort(candidates.begin() + std::ptrdiff_t(known), candidates.end()); // a hash table has no order
    throw Error(what + suggestion(std::string_view(name).substr(0, name.find('.')), candidates));
}

/// Resolution: function of this file, imported or path function, host's function, built-in. The first
/// function of a function file comes last: a script of a block may share its name with a path function.
std::vector<Value> Interpreter::State::call_named(const std::string& name, std::vector<Value> arguments,
                                                  int outputs) {
    const std::shared_ptr<const Program> program = frame_->program;
    const Function* local = program ? program->find(name) : nullptr;
    const bool is_entry = local && program->statements.empty() && local == &program->functions[0];
    if (local && !is_entry) return call_function(program, *local, std::move(arguments), outputs);
    for (const std::string& package : frame_->imports)
        if (const auto file = find_file(package + "." + name))
            return call_function(file, file->functions[0], std::move(arguments), outputs);
    if (const auto file = find_file(name))
        return call_function(file, file->functions[0], std::move(arguments), outputs);
    if (local) return call_function(program, *local, std::move(arguments), outputs);
    if (std::optional<Value> value = host.call(name, arguments)) return {std::move(*value)};
    const auto builtin = builtins().find(name);
    if (builtin == builtins().end()) unknown(name);
    return call_builtin(builtin->first, builtin->second, arguments, outputs);
}

std::vector<Value> Interpreter::State::call_builtin(std::string_view name, const Builtin& builtin,
                                                    std::vector<Value>& arguments, int outputs) {
    const auto n = static_cast<int>(arguments.size());
    if (n < builtin.least || (builtin.most >= 0 && n > builtin.most)) {
        std::string wanted = std::to_string(builtin.least);
        if (builtin.most < 0)
            wanted = "at least " + wanted;
        else if (builtin.most > builtin.least)
            wanted += " to " + std::to_string(builtin.most);
        throw Error("'" + std::string(name) + "' takes " + wanted +
                    (wanted == "1" ? " argument" : " arguments") + ", got " + std::to_string(n));
    }
    double elements = 1;
    for (const Value& argument : arguments) elements += double(argument.numel());
    budget.spend(elements);
    const Call call{name, arguments, outputs, *this};
    if (builtin.one) return {builtin.one(call)};
    return builtin.many(call);
}

std::vector<Value> Interpreter::State::call_function(const std::shared_ptr<const Program>& program,
                                                     const Function& function, std::vector<Value> arguments,
                                                     int outputs) {
    const Level level(*this);
    const bool takes_rest = !function.inputs.empty() && function.inputs.back() == "varargin";
    const std::size_t named = function.inputs.size() - takes_rest;
    if (arguments.size() > named && !takes_rest)
        throw Error("'" + function.name + "' takes " + std::to_string(named) +
                    (named == 1 ? " argument" : " arguments") + ", got " + std::to_string(arguments.size()));
    if (outputs > 1 && static_cast<std::size_t>(outputs) > function.outputs.size())
        throw Error("'" + function.name + "' gives " + std::to_string(function.outputs.size()) +
                    " values, not " + std::to_string(outputs));
    Workspace own;
    Frame frame{&own, program, &function, int(arguments.size()), {}, {}};
    for (std::size_t i = 0; i < std::min(named, arguments.size()); ++i)
        if (function.inputs[i] != "~") own.set(function.inputs[i], std::move(arguments[i]));
    if (takes_rest) {
        std::vector<Value> rest;
        for (std::size_t i = named; i < arguments.size(); ++i) rest.push_back(std::move(arguments[i]));
        const auto n = static_cast<Index>(rest.size());
        own.set("varargin", Value::cell(n > 0, n, std::move(rest)));
    }
    const Entered entered(*this, frame);
    const IndexContext* const outer_index = std::exchange(index_, nullptr);
    execute(function.body);
    index_ = outer_index;
    for (const std::string& name : frame.persistent) persistent_[&function][name] = *own.find(name);
    std::vector<Value> results;
    for (std::size_t k = 0; k < std::max<std::size_t>(outputs, 1) && k < function.outputs.size(); ++k) {
        const Value* result = own.find(function.outputs[k]);
        if (result == nullptr) {
            if (outputs == 0) break;
            throw Error("'" + function.name + "' does not set its output '" + function.outputs[k] + "'");
        }
        results.push_back(*result);
    }
    return results;
}

std::vector<Value> Interpreter::State::apply(const Value& function, std::vector<Value> arguments,
                                             int outputs) {
    const Level level(*this);
    const Closure& closure = function.function();
    Workspace own;
    Frame frame{&own, closure.program, nullptr, int(arguments.size()), {}, {}};
    if (!closure.lambda) {
        frame.imports = frame_->imports;
        const Entered entered(*this, frame);
        return call_named(closure.name, std::move(arguments), outputs);
    }
    const std::vector<std::string>& parameters = closure.lambda->parameters;
    if (arguments.size() > parameters.size())
        throw Error("the function takes " + std::to_string(parameters.size()) + " arguments, got " +
                    std::to_string(arguments.size()));
    for (const auto& [name, value] : closure.captured) own.set(name, value);
    for (std::size_t i = 0; i < arguments.size(); ++i) own.set(parameters[i], std::move(arguments[i]));
    const ExpressionPtr body = closure.lambda->parts[0];
    const Entered entered(*this, frame);
    const IndexContext* const outer_index = std::exchange(index_, nullptr);
    std::vector<Value> results = evaluate_many(*body, outputs);
    index_ = outer_index;
    return results;
}

} // namespace bf::matlab
