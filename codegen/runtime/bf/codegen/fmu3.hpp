// The functions of FMI 3.0 over an instance: included by the one source file of an FMU that defines its
// tables.
#pragma once

#include "bf/codegen/fmu_instance.hpp"
#include "bf/fmi/fmi3.h"

#include <exception>

namespace bf::generated {

extern const FmuTables fmu_tables;

namespace fmu3 {

using fmi::Call;

inline FmuInstance* of(fmi3Instance instance) noexcept { return static_cast<FmuInstance*>(instance); }

inline void log(const FmuInstance& instance, FmuInstance::Level level, const char* category,
                const char* text) {
    const auto callback = reinterpret_cast<fmi3LogMessageCallback>(instance.callback);
    if (callback && (instance.is_logging || level >= FmuInstance::Level::error))
        callback(instance.environment, fmi3Status(level), category, text);
}

/// Does what f does where the order of calls allows it; f says whether it succeeded, and whatever it could
/// not do has a message.
template <class F> fmi3Status call(fmi3Instance handle, Call kind, const char* function, F&& f) noexcept {
    FmuInstance* const instance = of(handle);
    if (!instance) return fmi3Error;
    try {
        if (!instance->may(kind, function) || !f(*instance)) return fmi3Error;
    } catch (const std::exception& error) {
        instance->message(FmuInstance::Level::error, "logStatusError", "%s: %s", function, error.what());
        return fmi3Error;
    }
    instance->order.done(kind);
    return fmi3OK;
}

/// The same of what the model itself does: after a failure nothing goes on.
template <class F> fmi3Status run(fmi3Instance handle, Call kind, const char* function, F&& f) noexcept {
    return call(handle, kind, function, [&](FmuInstance& instance) {
        const bool good = f(instance);
        if (!good) instance.order.fail();
        return good;
    });
}

inline fmi3Status unsupported(fmi3Instance handle, const char* function) noexcept {
    if (of(handle))
        of(handle)->message(FmuInstance::Level::error, "logStatusError",
                            "%s: this FMU has nothing of that kind", function);
    return fmi3Error;
}

/// Calls f with each variable and where its values begin; false for what has another type or size.
template <class F>
bool for_each(FmuInstance& instance, const char* function, Type type, const fmi3ValueReference* references,
              std::size_t count, std::size_t values, F&& f) {
    std::size_t at = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const auto* const v = instance.variable(references[i]);
        if (!v || v->type != type) {
            instance.message(FmuInstance::Level::error, "logStatusError",
                             "%s: there is no variable %u of this type", function, unsigned(references[i]));
            return false;
        }
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
    return call(handle, Call::get_values, function, [&](FmuInstance& instance) {
        return for_each(instance, function, type, references, count, size,
                        [&](const auto& v, std::size_t at) {
                            if (!instance.refresh(v)) {
                                instance.order.fail();
                                return false;
                            }
                            const auto* const from = reinterpret_cast<const T*>(v.data);
                            for (int i = 0; i < v.count; ++i)
                                values[at + std::size_t(i)] = from[FmuInstance::place(v, i)];
                            return true;
                        });
    });
}

template <class T>
fmi3Status set(fmi3Instance handle, const char* function, Type type, const fmi3ValueReference* references,
               std::size_t count, const T* values, std::size_t size) noexcept {
    return call(handle, Call::set_values, function, [&](FmuInstance& instance) {
        const bool good =
            for_each(instance, function, type, references, count, size, [&](const auto& v, std::size_t at) {
                if (!v.can_be_set) {
                    instance.message(FmuInstance::Level::error, "logStatusError",
                                     "%s: '%s' is computed, it cannot be set", function, v.name);
                    return false;
                }
                for (int i = 0; i < v.count; ++i) instance.write(v, i, double(values[at + std::size_t(i)]));
                return true;
            });
        return instance.finish_writing() && good;
    });
}

} // namespace fmu3
} // namespace bf::generated

extern "C" {

const char* fmi3GetVersion(void) { return "3.0"; }

fmi3Status fmi3SetDebugLogging(fmi3Instance handle, fmi3Boolean on, size_t, const fmi3String*) {
    return bf::generated::fmu3::call(handle, bf::fmi::Call::set_debug_logging, "fmi3SetDebugLogging",
                                     [&](auto& instance) {
                                         instance.is_logging = on;
                                         return true;
                                     });
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String, fmi3Boolean,
                                         fmi3Boolean logging, fmi3Boolean uses_event_mode,
                                         fmi3Boolean allows_early_return, const fmi3ValueReference*, size_t,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback between) {
    using namespace bf::generated;
    try {
        auto instance =
            std::make_unique<FmuInstance>(fmu_tables, name, bf::fmi::CallOrder(3, true, false), fmu3::log);
        instance->callback = reinterpret_cast<void (*)(void)>(log);
        instance->between = reinterpret_cast<void (*)(void)>(between);
        instance->environment = environment;
        instance->is_logging = logging;
        instance->allows_early_return = allows_early_return;
        if (!token || std::strcmp(token, fmu_tables.token) != 0)
            instance->fail("the instantiation token is not that of this FMU");
        else if (uses_event_mode)
            instance->fail("this FMU has no event mode in co-simulation");
        else if (instance->open())
            return instance.release();
    } catch (const std::exception&) { // there is no memory
    }
    return nullptr;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String, fmi3Boolean,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
    using namespace bf::generated;
    try {
        auto instance =
            std::make_unique<FmuInstance>(fmu_tables, name, bf::fmi::CallOrder(3, false, true), fmu3::log);
        instance->callback = reinterpret_cast<void (*)(void)>(log);
        instance->environment = environment;
        instance->is_logging = logging;
        if (!token || std::strcmp(token, fmu_tables.token) != 0)
            instance->fail("the instantiation token is not that of this FMU");
        else if (instance->open())
            return instance.release();
    } catch (const std::exception&) { // there is no memory
    }
    return nullptr;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String, fmi3String, fmi3String, fmi3Boolean, fmi3Boolean,
                                               fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback log, fmi3ClockUpdateCallback,
                                               fmi3LockPreemptionCallback, fmi3UnlockPreemptionCallback) {
    if (log) log(environment, fmi3Error, "logStatusError", "this FMU is not for scheduled execution");
    return nullptr;
}

void fmi3FreeInstance(fmi3Instance handle) { delete bf::generated::fmu3::of(handle); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance handle, fmi3Boolean, fmi3Float64, fmi3Float64 start,
                                       fmi3Boolean, fmi3Float64) {
    return bf::generated::fmu3::call(handle, bf::fmi::Call::enter_initialization,
                                     "fmi3EnterInitializationMode", [&](auto& instance) {
                                         instance.set_up(start);
                                         return true;
                                     });
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance handle) {
    return bf::generated::fmu3::run(handle, bf::fmi::Call::exit_initialization, "fmi3ExitInitializationMode",
                                    [](auto& instance) { return instance.initialize(); });
}

fmi3Status fmi3EnterEventMode(fmi3Instance handle) {
    return bf::generated::fmu3::call(handle, bf::fmi::Call::enter_event_mode, "fmi3EnterEventMode",
                                     [](auto&) { return true; });
}

fmi3Status fmi3Terminate(fmi3Instance handle) {
    return bf::generated::fmu3::call(handle, bf::fmi::Call::terminate, "fmi3Terminate",
                                     [](auto&) { return true; });
}

fmi3Status fmi3Reset(fmi3Instance handle) {
    return bf::generated::fmu3::run(handle, bf::fmi::Call::reset, "fmi3Reset",
                                    [](auto& instance) { return instance.reset(); });
}

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
#undef BF_FMI3_VALUES

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance handle, fmi3ValueReference, size_t*) {
    return bf::generated::fmu3::unsupported(handle, "fmi3GetNumberOfVariableDependencies");
}
fmi3Status fmi3GetVariableDependencies(fmi3Instance handle, fmi3ValueReference, size_t*, fmi3ValueReference*,
                                       size_t*, fmi3DependencyKind*, size_t) {
    return bf::generated::fmu3::unsupported(handle, "fmi3GetVariableDependencies");
}

fmi3Status fmi3GetFMUState(fmi3Instance handle, fmi3FMUState* state) {
    return bf::generated::fmu3::call(
        handle, bf::fmi::Call::save_state, "fmi3GetFMUState",
        [&](auto& instance) { return bf::generated::save_state(instance, *state); });
}
fmi3Status fmi3SetFMUState(fmi3Instance handle, fmi3FMUState state) {
    return bf::generated::fmu3::call(
        handle, bf::fmi::Call::save_state, "fmi3SetFMUState",
        [&](auto& instance) { return bf::generated::restore_state(instance, state); });
}
fmi3Status fmi3FreeFMUState(fmi3Instance handle, fmi3FMUState* state) {
    return bf::generated::fmu3::call(handle, bf::fmi::Call::save_state, "fmi3FreeFMUState",
                                     [&](auto&) { return bf::generated::free_state(*state); });
}
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance handle, fmi3FMUState state, size_t* size) {
    return bf::generated::fmu3::call(handle, bf::fmi::Call::save_state, "fmi3SerializedFMUStateSize",
                                     [&](auto& instance) {
                                         *size = instance.serialized_size();
                                         return state != nullptr;
                                     });
}
fmi3Status fmi3SerializeFMUState(fmi3Instance handle, fmi3FMUState state, fmi3Byte* bytes, size_t size) {
    return bf::generated::fmu3::call(
        handle, bf::fmi::Call::save_state, "fmi3SerializeFMUState",
        [&](auto& instance) { return bf::generated::serialize_state(instance, state, bytes, size); });
}
fmi3Status fmi3DeserializeFMUState(fmi3Instance handle, const fmi3Byte* bytes, size_t size,
                                   fmi3FMUState* state) {
    return bf::generated::fmu3::call(
        handle, bf::fmi::Call::save_state, "fmi3DeserializeFMUState",
        [&](auto& instance) { return (*state = instance.deserialize(bytes, size)) != nullptr; });
}

fmi3Status fmi3DoStep(fmi3Instance handle, fmi3Float64 time, fmi3Float64 step, fmi3Boolean,
                      fmi3Boolean* event_needed, fmi3Boolean* terminate, fmi3Boolean* returned_early,
                      fmi3Float64* reached) {
    return bf::generated::fmu3::run(handle, bf::fmi::Call::do_step, "fmi3DoStep", [&](auto& instance) {
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

fmi3Status fmi3EnterConfigurationMode(fmi3Instance handle) {
    return bf::generated::fmu3::call(handle, bf::fmi::Call::enter_configuration, "fmi3EnterConfigurationMode",
                                     [](auto&) { return true; });
}
fmi3Status fmi3ExitConfigurationMode(fmi3Instance handle) {
    return bf::generated::fmu3::call(handle, bf::fmi::Call::exit_configuration, "fmi3ExitConfigurationMode",
                                     [](auto&) { return true; });
}

// Model exchange.
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance handle, fmi3Boolean* again, fmi3Boolean* terminate,
                                    fmi3Boolean* nominals_changed, fmi3Boolean* states_changed,
                                    fmi3Boolean* has_next_event, fmi3Float64* next_event) {
    return bf::generated::fmu3::run(
        handle, bf::fmi::Call::update_discrete_states, "fmi3UpdateDiscreteStates", [&](auto& instance) {
            *again = *terminate = *nominals_changed = *states_changed = *has_next_event = false;
            if (!instance.handle_event(*states_changed)) return false;
            *has_next_event = instance.has_next_event();
            *next_event = instance.next_event();
            return true;
        });
}
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance handle) {
    return bf::generated::fmu3::call(handle, bf::fmi::Call::enter_continuous_time,
                                     "fmi3EnterContinuousTimeMode", [](auto&) { return true; });
}
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance handle, fmi3Boolean, fmi3Boolean* enter_event_mode,
                                       fmi3Boolean* terminate) {
    return bf::generated::fmu3::call(handle, bf::fmi::Call::completed_integrator_step,
                                     "fmi3CompletedIntegratorStep", [&](auto&) {
                                         *enter_event_mode = *terminate = false;
                                         return true;
                                     });
}
fmi3Status fmi3SetTime(fmi3Instance handle, fmi3Float64 time) {
    return bf::generated::fmu3::call(handle, bf::fmi::Call::set_time, "fmi3SetTime", [&](auto& instance) {
        instance.set_time(time);
        return true;
    });
}
fmi3Status fmi3SetContinuousStates(fmi3Instance handle, const fmi3Float64* values, size_t count) {
    return bf::generated::fmu3::call(handle, bf::fmi::Call::set_continuous_states, "fmi3SetContinuousStates",
                                     [&](auto& instance) {
                                         if (!instance.has_count(count, instance.exchange().continuous_count))
                                             return false;
                                         instance.set_states(values);
                                         return true;
                                     });
}
fmi3Status fmi3GetContinuousStates(fmi3Instance handle, fmi3Float64* values, size_t count) {
    return bf::generated::fmu3::call(
        handle, bf::fmi::Call::get_continuous, "fmi3GetContinuousStates", [&](auto& instance) {
            return instance.has_count(count, instance.exchange().continuous_count) &&
                   instance.get_states(values);
        });
}
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance handle, fmi3Float64* values, size_t count) {
    return bf::generated::fmu3::run(
        handle, bf::fmi::Call::get_continuous, "fmi3GetContinuousStateDerivatives", [&](auto& instance) {
            return instance.has_count(count, instance.exchange().continuous_count) &&
                   instance.get_rates(values);
        });
}
fmi3Status fmi3GetEventIndicators(fmi3Instance handle, fmi3Float64* values, size_t count) {
    return bf::generated::fmu3::run(handle, bf::fmi::Call::get_continuous, "fmi3GetEventIndicators",
                                    [&](auto& instance) {
                                        return instance.has_count(count, instance.exchange().guard_count) &&
                                               instance.compute_crossings(values);
                                    });
}
fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance handle, fmi3Float64* values, size_t count) {
    return bf::generated::fmu3::call(
        handle, bf::fmi::Call::get_nominals, "fmi3GetNominalsOfContinuousStates", [&](auto& instance) {
            std::fill(values, values + count, 1.0);
            return instance.has_count(count, instance.exchange().continuous_count);
        });
}
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance handle, size_t* count) {
    return bf::generated::fmu3::call(handle, bf::fmi::Call::get_numbers, "fmi3GetNumberOfEventIndicators",
                                     [&](auto& instance) {
                                         *count = size_t(instance.exchange().guard_count);
                                         return true;
                                     });
}
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance handle, size_t* count) {
    return bf::generated::fmu3::call(handle, bf::fmi::Call::get_numbers, "fmi3GetNumberOfContinuousStates",
                                     [&](auto& instance) {
                                         *count = size_t(instance.exchange().continuous_count);
                                         return true;
                                     });
}

// What this FMU has not.
#define BF_FMI3_NONE(name, ...)                                                                              \
    fmi3Status name(fmi3Instance handle, ##__VA_ARGS__) {                                                    \
        return bf::generated::fmu3::unsupported(handle, #name);                                              \
    }
using bf_fmi3_references = const fmi3ValueReference*;
BF_FMI3_NONE(fmi3GetInt64, bf_fmi3_references, size_t, fmi3Int64*, size_t)
BF_FMI3_NONE(fmi3SetInt64, bf_fmi3_references, size_t, const fmi3Int64*, size_t)
BF_FMI3_NONE(fmi3GetUInt64, bf_fmi3_references, size_t, fmi3UInt64*, size_t)
BF_FMI3_NONE(fmi3SetUInt64, bf_fmi3_references, size_t, const fmi3UInt64*, size_t)
BF_FMI3_NONE(fmi3GetString, bf_fmi3_references, size_t, fmi3String*, size_t)
BF_FMI3_NONE(fmi3SetString, bf_fmi3_references, size_t, const fmi3String*, size_t)
BF_FMI3_NONE(fmi3GetBinary, bf_fmi3_references, size_t, size_t*, fmi3Binary*, size_t)
BF_FMI3_NONE(fmi3SetBinary, bf_fmi3_references, size_t, const size_t*, const fmi3Binary*, size_t)
BF_FMI3_NONE(fmi3GetClock, bf_fmi3_references, size_t, fmi3Clock*)
BF_FMI3_NONE(fmi3SetClock, bf_fmi3_references, size_t, const fmi3Clock*)
BF_FMI3_NONE(fmi3GetDirectionalDerivative, bf_fmi3_references, size_t, bf_fmi3_references, size_t,
             const fmi3Float64*, size_t, fmi3Float64*, size_t)
BF_FMI3_NONE(fmi3GetAdjointDerivative, bf_fmi3_references, size_t, bf_fmi3_references, size_t,
             const fmi3Float64*, size_t, fmi3Float64*, size_t)
BF_FMI3_NONE(fmi3GetIntervalDecimal, bf_fmi3_references, size_t, fmi3Float64*, fmi3IntervalQualifier*)
BF_FMI3_NONE(fmi3GetIntervalFraction, bf_fmi3_references, size_t, fmi3UInt64*, fmi3UInt64*,
             fmi3IntervalQualifier*)
BF_FMI3_NONE(fmi3GetShiftDecimal, bf_fmi3_references, size_t, fmi3Float64*)
BF_FMI3_NONE(fmi3GetShiftFraction, bf_fmi3_references, size_t, fmi3UInt64*, fmi3UInt64*)
BF_FMI3_NONE(fmi3SetIntervalDecimal, bf_fmi3_references, size_t, const fmi3Float64*)
BF_FMI3_NONE(fmi3SetIntervalFraction, bf_fmi3_references, size_t, const fmi3UInt64*, const fmi3UInt64*)
BF_FMI3_NONE(fmi3SetShiftDecimal, bf_fmi3_references, size_t, const fmi3Float64*)
BF_FMI3_NONE(fmi3SetShiftFraction, bf_fmi3_references, size_t, const fmi3UInt64*, const fmi3UInt64*)
BF_FMI3_NONE(fmi3EvaluateDiscreteStates)
BF_FMI3_NONE(fmi3EnterStepMode)
BF_FMI3_NONE(fmi3GetOutputDerivatives, bf_fmi3_references, size_t, const fmi3Int32*, fmi3Float64*, size_t)
BF_FMI3_NONE(fmi3ActivateModelPartition, fmi3ValueReference, fmi3Float64)
#undef BF_FMI3_NONE

} // extern "C"
