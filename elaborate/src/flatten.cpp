// Scopes and nodes: evaluates variables and settings, makes the blocks.
#include "bf/base/names.hpp"
#include "bf/base/run_options.hpp"
#include "bf/core/hash.hpp"
#include "bf/model/edit.hpp"

#include "stages.hpp"

#include <algorithm>
#include <cmath>

namespace bf::elaboration {

namespace {

std::vector<std::string> setting_names(const Declaration& d) {
    std::vector<std::string> names;
    for (const auto& argument : d.arguments) names.push_back(argument.name);
    for (const auto& slot : d.slots)
        if (slot.role == Role::parameter) names.push_back(slot.name);
    return names;
}

class Flattener {
  public:
    explicit Flattener(Elaboration& elaboration) : e_(elaboration) {}

    void run() {
        e_.scopes.emplace_back(nullptr);
        Scope& root = e_.root();
        root.system = &e_.model.root;
        for (const auto& [name, text, where] : e_.options.overrides) {
            by_name_[name] = overrides_.size(); // the last one counts
            by_block_[name.substr(0, name.rfind('.'))].push_back(overrides_.size());
            overrides_.push_back({name, text, where});
        }
        variables(root, e_.model.root.variables, "", nullptr);
        read_times();
        fill(root);
        report_unused();
    }

  private:
    struct Override {
        std::string name, text;
        model::Location where;
    };

    void read_times() {
        const auto model_number = [&](const char* name, const std::optional<model::Expression>& given,
                                      double otherwise, auto&& is_right, const char* rule) {
            model::Expression expression = given.value_or(model::Expression{});
            if (!override_of(name, expression) && !given) return otherwise;
            const auto value = e_.evaluate(expression, e_.root().variables, name);
            if (!value) return otherwise;
            if (value->is_array() && !value->is_text() && value->is_scalar() && is_right(value->scalar()))
                return value->scalar();
            e_.report.add(expression.where, "", "'" + std::string(name) + "' is " + value->describe(), rule);
            return otherwise;
        };
        e_.diagram.step = model_number(
            "step", e_.model.step, 0, [](double x) { return x > 0 && x <= longest_step; },
            "give a positive number of seconds up to 1e9");
        e_.diagram.stop = model_number(
            "stop", e_.model.stop, std::numeric_limits<double>::infinity(), [](double x) { return x >= 0; },
            "give a number of seconds from 0 to Inf");
        if (const std::string wrong = check_stop(e_.diagram.stop, e_.diagram.step);
            e_.diagram.step > 0 && !wrong.empty())
            e_.report.add(e_.model.step ? e_.model.step->where : model::Location{}, "", wrong,
                          "give a longer 'step', or a shorter 'stop' (Inf has no end)");
        read_solver();
        e_.diagram.refuses_non_finite = e_.model.non_finite == model::NonFinite::error;
        e_.diagram.solves_algebraic_loops = e_.model.algebraic_loops == model::AlgebraicLoops::solve;
        auto& solver = e_.diagram.solver;
        const auto positive = [](double x) { return x > 0; };
        solver.relative_tolerance = model_number("relative_tolerance", e_.model.relative_tolerance, 1e-6,
                                                 positive, "give a positive number");
        solver.absolute_tolerance = model_number("absolute_tolerance", e_.model.absolute_tolerance, 1e-9,
                                                 positive, "give a positive number");
        // A fiftieth of the run, so that no step leaps over what happens in it.
        const double stop = e_.diagram.stop;
        solver.max_step = model_number("max_step", e_.model.max_step,
                                       stop > 0 ? stop / 50 : std::numeric_limits<double>::infinity(),
                                       positive, "give a positive number of seconds, or Inf");
    }

    void read_solver() {
        model::Expression method = e_.model.solver.value_or(model::Expression{.text = "rk4"});
        override_of("solver", method);
        if (const auto known = solver_method(method.text)) {
            e_.diagram.solver.method = *known;
            return;
        }
        std::string names;
        for (const auto& [name, known] : solver_methods)
            names += (names.empty() ? "" : ", ") + std::string(name);
        e_.report.add(method.where, "",
                      "there is no solver " +
                          (method.text.starts_with("'") ? method.text : "'" + method.text + "'"),
                      "solvers: " + names);
    }

    bool override_of(const std::string& name, model::Expression& expression) {
        const auto found = by_name_.find(name);
        if (found == by_name_.end()) return false;
        const Override& given = overrides_[found->second];
        expression = {.text = given.text, .where = given.where};
        used_.insert(name);
        return true;
    }

    void report_unused() {
        for (const auto& given : overrides_) {
            if (used_.contains(given.name)) continue;
            e_.report.add(given.where, "",
                          "nothing is called '" + given.name + "'" +
                              e_.report.suggestion(given.name, [&] { return known_names(); }),
                          "give the name of a variable, of a setting as block.setting, step, stop or one of "
                          "the solver");
        }
    }

    std::vector<std::string> known_names() const {
        std::vector<std::string> names{
            "step", "stop", "solver", "relative_tolerance", "absolute_tolerance", "max_step"};
        for (const auto& scope : e_.scopes)
            add_names(scope.system->variables, scope.path.empty() ? "" : scope.path + ".", names);
        for (const auto& node : e_.diagram.nodes)
            for (const auto& name : setting_names(node.block->declaration()))
                names.push_back(node.path + "." + name);
        return names;
    }

    static void add_names(const std::vector<model::Variable>& variables, const std::string& prefix,
                          std::vector<std::string>& names) {
        for (const auto& variable : variables) {
            names.push_back(prefix + variable.name);
            add_names(variable.fields, prefix + variable.name + ".", names);
        }
    }

    /// Variables of a system in document order, so that each sees those before it. Those of a subsystem in
    /// another file can be replaced `with` values of the system around it; each can be overridden by its
    /// path.
    void variables(Scope& scope, const std::vector<model::Variable>& list, const std::string& prefix,
                   const std::vector<model::Variable>* with) {
        enumerations(scope);
        std::unordered_map<std::string_view, const model::Variable*> others;
        if (with)
            for (const auto& other : *with) others[other.name] = &other;
        for (const auto& variable : list) {
            const auto other = others.find(variable.name);
            const auto value = other == others.end() ? value_of(scope.variables, variable, prefix)
                                                     : value_of(scope.variables, variable, prefix,
                                                                other->second, &scope.parent->variables);
            scope.variables.set(variable.name, value);
            scope.variables.paths[variable.name] = prefix + variable.name;
            note_declaration(variable, prefix + variable.name);
            hold_to_limits(scope, variable, value, prefix + variable.name, nullptr);
        }
    }

    /// What the model says about a variable. Structs that are copies share their variables: the first counts.
    void note_declaration(const model::Variable& declared, const std::string& name) {
        for (const auto& field : declared.fields) note_declaration(field, name + "." + field.name);
        const auto part = e_.part_of(name);
        if (part.variable < 0 || part.rest > 0) return;
        auto& definition = e_.diagram.definitions[static_cast<std::size_t>(part.variable)];
        if (definition.unit.empty()) definition.unit = declared.unit;
        if (definition.doc.empty()) definition.doc = declared.doc;
    }

    /// Checks a variable, wherever its value comes from, against the limits of its declaration, and notes
    /// these for changes in a run. `where` the struct around it is written; null: it has no value of its own.
    void hold_to_limits(const Scope& scope, const model::Variable& declared, const matlab::Value& value,
                        const std::string& name, const model::Location* where) {
        if (const auto written = written_.find(name); written != written_.end()) where = &written->second;
        for (const auto& field : declared.fields)
            if (const auto* part = value.is_struct() ? value.find_field(field.name) : nullptr)
                hold_to_limits(scope, field, *part, name + "." + field.name, where);
        const auto limit = [&](const auto& expression, const char* what, double none) {
            if (!expression) return none;
            return e_.evaluate_scalar(*expression, scope.variables, name, what).value_or(none);
        };
        const Limits limits{limit(declared.minimum, "minimum", -Limits::infinity),
                            limit(declared.above, "above", -Limits::infinity),
                            limit(declared.maximum, "maximum", Limits::infinity)};
        if (!limits.are_given()) return;
        const std::string variable = "variable '" + name + "' must be ";
        const auto report = [&](const model::Location& at, std::string message, std::string remedy = {}) {
            e_.report.add({at, "", std::move(message), std::move(remedy), {}, false, name});
        };
        if (limits.minimum > limits.maximum || limits.above >= limits.maximum)
            return report(declared.where, variable + text_of(limits) + ", which no number is",
                          "let 'maximum' be the greatest of its limits");
        if (!where) return; // there is no value, which is reported
        const auto numbers = to_value(value);
        if (!numbers || numbers->kind != Value::Kind::number)
            return report(*where, variable + "a number, not " + value.describe(),
                          "its declaration gives it limits");
        if (const auto wrong = outside(limits, numbers->data); !wrong.empty())
            report(*where, "variable '" + name + "' " + wrong);
        const auto part = e_.part_of(name);
        if (part.variable < 0 || part.rest > 0) return;
        // Structs that are copies share their variables: the limits of all of them hold.
        Limits& all = e_.diagram.definitions[static_cast<std::size_t>(part.variable)].limits;
        all = {std::max(all.minimum, limits.minimum), std::max(all.above, limits.above),
               std::min(all.maximum, limits.maximum)};
    }

    /// Each is a struct of numbers of type int32.
    void enumerations(Scope& scope) {
        const std::string prefix = scope.path.empty() ? "" : scope.path + ".";
        for (const auto& enumeration : scope.system->enumerations) {
            matlab::Value::Fields fields;
            double next = 0;
            for (const auto& member : enumeration.fields) {
                const std::string name = enumeration.name + "." + member.name;
                if (!member.value.text.empty())
                    next = e_.evaluate_scalar(member.value, scope.variables, scope.path, name.c_str())
                               .value_or(next);
                const matlab::Value value = matlab::Value(next).as(matlab::Class::Int32);
                if (value.scalar() != next)
                    e_.report.add(member.value.where, scope.path,
                                  "'" + name + "' is " + matlab::number_text(next),
                                  "give a whole number of type int32");
                fields.emplace_back(member.name, value);
                e_.define({Definition::Kind::constant, prefix + name, {}, {}, value, {}, {}},
                          scope.variables);
                ++next;
            }
            scope.variables.set(enumeration.name, matlab::Value::structure(std::move(fields)));
            scope.variables.paths[enumeration.name] = prefix + enumeration.name;
        }
    }

    /// `with` is given in its place, in the workspace `outer`; of a struct field by field.
    matlab::Value value_of(const Variables& workspace, const model::Variable& variable,
                           const std::string& prefix, const model::Variable* with = nullptr,
                           const Variables* outer = nullptr) {
        if (with && (variable.fields.empty() || with->fields.empty())) return value_of(*outer, *with, prefix);
        const std::string name = prefix + variable.name;
        model::Expression expression = variable.value;
        const bool overridden = override_of(name, expression);
        if (variable.fields.empty() || overridden) {
            const auto value = e_.evaluate(expression, workspace, name, Definition::Kind::variable);
            if (!value) {
                e_.unknown_variables.insert(name);
                return matlab::Value(0.0);
            }
            written_[name] = expression.where;
            return *value;
        }
        matlab::Value::Fields fields;
        // Fields see the struct as far as it is written: Gain: {Kp: 1, Kd: 2*Gain.Kp}.
        Variables partial(&workspace), outer_partial(outer ? outer : &workspace);
        const std::string top = name.substr(0, name.find('.'));
        const auto add = [&](const model::Variable& field, const model::Variable* given) {
            fields.emplace_back(field.name, value_of(partial, field, name + ".", given, &outer_partial));
            if (top != variable.name) return;
            for (Variables* seen : {&partial, &outer_partial}) {
                if (seen == &outer_partial && !with) continue;
                auto so_far = fields.size() == 1 ? matlab::Value::structure() : seen->take(variable.name);
                so_far.set_field(field.name, fields.back().second);
                seen->set(variable.name, std::move(so_far));
                seen->paths[variable.name] = name;
            }
        };
        for (const auto& field : variable.fields)
            add(field, with ? model::find_variable(with->fields, field.name) : nullptr);
        if (with)
            for (const auto& field : with->fields)
                if (!model::find_variable(variable.fields, field.name)) add(field, &field);
        return matlab::Value::structure(std::move(fields));
    }

    void fill(Scope& scope) {
        for (const auto& block : scope.system->blocks) {
            const std::string path = scope.path.empty() ? block.name : scope.path + "." + block.name;
            scope.items[block.name];
            if (block.when && !is_wanted(scope, *block.when, path)) {
                scope.left_out.insert(block.name);
                e_.left_out.insert(path);
            } else if (add_bus(scope, block, path))
                continue;
            else if (block.is_library_block())
                add_node(scope, block, path);
            else
                add_scope(scope, block, path);
        }
    }

    void add_scope(Scope& parent, const model::Block& block, const std::string& path) {
        const model::System* content = block.content();
        if (!content) return;
        hold_to_size(path, block.where);
        e_.scopes.emplace_back(&parent.variables);
        Scope& scope = e_.scopes.back();
        scope.system = content;
        scope.self = &block;
        scope.parent = &parent;
        scope.path = path;
        inherit(scope, parent);
        sample_time(parent, block, path, scope.sample_time);
        parent.items[block.name] = {-1, &scope};
        const auto* with = block.reference ? &block.reference->with : nullptr;
        if (content->execution == model::Execution::for_each) return add_parts(scope, with);
        add_condition(scope);
        add_loop(scope);
        variables(scope, content->variables, path + ".", with);
        fill(scope);
    }

    static void inherit(Scope& scope, const Scope& parent) {
        scope.condition = parent.condition;
        scope.loop = parent.loop;
        scope.sample_time = parent.sample_time;
    }

    void add_condition(Scope& scope) {
        const auto& system = *scope.system;
        const auto e = system.execution;
        using enum model::Execution;
        if (e != enabled && e != triggered && e != enabled_and_triggered && !system.reset) return;
        Condition condition;
        condition.path = scope.path;
        condition.parent = scope.condition;
        condition.loop = scope.loop;
        condition.trigger_edge = system.trigger;
        condition.reset_edge = system.reset.value_or(model::Edge::rising);
        condition.resets_states = system.states == model::States::reset;
        scope.condition = static_cast<int>(e_.diagram.conditions.size());
        e_.diagram.conditions.push_back(std::move(condition));
    }

    void add_loop(Scope& scope) {
        const auto& system = *scope.system;
        const bool is_for = system.execution == model::Execution::for_loop;
        if (!is_for && system.execution != model::Execution::while_loop) return;
        Loop loop;
        loop.kind = is_for ? Loop::Kind::for_loop : Loop::Kind::while_loop;
        loop.path = scope.path;
        loop.parent = scope.loop;
        loop.condition = scope.condition;
        loop.resets_states = system.states == model::States::reset;
        if (is_for && system.iterations)
            loop.iterations = count_of(*scope.parent, *system.iterations, scope.path).value_or(1);
        scope.loop = static_cast<int>(e_.diagram.plan.loops.size());
        e_.diagram.plan.loops.push_back(std::move(loop));
    }

    /// The iterations of a for_each subsystem: copies called path(1), path(2), ..., which know their
    /// `iteration`.
    void add_parts(Scope& front, const std::vector<model::Variable>* with) {
        if (!front.system->iterations) return; // reported by the check of the model
        const auto count = count_of(*front.parent, *front.system->iterations, front.path);
        for (int i = 1; count && i <= *count; ++i) {
            hold_to_size(front.path, front.self->where);
            Scope& part = e_.scopes.emplace_back(&front.variables);
            part.system = front.system;
            part.self = front.self;
            part.parent = &front;
            part.path = front.path + "(" + std::to_string(i) + ")";
            inherit(part, front);
            front.parts.push_back(&part);
            const matlab::Value iteration(static_cast<double>(i));
            part.variables.set("iteration", iteration);
            part.variables.paths["iteration"] = part.path + ".iteration";
            e_.define({Definition::Kind::constant, part.path + ".iteration", {}, {}, iteration, {}, {}},
                      part.variables);
            variables(part, part.system->variables, part.path + ".", with);
            fill(part);
        }
    }

    std::optional<int> count_of(const Scope& scope, const model::Expression& expression,
                                const std::string& path) {
        const auto n = e_.evaluate_scalar(expression, scope.variables, path, "iterations");
        if (!n) return std::nullopt;
        if (*n >= 1 && *n <= 100000 && *n == std::floor(*n)) return static_cast<int>(*n);
        e_.report.add(expression.where, path, "'iterations' is " + matlab::number_text(*n),
                      "give a whole number from 1 to 100000");
        return std::nullopt;
    }

    bool is_wanted(const Scope& scope, const model::Expression& when, const std::string& path) {
        const auto value = e_.evaluate_scalar(when, scope.variables, path, "when");
        return !value || *value != 0;
    }

    /// BusCreator, BusSelector and BusAssignment group wires: they become no block of the diagram.
    bool add_bus(Scope& scope, const model::Block& block, const std::string& path) {
        using Kind = Bus::Kind;
        static const std::unordered_map<std::string_view, std::pair<Kind, const char*>> kinds{
            {"BusCreator", {Kind::creator, "signals"}},
            {"BusSelector", {Kind::selector, "signals"}},
            {"BusAssignment", {Kind::assignment, "signals"}}};
        const auto found = kinds.find(block.type);
        if (found == kinds.end()) return false;
        const auto [kind, argument] = found->second;
        Bus bus{kind, path, &scope, {}, {}, block.where};
        for (const auto& setting : block.settings) {
            if (setting.name != argument) {
                e_.report.add(setting.where, path,
                              "the block has no argument or parameter '" + setting.name + "'",
                              "it has 'signals', a list of names");
                continue;
            }
            if (const auto names = text_setting(e_, scope, setting, true, path)) bus.names = names->texts;
        }
        if (bus.names.empty())
            e_.report.add(block.where, path, "a " + block.type + " needs 'signals'",
                          "give a list of names, e.g. signals: [position, velocity]");
        std::unordered_set<std::string_view> ports;
        for (const auto& name : bus.names)
            if (!ports.insert(last_name(name)).second)
                e_.report.add(block.where, path,
                              "'signals' has two that are called '" + std::string(last_name(name)) + "'",
                              kind == Kind::creator ? "give them different names"
                                                    : "put one into another " + block.type);
        for (std::size_t i = 0; i < bus.names.size(); ++i) bus.places.try_emplace(bus.names[i], i);
        bus.drivers.resize(bus.names.size() + 1);
        scope.items[block.name] = {-1, nullptr, static_cast<int>(e_.buses.size())};
        e_.buses.push_back(std::move(bus));
        return true;
    }

    void add_node(Scope& scope, const model::Block& block, const std::string& path) {
        hold_to_size(path, block.where);
        const BlockClass* type = class_of(block, path);
        if (!type) return;
        const Declaration& declared = made_[type]->declaration();
        Arguments arguments;
        arguments.folder = e_.options.folder;
        if (block.where.file) {
            const auto slash = block.where.file->rfind('/');
            if (slash != std::string::npos) arguments.folder = block.where.file->substr(0, slash);
        }
        std::vector<model::Setting> changed;
        if (!overrides_.empty()) changed = overridden_settings(block, path);
        const auto& settings = overrides_.empty() ? block.settings : changed;
        const std::size_t first_definition = e_.diagram.definitions.size();
        std::vector<const model::Setting*> parameters;
        for (const auto& setting : settings) {
            const auto argument = std::find_if(declared.arguments.begin(), declared.arguments.end(),
                                               [&](const auto& a) { return a.name == setting.name; });
            const bool is_argument = argument != declared.arguments.end();
            if (!is_argument) {
                // A parameter may exist only under these arguments: known after the block is made.
                parameters.push_back(&setting);
                continue;
            }
            const bool is_text = argument->initial.kind != Value::Kind::number;
            auto value =
                is_text ? text_setting(e_, scope, setting, argument->initial.kind == Value::Kind::texts, path)
                        : number(scope, setting, path);
            if (value) arguments.emplace_back(setting.name, std::move(*value));
        }
        for (const auto& argument : declared.arguments)
            if (argument.from_path && std::ranges::find(arguments, argument.name, [](const auto& a) {
                                          return a.first;
                                      }) == arguments.end()) // half of it, which an int holds
                arguments.emplace_back(argument.name, static_cast<double>(number_of_name(path) / 2));

        if (e_.options.files)
            for (const auto& file : named_files(arguments))
                if (!e_.options.files->contains(file)) {
                    e_.report.add(block.where, path, "it names a file that the program does not use",
                                  "start the program anew with this model");
                    return;
                }

        DiagramNode node;
        try {
            node.block = type->make(arguments);
        } catch (const std::exception& error) {
            e_.report.add(block.where, path, error.what());
            return;
        }
        node.path = path;
        node.arguments = std::move(arguments);
        node.type = type->qualified_name();
        node.library = type->library;
        node.methods = type->methods;
        node.condition = scope.condition;
        node.loop = scope.loop;
        node.doc = block.doc;
        for (const Scope* at = &scope; node.doc.empty() && at && at->self; at = at->parent)
            node.doc = at->self->doc;
        node.where = block.where;
        const auto& d = node.block->declaration();
        for (const auto& problem : d.problems) e_.report.add(place_of_row(block, problem), path, problem);
        if (!d.problems.empty() && d.slots.empty()) return; // what it declares is not known
        give_parameters(scope, path, node.block->resolution(), parameters, block.where);
        node.sources.resize(d.slots.size());
        node.providers.resize(d.requirements.size());

        const int index = static_cast<int>(e_.diagram.nodes.size());
        for (std::size_t i = first_definition; i < e_.diagram.definitions.size(); ++i)
            if (auto& definition = e_.diagram.definitions[i]; definition.kind == Definition::Kind::parameter)
                definition.end = {index, d.find(definition.path.substr(path.size() + 1), Role::parameter)};
        scope.items[block.name] = {index, nullptr};
        scope.nodes.push_back(index);
        sample_time(scope, block, path, e_.sample_times.emplace_back(scope.sample_time));
        e_.diagram.nodes.push_back(std::move(node));
    }

    std::vector<std::string> type_names() const {
        std::vector<std::string> names;
        for (const auto& known : e_.registry.classes()) names.push_back(known->qualified_name());
        return names;
    }

    static model::Fix retyped(const std::string& path, const std::string& type) {
        return fix("Make it a " + type, model::operations::Set{path, "block", type});
    }

    /// The class of a block, made once with default arguments: null after a report.
    const BlockClass* class_of(const model::Block& block, const std::string& path) {
        const auto refuse = [&](const std::string& why) {
            std::vector<model::Fix> fixes;
            for (const auto& known : e_.registry.classes())
                if (known->name == block.type) fixes.push_back(retyped(path, known->qualified_name()));
            if (fixes.empty())
                for (const auto& name : similar(block.type, type_names()))
                    fixes.push_back(retyped(path, name));
            e_.report.add(block.type_where ? block.type_where : block.where, path, why, "", std::move(fixes));
            return nullptr;
        };
        const auto known = classes_.find(block.type);
        if (known != classes_.end()) return known->second ? known->second : refuse(refused_[block.type]);
        // Each looks through all names, and through folders.
        constexpr std::size_t most_refused = 50;
        if (refused_.size() >= most_refused)
            return refuse("there were " + std::to_string(most_refused) +
                          " types of blocks that cannot be had; more are not looked for");
        try {
            const BlockClass* type = &e_.registry.find(block.type);
            try {
                made_[type] = type->make({});
            } catch (const std::exception& error) {
                throw std::runtime_error("block '" + type->qualified_name() +
                                         "' cannot be made: " + error.what());
            }
            return classes_[block.type] = type;
        } catch (const std::exception& error) {
            classes_[block.type] = nullptr;
            return refuse(refused_[block.type] = error.what());
        }
    }

    /// The sample time a block or subsystem names for itself; an offset belongs to its period.
    void sample_time(const Scope& around, const model::Block& block, const std::string& path,
                     SampleTime& time) {
        if (!block.period) return;
        const auto value = [&](const auto& expression, const char* what) {
            return expression ? e_.evaluate_scalar(*expression, around.variables, path, what) : std::nullopt;
        };
        time = {value(block.period, "period"), value(block.offset, "offset"), &block, path};
    }

    /// The block's settings after overrides called path.setting.
    std::vector<model::Setting> overridden_settings(const model::Block& block, const std::string& path) {
        std::vector<model::Setting> settings = block.settings;
        const auto found = by_block_.find(path);
        if (found == by_block_.end()) return settings;
        for (const std::size_t i : found->second) {
            const Override& given = overrides_[i];
            if (given.name.size() <= path.size()) continue; // it is called as the block is
            const std::string name = given.name.substr(path.size() + 1);
            auto setting =
                std::find_if(settings.begin(), settings.end(), [&](const auto& s) { return s.name == name; });
            if (setting == settings.end())
                setting = settings.insert(settings.end(), {.name = name, .value = {}});
            setting->value = {.text = given.text, .where = given.where};
            used_.insert(given.name);
        }
        return settings;
    }

    std::optional<Value> number(const Scope& scope, const model::Setting& setting, const std::string& path,
                                Definition::Kind kind = Definition::Kind::structure) {
        auto value = e_.evaluate(setting.value, scope.variables, path + "." + setting.name, kind);
        if (!value) return std::nullopt;
        auto converted = to_value(*value);
        if (!converted)
            e_.report.add(setting.value.where, path,
                          "'" + setting.name + "' is a " + std::string(value->type_name()),
                          "give a number, a vector, a matrix or a text");
        return converted;
    }

    void give_parameters(const Scope& scope, const std::string& path, Resolution& r,
                         const std::vector<const model::Setting*>& parameters, const model::Location& where) {
        const auto check_limits = [&](const Slot& slot, const model::Location& at,
                                      const std::string& remedy) {
            const auto wrong =
                outside_limits(slot, slot.initial.empty() ? std::vector<double>{0} : slot.initial);
            if (!wrong.empty()) e_.report.add(at, path, wrong, remedy);
        };
        for (Slot& slot : r.slots) {
            const bool is_default =
                slot.role == Role::parameter &&
                std::none_of(parameters.begin(), parameters.end(),
                             [&](const auto* setting) { return setting->name == slot.name; });
            if (is_default && slot.from_path) slot.initial = {static_cast<double>(number_of_name(path))};
            if (is_default)
                check_limits(slot, where,
                             "give '" + slot.name +
                                 "' a value"); // one may lie outside: then a value must be given
        }
        for (const auto* setting : parameters) {
            const int index = r.find(setting->name, Role::parameter);
            if (index < 0) {
                auto meant = e_.report.meant(
                    setting->name, [&] { return setting_names(r.declaration()); },
                    [&](const std::string& name) { return renamed_setting(path, *setting, name); });
                e_.report.add(setting->where ? setting->where : setting->value.where, path,
                              "the block has no argument or parameter '" + setting->name + "'" + meant.text,
                              "", std::move(meant.fixes));
                continue;
            }
            const Slot& slot = r.slots[static_cast<std::size_t>(index)];
            const auto value = number(scope, *setting, path, Definition::Kind::parameter);
            if (!value) continue;
            if (value->kind != Value::Kind::number) {
                e_.report.add(setting->value.where, path,
                              "parameter '" + slot.name + "' must be a number, not " + value->describe());
                continue;
            }
            if (value->data.empty()) {
                e_.report.add(setting->value.where, path, "parameter '" + slot.name + "' is empty",
                              "give at least one element");
                continue;
            }
            try {
                give(r, index, *value);
                e_.written_parameters[{static_cast<int>(e_.diagram.nodes.size()), index}] =
                    setting->value.where;
                check_limits(slot, setting->value.where, outside_remedy(slot));
            } catch (const ResolutionError& error) {
                e_.report.add(setting->value.where, path,
                              "'" + setting->value.text + "' does not fit: " + error.what());
            }
        }
        give_defaults(r);
    }

    Elaboration& e_;
    /// Refuses models that are larger than memory: files that use each other are copied for each use.
    void hold_to_size(const std::string& path, const model::Location& where) {
        constexpr std::size_t most_blocks = 250000, most_values = 4000000;
        const std::size_t blocks = e_.diagram.nodes.size() + e_.scopes.size();
        if (blocks <= most_blocks && e_.diagram.definitions.size() <= most_values) return;
        e_.report.add(where, path,
                      "the model has more than " + std::to_string(most_blocks) +
                          " blocks and subsystems, or " + std::to_string(most_values) +
                          " variables, when each use of a file is counted",
                      "let files use each other less often, or work on vectors");
        e_.report.throw_if_any();
    }

    std::vector<Override> overrides_;
    std::unordered_map<std::string, std::size_t> by_name_;
    std::unordered_map<std::string, std::vector<std::size_t>>
        by_block_; ///< by what stands before the last dot
    std::unordered_set<std::string> used_;
    std::unordered_map<std::string, model::Location> written_;   ///< where values of variables are
    std::unordered_map<std::string, const BlockClass*> classes_; ///< null: it cannot be had
    std::unordered_map<std::string, std::string> refused_;       ///< why
    std::unordered_map<const BlockClass*, std::unique_ptr<Block>> made_;
};

} // namespace

void flatten(Elaboration& e) {
    e.diagram.name = e.model.name;
    e.diagram.rates.push_back({0, 0, true});
    e.diagram.conditions.emplace_back();
    for (const auto& plugin : e.model.plugins) {
        try {
            e.registry.load_plugin(plugin.name);
        } catch (const PluginError& error) {
            e.report.add(plugin.where, "", error.what());
        }
    }
    e.report.throw_if_any();
    Flattener(e).run();
}

} // namespace bf::elaboration
