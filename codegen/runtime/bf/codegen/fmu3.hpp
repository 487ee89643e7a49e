// The functions of FMI 3.0 over an instance: included by the one source file of an FMU that defines its
// tables.
#pragma once

#include "bf/fmi/fmi3.h"

#define BF_FMI(name) fmi3##name
#define BF_FMI_STATE(verb) fmi3##verb##FMUState
#define BF_FMI_STATE_SIZE fmi3SerializedFMUStateSize
#define BF_FMI_DESERIALIZE fmi3DeserializeFMUState
#define BF_FMI_DERIVATIVES fmi3GetContinuousStateDerivatives
#include "bf/codegen/fmu_entries.hpp"

namespace bf::generated::fmu3 {

inline void log(const FmuMessages& instance, FmuMessages::Level level, const char* category,
                const char* text) {
    const auto callback = reinterpret_cast<fmi3LogMessageCallback>(instance.callback);
    if (callback && (instance.is_logging || level >= FmuMessages::Level::error))
        callback(instance.environment, fmi3Status(level), category, text);
}

/// Enumerations are integers of 64 bits in the standard, and of 32 in the model; no others have 64.
template <class T> constexpr bool is_enumeration = std::is_same_v<T, fmi3Int64>;

/// Calls f with each variable and where its values begin; false for what has another type or size.
template <class T, class F>
bool for_each(FmuInstance& instance, const char* function, Type type, const fmi3ValueReference* references,
              std::size_t count, std::size_t values, F&& f) {
    std::size_t at = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const auto* const v = instance.variables.variable(references[i]);
        if (!v || v->type != type || v->is_enumeration != is_enumeration<T>)
            return has_none(instance, function, references[i]);
        if (at + std::size_t(v->count) > values) break;
        if (!f(*v, at)) return false;
        at += std::size_t(v->count);
    }
    if (at == values) return true;
    instance.message(FmuInstance::Level::error, "logStatusError", "%s: the variables have not %zu elements",
                     function, values);
    return false;
}

template <class T>
fmi3Status get(fmi3Instance handle, const char* function, Type type, const fmi3ValueReference* references,
               std::size_t count, T* values, std::size_t size) noexcept {
    using Stored = std::conditional_t<is_enumeration<T>, fmi3Int32, T>;
    return call(handle, Call::get_values, function, [&](FmuInstance& instance) {
        return for_each<T>(instance, function, type, references, count, size,
                           [&](const auto& v, std::size_t at) {
                               if (!instance.has_value(v, function) || !refreshed(instance, v)) return false;
                               const auto* const from = reinterpret_cast<const Stored*>(v.data);
                               for (int i = 0; i < v.count; ++i)
                                   values[at + std::size_t(i)] = from[FmuVariables::place(v, i)];
                               return true;
                           });
    });
}

template <class T>
fmi3Status set(fmi3Instance handle, const char* function, Type type, const fmi3ValueReference* references,
               std::size_t count, const T* values, std::size_t size) noexcept {
    return call(handle, Call::set_values, function, [&](FmuInstance& instance) {
        const bool good = for_each<T>(
            instance, function, type, references, count, size, [&](const auto& v, std::size_t at) {
                if (!instance.has_value(v, function) || !can_be_set(instance, function, v)) return false;
                for (int i = 0; i < v.count; ++i) {
                    const T value = values[at + std::size_t(i)];
                    if constexpr (is_enumeration<T>)
                        if (T(fmi3Int32(value)) != value)
                            return cannot_be(instance, function, v, double(value));
                    instance.write(v, i, double(value));
                }
                return true;
            });
        return instance.finish_writing() && good;
    });
}

/// Those of a call that asks for derivatives.
inline bool elements(FmuInstance& instance, const char* function, const fmi3ValueReference* references,
                     std::size_t count, std::size_t values, FmuElements& to) {
    for (std::size_t k = 0; k < count; ++k) {
        const auto* const v = instance.variables.variable(references[k]);
        if (!v) return has_none(instance, function, references[k]);
        for (int i = 0; i < v->count; ++i) to.push_back({int(references[k]), FmuVariables::place(*v, i)});
    }
    return are_differentiable(instance, function, to, values);
}

/// Calls f with each clock and its number in the list; false for what is none.
template <class F>
fmi3Status for_each_clock(fmi3Instance handle, Call kind, const char* function,
                          const fmi3ValueReference* references, std::size_t count, F&& f) noexcept {
    return call(handle, kind, function, [&](FmuInstance& instance) {
        for (std::size_t i = 0; i < count; ++i) {
            const FmuClock* const clock = instance.clocks.clock(references[i]);
            if (!clock) return has_none(instance, function, references[i]);
            if (!f(instance, *clock, i)) return false;
        }
        return true;
    });
}
inline bool has_fraction(const FmuInstance& instance, const char* function, const FmuClock& clock) {
    if (clock.resolution != 0) return true;
    instance.message(FmuInstance::Level::error, "logStatusError",
                     "%s: no fraction is exactly the interval of '%s'", function, clock.name);
    return false;
}

/// Calls f with each structural parameter and its number in the list.
template <class F>
bool for_each_structural(FmuInstance& instance, const char* function, const fmi3ValueReference* references,
                         std::size_t count, std::size_t values, F&& f) {
    for (std::size_t i = 0; i < count; ++i) {
        std::uint64_t* const its = instance.structure.value(references[i]);
        if (!its) return has_none(instance, function, references[i]);
        if (i < values) f(*its, i);
    }
    if (count == values) return true;
    instance.message(FmuInstance::Level::error, "logStatusError", "%s: the variables have not %zu elements",
                     function, values);
    return false;
}

/// An instance of that order of calls, or null.
inline fmi3Instance make(fmi::CallOrder order, fmi3String name, fmi3String token, fmi3String resources,
                         bool is_logging, fmi3InstanceEnvironment environment,
                         fmi3LogMessageCallback log_message, fmi3IntermediateUpdateCallback between = nullptr,
                         bool allows_early_return = false) {
    try {
        auto instance =
            std::make_unique<FmuInstance>(fmu_models, name, order, log, resources ? resources : "");
        instance->callback = reinterpret_cast<void (*)(void)>(log_message);
        instance->between = reinterpret_cast<void (*)(void)>(between);
        instance->environment = environment;
        instance->is_logging = is_logging;
        instance->allows_early_return = allows_early_return;
        return opened(std::move(instance), token);
    } catch (const std::exception&) { // there is no memory
        return nullptr;
    }
}

} // namespace bf::generated::fmu3

extern "C" {

using bf_fmi3_references = const fmi3ValueReference*;

const char* fmi3GetVersion(void) { return "3.0"; }

BF_FMI_FUNCTION(fmi3SetDebugLogging, (fmi3Instance handle, fmi3Boolean on, size_t, const fmi3String*), call,
                set_debug_logging, {
                    instance.is_logging = on;
                    return true;
                })

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean,
                                         fmi3Boolean logging, fmi3Boolean uses_event_mode,
                                         fmi3Boolean allows_early_return, const fmi3ValueReference*, size_t,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback between) {
    const bool has_clocks = bf::generated::fmu_models.first->clock_count > 0;
    if (uses_event_mode != has_clocks) {
        if (log)
            log(environment, fmi3Error, "logStatusError",
                has_clocks
                    ? "this FMU has clocks, which tick in event mode: use that (FMI 3.0, section 2.3.1)"
                    : "this FMU has no event mode in co-simulation");
        return nullptr;
    }
    return bf::generated::fmu3::make({3, true, uses_event_mode}, name, token, resources, logging, environment,
                                     log, between, allows_early_return);
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    if (!bf::generated::fmu_models.has_model_exchange) {
        if (log) log(environment, fmi3Error, "logStatusError", "this FMU is for co-simulation alone");
        return nullptr;
    }
    return bf::generated::fmu3::make({3, false, true}, name, token, resources, logging, environment, log);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String, fmi3String, fmi3String, fmi3Boolean, fmi3Boolean,
                                               fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback log, fmi3ClockUpdateCallback,
                                               fmi3LockPreemptionCallback, fmi3UnlockPreemptionCallback) {
    if (log) log(environment, fmi3Error, "logStatusError", "this FMU is not for scheduled execution");
    return nullptr;
}

BF_FMI_FUNCTION(fmi3EnterInitializationMode,
                (fmi3Instance handle, fmi3Boolean, fmi3Float64, fmi3Float64 start, fmi3Boolean has_stop,
                 fmi3Float64 stop),
                call, enter_initialization, { return instance.set_up(start, has_stop ? stop : HUGE_VAL); })

#define BF_FMI3_VALUES(T, type)                                                                              \
    fmi3Status fmi3Get##T(fmi3Instance handle, const fmi3ValueReference* references, size_t count,           \
                          fmi3##T* values, size_t size) {                                                    \
        return bf::generated::fmu3::get(handle, "fmi3Get" #T, bf::generated::Type::type, references, count,  \
                                        values, size);                                                       \
    }                                                                                                        \
    fmi3Status fmi3Set##T(fmi3Instance handle, const fmi3ValueReference* references, size_t count,           \
                          const fmi3##T* values, size_t size) {                                              \
        return bf::generated::fmu3::set(handle, "fmi3Set" #T, bf::generated::Type::type, references, count,  \
                                        values, size);                                                       \
    }
BF_FMI3_VALUES(Float32, float32)
BF_FMI3_VALUES(Float64, float64)
BF_FMI3_VALUES(Int8, int8)
BF_FMI3_VALUES(UInt8, uint8)
BF_FMI3_VALUES(Int16, int16)
BF_FMI3_VALUES(UInt16, uint16)
BF_FMI3_VALUES(Int32, int32)
BF_FMI3_VALUES(UInt32, uint32)
BF_FMI3_VALUES(Boolean, boolean)
BF_FMI3_VALUES(Int64, int32) // of enumerations
#undef BF_FMI3_VALUES

fmi3Status fmi3DoStep(fmi3Instance handle, fmi3Float64 time, fmi3Float64 step, fmi3Boolean,
                      fmi3Boolean* event_needed, fmi3Boolean* terminate, fmi3Boolean* returned_early,
                      fmi3Float64* reached) {
    return bf::generated::run(handle, bf::fmi::Call::do_step, "fmi3DoStep", [&](auto& instance) {
        *event_needed = *terminate = *returned_early = false;
        *reached = instance.time();
        if (!instance.is_step(time, step)) return false;
        const auto between = reinterpret_cast<fmi3IntermediateUpdateCallback>(instance.between);
        const bool good = instance.advance(step, [&](double at) {
            bool is_asked = false;
            double when = at;
            if (between) {
                instance.order.enter_intermediate_update();
                between(instance.environment, at, false, true, true, instance.allows_early_return, &is_asked,
                        &when);
                instance.order.leave_intermediate_update();
            }
            *returned_early = is_asked && instance.allows_early_return;
            return *returned_early;
        });
        *reached = instance.time();
        return good;
    });
}

BF_FMI_FUNCTION(fmi3EnterStepMode, (fmi3Instance handle), call, enter_step_mode, { return true; })

// Structural parameters, which are the only variables of 64 bits without a sign.
BF_FMI_FUNCTION(fmi3EnterConfigurationMode, (fmi3Instance handle), call, enter_configuration, {
    return instance.order.state() == bf::fmi::instantiated ||
           instance.fail("structural parameters of this FMU are fixed when it is initialized");
})
BF_FMI_FUNCTION(fmi3ExitConfigurationMode, (fmi3Instance handle), run, exit_configuration,
                { return instance.exit_configuration(); })
BF_FMI_FUNCTION(fmi3GetUInt64,
                (fmi3Instance handle, bf_fmi3_references references, size_t count, fmi3UInt64* values,
                 size_t size),
                call, get_values, {
                    return bf::generated::fmu3::for_each_structural(
                        instance, "fmi3GetUInt64", references, count, size,
                        [&](const std::uint64_t& its, std::size_t i) { values[i] = its; });
                })
BF_FMI_FUNCTION(fmi3SetUInt64,
                (fmi3Instance handle, bf_fmi3_references references, size_t count, const fmi3UInt64* values,
                 size_t size),
                call, set_values, {
                    if (instance.order.state() != bf::fmi::configuration)
                        return instance.fail("fmi3SetUInt64: structural parameters are set in the "
                                             "Configuration Mode (FMI 3.0, section 2.3.1)");
                    const auto each = [&](auto&& f) {
                        return bf::generated::fmu3::for_each_structural(instance, "fmi3SetUInt64", references,
                                                                        count, size, f);
                    };
                    bf::generated::Problem why;
                    bool is_known = true;
                    return each([&](std::uint64_t& its, std::size_t i) {
                               is_known = is_known && instance.structure.has(&its, values[i], why);
                           }) &&
                           (is_known || instance.fail(why.text)) &&
                           each([&](std::uint64_t& its, std::size_t i) { its = values[i]; });
                })

// Events.
BF_FMI_FUNCTION(fmi3UpdateDiscreteStates,
                (fmi3Instance handle, fmi3Boolean* again, fmi3Boolean* terminate,
                 fmi3Boolean* nominals_changed, fmi3Boolean* states_changed, fmi3Boolean* has_next_event,
                 fmi3Float64* next_event),
                run, update_discrete_states, {
                    *again = *terminate = *nominals_changed = *states_changed = *has_next_event = false;
                    if (!instance.handle_event(*states_changed)) return false;
                    *has_next_event = instance.has_next_event();
                    *next_event = instance.next_event();
                    return true;
                })
BF_FMI_FUNCTION(fmi3GetNumberOfEventIndicators, (fmi3Instance handle, size_t* count), call, get_numbers, {
    *count = size_t(instance.exchange().guard_count);
    return true;
})
BF_FMI_FUNCTION(fmi3GetNumberOfContinuousStates, (fmi3Instance handle, size_t* count), call, get_numbers, {
    *count = size_t(instance.exchange().continuous_count);
    return true;
})

#define BF_FMI3_DERIVATIVE(name, is_adjoint)                                                                 \
    BF_FMI_FUNCTION(name,                                                                                    \
                    (fmi3Instance handle, bf_fmi3_references unknowns, size_t unknown_count,                 \
                     bf_fmi3_references knowns, size_t known_count, const fmi3Float64* seed,                 \
                     size_t seed_size, fmi3Float64* change, size_t change_size),                             \
                    call, get_derivatives_of, {                                                              \
                        using namespace bf::generated;                                                       \
                        FmuElements by, of; /* of an adjoint derivative the seed is that of the unknowns */  \
                        return fmu3::elements(instance, #name, knowns, known_count,                          \
                                              is_adjoint ? change_size : seed_size, by) &&                   \
                               fmu3::elements(instance, #name, unknowns, unknown_count,                      \
                                              is_adjoint ? seed_size : change_size, of) &&                   \
                               (is_adjoint ? adjoint : directional)(instance, by, of, seed, change);         \
                    })
BF_FMI3_DERIVATIVE(fmi3GetDirectionalDerivative, false)
BF_FMI3_DERIVATIVE(fmi3GetAdjointDerivative, true)
#undef BF_FMI3_DERIVATIVE

// Clocks.
#define BF_FMI3_CLOCKS(name, kind, parameters, ...)                                                          \
    fmi3Status name parameters {                                                                             \
        return bf::generated::fmu3::for_each_clock(                                                          \
            handle, bf::fmi::Call::kind, #name, references,                                                  \
            count, [&](auto& instance, const auto& clock, size_t i) -> bool __VA_ARGS__);                    \
    }
BF_FMI3_CLOCKS(fmi3SetClock, activate_clocks,
               (fmi3Instance handle, bf_fmi3_references references, size_t count, const fmi3Clock* active), {
                   bf::generated::Problem why;
                   return active[i] ? instance.activate(clock)
                                    : instance.clocks.deactivate(clock, why) || instance.fail(why.text);
               })
BF_FMI3_CLOCKS(fmi3GetClock, activate_clocks,
               (fmi3Instance handle, bf_fmi3_references references, size_t count, fmi3Clock* active), {
                   active[i] = instance.clocks.is_active(clock);
                   return true;
               })
BF_FMI3_CLOCKS(fmi3GetIntervalDecimal, get_clocks,
               (fmi3Instance handle, bf_fmi3_references references, size_t count, fmi3Float64* intervals,
                fmi3IntervalQualifier* qualifiers),
               {
                   intervals[i] = instance.clocks.interval(clock);
                   qualifiers[i] = fmi3IntervalUnchanged; // as that of the description is
                   return true;
               })
BF_FMI3_CLOCKS(fmi3GetShiftDecimal, get_clocks,
               (fmi3Instance handle, bf_fmi3_references references, size_t count, fmi3Float64* shifts), {
                   shifts[i] = instance.clocks.shift(clock);
                   return true;
               })
BF_FMI3_CLOCKS(fmi3GetIntervalFraction, get_clocks,
               (fmi3Instance handle, bf_fmi3_references references, size_t count, fmi3UInt64* counters,
                fmi3UInt64* resolutions, fmi3IntervalQualifier* qualifiers),
               {
                   counters[i] = clock.interval;
                   resolutions[i] = clock.resolution;
                   qualifiers[i] = fmi3IntervalUnchanged;
                   return bf::generated::fmu3::has_fraction(instance, "fmi3GetIntervalFraction", clock);
               })
BF_FMI3_CLOCKS(fmi3GetShiftFraction, get_clocks,
               (fmi3Instance handle, bf_fmi3_references references, size_t count, fmi3UInt64* counters,
                fmi3UInt64* resolutions),
               {
                   counters[i] = clock.shift;
                   resolutions[i] = clock.resolution;
                   return bf::generated::fmu3::has_fraction(instance, "fmi3GetShiftFraction", clock);
               })
#undef BF_FMI3_CLOCKS

// What this FMU has not: intervals are constant, and clocks are activated, no partitions.
BF_FMI_NONE(fmi3GetString, (fmi3Instance handle, bf_fmi3_references, size_t, fmi3String*, size_t))
BF_FMI_NONE(fmi3SetString, (fmi3Instance handle, bf_fmi3_references, size_t, const fmi3String*, size_t))
BF_FMI_NONE(fmi3GetBinary, (fmi3Instance handle, bf_fmi3_references, size_t, size_t*, fmi3Binary*, size_t))
BF_FMI_NONE(fmi3SetBinary,
            (fmi3Instance handle, bf_fmi3_references, size_t, const size_t*, const fmi3Binary*, size_t))
BF_FMI_NONE(fmi3GetNumberOfVariableDependencies, (fmi3Instance handle, fmi3ValueReference, size_t*))
BF_FMI_NONE(fmi3GetVariableDependencies, (fmi3Instance handle, fmi3ValueReference, size_t*,
                                          fmi3ValueReference*, size_t*, fmi3DependencyKind*, size_t))
BF_FMI_NONE(fmi3SetIntervalDecimal, (fmi3Instance handle, bf_fmi3_references, size_t, const fmi3Float64*))
BF_FMI_NONE(fmi3SetIntervalFraction,
            (fmi3Instance handle, bf_fmi3_references, size_t, const fmi3UInt64*, const fmi3UInt64*))
BF_FMI_NONE(fmi3SetShiftDecimal, (fmi3Instance handle, bf_fmi3_references, size_t, const fmi3Float64*))
BF_FMI_NONE(fmi3SetShiftFraction,
            (fmi3Instance handle, bf_fmi3_references, size_t, const fmi3UInt64*, const fmi3UInt64*))
BF_FMI_NONE(fmi3EvaluateDiscreteStates, (fmi3Instance handle))
BF_FMI_NONE(fmi3GetOutputDerivatives,
            (fmi3Instance handle, bf_fmi3_references, size_t, const fmi3Int32*, fmi3Float64*, size_t))
BF_FMI_NONE(fmi3ActivateModelPartition, (fmi3Instance handle, fmi3ValueReference, fmi3Float64))

} // extern "C"
