// A generated model as an instance of an FMU, for either version of the standard.
#pragma once

#include "bf/codegen/fmu_clocks.hpp"
#include "bf/codegen/fmu_model.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace bf::generated {

/// One instance: a model, the time that it has reached, and how it is called. It holds the values that the
/// importer wrote until the step under way needs them.
///
/// A step of the model begins with the signals at its time, from the inputs there, and ends with the next
/// states. The importer may read outputs before it writes the inputs of the same instant; signals that were
/// computed too early are computed again from a copy of the model.
class FmuInstance : public FmuModel {
  public:
    using Variable = FmuVariables::Variable;

    FmuInstance(const FmuModels& models, const char* name, fmi::CallOrder order_of_calls, Log log_message,
                std::string resources)
        : FmuModel(models, name, order_of_calls, log_message, std::move(resources)),
          clocks(*models.first, moment_) {}

    /// Makes the model; false, with a message, where it cannot.
    bool open() {
        is_computed_ = is_stale_ = false;
        new_values_.clear();
        later_values_.clear();
        later_inputs_.clear();
        written_.assign(std::size_t(tables().variable_count) + 1, false);
        return FmuModel::open();
    }
    bool reset() { return become(structure.first()); }

    // ---- structural parameters

    /// The model of those values takes the place of the present one; what the importer wrote before, in
    /// variables of the same size, stays.
    bool exit_configuration() {
        Problem why;
        const FmuTables* const chosen = structure.chosen(why);
        if (!chosen) return fail(why.text);
        if (chosen == &tables()) return true;
        std::vector<std::pair<std::uint32_t, std::vector<double>>> kept;
        for (std::uint32_t number = 0; number < written_.size(); ++number)
            if (written_[number]) {
                const Variable& v = *variables.variable(number);
                kept.emplace_back(number, std::vector<double>(std::size_t(v.count)));
                for (int i = 0; i < v.count; ++i)
                    kept.back().second[std::size_t(i)] = read(v.data, v.type, FmuVariables::place(v, i));
            }
        if (!become(*chosen)) return false;
        for (const auto& [number, values] : kept) {
            const Variable& v = *variables.variable(number);
            for (int i = 0; std::size_t(v.count) == values.size() && i < v.count; ++i)
                write(v, i, values[std::size_t(i)]);
        }
        return finish_writing();
    }

    // ---- variables

    /// Makes the variable's memory hold its value of now; false when the model fails.
    bool refresh(const Variable& v) {
        if (variables.is_time(v)) return true;
        // Solvers look beyond a tick.
        if (order.state() != fmi::continuous_time && !have_clocks_ticked()) return false;
        if (v.table == fmu_rates) return initialize() && compute_rates();
        if (v.table == fmu_states) return initialize();
        if (v.table == fmu_crossings) return initialize() && compute_crossings(variables.crossings());
        return (v.table != bf_run_signals && v.table != bf_run_outputs) || compute();
    }

    /// Element i, row by row, becomes x when the variable's values are complete.
    void write(const Variable& v, int i, double x) {
        if (structure.have_some()) written_[variables.number(v)] = true;
        if (v.table == bf_run_inputs) {
            const int at = FmuVariables::place(v, i);
            if ((is_computed_ || moment_.is_committed) && same(read(v.data, v.type, at), x)) return;
            is_stale_ = true;
            if (begin_anew())
                generated::write(v.data, v.type, at, x);
            else
                later_inputs_.push_back({&v, at, x});
        } else {
            if (new_values_.empty() || new_values_.back().variable != &v) {
                new_values_.push_back({&v, std::vector<double>(std::size_t(v.count))});
                for (int e = 0; e < v.count; ++e)
                    new_values_.back().values[std::size_t(e)] = read(v.data, v.type, e);
            }
            new_values_.back().values[std::size_t(FmuVariables::place(v, i))] = x;
        }
    }

    /// Parameters take the values that were written, all or none; false, with a message, for values that they
    /// refuse.
    bool finish_writing() {
        if (new_values_.empty()) return true;
        if (!begin_anew()) {
            for (auto& its : new_values_) later_values_.push_back(std::move(its));
            new_values_.clear();
            return true;
        }
        std::vector<bf_run_value> changes;
        for (const auto& its : new_values_)
            changes.push_back({its.variable->name, its.values.data(), its.variable->count});
        const char* const wrong = library_->set_parameters(model_, changes.data(), int(changes.size()));
        new_values_.clear();
        is_stale_ = true;
        if (wrong) message(Level::error, "logStatusError", "%s", wrong);
        // Initial states follow from parameters as long as the run has not begun.
        if (order.state() == fmi::initialization || order.state() == fmi::instantiated)
            moment_.is_initialized = false;
        return !wrong;
    }

    // ---- time

    /// `stop` is infinite where none is given.
    bool set_up(double start, double stop) noexcept {
        if (!std::isfinite(start) || !(stop >= start)) {
            message(Level::error, "logStatusError",
                    "the start time must be a number up to the stop time, but it is %g and the stop time %g",
                    start, stop);
            return false;
        }
        moment_.start = moment_.time = start;
        moment_.stop = stop;
        if (start != 0)
            message(Level::warning, "logStatusWarning",
                    "the model counts its own time from 0, which is %g here", start);
        return true;
    }

    /// Initial states, from parameters and inputs.
    bool initialize() {
        if (!moment_.is_initialized && !library_->initialize(model_)) return fail_of_model();
        moment_.is_initialized = true;
        return true;
    }

    /// The signals at the present time. Where the step `ends` at once, nobody goes back behind them.
    bool compute(bool ends = false) {
        if (moment_.is_committed) { // between two steps of a model whose solver is the importer's
            if (is_stale_ &&
                !exchange().compute_signals(model_, own_time(), order.state() == fmi::event_mode))
                return fail_of_model();
            is_stale_ = false;
            return true;
        }
        if (is_computed_) return true;
        if (!initialize()) return false;
        if (has_state() && !ends) memory_.keep();
        is_computed_ = true;
        return library_->output(model_) || fail_of_model();
    }

    /// Is a step of the importer one that can be done? With a message where not.
    bool is_step(double time, double step) const noexcept {
        const double slack = 1e-9 * std::max(1.0, std::abs(moment_.time));
        if (!(std::abs(time - moment_.time) <= slack))
            message(Level::error, "logStatusError",
                    "a step begins at %.17g s, but the last one ended at %.17g s", time, moment_.time);
        else if (!(step > 0 && step < 1e15))
            message(Level::error, "logStatusError", "a step of %g s cannot be done", step);
        else if (time + step > moment_.stop + slack)
            message(
                Level::error, "logStatusError",
                "a step to %.17g s cannot be done, as %.17g s was given as the stop time (FMI 2.0, section "
                "2.1.6; FMI 3.0, section 2.3.2)",
                time + step, moment_.stop);
        else
            return true;
        return false;
    }

    /// Does whatever steps of the model end until `time` + `step`. `between` is called with the time after
    /// each of them that ends before that, and ends it early when it says so.
    template <class Between> bool advance(double step, Between&& between) {
        const double period = library_->period, end = moment_.time + step;
        const auto last = std::int64_t(std::floor((end - moment_.start) / period + 1e-6));
        if (Problem why; !clocks.have_ticked(last, end, why)) return fail(why.text);
        while (library_->steps(model_) < last) {
            if (!compute(true)) return false;
            if (!library_->update(model_)) return fail_of_model();
            is_computed_ = false;
            write_later_values();
            moment_.time = moment_.start + double(library_->steps(model_)) * period;
            if (moment_.time < end - 1e-6 * period && between(moment_.time)) return true;
        }
        moment_.time = end;
        return true;
    }

    // ---- model exchange

    double own_time() const noexcept { return moment_.time - moment_.start; } ///< of the model
    /// What is computed between two steps is of that time, in a step of the step's.
    double instant() const noexcept { return moment_.is_committed ? own_time() : due(); }
    void set_time(double time) noexcept {
        moment_.time = time;
        is_stale_ = true;
    }
    void set_states(const double* values) noexcept {
        std::copy(values, values + exchange_->continuous_count, exchange_->states(model_));
        is_stale_ = true;
    }
    bool has_count(std::size_t given, int wanted) {
        return given == std::size_t(wanted) ||
               fail("as many numbers as the model has states or indicators must be given");
    }
    bool get_states(double* values) {
        if (!initialize()) return false;
        std::copy(exchange_->states(model_), exchange_->states(model_) + exchange_->continuous_count, values);
        return true;
    }
    bool get_rates(double* values) {
        if (!compute_rates()) return false;
        std::copy(exchange_->rates(model_), exchange_->rates(model_) + exchange_->continuous_count, values);
        return true;
    }
    bool compute_rates() {
        if (!is_reached()) return false;
        return exchange_->compute_rates(model_, instant()) || fail_of_model();
    }
    /// The signals are those of this instant.
    bool is_reached() { return moment_.is_committed || compute(); }
    /// Do sampled blocks compute, too, when the signals are computed?
    bool is_in_step() const noexcept { return exchange_->is_sampled && !moment_.is_committed; }
    /// Guards of subsystems that do not run keep away from 0.
    bool compute_crossings(double* values) {
        if (!is_reached()) return false;
        if (!exchange_->compute_crossings(model_, instant(), values)) return fail_of_model();
        for (int i = 0; i < exchange_->guard_count; ++i)
            if (std::isnan(values[i])) values[i] = 1;
        return true;
    }

    /// Events begin with the initial states.
    bool exit_initialization() { return order.is_co_simulation() ? initialize() : remember_states(); }
    /// Where a step of the model is due, it begins: outputs are those of the step, from the inputs there.
    bool enter_event() {
        if (order.is_co_simulation()) return true;
        if (!remember_states()) return false;
        if (clocks.have_some()) return have_clocks_ticked(); // which begin it
        const bool is_due =
            exchange_->is_sampled && own_time() >= due() - 1e-9 * std::max(1.0, std::abs(due()));
        if (is_due) {
            moment_.is_committed = is_computed_ = false;
            moment_.time = next_event(); // what is computed again later is of the step's time, to the bit
        }
        return true;
    }
    /// A clock ticks: the step of the model begins that all clocks of this instant have in common.
    bool activate(const FmuClock& clock) {
        Problem why;
        const std::int64_t step = clocks.activate(clock, why);
        if (step < 0) return fail(why.text);
        if (!moment_.is_committed) return true; // it begins already
        exchange_->pass(model_, step - library_->steps(model_));
        moment_.is_committed = is_computed_ = false;
        return true;
    }
    /// Ends the step that has begun, or answers a crossing. Did states jump since the event began? A step at
    /// which clocks tick ends with them alone, in co-simulation when time goes on.
    bool handle_event(bool& has_jumped) {
        const bool is_tick = clocks.is_some_active();
        if (Problem why; is_tick && !clocks.end_tick(why)) return fail(why.text);
        const bool waits = !is_tick && !moment_.is_committed && clocks.is_due(library_->steps(model_));
        if (waits || order.is_co_simulation()) return compute();
        if (!moment_.is_committed) {
            if (!compute()) return false;
            is_computed_ = false;
            moment_.is_committed = true;
            if (!exchange_->end_step(model_)) return fail_of_model();
        } else if (!exchange_->answer(model_, own_time())) {
            return fail_of_model();
        }
        is_stale_ = false;
        const double* const now = exchange_->states(model_);
        has_jumped = std::memcmp(states_before_.data(), now, states_before_.size() * sizeof(double)) != 0;
        return remember_states();
    }
    bool leave_event() {
        bool has_jumped = false;
        return moment_.is_committed || handle_event(has_jumped);
    }
    bool has_next_event() const noexcept { return exchange_->is_sampled && !clocks.have_some(); }
    double next_event() const noexcept { return moment_.start + due(); }

    // ---- states

    /// A step under way begins anew.
    void save(FmuState& to) const {
        to.tables = &tables();
        to.order = order;
        to.moment = moment_;
        to.model.resize(model_size());
        if (is_computed_)
            memory_.save_kept(to.model.data());
        else
            memory_.save(to.model.data());
    }
    bool restore(const FmuState& from) {
        if (from.order.is_co_simulation() != order.is_co_simulation())
            return fail("the state is one of an instance of the other kind, co-simulation or model exchange");
        if (from.tables != &tables() && !become(*from.tables)) return false;
        if (host_ && from.moment.is_initialized && !initialize()) return false; // its blocks start
        order = from.order;
        moment_ = from.moment;
        is_computed_ = false;
        is_stale_ = true;
        memory_.restore(from.model.data());
        return remember_states();
    }

    // ---- messages

    /// Has the variable a value at this instant? With a message where it has none.
    bool has_value(const Variable& v, const char* function) {
        Problem why;
        return order.state() & (fmi::instantiated | fmi::initialization) ||
               clocks.has_value(v, function, why) || fail(why.text);
    }

    FmuClocks clocks;                ///< alike in all models
    void (*between)(void) = nullptr; ///< the version's, that is called inside of steps
    bool allows_early_return = false;

  private:
    struct NewValues {
        const Variable* variable;
        std::vector<double> values;
    };
    struct LaterInput {
        const Variable* variable;
        int place;
        double value;
    };

    /// Begins anew, as that model.
    bool become(const FmuTables& tables) {
        choose(tables);
        return open();
    }
    bool remember_states() {
        states_before_.resize(std::size_t(exchange_->continuous_count));
        return get_states(states_before_.data());
    }
    /// Goes back to the begin of the step under way, whose signals may have been computed; false where blocks
    /// cannot: what is written then acts from the next step on.
    bool begin_anew() {
        if (!is_computed_) return true;
        if (order.state() & (fmi::instantiated | fmi::initialization)) {
            moment_.is_initialized = false;
        } else if (has_state()) {
            memory_.go_back();
        } else {
            if (!has_warned_)
                message(Level::warning, "logStatusWarning",
                        "outputs were read before inputs or parameters of the same instant were written; "
                        "these act one step later, as some blocks of the model cannot begin a step anew");
            has_warned_ = true;
            return false;
        }
        is_computed_ = false;
        return true;
    }
    bool have_clocks_ticked() {
        Problem why;
        return clocks.have_ticked(clocks.step_after(moment_.time), moment_.time, why) || fail(why.text);
    }
    static bool same(double a, double b) noexcept { return std::memcmp(&a, &b, sizeof a) == 0; }
    void write_later_values() {
        for (const auto& its : later_inputs_)
            generated::write(its.variable->data, its.variable->type, its.place, its.value);
        later_inputs_.clear();
        if (later_values_.empty()) return;
        new_values_.swap(later_values_);
        later_values_.clear();
        finish_writing();
    }

    std::vector<NewValues> new_values_, later_values_;
    std::vector<LaterInput> later_inputs_;
    std::vector<double> states_before_; ///< the event
    std::vector<bool> written_;         ///< by the importer, by numbers of variables
    bool is_computed_ = false;          ///< the signals of the step under way
    bool is_stale_ = false; ///< between two steps, did anything change since signals were computed?
    bool has_warned_ = false;
};

} // namespace bf::generated
