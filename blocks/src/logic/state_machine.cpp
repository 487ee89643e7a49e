// State machines and state charts.
#include "bf/base/numbers.hpp"
#include "bf/charts/table.hpp"
#include "bf/kernels/chart.hpp"
#include "bf/kernels/sources.hpp"

#include "../groups.hpp"
#include "../shapes.hpp"

#include <algorithm>
#include <cmath>

namespace bf::blocks {

namespace {

/// States and transitions between them: rows of numbers, or a chart with states in states.
class StateMachine final : public Block {
  public:
    explicit StateMachine(const Arguments& arguments) : Block(arguments) {
        if (is_flat)
            declare_rules(initial);
        else
            declare_rules(p);
    }

    Argument<std::vector<std::string>> states{
        this, "states", {.initial = {"idle"}, .doc = "names of the states, numbered from 1"}};
    Argument<Matrix> transitions{
        this,
        "transitions",
        {.initial = Matrix(0, 4),
         .doc = "rows [from to condition minimum_time], conditions from 1, 0: none"}};
    Argument<std::string> chart{
        this, "chart", {.initial = "", .doc = "in place of both: states in states, with actions"}};
    const bool is_flat = chart->empty();
    const charts::Chart document = read();
    const charts::Table table = lower();
    const int region_count = std::max(1, static_cast<int>(table.regions.size()));
    const int variable_count = static_cast<int>(document.variables.size());
    Dim regions = named("regions", table.regions, region_count > 1);
    Dim all_states = named("states", table.states, !is_flat);
    Dim all_variables = named("variables", variable_names(), variable_count > 0);

    Parameter<double> initial{this,
                              "initial",
                              {.initial = {1},
                               .minimum = 1,
                               .maximum = static_cast<double>(table.states.size()),
                               .doc = "number of the first state",
                               .present = is_flat,
                               .value_names = table.states}};
    Parameter<Array<double>> p{this,
                               "p",
                               {.initial = {0},
                                .unit = mixed_units,
                                .doc = "what the chart's `parameters` name",
                                .present = !is_flat}};
    InputList<> conditions{this,
                           input_names(),
                           {.unit = is_flat ? unit<"1"> : any_unit,
                            .doc = is_flat ? "one truth value per condition" : "read by the chart",
                            .optional = is_flat || table.ports.empty()}};
    Output<Array<double>> state{
        this,
        "state",
        {.shape = by_region(), .doc = "number of the active state", .value_names = table.states}};
    Output<Array<double>> time_in_state{
        this,
        "time_in_state",
        {.shape = by_region(), .unit = unit<"s">, .doc = "since the first step of the state"}};
    Output<Array<bool>> entered{
        this, "entered", {.shape = by_region(), .doc = "true in the first step of a state"}};
    Output<Array<bool>> active{this,
                               "active",
                               {.shape = {all_states},
                                .doc = "which states are active, with those around them",
                                .present = !is_flat}};
    Output<Array<double>> variables{this,
                                    "variables",
                                    {.shape = {all_variables},
                                     .unit = mixed_units,
                                     .doc = "of the chart",
                                     .present = variable_count > 0}};
    OutputList<double> outputs{this, port_names(false), {.unit = any_unit, .doc = "variable of the chart"}};
    OutputList<bool> state_outputs{this, port_names(true), {.doc = "true while the state is active"}};
    DiscreteState<Array<double>> x{
        this,
        "x",
        {.shape = is_flat ? scalar : Shape(Extent(std::max(table.compounds, 1))),
         .doc = is_flat ? "number of the state" : "active state of each group, 0: none",
         .value_names = table.states}};
    DiscreteState<Array<double>> memory{
        this,
        is_flat ? "entry" : "memory",
        {.shape = is_flat ? scalar : Shape(Extent(std::max(table.memory, 1))),
         .unit = is_flat ? unit<"s"> : mixed_units,
         .doc = is_flat ? "time at which the state began"
                        : "times of entry, histories, variables, timers, events"}};
    DiscreteState<bool> started{this, "started", {.doc = "false before the first step"}};

    void infer(Inference& inference) const override {
        for (std::size_t i = 0; i < table.reads.size(); ++i) {
            const auto& key = conditions[static_cast<int>(i)];
            const auto& reads = table.reads[i];
            const Size* s = inference.size(key);
            if (!s || s->count() >= reads.element) {
                if (s && !is_flat && reads.whole && s->count() != 1)
                    inference.refuse(label(resolution(), key.index()) +
                                     " must be a number, as the chart reads it; its elements are " +
                                     table.ports[i] + "(1), ...");
                continue;
            }
            if (is_flat)
                inference.refuse(label(resolution(), key.index()) + " is too short: 'transitions', row " +
                                 std::to_string(highest_row()) + ", names condition " +
                                 std::to_string(reads.element));
            inference.refuse(label(resolution(), key.index()) + " has no element " +
                             std::to_string(reads.element) + ", which the chart reads");
        }
        const Size* s = is_flat ? nullptr : inference.size(p);
        if (s && s->count() < static_cast<int>(document.parameters.size()))
            inference.refuse("parameter 'p' has " + std::to_string(s->count()) +
                             " elements, but the chart names " + std::to_string(document.parameters.size()) +
                             " parameters");
    }

  private:
    template <class P> void declare_rules(const P& parameter) {
        const Constants numbers(table.numbers);
        if (variable_count > 0)
            OutputRule(this, kernels::Chart{}, state, time_in_state, entered, variables, numbers, parameter,
                       x, memory, started, at_time, at_period, conditions);
        else
            OutputRule(this, kernels::StateMachine{}, state, time_in_state, entered, numbers, parameter, x,
                       memory, started, at_time, at_period, conditions);
        if (active.is_present()) OutputRule(this, kernels::ActiveStates{}, active, numbers, state);
        int values = 0, truths = 0;
        for (const auto& output : table.outputs) {
            const Constants place({static_cast<double>(output.place)});
            if (output.is_state)
                OutputRule(this, kernels::ElementOf{}, state_outputs[truths++], active, place);
            else
                OutputRule(this, kernels::ElementOf{}, outputs[values++], variables, place);
        }
        UpdateRule(this, kernels::ChartUpdate{}, next(x), next(memory), next(started), numbers, parameter, x,
                   memory, started, at_time, at_period, conditions);
    }
    Dim named(const char* name, std::vector<std::string> names, bool has_names) {
        if (!has_names) return Dim(this, name, [] { return 1; });
        return Dim(this, name, [names = std::move(names)]() -> Dim::Names { return names; });
    }
    Shape by_region() const { return region_count > 1 ? Shape(regions) : scalar; }
    std::vector<std::string> variable_names() const {
        std::vector<std::string> names;
        for (const auto& variable : document.variables) names.push_back(variable.first);
        return names;
    }
    std::vector<std::string> port_names(bool are_states) const {
        std::vector<std::string> names;
        for (const auto& output : table.outputs)
            if (output.is_state == are_states) names.push_back(output.port);
        return names;
    }
    std::vector<std::string> input_names() const {
        return table.ports.empty() ? std::vector<std::string>{"conditions"} : table.ports;
    }

    charts::Chart read() {
        if (is_flat) return {};
        if (transitions->rows() != 0 || states->size() != 1 || states->front() != "idle")
            problem("there are a 'chart' and 'states' or 'transitions'; the chart has its own, remove these");
        try {
            return charts::read(*chart, path_of(""));
        } catch (const charts::Refused& refused) {
            for (const auto& text : refused.problems()) problem("argument 'chart': " + text);
            return {};
        }
    }
    charts::Table lower() {
        const bool was_read = !document.root.states.empty() || declaration().problems.empty();
        try {
            if (is_flat)
                return charts::lower_flat(*states,
                                          are_right() ? numbers_of(*transitions) : std::vector<double>());
            if (was_read) return charts::lower(document);
        } catch (const charts::Refused& refused) {
            for (const auto& text : refused.problems())
                problem(std::string("argument '") + (is_flat ? "states" : "chart") + "': " + text);
        }
        charts::Table wrong = charts::lower_flat({"idle"}, {}); // with the ports that the wiring expects
        wrong.ports = document.inputs;
        for (const auto& event : document.events) wrong.ports.push_back(charts::port_name(event));
        wrong.reads.assign(wrong.ports.size(), {});
        for (const auto& output : document.outputs)
            wrong.outputs.push_back({charts::port_name(output), document.variables.empty(), 0});
        return wrong;
    }
    static std::vector<double> numbers_of(const Matrix& m) { return {m.data(), m.data() + m.size()}; }

    int highest_row() const {
        Eigen::Index row = 0;
        transitions->col(2).maxCoeff(&row);
        return static_cast<int>(row) + 1;
    }
    bool are_right() {
        if (transitions->size() == 0) return true;
        const std::size_t before = declaration().problems.size();
        if (transitions->cols() != 4) {
            problem("argument 'transitions' has " + std::to_string(transitions->cols()) +
                    " columns, but needs 4: from, to, condition, minimum_time");
            return false;
        }
        const double count = static_cast<double>(states->size());
        for (Eigen::Index i = 0; i < transitions->rows(); ++i) {
            const auto row = transitions->row(i);
            const auto is_state = [&](double s) { return s >= 1 && s <= count && s == std::floor(s); };
            const auto refuse = [&](const char* entry, double given, const std::string& rule) {
                problem("argument 'transitions', row " + std::to_string(i + 1) + ": " + entry + " is " +
                        number_text(given) + ", but " + rule);
            };
            const std::string numbers = "states are numbered 1 to " + std::to_string(states->size());
            if (!is_state(row(0))) refuse("from", row(0), numbers);
            if (!is_state(row(1))) refuse("to", row(1), numbers);
            if (!(row(2) >= 0) || row(2) != std::floor(row(2)))
                refuse("condition", row(2), "conditions are numbered from 1, 0: none");
            if (!(row(3) >= 0)) refuse("minimum_time", row(3), "it must not be negative");
        }
        return declaration().problems.size() == before;
    }
};

} // namespace

void add_state_machine(Library& library) {
    library.group("logic").add<StateMachine>(
        "StateMachine",
        "States with timed transitions. In each step the first row [from to condition minimum_time] of "
        "`transitions` that leaves the present state, whose condition is true and whose minimum time in the "
        "state has passed is taken, at most one per step; the outputs show the new state at once. Refuses "
        "states and conditions that do not exist. With `chart` the states have states inside, regions, "
        "histories, junctions, actions and events, in YAML or in a file of SCXML: see "
        "docs/how-to/state_charts.md.");
}

} // namespace bf::blocks
