// A generated model as an instance of an FMU, for either version of the standard.
#pragma once

#include "bf/codegen/model_exchange.hpp"
#include "bf/codegen/quantity.hpp"
#include "bf/fmi/call_order.hpp"
#include "bf/run/run_c.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace bf::generated {

/// A variable of the FMU: a row of the model's tables. The first one is the time, which has none.
struct FmuVariable {
    int table; ///< a bf_run_table, or one of the next
    int row;
    bool is_calculated; ///< from others: it cannot be set
};

/// Continuous states, their derivatives, and zero-crossing functions as one vector.
constexpr int fmu_states = 16, fmu_rates = 17, fmu_crossings = 18;

/// What an FMU does not know of its model.
struct FmuTables {
    const bf_run_library* (*library)(void);
    const char* token; ///< of the description that belongs to this code
    const FmuVariable* variables;
    int variable_count;
    const Exchange* exchange; ///< for model exchange
};

/// One instance: a model, the time that it has reached, and how it is called. It holds the values that the
/// importer wrote until the step under way needs them.
///
/// A step of the model begins with the signals at its time, from the inputs there, and ends with the next
/// states. The importer may read outputs before it writes the inputs of the same instant; signals that were
/// computed too early are computed again from a copy of the model.
class FmuInstance {
  public:
    enum class Level { ok, warning, discard, error };
    /// Where messages go: `level` has the numbers of both standards.
    using Log = void (*)(const FmuInstance&, Level, const char* category, const char* message);

    struct Variable {
        int table;
        Type type;
        int rows, cols, count;
        bool can_be_set;
        char* data;
        const char* name;
        int first; ///< number of its first element among those of all
    };

    FmuInstance(const FmuTables& tables, const char* name, fmi::CallOrder order_of_calls, Log log_message)
        : order(order_of_calls), name_(name ? name : ""), tables_(tables), library_(*tables.library()),
          log_(log_message) {}
    FmuInstance(const FmuInstance&) = delete;
    FmuInstance& operator=(const FmuInstance&) = delete;
    ~FmuInstance() { close(); }

    /// Makes the model; false, with a message, where it cannot.
    bool open() {
        model_ = library_.create();
        if (!model_) return fail("there is no memory for the model");
        variables_.clear();
        int first = 1; // behind the time
        variables_.push_back(
            {bf_run_signals, Type::float64, 1, 1, 1, false, reinterpret_cast<char*>(&time_), "time", 0});
        for (int i = 0; i < tables_.variable_count; ++i) {
            const FmuVariable& its = tables_.variables[i];
            bf_run_quantity q{};
            if (its.table == fmu_crossings) {
                crossings_.resize(std::size_t(exchange().guard_count));
                variables_.push_back({fmu_crossings, Type::float64, exchange().guard_count, 1,
                                      exchange().guard_count, false,
                                      reinterpret_cast<char*>(crossings_.data()), "event_indicators", first});
                first += exchange().guard_count;
                continue;
            }
            if (!(its.table < fmu_states ? library_.quantity(model_, bf_run_table(its.table), its.row, &q)
                                         : exchange().quantity(model_, its.table == fmu_rates, its.row, &q)))
                return fail("its tables do not fit its code");
            const int count = q.rows * q.cols;
            const bool can_be_set = !its.is_calculated && its.table != bf_run_outputs &&
                                    its.table != bf_run_signals && its.table < fmu_states;
            variables_.push_back({its.table, Type(q.type), q.rows, q.cols, count, can_be_set,
                                  static_cast<char*>(q.data), q.path, first});
            first += count;
        }
        elements_.clear();
        for (int v = 0; v < int(variables_.size()); ++v)
            for (int e = 0; e < variables_[std::size_t(v)].count; ++e) elements_.push_back({v, e});
        before_.resize(library_.snapshot_size);
        is_initialized_ = is_computed_ = is_committed_ = is_stale_ = false;
        time_ = start_ = 0;
        return true;
    }

    void close() noexcept {
        if (is_initialized_) library_.terminate(model_);
        if (model_) library_.destroy(model_);
        model_ = nullptr;
        is_initialized_ = false;
    }

    bool reset() {
        close();
        return open();
    }

    const char* name() const noexcept { return name_.c_str(); }
    double time() const noexcept { return time_; }
    bool has_state() const noexcept { return library_.snapshot_size > 0; }

    // ---- variables

    /// The variable of a value reference of FMI 3.0, or null.
    const Variable* variable(std::uint32_t reference) const noexcept {
        return reference < variables_.size() ? &variables_[reference] : nullptr;
    }
    struct Element {
        int variable, element; ///< the latter row by row
    };
    /// The element of a value reference of FMI 2.0, or null.
    const Element* element(std::uint32_t reference) const noexcept {
        return reference < elements_.size() ? &elements_[reference] : nullptr;
    }
    const Variable& variable_of(const Element& e) const noexcept {
        return variables_[std::size_t(e.variable)];
    }

    /// Where element i, row by row, of the variable stands in its memory, which is column by column.
    static int place(const Variable& v, int i) noexcept {
        return v.rows == 1 || v.cols == 1 ? i : i % v.cols * v.rows + i / v.cols;
    }

    /// Makes the variable's memory hold its value of now; false when the model fails.
    bool refresh(const Variable& v) {
        if (&v == variables_.data()) return true;
        if (v.table == fmu_rates) return initialize() && compute_rates();
        if (v.table == fmu_states) return initialize();
        if (v.table == fmu_crossings) return initialize() && compute_crossings(crossings_.data());
        return (v.table != bf_run_signals && v.table != bf_run_outputs) || compute();
    }

    /// Element i, row by row, becomes x when the variable's values are complete.
    void write(const Variable& v, int i, double x) {
        if (v.table == bf_run_inputs) {
            const int at = place(v, i);
            is_stale_ = true;
            if (is_computed_ && same(read(v.data, v.type, at), x)) return;
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
            new_values_.back().values[std::size_t(place(v, i))] = x;
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
        const char* const wrong = library_.set_parameters(model_, changes.data(), int(changes.size()));
        new_values_.clear();
        if (wrong) message(Level::error, "logStatusError", "%s", wrong);
        // Initial states follow from parameters as long as the run has not begun.
        if (order.state() == fmi::initialization || order.state() == fmi::instantiated)
            is_initialized_ = false;
        return !wrong;
    }

    // ---- time

    void set_up(double start) noexcept {
        start_ = time_ = start;
        if (start != 0)
            message(Level::warning, "logStatusWarning",
                    "the model counts its own time from 0, which is %g here", start);
    }

    /// Initial states, from parameters and inputs.
    bool initialize() {
        if (!is_initialized_ && !library_.initialize(model_)) return fail_of_model();
        is_initialized_ = true;
        return true;
    }

    /// The signals at the present time.
    bool compute() {
        if (is_committed_) { // between two steps of a model whose solver is the importer's
            if (is_stale_ && !exchange().compute_signals(model_, own_time())) return fail_of_model();
            is_stale_ = false;
            return true;
        }
        if (is_computed_) return true;
        if (!initialize()) return false;
        if (has_state()) library_.save(model_, before_.data());
        is_computed_ = true;
        return library_.output(model_) || fail_of_model();
    }

    /// Is a step of the importer one that can be done? With a message where not.
    bool is_step(double time, double step) const noexcept {
        const double slack = 1e-9 * std::max(1.0, std::abs(time_));
        if (!(std::abs(time - time_) <= slack))
            message(Level::error, "logStatusError",
                    "a step begins at %.17g s, but the last one ended at %.17g s", time, time_);
        else if (!(step > 0 && step < 1e15))
            message(Level::error, "logStatusError", "a step of %g s cannot be done", step);
        else
            return true;
        return false;
    }

    /// Does whatever steps of the model end until `time` + `step`. `between` is called with the time after
    /// each of them but the last, and ends it early when it says so.
    template <class Between> bool advance(double step, Between&& between) {
        const double period = library_.period, end = time_ + step;
        const auto last = std::int64_t(std::floor((end - start_) / period + 1e-6));
        while (library_.steps(model_) < last) {
            if (!compute()) return false;
            if (!library_.update(model_)) return fail_of_model();
            is_computed_ = false;
            write_later_values();
            const auto steps = library_.steps(model_);
            if (steps < last) {
                time_ = start_ + double(steps) * period;
                if (between(time_)) return true;
            }
        }
        time_ = end;
        return true;
    }

    // ---- model exchange

    const Exchange& exchange() const noexcept { return *tables_.exchange; }
    double own_time() const noexcept { return time_ - start_; } ///< of the model
    /// What is computed between two steps is of that time, in a step of the step's.
    double instant() const noexcept {
        return is_committed_ ? own_time() : double(library_.steps(model_)) * library_.period;
    }
    void set_time(double time) noexcept {
        time_ = time;
        is_stale_ = true;
    }
    void set_states(const double* values) noexcept {
        std::copy(values, values + exchange().continuous_count, exchange().states(model_));
        is_stale_ = true;
    }
    bool has_count(std::size_t given, int wanted) {
        return given == std::size_t(wanted) ||
               fail("as many numbers as the model has states or indicators must be given");
    }
    bool get_states(double* values) {
        if (!initialize()) return false;
        std::copy(exchange().states(model_), exchange().states(model_) + exchange().continuous_count, values);
        return true;
    }
    bool get_rates(double* values) {
        if (!compute_rates()) return false;
        std::copy(exchange().rates(model_), exchange().rates(model_) + exchange().continuous_count, values);
        return true;
    }
    bool compute_rates() {
        if (!is_committed_ && !compute()) return false;
        return exchange().compute_rates(model_, instant()) || fail_of_model();
    }
    /// Guards of subsystems that do not run keep away from 0.
    bool compute_crossings(double* values) {
        if (!is_committed_ && !compute()) return false;
        if (!exchange().compute_crossings(model_, instant(), values)) return fail_of_model();
        for (int i = 0; i < exchange().guard_count; ++i)
            if (std::isnan(values[i])) values[i] = 1;
        return true;
    }
    /// An event: the step of the model that is due, or what answers a crossing.
    bool handle_event(bool& has_jumped) {
        const auto count = std::size_t(exchange().continuous_count);
        before_event_.assign(exchange().states(model_), exchange().states(model_) + count);
        const double due = double(library_.steps(model_)) * library_.period;
        const bool is_due = !is_committed_ || (exchange().is_sampled &&
                                               own_time() >= due - 1e-9 * std::max(1.0, std::abs(due)));
        if (is_due) {
            is_committed_ = false;
            if (!compute()) return false;
            is_computed_ = false;
            is_committed_ = true;
            is_stale_ = false;
            if (!exchange().end_step(model_)) return fail_of_model();
        } else {
            if (!exchange().answer(model_, own_time())) return fail_of_model();
            is_stale_ = false;
        }
        has_jumped =
            std::memcmp(before_event_.data(), exchange().states(model_), count * sizeof(double)) != 0;
        return true;
    }
    bool has_next_event() const noexcept { return exchange().is_sampled; }
    double next_event() const noexcept { return start_ + double(library_.steps(model_)) * library_.period; }

    // ---- states

    struct Saved {
        fmi::CallOrder order;
        double time, start;
        bool is_initialized, is_committed;
        std::vector<unsigned char> bytes;
    };

    Saved* save() const {
        auto* const saved = new Saved{order, time_, start_, is_initialized_, is_committed_, before_};
        if (!is_computed_) library_.save(model_, saved->bytes.data()); // else the step begins anew
        return saved;
    }
    void save_again(Saved& saved) const {
        saved.order = order, saved.time = time_, saved.start = start_, saved.is_initialized = is_initialized_;
        saved.is_committed = is_committed_;
        if (is_computed_)
            std::memcpy(saved.bytes.data(), before_.data(), before_.size());
        else
            library_.save(model_, saved.bytes.data());
    }
    void restore(const Saved& saved) {
        order = saved.order;
        time_ = saved.time, start_ = saved.start, is_initialized_ = saved.is_initialized;
        is_committed_ = is_stale_ = saved.is_committed;
        is_computed_ = false;
        library_.restore(model_, saved.bytes.data());
    }

    /// Bytes of a saved state: which code it is of, then how the instance was called, then the model.
    std::size_t serialized_size() const noexcept { return sizeof(Header) + library_.snapshot_size; }
    void serialize(const Saved& saved, unsigned char* to) const {
        Header header{library_.fingerprint, library_.snapshot_size, saved.time,          saved.start,
                      saved.is_initialized, saved.is_committed,     saved.order.state(), 0};
        std::memcpy(to, &header, sizeof header);
        std::memcpy(to + sizeof header, saved.bytes.data(), saved.bytes.size());
    }
    /// Null, with a message, for bytes that no instance of this FMU made.
    Saved* deserialize(const unsigned char* from, std::size_t size) {
        Header header{};
        if (size == serialized_size()) std::memcpy(&header, from, sizeof header);
        if (header.fingerprint != library_.fingerprint || header.size != library_.snapshot_size ||
            !order.is_state(header.state)) {
            message(Level::error, "logStatusError", "these bytes are no state of this FMU");
            return nullptr;
        }
        auto* const saved = new Saved{order,
                                      header.time,
                                      header.start,
                                      header.is_initialized != 0,
                                      header.is_committed != 0,
                                      std::vector<unsigned char>(from + sizeof header, from + size)};
        saved->order.set_state(fmi::State(header.state));
        return saved;
    }

    // ---- messages

    /// May this function be called now?
    bool may(fmi::Call call, const char* function) {
        Problem problem;
        if (order.check(call, function, problem)) return true;
        message(Level::error, "logStatusError", "%s", problem.text);
        return false;
    }

    [[gnu::format(printf, 4, 5)]] void message(Level level, const char* category, const char* format,
                                               ...) const noexcept {
        char text[600];
        va_list list;
        va_start(list, format);
        std::vsnprintf(text, sizeof text, format, list);
        va_end(list);
        if (log_) log_(*this, level, category, text);
    }
    bool fail(const char* text) {
        message(Level::error, "logStatusError", "%s", text);
        return false;
    }

    fmi::CallOrder order;
    // Of the version's functions.
    void (*callback)(void) = nullptr; ///< that logs
    void (*between)(void) = nullptr;  ///< that is called inside of steps
    void* environment = nullptr;
    bool is_logging = false, allows_early_return = false;

  private:
    struct Header {
        std::uint64_t fingerprint, size;
        double time, start;
        std::uint32_t is_initialized, is_committed, state, unused;
    };
    struct NewValues {
        const Variable* variable;
        std::vector<double> values;
    };
    struct LaterInput {
        const Variable* variable;
        int place;
        double value;
    };

    static std::size_t size_of(Type type) noexcept {
        return with_type(type, [](auto* t) { return sizeof *t; });
    }
    bool fail_of_model() {
        const char *const block = library_.failed_block(model_), *const why = library_.failure(model_);
        message(Level::error, "logStatusError", "at %g s: %s%s%s", time_, block ? block : "",
                block && *block ? ": " : "", why ? why : "the model failed");
        return false;
    }
    /// Goes back to the begin of the step under way, whose signals may have been computed; false where blocks
    /// cannot: what is written then acts from the next step on.
    bool begin_anew() {
        if (!is_computed_) return true;
        if (order.state() == fmi::initialization) {
            is_initialized_ = false;
        } else if (has_state()) {
            library_.restore(model_, before_.data());
        } else {
            if (!has_warned_)
                message(Level::warning, "logStatusWarning",
                        "outputs were read before inputs or parameters of the same instant were written; "
                        "these act one "
                        "step later, as some blocks of the model cannot begin a step anew");
            has_warned_ = true;
            return false;
        }
        is_computed_ = false;
        return true;
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

    std::string name_;
    const FmuTables& tables_;
    const bf_run_library& library_;
    Log log_;
    bf_run_model* model_ = nullptr;
    std::vector<Variable> variables_;
    std::vector<Element> elements_;
    std::vector<unsigned char> before_; ///< the model at the begin of the step whose signals were computed
    std::vector<NewValues> new_values_, later_values_;
    std::vector<LaterInput> later_inputs_;
    std::vector<double> before_event_, crossings_;
    bool is_initialized_ = false, is_computed_ = false, has_warned_ = false;
    bool is_committed_ = false,
         is_stale_ = false;       ///< in model exchange: is it between steps, did anything change?
    double time_ = 0, start_ = 0; ///< s
};

// States as pointers of the standard's functions. A saved one that is given again is written over.

inline bool has_states(FmuInstance& instance) {
    return instance.has_state() ||
           instance.fail("some blocks of the model cannot be saved, so there are no states");
}
inline bool save_state(FmuInstance& instance, void*& state) {
    if (!has_states(instance)) return false;
    if (state)
        instance.save_again(*static_cast<FmuInstance::Saved*>(state));
    else
        state = instance.save();
    return true;
}
inline bool restore_state(FmuInstance& instance, const void* state) {
    if (!has_states(instance)) return false;
    if (!state) return instance.fail("there is no state at this address");
    instance.restore(*static_cast<const FmuInstance::Saved*>(state));
    return true;
}
inline bool free_state(void*& state) {
    delete static_cast<FmuInstance::Saved*>(state);
    state = nullptr;
    return true;
}
inline bool serialize_state(FmuInstance& instance, const void* state, void* bytes, std::size_t size) {
    if (!has_states(instance)) return false;
    if (!state || size < instance.serialized_size()) return instance.fail("the state needs more bytes");
    instance.serialize(*static_cast<const FmuInstance::Saved*>(state), static_cast<unsigned char*>(bytes));
    return true;
}

} // namespace bf::generated
