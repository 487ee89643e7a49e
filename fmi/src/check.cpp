#include "bf/fmi/check.hpp"

#include "bf/fmi/clockwork.hpp"
#include "xml.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

namespace bf::fmi {

namespace {

/// May a variable of that causality change so? FMI 2.0.4, table on page 50; FMI 3.0, section 2.4.7.4.
bool can_be(Causality causality, Variability variability) {
    using V = Variability;
    switch (causality) {
    case Causality::parameter:
    case Causality::calculated_parameter:
    case Causality::structural_parameter: return variability == V::fixed || variability == V::tunable;
    case Causality::input: return variability == V::discrete || variability == V::continuous;
    case Causality::output:
        return variability == V::constant || variability == V::discrete || variability == V::continuous;
    case Causality::local: return true;
    case Causality::independent: return variability == V::continuous;
    }
    return false;
}

/// What holds where the description does not say it.
Initial initial_of(const Variable& v) {
    if (v.initial != Initial::none) return v.initial;
    switch (v.causality) {
    case Causality::parameter:
    case Causality::structural_parameter: return Initial::exact;
    case Causality::calculated_parameter: return Initial::calculated;
    case Causality::output:
    case Causality::local:
        return v.variability == Variability::constant ? Initial::exact : Initial::calculated;
    default: return Initial::none;
    }
}

} // namespace

std::vector<std::string> problems_of(const Description& d) {
    std::vector<std::string> problems;
    const bool is_2 = d.version == 2;
    const std::string of_variables = is_2 ? " (FMI 2.0.4, section 2.2.7)" : " (FMI 3.0, section 2.4.7)",
                      of_structure = is_2 ? " (FMI 2.0.4, section 2.2.8)" : " (FMI 3.0, section 2.4.8)";
    const auto add = [&](const Variable& v, const std::string& what, const std::string& section) {
        problems.push_back("'" + v.name + "' " + what + section);
    };
    int independent = 0;
    std::set<int> outputs, unknowns, optional; // the last ones of the unknowns
    for (int number = 0; number < static_cast<int>(d.variables.size()); ++number) {
        const Variable& v = d.variables[static_cast<std::size_t>(number)];
        const bool is_real = v.type == Type::float64 || v.type == Type::float32;
        const bool can_start = has_values(v.type), has_start = !v.start.empty();
        const Initial initial = initial_of(v);
        if (!can_be(v.causality, v.variability))
            add(v,
                std::string("is ") + causality_names[static_cast<int>(v.causality)].first + " and " +
                    variability_names[static_cast<int>(v.variability)] + ", which exclude each other",
                of_variables);
        if (v.variability == Variability::continuous && !is_real)
            add(v, "is continuous, but its type is not", of_variables);
        if (v.type == Type::clock && v.variability != Variability::discrete)
            add(v, "is a clock, but not discrete", of_variables);
        if (!v.clocks.empty() && v.variability != Variability::discrete &&
            v.variability != Variability::tunable)
            add(v, "has a clock, but is neither discrete nor tunable", of_variables);
        if (v.ticks && v.ticks->kind != Ticks::Kind::triggered && v.causality != Causality::input)
            add(v, "ticks at times of its own, but is no input", " (FMI 3.0, section 2.2.9)");
        if (v.ticks && v.ticks->resolution != 0 && v.ticks->interval &&
            std::abs(static_cast<double>(v.ticks->interval_count) / static_cast<double>(v.ticks->resolution) -
                     *v.ticks->interval) > 1e-9 * *v.ticks->interval)
            add(v, "has two intervals: intervalCounter / resolution is not intervalDecimal", of_variables);
        if (v.initial != Initial::none &&
            (v.causality == Causality::input || v.causality == Causality::independent))
            add(v, "has an 'initial', which inputs and the independent variable have not", of_variables);
        const bool needs_start = v.causality == Causality::input || v.causality == Causality::parameter ||
                                 v.causality == Causality::structural_parameter ||
                                 initial == Initial::exact || initial == Initial::approx;
        if (can_start && needs_start && !has_start) add(v, "lacks a start value", of_variables);
        if (has_start && (v.causality == Causality::independent || initial == Initial::calculated))
            add(v, "has a start value, though it is calculated", of_variables);
        for (const double x : v.start)
            if ((v.minimum && x < *v.minimum) || (v.maximum && x > *v.maximum)) {
                add(v, "starts outside of its own limits", of_variables);
                break;
            }
        const auto type = std::find_if(d.enumerations.begin(), d.enumerations.end(),
                                       [&](const auto& its) { return its.name == v.declared_type; });
        if (type != d.enumerations.end())
            for (const double x : v.start)
                if (std::none_of(type->items.begin(), type->items.end(),
                                 [&](const auto& item) { return item.first == x; })) {
                    add(v, "starts at " + number_text(x) + ", which its type '" + type->name + "' has not",
                        of_variables);
                    break;
                }
        independent += v.causality == Causality::independent;
        if (v.causality == Causality::output) outputs.insert(number);
        const bool is_unknown = initial == Initial::calculated || initial == Initial::approx;
        if (is_unknown &&
            (v.causality == Causality::output || v.causality == Causality::calculated_parameter) &&
            v.type != Type::clock)
            (v.clocks.empty() ? unknowns : optional).insert(number);
    }
    if (independent > 1 || (!is_2 && independent != 1))
        problems.push_back("there are " + std::to_string(independent) +
                           " independent variables, but there is one time" + of_variables);
    for (const auto& derivative : d.derivatives) {
        const Variable& v = d.variables[static_cast<std::size_t>(derivative.variable)];
        if (v.derivative_of < 0) {
            add(v, "stands among the derivatives, but names no state", of_structure);
            continue;
        }
        for (const int number : {derivative.variable, v.derivative_of}) {
            const Initial initial = initial_of(d.variables[static_cast<std::size_t>(number)]);
            if (initial == Initial::calculated || initial == Initial::approx) unknowns.insert(number);
        }
    }
    if (d.has_clocks() && d.co_simulation && !d.co_simulation->has_event_mode)
        problems.emplace_back("it has clocks, but no event mode in co-simulation (FMI 3.0, section 4.4)");
    const auto compare = [&](const char* list, const std::vector<Unknown>& given,
                             const std::set<int>& wanted) {
        std::set<int> named;
        for (const auto& u : given)
            if (!named.insert(u.variable).second)
                add(d.variables[static_cast<std::size_t>(u.variable)],
                    std::string("stands twice among the ") + list, of_structure);
        for (const int number : wanted)
            if (!named.contains(number))
                add(d.variables[static_cast<std::size_t>(number)],
                    std::string("is missing among the ") + list, of_structure);
        for (const int number : named)
            if (!wanted.contains(number) && !optional.contains(number))
                add(d.variables[static_cast<std::size_t>(number)],
                    std::string("must not stand among the ") + list, of_structure);
    };
    compare("outputs", d.outputs, outputs);
    compare("initial unknowns", d.initial_unknowns, unknowns);
    return problems;
}

namespace {

constexpr int steps = 20;

/// All values of a description that can be read, as one row of bits.
class Readings {
  public:
    explicit Readings(const Description& d) {
        std::map<Type, std::size_t> groups;
        for (const auto& v : d.variables) {
            if (!has_values(v.type) || v.causality == Causality::independent || !v.clocks.empty()) continue;
            const Type type = d.version == 2 && v.type == Type::float32 ? Type::float64 : v.type;
            const auto [at, is_new] = groups.emplace(type, values_.size());
            if (is_new) {
                values_.emplace_back(d.version, type);
                names_.emplace_back();
            }
            values_[at->second].add(v);
            for (int i = 0; i < v.count(); ++i) names_[at->second].push_back(v.name);
        }
    }
    bool read(Instance& instance) {
        return std::all_of(values_.begin(), values_.end(), [&](Values& v) { return instance.get(v); });
    }
    std::vector<double> row() const {
        std::vector<double> all;
        for (const auto& v : values_)
            for (std::size_t i = 0; i < v.size(); ++i) all.push_back(v[i]);
        return all;
    }
    const std::string& name(std::size_t i) const {
        std::size_t group = 0;
        while (i >= names_[group].size()) i -= names_[group++].size();
        return names_[group][i];
    }

  private:
    std::vector<Values> values_;
    std::vector<std::vector<std::string>> names_; ///< of elements
};

using Rows = std::vector<std::vector<double>>;

/// Start values of what the importer may set.
std::vector<Values> starts(const Description& d) {
    std::vector<Values> all;
    for (const auto& v : d.variables) {
        const bool is_set = v.causality == Causality::input || v.causality == Causality::parameter;
        if (!is_set || !has_values(v.type) || v.start.empty() || !v.clocks.empty()) continue;
        Values& values =
            all.emplace_back(d.version, d.version == 2 && v.type == Type::float32 ? Type::float64 : v.type);
        values.add(v);
        for (std::size_t i = 0; i < v.start.size(); ++i) values.set(i, v.start[i]);
    }
    return all;
}

/// An instance that is driven through time.
class Driven {
  public:
    Driven(const Library& library, const char* name, char* function)
        : instance(library, name, {}, function), x_(static_cast<std::size_t>(instance.state_count())),
          rates_(x_.size()), before_(static_cast<std::size_t>(instance.indicator_count())),
          after_(before_.size()), clockwork_(library.description(), library.archive().string()),
          steps_(library.kind() == Kind::co_simulation) {}

    bool begin(const Description& d) {
        for (const auto& values : starts(d))
            if (!instance.set(values)) return false;
        ticked = -std::numeric_limits<double>::infinity();
        return instance.enter_initialization(d.start) && clockwork_.begin(instance, d.start) &&
               instance.exit_initialization() && (instance.state() != event_mode || end_event(d.start));
    }
    bool advance(double time, double step) {
        const bool steps = instance.state() == step_mode;
        const double end = time + step;
        while (time < end) {
            double next = end;
            for (const double one : {steps ? end : event.next, clockwork_.next(ticked)})
                if (one > time && one < next) next = one;
            if (!(steps ? instance.do_step(time, next - time) : exchange(next, next - time))) return false;
            time = next;
            if (clockwork_.next(ticked) <= time + 1e-9 && !(instance.enter_event_mode() && end_event(time)))
                return false;
        }
        return true;
    }
    struct Moment {
        Event event; ///< the last one
        double ticked = 0;
    };
    Moment moment() const { return {event, ticked}; }
    bool restore(const std::vector<std::uint8_t>& bytes, State mode, const Moment& moment) {
        event = moment.event, ticked = moment.ticked;
        return instance.restore(bytes, mode);
    }

    LocalInstance instance;
    Event event;       ///< the last one
    double ticked = 0; ///< s, when clocks did last

  private:
    bool end_event(double time) {
        const bool is_tick = clockwork_.next(ticked) <= time + 1e-9;
        if ((is_tick && !clockwork_.tick(instance, ticked, time)) || !instance.handle_event(event))
            return false;
        if (is_tick) ticked = time;
        return steps_ ? instance.enter_step_mode() : instance.enter_continuous_time();
    }
    /// One of Euler's steps, which changes no state by much, as it may be too long for the model.
    bool exchange(double end, double step) {
        if (!instance.get_states(x_.data()) || !instance.get_derivatives(rates_.data()) ||
            !instance.get_indicators(before_.data()))
            return false;
        for (std::size_t i = 0; i < x_.size(); ++i) {
            const double most = 0.1 * (1 + std::abs(x_[i]));
            x_[i] += std::clamp(step * rates_[i], -most, most);
        }
        bool is_event = false;
        if (!instance.set_time(end) || !instance.set_states(x_.data()) || !instance.complete_step(is_event) ||
            !instance.get_indicators(after_.data()))
            return false;
        for (std::size_t i = 0; i < after_.size(); ++i) is_event |= (before_[i] > 0) != (after_[i] > 0);
        is_event |= end >= event.next;
        return !is_event || (instance.enter_event_mode() && end_event(end));
    }

    std::vector<double> x_, rates_, before_, after_;
    Clockwork clockwork_;
    bool steps_;
};

} // namespace

std::vector<std::string> problems_of_run(const Library& library, double step,
                                         const std::function<void(const std::string&)>& doing,
                                         char* function) {
    const Description& d = library.description();
    std::vector<std::string> problems;
    Readings readings(d);
    const std::string of_arithmetic = " (rounding, or subnormal numbers flushed to zero), as no function may";
    const auto failed = [&](const Driven& driven) {
        problems.emplace_back(driven.instance.failure());
        return false;
    };
    const auto begin = [&](Driven& driven) { return driven.begin(d) || failed(driven); };
    const auto go_on = [&](Driven& driven, int from, int to, Rows& rows) {
        for (int k = from; k < to; ++k) {
            if (!readings.read(driven.instance)) return failed(driven);
            rows.push_back(readings.row());
            if (!driven.advance(d.start + k * step, step)) return failed(driven);
        }
        return true;
    };
    const auto compare = [&](const Rows& a, const Rows& b, const std::string& what) {
        for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k)
            for (std::size_t i = 0; i < a[k].size(); ++i)
                if (std::memcmp(&a[k][i], &b[k][i], sizeof(double)) != 0) {
                    problems.push_back("'" + readings.name(i) + "' " + what);
                    return;
                }
    };
    try {
        if (library.changes_arithmetic())
            problems.push_back("its library changes the arithmetic of the process when it is opened" +
                               of_arithmetic);
        doing("its steps");
        Driven one(library, "one", function);
        Rows first, again, other, restored;
        if (!begin(one) || !go_on(one, 0, steps, first)) return problems;
        const bool saves = library.interface()->has_state && library.interface()->can_serialize;
        std::vector<std::uint8_t> bytes;
        if (saves) {
            doing("its saved states");
            const State mode = one.instance.state();
            if (!one.instance.save(bytes)) return failed(one), problems;
            const auto moment = one.moment();
            if (!go_on(one, steps, 2 * steps, first)) return problems;
            Driven fresh(library, "fresh", function);
            for (Driven* its : {&one, &fresh}) {
                if (its == &fresh && !begin(fresh)) return problems;
                restored.clear();
                if (!its->restore(bytes, mode, moment)) return failed(*its), problems;
                if (!go_on(*its, steps, 2 * steps, restored)) return problems;
                compare({first.begin() + steps, first.end()}, restored,
                        its == &one ? "differs after the state was gone back to"
                                    : "differs after the state was gone back to in another instance");
            }
        }
        if (!library.interface()->only_once) {
            doing("two instances");
            Driven two(library, "two", function), three(library, "three", function);
            if (!begin(two) || !begin(three)) return problems;
            for (int k = 0; k < steps; ++k)
                if (!go_on(two, k, k + 1, again) || !go_on(three, k, k + 1, other)) return problems;
            compare(first, again, "differs in a second instance");
            compare(first, other, "differs where two instances step by turns");
        }
        doing("its end and its new begin");
        if (!one.instance.terminate() || !one.instance.reset()) return failed(one), problems;
        again.clear();
        if (!begin(one) || !go_on(one, 0, steps, again)) return problems;
        compare(first, again, "differs after it was begun anew");
        doing("the instances' end");
        if (const char* const changer = one.instance.changed_arithmetic())
            problems.push_back(std::string(changer) + " leaves the arithmetic of the process changed" +
                               of_arithmetic);
    } catch (const FmuError& error) {
        problems.emplace_back(error.what());
    }
    return problems;
}

} // namespace bf::fmi
