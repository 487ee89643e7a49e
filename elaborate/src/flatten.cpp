// Scopes and nodes: evaluates variables and settings, makes the blocks.
#include "stages.hpp"

#include <algorithm>
#include <cmath>

namespace bf::elaboration {

namespace {

/// What a class declares with default arguments, to tell arguments from parameters before a block is made.
const Declaration& class_declaration(std::unordered_map<std::string, std::unique_ptr<Block>>& made,
                                     const BlockClass& type) {
    auto& block = made[type.qualified_name()];
    if (!block) block = type.make({});
    return block->declaration();
}

std::vector<std::string> setting_names(const Declaration& d) {
    std::vector<std::string> names;
    for (const auto& argument : d.arguments) names.push_back(argument.name);
    for (const auto& slot : d.slots)
        if (slot.role == Role::parameter) names.push_back(slot.name);
    return names;
}

/// The size a value gives to a parameter: vectors are 1-D unless the parameter keeps them as written or is
/// declared a matrix.
Size parameter_size(const Slot& slot, const Value& value) {
    if (value.rows == 1 && value.cols == 1) return {1, 1, slot.shape.is_matrix};
    const bool is_vector = value.rows == 1 || value.cols == 1;
    if (slot.shape.is_matrix || slot.as_written || !is_vector) return {value.rows, value.cols, true};
    return {value.rows * value.cols, 1, false};
}

/// Does the parameter alone decide its size? Where an input shares its shape, one element expands to what is
/// wired.
bool has_own_shape(const Declaration& d, const Slot& slot) {
    if (slot.shape.symbol < 0) return false;
    return std::none_of(d.slots.begin(), d.slots.end(), [&](const Slot& s) {
        return s.role == Role::input && s.shape.symbol == slot.shape.symbol;
    });
}

class Flattener {
  public:
    explicit Flattener(Elaboration& elaboration) : e_(elaboration) {}

    void run() {
        e_.scopes.emplace_back(nullptr);
        Scope& root = e_.root();
        root.system = &e_.model.root;
        apply_overrides();
        fill(root);
        for (const auto& [name, expression] : settings_)
            if (!used_.contains(name))
                e_.report.add({}, "", "nothing is called '" + name + "'" + did_you_mean(name, known_names()),
                              "give the name of a variable, of a setting as block.setting, step or stop");
    }

  private:
    void apply_overrides() {
        for (const auto& [name, text] : e_.options.overrides) settings_[name] = text;
        const auto time = [&](const char* name, const std::optional<model::Expression>& given,
                              double otherwise) {
            model::Expression expression = given.value_or(model::Expression{});
            if (!override_of(name, expression) && !given) return otherwise;
            return e_.evaluate_scalar(expression, e_.root().variables, "", name).value_or(otherwise);
        };
        variables(e_.root(), e_.model.root.variables, "");
        e_.diagram.step = time("step", e_.model.step, 0);
        e_.diagram.stop = time("stop", e_.model.stop, std::numeric_limits<double>::infinity());
        if (e_.diagram.step < 0 || !std::isfinite(e_.diagram.step))
            e_.report.add(e_.model.step ? e_.model.step->where : e_.model.where, "",
                          "the base period 'step' is " + matlab::number_text(e_.diagram.step) + " s",
                          "give a positive number of seconds");
    }

    bool override_of(const std::string& name, model::Expression& expression) {
        const auto found = settings_.find(name);
        if (found == settings_.end()) return false;
        expression.text = found->second;
        expression.quotes = model::Quotes::none;
        expression.where = {};
        used_.insert({name, true});
        return true;
    }

    std::vector<std::string> known_names() const {
        std::vector<std::string> names{"step", "stop"};
        for (const auto& [name, seen] : seen_) names.push_back(name);
        return names;
    }

    /// Variables of a system in document order; those of the root can be overridden by name.
    void variables(Scope& scope, const std::vector<model::Variable>& list, const std::string& prefix) {
        for (const auto& variable : list)
            scope.variables.set(variable.name, value_of(scope, scope.variables, variable, prefix));
    }

    matlab::Value value_of(Scope& scope, const matlab::Workspace& workspace, const model::Variable& variable,
                           const std::string& prefix) {
        const std::string name = prefix + variable.name;
        if (scope.parent == nullptr) seen_[name] = true;
        model::Expression expression = variable.value;
        const bool overridden = scope.parent == nullptr && override_of(name, expression);
        if (variable.fields.empty() || overridden)
            return e_.evaluate(expression, workspace, scope.path).value_or(matlab::Value(0.0));
        matlab::Value::Fields fields;
        // Fields see the struct as far as it is written: Gain: {Kp: 1, Kd: 2*Gain.Kp}.
        matlab::Workspace partial(&workspace);
        const std::string top = name.substr(0, name.find('.'));
        for (const auto& field : variable.fields) {
            fields.emplace_back(field.name, value_of(scope, partial, field, name + "."));
            if (top == variable.name) partial.set(variable.name, matlab::Value::structure(fields));
        }
        return matlab::Value::structure(std::move(fields));
    }

    void fill(Scope& scope) {
        for (const auto& block : scope.system->blocks) {
            const std::string path = scope.path.empty() ? block.name : scope.path + "." + block.name;
            if (block.is_library_block())
                add_node(scope, block, path);
            else
                add_scope(scope, block, path);
        }
    }

    void add_scope(Scope& parent, const model::Block& block, const std::string& path) {
        const model::System* content = block.content();
        if (!content) return;
        e_.scopes.emplace_back(&parent.variables);
        Scope& scope = e_.scopes.back();
        scope.system = content;
        scope.self = &block;
        scope.parent = &parent;
        scope.path = path;
        scope.condition = parent.condition;
        scope.period = parent.period;
        scope.offset = parent.offset;
        if (block.period) scope.period = e_.evaluate_scalar(*block.period, parent.variables, path, "period");
        if (block.offset) scope.offset = e_.evaluate_scalar(*block.offset, parent.variables, path, "offset");
        parent.items[block.name] = {-1, &scope};
        if (content->execution == model::Execution::enabled) {
            Condition condition;
            condition.path = path;
            condition.parent = parent.condition;
            condition.resets_states = content->states == model::States::reset;
            scope.condition = static_cast<int>(e_.diagram.conditions.size());
            e_.diagram.conditions.push_back(std::move(condition));
        }
        variables(scope, content->variables, path + ".");
        if (block.reference) variables(scope, block.reference->with, path + ".");
        fill(scope);
    }

    void add_node(Scope& scope, const model::Block& block, const std::string& path) {
        const BlockClass* type = nullptr;
        try {
            type = &e_.registry.find(block.type);
        } catch (const PluginError& error) {
            e_.report.add(block.type_where, path, error.what());
            return;
        }
        const Declaration& declared = class_declaration(made_, *type);
        Arguments arguments;
        arguments.folder = e_.options.folder;
        if (block.where.file) {
            const auto slash = block.where.file->rfind('/');
            if (slash != std::string::npos) arguments.folder = block.where.file->substr(0, slash);
        }
        std::vector<model::Setting> settings = block.settings;
        for (const auto& name : setting_names(declared)) {
            const std::string full = path + "." + name;
            seen_[full] = true;
            model::Expression expression;
            if (!settings_.contains(full)) continue;
            auto given =
                std::find_if(settings.begin(), settings.end(), [&](const auto& s) { return s.name == name; });
            if (given == settings.end()) given = settings.insert(settings.end(), {name, {}, block.where});
            override_of(full, given->value);
        }
        std::vector<std::pair<const model::Setting*, Value>> parameters;
        for (const auto& setting : settings) {
            const auto argument = std::find_if(declared.arguments.begin(), declared.arguments.end(),
                                               [&](const auto& a) { return a.name == setting.name; });
            const bool is_argument = argument != declared.arguments.end();
            if (!is_argument) {
                // A parameter may exist only under these arguments: known after the block is made.
                if (auto value = number(scope, setting, path))
                    parameters.emplace_back(&setting, std::move(*value));
                continue;
            }
            const bool is_text = argument->initial.kind != Value::Kind::number;
            auto value =
                is_text ? text_setting(e_, scope, setting, argument->initial.kind == Value::Kind::texts, path)
                        : number(scope, setting, path);
            if (value) arguments.emplace_back(setting.name, std::move(*value));
        }

        DiagramNode node;
        try {
            node.block = type->make(arguments);
        } catch (const std::exception& error) {
            e_.report.add(block.where, path, error.what());
            return;
        }
        node.path = path;
        node.type = type->qualified_name();
        node.methods = type->methods;
        node.condition = scope.condition;
        node.where = block.where;
        auto& d = node.block->declaration();
        for (const auto& problem : d.problems) e_.report.add(block.where, path, problem);
        give_parameters(path, d, parameters);
        node.sources.resize(d.slots.size());
        node.providers.resize(d.requirements.size());

        const int index = static_cast<int>(e_.diagram.nodes.size());
        scope.items[block.name] = {index, nullptr};
        scope.nodes.push_back(index);
        e_.node_periods.push_back(
            block.period ? e_.evaluate_scalar(*block.period, scope.variables, path, "period") : scope.period);
        e_.node_offsets.push_back(
            block.offset ? e_.evaluate_scalar(*block.offset, scope.variables, path, "offset") : scope.offset);
        e_.diagram.nodes.push_back(std::move(node));
    }

    std::optional<Value> number(const Scope& scope, const model::Setting& setting, const std::string& path) {
        auto value = e_.evaluate(setting.value, scope.variables, path);
        if (!value) return std::nullopt;
        auto converted = to_value(*value);
        if (!converted)
            e_.report.add(setting.value.where, path,
                          "'" + setting.name + "' is a " + std::string(value->type_name()),
                          "give a number, a vector, a matrix or a text");
        return converted;
    }

    void give_parameters(const std::string& path, Declaration& d,
                         const std::vector<std::pair<const model::Setting*, Value>>& parameters) {
        for (const auto& [setting, value] : parameters) {
            const int index = d.find(setting->name, Role::parameter);
            if (index < 0) {
                e_.report.add(setting->where ? setting->where : setting->value.where, path,
                              "the block has no argument or parameter '" + setting->name + "'" +
                                  did_you_mean(setting->name, setting_names(d)));
                continue;
            }
            Slot& slot = d.slots[static_cast<std::size_t>(index)];
            if (value.kind != Value::Kind::number) {
                e_.report.add(setting->value.where, path,
                              "parameter '" + slot.name + "' must be a number, not " + value.describe());
                continue;
            }
            slot.initial = value.data;
            if (value.data.empty()) {
                e_.report.add(setting->value.where, path, "parameter '" + slot.name + "' is empty",
                              "give at least one element");
                continue;
            }
            const bool decides = has_own_shape(d, slot) || value.data.size() > 1;
            try {
                if (decides) offer(d, index, parameter_size(slot, value));
                if (value.type != Type::float64 && slot.type_symbol >= 0) offer(d, index, value.type);
            } catch (const ResolutionError& error) {
                e_.report.add(setting->value.where, path, error.what());
            }
        }
        for (std::size_t i = 0; i < d.slots.size(); ++i) {
            Slot& slot = d.slots[i];
            if (slot.role != Role::parameter || !has_own_shape(d, slot)) continue;
            const bool given = std::any_of(parameters.begin(), parameters.end(),
                                           [&](const auto& p) { return p.first->name == slot.name; });
            const int count = static_cast<int>(slot.initial.size());
            if (!given && !d.shapes[static_cast<std::size_t>(slot.shape.symbol)].known)
                offer(d, static_cast<int>(i), Size{std::max(count, 1), 1, false});
        }
    }

    Elaboration& e_;
    std::unordered_map<std::string, std::unique_ptr<Block>> made_;
    std::unordered_map<std::string, std::string> settings_;
    std::unordered_map<std::string, bool> used_;
    std::unordered_map<std::string, bool> seen_;
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
