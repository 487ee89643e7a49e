// Models as FMUs.
#include "bf/codegen/fmu.hpp"

#include "generator.hpp"
#include <set>
#include <unordered_set>

namespace bf::codegen {

namespace {

/// The inputs of the root, the continuous states and "time", on which signals depend in the same step:
/// through what a block reads for its outputs, or by which it finds and answers crossings, as states then
/// jump in the step, through what decides whether and how often it runs, and through the objects that it
/// shares with others.
class Dependencies {
  public:
    explicit Dependencies(const Diagram& diagram) : diagram_(diagram) {
        for (const auto& input : diagram.inputs) inputs_[{input.end.node, input.end.slot}] = input.path;
    }

    std::vector<std::string> of(const Node::End& end) {
        found_.clear();
        seen_.clear();
        follow(end);
        return {found_.begin(), found_.end()};
    }

  private:
    void follow(const Node::End& end) {
        if (end.node < 0 || !seen_.insert({end.node, end.slot}).second) return;
        if (const auto input = inputs_.find({end.node, end.slot}); input != inputs_.end()) {
            found_.insert(input->second);
            return;
        }
        const auto& node = diagram_.nodes[static_cast<std::size_t>(end.node)];
        note_own(node, end);
        for (std::size_t s = 0; s < node.sources.size(); ++s)
            if (node.block->resolution().slots[s].role == Role::input &&
                (node.block->feedthrough(end.slot, static_cast<int>(s)) ||
                 decides_events(node, static_cast<int>(s))))
                follow(node.sources[s].node >= 0 ? node.sources[s]
                                                 : Node::End{end.node, static_cast<int>(s)});
        for (int c = node.condition; c >= 0; c = diagram_.conditions[static_cast<std::size_t>(c)].parent) {
            const auto& condition = diagram_.conditions[static_cast<std::size_t>(c)];
            for (const auto& by : {condition.enable, condition.trigger, condition.reset}) follow(by);
        }
        for (int l = node.loop; l >= 0; l = diagram_.plan.loops[static_cast<std::size_t>(l)].parent) {
            const auto& loop = diagram_.plan.loops[static_cast<std::size_t>(l)];
            for (const auto& by : {loop.count, loop.initial, loop.again}) follow(by);
        }
        for (const auto& provider : node.providers) follow_all(provider.node);
    }
    /// Continuous states and the time, by the rules of a block; all of them where it computes as a class.
    void note_own(const DiagramNode& node, const Node::End& end) {
        const Declaration& d = node.block->declaration();
        if (d.traits.is_root_input) return;
        const auto& slots = node.block->resolution().slots;
        const auto reads = [&](auto&& is_read) {
            return node.methods.output || std::any_of(d.output_rules.begin(), d.output_rules.end(), is_read);
        };
        for (std::size_t s = 0; s < slots.size(); ++s)
            if (slots[s].role == Role::continuous_state && slots[s].size.count() > 0 &&
                reads([&](const Call& rule) { return rule.reads(static_cast<int>(s)); }))
                found_.insert(diagram_.end_path({end.node, static_cast<int>(s)}));
        if (reads([](const Call& rule) {
                return std::any_of(rule.operands.begin(), rule.operands.end(),
                                   [](const auto& operand) { return operand.source == Call::Source::time; });
            }))
            found_.insert("time");
    }
    /// Does the block read the input where it looks for crossings that it answers, or answers them?
    static bool decides_events(const DiagramNode& node, int input) {
        const Declaration& d = node.block->declaration();
        if (!node.block->answers(node.methods)) return false;
        if (node.methods.guards || node.methods.event) return true;
        const auto is_answered = [&](const Call& rule) {
            for (std::size_t s = 0; s < d.slots.size(); ++s)
                if (d.slots[s].role == Role::guard && d.slots[s].type == Type::float64 &&
                    rule.writes(static_cast<int>(s)))
                    return true;
            return false;
        };
        const auto reads = [&](const Call& rule) { return rule.reads(input); };
        return std::any_of(d.event_rules.begin(), d.event_rules.end(), reads) ||
               std::any_of(d.guard_rules.begin(), d.guard_rules.end(),
                           [&](const Call& rule) { return is_answered(rule) && reads(rule); });
    }
    /// All that a provider reads.
    void follow_all(int n) {
        const auto& node = diagram_.nodes[static_cast<std::size_t>(n)];
        for (const auto& source : node.sources) follow(source);
        for (const auto& provider : node.providers)
            if (seen_.insert({provider.node, -1}).second) follow_all(provider.node);
    }

    const Diagram& diagram_;
    std::map<std::pair<int, int>, std::string> inputs_;
    std::set<std::string> found_;
    std::set<std::pair<int, int>> seen_;
};

/// Is the parameter one that no rule reads, but a state takes its initial value from, at the start alone?
bool is_initial(const DiagramNode& node, int parameter) {
    if (node.condition > 0 || node.loop >= 0) return false; // which may begin anew
    const Declaration& d = node.block->declaration();
    for (const Phase phase : phases)
        for (const Call& rule : d.rules(phase))
            if (rule.reads(parameter)) return false;
    return std::any_of(d.slots.begin(), d.slots.end(),
                       [&](const SlotDeclaration& slot) { return slot.initial_from == parameter; });
}

/// What an input has until it is written: 0, as all inputs of the generated class, unless that is no value of
/// its enumeration.
double first_value(const FmuVariable& input) {
    const auto is_0 = [](const auto& item) { return item.first == 0; };
    return input.names.empty() || std::any_of(input.names.begin(), input.names.end(), is_0)
               ? 0
               : input.names.front().first;
}

/// Of the row of a variable, what only few have.
std::string rest_of_row(const FmuVariable& variable) {
    if (variable.names.empty() && variable.clocks.empty()) return {};
    std::uint64_t bits = 0;
    for (const int clock : variable.clocks) bits |= std::uint64_t{1} << static_cast<unsigned>(clock);
    const int start = variable.role == FmuVariable::Role::input ? static_cast<int>(first_value(variable)) : 0;
    return std::string(variable.names.empty() ? ", false, " : ", true, ") + std::to_string(bits) + "u, " +
           std::to_string(start);
}

std::vector<double> elements_of(const std::vector<double>& initial, std::size_t count) {
    if (initial.size() == count) return initial;
    return std::vector<double>(count, initial.empty() ? 0.0 : initial.front());
}

} // namespace

/// Whatever has conditions, slower rates, triggers or events remembers something from one evaluation to the
/// next.
bool Generator::are_signals_repeatable() const {
    using Kind = program::Statement::Kind;
    const auto are_all = [](const program::Statements& list, std::initializer_list<Kind> kinds) {
        return std::all_of(list.begin(), list.end(), [&](const program::Statement& s) {
            return std::find(kinds.begin(), kinds.end(), s.kind) != kinds.end();
        });
    };
    return control_quantities().empty() && are_all(program_.outputs, {Kind::run}) &&
           are_all(program_.step, {Kind::hit, Kind::evaluate});
}

FmuPart Generator::fmu(const FmuChoice& choice, const std::map<std::string, std::string>& folders) {
    FmuPart part;
    FmuCode& code = part.code;
    folders_ = folders;
    for (auto& [name, text] : run())
        if (!name.starts_with("include/") && name != "main.cpp" && !name.starts_with(file_ + "_c.") &&
            (name.ends_with(".hpp") || name.ends_with(".cpp")))
            code.files[name] = text;
    code.is_hosted = has_hosted();
    code.uses_standard_blocks = uses_standard_library();
    code.plugins = plugins();
    code.options = {code.is_hosted ? "-std=c++20" : "-std=c++17", "-O3", "-DNDEBUG", "-ffp-contract=off",
                    "-fno-semantic-interposition"};
    if (!has_matrices_) code.options.push_back("-fno-tree-slp-vectorize");
    code.identifier = file_;

    std::vector<int> clocked; // rates
    if (choice.has_clocks) {
        clocked = clocked_rates();
        for (const int rate : clocked) {
            code.clocks.push_back(clock_of(diagram_.rates[static_cast<std::size_t>(rate)]));
            code.clocks.back().name = "clock_" + rate_name(rate);
        }
        const auto is_of_all = [](const FmuClock& clock) { return clock.ticks == 1 && clock.offset == 0; };
        if (has_unclocked_steps() && std::none_of(code.clocks.begin(), code.clocks.end(), is_of_all)) {
            code.clocks.push_back(clock_of({}));
            code.clocks.back().name = "clock_of_all_steps";
        }
        if (code.clocks.empty() || code.clocks.size() > 64)
            throw GenerationError(
                "no FMU with clocks can be made of '" + diagram_.name + "': it has " +
                std::to_string(code.clocks.size()) +
                " rates of sampled blocks, but must have 1 to 64; export it without clocks");
    }
    std::vector<std::string> places; // of numbers that have derivatives
    std::unordered_set<std::string> names{"time"};
    Dependencies dependencies(diagram_);
    const auto add = [&](FmuVariable variable, const char* table, int row, const std::string& place = {}) {
        if (std::count(choice.structural.begin(), choice.structural.end(), variable.name)) return;
        const bool is_new = names.insert(variable.name).second;
        if (!is_new && variable.role == FmuVariable::Role::signal) return; // an output of that name is it
        if (!is_new)
            throw GenerationError(
                "no FMU can be made of '" + diagram_.name + "': '" + variable.name +
                "' names two of its ports, parameters or variables, or is the time; rename one");
        part.rows.push_back(std::string("    {") + table + ", " + number(row) + ", " +
                            (variable.role == FmuVariable::Role::calculated ? "FmuSetting::none"
                             : variable.role == FmuVariable::Role::fixed    ? "FmuSetting::before"
                                                                            : "FmuSetting::always") +
                            rest_of_row(variable) + "},\n");
        places.push_back(variable.type == Type::float64 ? place : std::string());
        code.variables.push_back(std::move(variable));
    };
    const auto of_slot = [&](FmuVariable::Role role, const std::string& path, const Node::End& end) {
        const Slot& slot = diagram_.slot(end);
        FmuVariable variable{role,           path,           unit_text(slot), slot.doc, type_of(slot),
                             slot.size.rows, slot.size.cols, slot.limits,     {},       {}};
        for (const auto& enumerated : diagram_.enumerated) // others, as of states, are numbers there
            if (enumerated.end.node == end.node && enumerated.end.slot == end.slot &&
                variable.type == Type::int32)
                variable.names = enumerated.names;
        if (role == FmuVariable::Role::input || role == FmuVariable::Role::output ||
            role == FmuVariable::Role::signal)
            for (const int rate : rates_of(end))
                if (const auto at = std::find(clocked.begin(), clocked.end(), rate); at != clocked.end())
                    variable.clocks.push_back(static_cast<int>(at - clocked.begin()));
        if (role != FmuVariable::Role::output && role != FmuVariable::Role::signal)
            variable.start = elements_of(slot.initial, static_cast<std::size_t>(slot.size.count()));
        return variable;
    };
    int row = 0;
    for (const auto& input : inputs_) {
        auto variable = of_slot(FmuVariable::Role::input, input.path, input.end);
        variable.unit = input.unit, variable.doc = input.doc;
        std::fill(variable.start.begin(), variable.start.end(), first_value(variable));
        add(std::move(variable), "bf_run_inputs", row++, "inputs." + input.member);
    }
    row = 0;
    for (const auto& output : outputs_) {
        auto variable = of_slot(FmuVariable::Role::output, output.path, output.end);
        variable.unit = output.unit, variable.doc = output.doc;
        variable.dependencies = dependencies.of(output.end);
        add(std::move(variable), "bf_run_outputs", row++, "outputs." + output.member);
    }
    const auto role_of = [&](const std::string& name) {
        return formula_of(name) < 0 ? FmuVariable::Role::parameter : FmuVariable::Role::calculated;
    };
    row = 0;
    for (const auto& field : formulas_.variables) {
        const auto& v = definition(field.definition);
        FmuVariable variable{role_of(v.path),
                             v.path,
                             v.unit,
                             v.about(),
                             Type::float64,
                             static_cast<int>(v.value.rows()),
                             static_cast<int>(v.value.cols()),
                             v.limits,
                             {},
                             {}};
        for (matlab::Index i = 0; i < v.value.numel(); ++i) variable.start.push_back(v.value[i]);
        add(std::move(variable), "bf_run_variables", row++);
    }
    row = 0;
    for (const auto& field : parameters_) {
        auto variable = of_slot(role_of(field.path), field.path, field.end);
        if (variable.role == FmuVariable::Role::parameter && is_initial(node(field.end.node), field.end.slot))
            variable.role = FmuVariable::Role::fixed;
        add(std::move(variable), "bf_run_parameters", row++);
    }
    row = 0;
    for (const auto& signal : recorded_rows())
        add(of_slot(FmuVariable::Role::signal, signal.path, signal.end), "bf_run_signals", row++,
            place_of(signal.end).text());

    row = 0;
    std::vector<std::pair<FmuVariable, std::string>> rates;
    for (const auto& field : continuous_) {
        auto state = of_slot(FmuVariable::Role::state, field.path, field.end);
        state.rows *= state.cols; // elements in the order of the solver
        state.cols = 1;
        state.start.clear();
        FmuVariable rate = state;
        rate.role = FmuVariable::Role::rate;
        rate.name = "der(" + state.name + ")";
        rate.unit.clear();
        rate.doc = "derivative of " + state.name;
        add(std::move(state), "bf::generated::fmu_states", row++, "continuous." + field.member);
        rates.emplace_back(std::move(rate), "rates_." + field.member);
    }
    row = 0;
    for (auto& [rate, place] : rates) add(std::move(rate), "bf::generated::fmu_rates", row++, place);
    if (guard_count() + mark_count() > 0)
        add({FmuVariable::Role::crossings,
             "event_indicators",
             "",
             "zero-crossing functions",
             Type::float64,
             guard_count() + mark_count(),
             1,
             {},
             {},
             {}},
            "bf::generated::fmu_crossings", 0);

    for (const auto& clock : code.clocks) {
        if (!names.insert(clock.name).second)
            throw GenerationError("no FMU with clocks can be made of '" + diagram_.name + "': '" +
                                  clock.name +
                                  "' is the name of a clock, and of another quantity; rename that");
        part.clocks += "    {" + literal(clock.name);
        for (const auto number :
             {static_cast<std::uint64_t>(clock.ticks), static_cast<std::uint64_t>(clock.offset),
              clock.resolution, clock.interval, clock.shift})
            part.clocks += ", " + std::to_string(number);
        part.clocks += "},\n";
    }
    const std::string derivatives = derivatives_source(places);
    code.has_derivatives = !derivatives.empty();
    if (code.has_derivatives) code.files[file_ + "_derivatives.cpp"] = derivatives;

    part.declarations = "#include \"" + file_ + ".hpp\"\nconst bf_run_library* " + file_ + "_library();\n" +
                        (code.has_derivatives ? "namespace bf::generated {\nextern const FmuDerivatives " +
                                                    file_ + "_derivatives;\n}\n"
                                              : "");
    part.library = file_ + "_library";
    part.functions = "&bf::generated::ExchangeOf<" + class_ + ">::functions, " +
                     (code.is_hosted ? "&bf::generated::HostOf<" + class_ + ">::functions" : "nullptr");
    part.derivatives = file_ + "_derivatives";
    part.is_repeatable = are_signals_repeatable();
    return part;
}

} // namespace bf::codegen
