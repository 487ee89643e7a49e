// The functions of FMI 2.0 over an instance: included by the one source file of an FMU that defines its
// tables.
#pragma once

#include "bf/codegen/fmu_instance.hpp"
#include "bf/fmi/fmi2.h"

#include <exception>

namespace bf::generated {

extern const FmuTables fmu_tables;

namespace fmu2 {

using fmi::Call;

inline FmuInstance* of(fmi2Component component) noexcept { return static_cast<FmuInstance*>(component); }

inline void log(const FmuInstance& instance, FmuInstance::Level level, const char* category,
                const char* text) {
    const auto callback = reinterpret_cast<decltype(fmi2CallbackFunctions::logger)>(instance.callback);
    if (!callback || !(instance.is_logging || level >= FmuInstance::Level::error)) return;
    // The text is the format itself: importers in languages without variadic functions show nothing else.
    char format[700];
    std::size_t size = 0;
    for (const char* c = text; *c && size + 2 < sizeof format; ++c) {
        if (*c == '%') format[size++] = '%';
        format[size++] = *c;
    }
    format[size] = '\0';
    callback(instance.environment, instance.name(), fmi2Status(level), category, format);
}

/// Does what f does where the order of calls allows it; f says whether it succeeded, and whatever it could
/// not do has a message.
template <class F> fmi2Status call(fmi2Component handle, Call kind, const char* function, F&& f) noexcept {
    FmuInstance* const instance = of(handle);
    if (!instance) return fmi2Error;
    try {
        if (!instance->may(kind, function) || !f(*instance)) return fmi2Error;
    } catch (const std::exception& error) {
        instance->message(FmuInstance::Level::error, "logStatusError", "%s: %s", function, error.what());
        return fmi2Error;
    }
    instance->order.done(kind);
    return fmi2OK;
}

/// The same of what the model itself does: after a failure nothing goes on.
template <class F> fmi2Status run(fmi2Component handle, Call kind, const char* function, F&& f) noexcept {
    return call(handle, kind, function, [&](FmuInstance& instance) {
        const bool good = f(instance);
        if (!good) instance.order.fail();
        return good;
    });
}

inline fmi2Status unsupported(fmi2Component handle, const char* function) noexcept {
    if (of(handle))
        of(handle)->message(FmuInstance::Level::error, "logStatusError",
                            "%s: this FMU has nothing of that kind", function);
    return fmi2Error;
}

/// Which of the standard's types holds the values of ours: those of uint32 do not fit into a 32-bit integer.
enum class Kind { real, integer, boolean };
inline Kind kind_of(Type type) noexcept {
    switch (type) {
    case Type::float64:
    case Type::float32:
    case Type::uint32: return Kind::real;
    case Type::boolean: return Kind::boolean;
    default: return Kind::integer;
    }
}

/// Calls f with each variable and its element; false for one of another type.
template <class F>
bool for_each(FmuInstance& instance, const char* function, Kind kind, const fmi2ValueReference* references,
              std::size_t count, F&& f) {
    for (std::size_t i = 0; i < count; ++i) {
        const auto* const element = instance.element(references[i]);
        if (!element || kind_of(instance.variable_of(*element).type) != kind) {
            instance.message(FmuInstance::Level::error, "logStatusError",
                             "%s: there is no variable %u of this type", function, unsigned(references[i]));
            return false;
        }
        if (!f(instance.variable_of(*element), element->element, i)) return false;
    }
    return true;
}

template <class T>
fmi2Status get(fmi2Component handle, const char* function, Kind kind, const fmi2ValueReference* references,
               std::size_t count, T* values) noexcept {
    return call(handle, Call::get_values, function, [&](FmuInstance& instance) {
        return for_each(instance, function, kind, references, count,
                        [&](const auto& v, int element, std::size_t i) {
                            if (!instance.refresh(v)) {
                                instance.order.fail();
                                return false;
                            }
                            values[i] = T(read(v.data, v.type, FmuInstance::place(v, element)));
                            return true;
                        });
    });
}

template <class T>
fmi2Status set(fmi2Component handle, const char* function, Kind kind, const fmi2ValueReference* references,
               std::size_t count, const T* values) noexcept {
    return call(handle, Call::set_values, function, [&](FmuInstance& instance) {
        const bool good = for_each(
            instance, function, kind, references, count, [&](const auto& v, int element, std::size_t i) {
                const Quantity its{v.name, "", "", v.type, Where::inputs, 1, 1, 0, -1};
                if (!v.can_be_set)
                    instance.message(FmuInstance::Level::error, "logStatusError",
                                     "%s: '%s' is computed, it cannot be set", function, v.name);
                else if (v.type != Type::float64 && v.type != Type::float32 &&
                         !range_of(its).holds(double(values[i])))
                    instance.message(FmuInstance::Level::error, "logStatusError", "%s: '%s' cannot be %g",
                                     function, v.name, double(values[i]));
                else
                    return instance.write(v, element, double(values[i])), true;
                return false;
            });
        return instance.finish_writing() && good;
    });
}

} // namespace fmu2
} // namespace bf::generated

extern "C" {

const char* fmi2GetTypesPlatform(void) { return "default"; }
const char* fmi2GetVersion(void) { return "2.0"; }

fmi2Status fmi2SetDebugLogging(fmi2Component handle, fmi2Boolean on, size_t, const fmi2String*) {
    return bf::generated::fmu2::call(handle, bf::fmi::Call::set_debug_logging, "fmi2SetDebugLogging",
                                     [&](auto& instance) {
                                         instance.is_logging = on;
                                         return true;
                                     });
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String,
                              const fmi2CallbackFunctions* callbacks, fmi2Boolean, fmi2Boolean logging) {
    using namespace bf::generated;
    if (!callbacks) return nullptr;
    try {
        auto instance = std::make_unique<FmuInstance>(
            fmu_tables, name, bf::fmi::CallOrder(2, type == fmi2CoSimulation, false), fmu2::log);
        instance->callback = reinterpret_cast<void (*)(void)>(callbacks->logger);
        instance->environment = callbacks->componentEnvironment;
        instance->is_logging = logging;
        if (!guid || std::strcmp(guid, fmu_tables.token) != 0)
            instance->fail("the GUID is not that of this FMU");
        else if (instance->open())
            return instance.release();
    } catch (const std::exception&) { // there is no memory
    }
    return nullptr;
}

void fmi2FreeInstance(fmi2Component handle) { delete bf::generated::fmu2::of(handle); }

fmi2Status fmi2SetupExperiment(fmi2Component handle, fmi2Boolean, fmi2Real, fmi2Real start, fmi2Boolean,
                               fmi2Real) {
    return bf::generated::fmu2::call(handle, bf::fmi::Call::setup_experiment, "fmi2SetupExperiment",
                                     [&](auto& instance) {
                                         instance.set_up(start);
                                         return true;
                                     });
}
fmi2Status fmi2EnterInitializationMode(fmi2Component handle) {
    return bf::generated::fmu2::call(handle, bf::fmi::Call::enter_initialization,
                                     "fmi2EnterInitializationMode", [](auto&) { return true; });
}
fmi2Status fmi2ExitInitializationMode(fmi2Component handle) {
    return bf::generated::fmu2::run(handle, bf::fmi::Call::exit_initialization, "fmi2ExitInitializationMode",
                                    [](auto& instance) { return instance.initialize(); });
}
fmi2Status fmi2Terminate(fmi2Component handle) {
    return bf::generated::fmu2::call(handle, bf::fmi::Call::terminate, "fmi2Terminate",
                                     [](auto&) { return true; });
}
fmi2Status fmi2Reset(fmi2Component handle) {
    return bf::generated::fmu2::run(handle, bf::fmi::Call::reset, "fmi2Reset",
                                    [](auto& instance) { return instance.reset(); });
}

#define BF_FMI2_VALUES(T, kind)                                                                              \
    fmi2Status fmi2Get##T(fmi2Component handle, const fmi2ValueReference* references, size_t count,          \
                          fmi2##T* values) {                                                                 \
        return bf::generated::fmu2::get(handle, "fmi2Get" #T, bf::generated::fmu2::Kind::kind, references,   \
                                        count, values);                                                      \
    }                                                                                                        \
    fmi2Status fmi2Set##T(fmi2Component handle, const fmi2ValueReference* references, size_t count,          \
                          const fmi2##T* values) {                                                           \
        return bf::generated::fmu2::set(handle, "fmi2Set" #T, bf::generated::fmu2::Kind::kind, references,   \
                                        count, values);                                                      \
    }
BF_FMI2_VALUES(Real, real)
BF_FMI2_VALUES(Integer, integer)
BF_FMI2_VALUES(Boolean, boolean)
#undef BF_FMI2_VALUES

fmi2Status fmi2GetFMUstate(fmi2Component handle, fmi2FMUstate* state) {
    return bf::generated::fmu2::call(
        handle, bf::fmi::Call::save_state, "fmi2GetFMUstate",
        [&](auto& instance) { return bf::generated::save_state(instance, *state); });
}
fmi2Status fmi2SetFMUstate(fmi2Component handle, fmi2FMUstate state) {
    return bf::generated::fmu2::call(
        handle, bf::fmi::Call::save_state, "fmi2SetFMUstate",
        [&](auto& instance) { return bf::generated::restore_state(instance, state); });
}
fmi2Status fmi2FreeFMUstate(fmi2Component handle, fmi2FMUstate* state) {
    return bf::generated::fmu2::call(handle, bf::fmi::Call::save_state, "fmi2FreeFMUstate",
                                     [&](auto&) { return bf::generated::free_state(*state); });
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component handle, fmi2FMUstate state, size_t* size) {
    return bf::generated::fmu2::call(handle, bf::fmi::Call::save_state, "fmi2SerializedFMUstateSize",
                                     [&](auto& instance) {
                                         *size = instance.serialized_size();
                                         return state != nullptr;
                                     });
}
fmi2Status fmi2SerializeFMUstate(fmi2Component handle, fmi2FMUstate state, fmi2Byte* bytes, size_t size) {
    return bf::generated::fmu2::call(
        handle, bf::fmi::Call::save_state, "fmi2SerializeFMUstate",
        [&](auto& instance) { return bf::generated::serialize_state(instance, state, bytes, size); });
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component handle, const fmi2Byte* bytes, size_t size,
                                   fmi2FMUstate* state) {
    return bf::generated::fmu2::call(
        handle, bf::fmi::Call::save_state, "fmi2DeSerializeFMUstate", [&](auto& instance) {
            return (*state = instance.deserialize(reinterpret_cast<const unsigned char*>(bytes), size)) !=
                   nullptr;
        });
}

fmi2Status fmi2DoStep(fmi2Component handle, fmi2Real time, fmi2Real step, fmi2Boolean) {
    return bf::generated::fmu2::run(handle, bf::fmi::Call::do_step, "fmi2DoStep", [&](auto& instance) {
        return instance.is_step(time, step) && instance.advance(step, [](double) { return false; });
    });
}
fmi2Status fmi2GetRealStatus(fmi2Component handle, const fmi2StatusKind kind, fmi2Real* value) {
    return bf::generated::fmu2::call(handle, bf::fmi::Call::get_step_status, "fmi2GetRealStatus",
                                     [&](auto& instance) {
                                         *value = instance.time();
                                         return kind == fmi2LastSuccessfulTime;
                                     });
}
fmi2Status fmi2GetBooleanStatus(fmi2Component handle, const fmi2StatusKind kind, fmi2Boolean* value) {
    return bf::generated::fmu2::call(handle, bf::fmi::Call::get_step_status, "fmi2GetBooleanStatus",
                                     [&](auto&) {
                                         *value = false;
                                         return kind == fmi2Terminated;
                                     });
}

// Model exchange.
fmi2Status fmi2EnterEventMode(fmi2Component handle) {
    return bf::generated::fmu2::call(handle, bf::fmi::Call::enter_event_mode, "fmi2EnterEventMode",
                                     [](auto&) { return true; });
}
fmi2Status fmi2NewDiscreteStates(fmi2Component handle, fmi2EventInfo* info) {
    return bf::generated::fmu2::run(handle, bf::fmi::Call::update_discrete_states, "fmi2NewDiscreteStates",
                                    [&](auto& instance) {
                                        *info = {};
                                        bool has_jumped = false;
                                        if (!instance.handle_event(has_jumped)) return false;
                                        info->valuesOfContinuousStatesChanged = has_jumped;
                                        info->nextEventTimeDefined = instance.has_next_event();
                                        info->nextEventTime = instance.next_event();
                                        return true;
                                    });
}
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component handle) {
    return bf::generated::fmu2::call(handle, bf::fmi::Call::enter_continuous_time,
                                     "fmi2EnterContinuousTimeMode", [](auto&) { return true; });
}
fmi2Status fmi2CompletedIntegratorStep(fmi2Component handle, fmi2Boolean, fmi2Boolean* enter_event_mode,
                                       fmi2Boolean* terminate) {
    return bf::generated::fmu2::call(handle, bf::fmi::Call::completed_integrator_step,
                                     "fmi2CompletedIntegratorStep", [&](auto&) {
                                         *enter_event_mode = *terminate = false;
                                         return true;
                                     });
}
fmi2Status fmi2SetTime(fmi2Component handle, fmi2Real time) {
    return bf::generated::fmu2::call(handle, bf::fmi::Call::set_time, "fmi2SetTime", [&](auto& instance) {
        instance.set_time(time);
        return true;
    });
}
fmi2Status fmi2SetContinuousStates(fmi2Component handle, const fmi2Real* values, size_t count) {
    return bf::generated::fmu2::call(handle, bf::fmi::Call::set_continuous_states, "fmi2SetContinuousStates",
                                     [&](auto& instance) {
                                         if (!instance.has_count(count, instance.exchange().continuous_count))
                                             return false;
                                         instance.set_states(values);
                                         return true;
                                     });
}
fmi2Status fmi2GetContinuousStates(fmi2Component handle, fmi2Real* values, size_t count) {
    return bf::generated::fmu2::call(
        handle, bf::fmi::Call::get_continuous, "fmi2GetContinuousStates", [&](auto& instance) {
            return instance.has_count(count, instance.exchange().continuous_count) &&
                   instance.get_states(values);
        });
}
fmi2Status fmi2GetDerivatives(fmi2Component handle, fmi2Real* values, size_t count) {
    return bf::generated::fmu2::run(
        handle, bf::fmi::Call::get_continuous, "fmi2GetDerivatives", [&](auto& instance) {
            return instance.has_count(count, instance.exchange().continuous_count) &&
                   instance.get_rates(values);
        });
}
fmi2Status fmi2GetEventIndicators(fmi2Component handle, fmi2Real* values, size_t count) {
    return bf::generated::fmu2::run(handle, bf::fmi::Call::get_continuous, "fmi2GetEventIndicators",
                                    [&](auto& instance) {
                                        return instance.has_count(count, instance.exchange().guard_count) &&
                                               instance.compute_crossings(values);
                                    });
}
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component handle, fmi2Real* values, size_t count) {
    return bf::generated::fmu2::call(
        handle, bf::fmi::Call::get_nominals, "fmi2GetNominalsOfContinuousStates", [&](auto& instance) {
            std::fill(values, values + count, 1.0);
            return instance.has_count(count, instance.exchange().continuous_count);
        });
}

// What this FMU has not: steps end before fmi2DoStep does.
#define BF_FMI2_NONE(name, ...)                                                                              \
    fmi2Status name(fmi2Component handle, ##__VA_ARGS__) {                                                   \
        return bf::generated::fmu2::unsupported(handle, #name);                                              \
    }
using bf_fmi2_references = const fmi2ValueReference*;
BF_FMI2_NONE(fmi2GetString, bf_fmi2_references, size_t, fmi2String*)
BF_FMI2_NONE(fmi2SetString, bf_fmi2_references, size_t, const fmi2String*)
BF_FMI2_NONE(fmi2GetDirectionalDerivative, bf_fmi2_references, size_t, bf_fmi2_references, size_t,
             const fmi2Real*, fmi2Real*)
BF_FMI2_NONE(fmi2SetRealInputDerivatives, bf_fmi2_references, size_t, const fmi2Integer*, const fmi2Real*)
BF_FMI2_NONE(fmi2GetRealOutputDerivatives, bf_fmi2_references, size_t, const fmi2Integer*, fmi2Real*)
BF_FMI2_NONE(fmi2CancelStep)
BF_FMI2_NONE(fmi2GetStatus, const fmi2StatusKind, fmi2Status*)
BF_FMI2_NONE(fmi2GetIntegerStatus, const fmi2StatusKind, fmi2Integer*)
BF_FMI2_NONE(fmi2GetStringStatus, const fmi2StatusKind, fmi2String*)
#undef BF_FMI2_NONE

} // extern "C"
