// The functions of FMI 2.0 over an instance: included by the one source file of an FMU that defines its
// tables.
#pragma once

#include "bf/fmi/fmi2.h"

#define BF_FMI(name) fmi2##name
#define BF_FMI_STATE(verb) fmi2##verb##FMUstate
#define BF_FMI_STATE_SIZE fmi2SerializedFMUstateSize
#define BF_FMI_DESERIALIZE fmi2DeSerializeFMUstate
#define BF_FMI_DERIVATIVES fmi2GetDerivatives
#include "bf/codegen/fmu_entries.hpp"

namespace bf::generated::fmu2 {

inline void log(const FmuMessages& instance, FmuMessages::Level level, const char* category,
                const char* text) {
    const auto callback = reinterpret_cast<decltype(fmi2CallbackFunctions::logger)>(instance.callback);
    if (!callback || !(instance.is_logging || level >= FmuMessages::Level::error)) return;
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
        const auto* const element = instance.variables.element(references[i]);
        if (!element || kind_of(instance.variables.variable_of(*element).type) != kind)
            return has_none(instance, function, references[i]);
        if (!f(instance.variables.variable_of(*element), element->element, i)) return false;
    }
    return true;
}

/// Those of a call that asks for derivatives.
inline bool elements(FmuInstance& instance, const char* function, const fmi2ValueReference* references,
                     std::size_t count, FmuElements& to) {
    for (std::size_t i = 0; i < count; ++i) {
        const auto* const e = instance.variables.element(references[i]);
        if (!e) return has_none(instance, function, references[i]);
        to.push_back({e->variable, FmuVariables::place(instance.variables.variable_of(*e), e->element)});
    }
    return are_differentiable(instance, function, to, count);
}

template <class T>
fmi2Status get(fmi2Component handle, const char* function, Kind kind, const fmi2ValueReference* references,
               std::size_t count, T* values) noexcept {
    return call(handle, Call::get_values, function, [&](FmuInstance& instance) {
        return for_each(instance, function, kind, references, count,
                        [&](const auto& v, int element, std::size_t i) {
                            if (!refreshed(instance, v)) return false;
                            values[i] = T(read(v.data, v.type, FmuVariables::place(v, element)));
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
                if (!can_be_set(instance, function, v)) return false;
                const Quantity its{v.name, "", "", v.type, Where::inputs, 1, 1, 0, -1};
                const bool holds = v.type == Type::float64 || range_of(its).holds(double(values[i])) ||
                                   (v.type == Type::float32 && !std::isfinite(double(values[i])));
                if (!holds) return cannot_be(instance, function, v, double(values[i]));
                instance.write(v, element, double(values[i]));
                return true;
            });
        return instance.finish_writing() && good;
    });
}

/// The folder of a URI file:/PATH or file://HOST/PATH (RFC 3986, RFC 8089); "" for another one.
inline std::string folder_of(const char* uri) {
    if (!uri || std::strncmp(uri, "file:", 5) != 0) return {};
    uri += 5;
    if (std::strncmp(uri, "//", 2) == 0) uri = std::strchr(uri + 2, '/');
    std::string folder;
    for (; uri && *uri; ++uri) {
        const auto digit = [&](int i) {
            const char* const all = "0123456789abcdef";
            const char* const at = uri[i] ? std::strchr(all, uri[i] | 32) : nullptr;
            return at ? int(at - all) : -1;
        };
        if (*uri == '%' && digit(1) >= 0 && digit(2) >= 0) {
            folder += char(16 * digit(1) + digit(2));
            uri += 2;
        } else {
            folder += *uri;
        }
    }
    return folder;
}

} // namespace bf::generated::fmu2

extern "C" {

const char* fmi2GetTypesPlatform(void) { return "default"; }
const char* fmi2GetVersion(void) { return "2.0"; }

BF_FMI_FUNCTION(fmi2SetDebugLogging, (fmi2Component handle, fmi2Boolean on, size_t, const fmi2String*), call,
                set_debug_logging, {
                    instance.is_logging = on;
                    return true;
                })

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* callbacks, fmi2Boolean, fmi2Boolean logging) {
    using namespace bf::generated;
    if (!callbacks) return nullptr;
    try {
        auto instance = std::make_unique<FmuInstance>(fmu_models, name,
                                                      bf::fmi::CallOrder(2, type == fmi2CoSimulation, false),
                                                      fmu2::log, fmu2::folder_of(resources));
        instance->callback = reinterpret_cast<void (*)(void)>(callbacks->logger);
        instance->environment = callbacks->componentEnvironment;
        instance->is_logging = logging;
        return opened(std::move(instance), guid);
    } catch (const std::exception&) { // there is no memory
        return nullptr;
    }
}

BF_FMI_FUNCTION(fmi2SetupExperiment,
                (fmi2Component handle, fmi2Boolean, fmi2Real, fmi2Real start, fmi2Boolean has_stop,
                 fmi2Real stop),
                call, setup_experiment, { return instance.set_up(start, has_stop ? stop : HUGE_VAL); })
BF_FMI_FUNCTION(fmi2EnterInitializationMode, (fmi2Component handle), call, enter_initialization,
                { return true; })

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

BF_FMI_FUNCTION(fmi2DoStep, (fmi2Component handle, fmi2Real time, fmi2Real step, fmi2Boolean), run, do_step, {
    return instance.is_step(time, step) && instance.advance(step, [](double) { return false; });
})
BF_FMI_FUNCTION(fmi2GetRealStatus, (fmi2Component handle, const fmi2StatusKind kind, fmi2Real* value), call,
                get_step_status, {
                    *value = instance.time();
                    return kind == fmi2LastSuccessfulTime;
                })
BF_FMI_FUNCTION(fmi2GetBooleanStatus, (fmi2Component handle, const fmi2StatusKind kind, fmi2Boolean* value),
                call, get_step_status, {
                    *value = false;
                    return kind == fmi2Terminated;
                })

// Model exchange.
BF_FMI_FUNCTION(fmi2NewDiscreteStates, (fmi2Component handle, fmi2EventInfo* info), run,
                update_discrete_states, {
                    *info = {};
                    bool has_jumped = false;
                    if (!instance.handle_event(has_jumped)) return false;
                    info->valuesOfContinuousStatesChanged = has_jumped;
                    info->nextEventTimeDefined = instance.has_next_event();
                    info->nextEventTime = instance.next_event();
                    return true;
                })

// What this FMU has not: steps end before fmi2DoStep does.
using bf_fmi2_references = const fmi2ValueReference*;
BF_FMI_NONE(fmi2GetString, (fmi2Component handle, bf_fmi2_references, size_t, fmi2String*))
BF_FMI_NONE(fmi2SetString, (fmi2Component handle, bf_fmi2_references, size_t, const fmi2String*))
BF_FMI_FUNCTION(fmi2GetDirectionalDerivative,
                (fmi2Component handle, bf_fmi2_references unknowns, size_t unknown_count,
                 bf_fmi2_references knowns, size_t known_count, const fmi2Real* seed, fmi2Real* change),
                call, get_derivatives_of, {
                    using namespace bf::generated;
                    FmuElements by, of;
                    const char* const function = "fmi2GetDirectionalDerivative";
                    return fmu2::elements(instance, function, knowns, known_count, by) &&
                           fmu2::elements(instance, function, unknowns, unknown_count, of) &&
                           directional(instance, by, of, seed, change);
                })
BF_FMI_NONE(fmi2SetRealInputDerivatives,
            (fmi2Component handle, bf_fmi2_references, size_t, const fmi2Integer*, const fmi2Real*))
BF_FMI_NONE(fmi2GetRealOutputDerivatives,
            (fmi2Component handle, bf_fmi2_references, size_t, const fmi2Integer*, fmi2Real*))
BF_FMI_NONE(fmi2CancelStep, (fmi2Component handle))
BF_FMI_NONE(fmi2GetStatus, (fmi2Component handle, const fmi2StatusKind, fmi2Status*))
BF_FMI_NONE(fmi2GetIntegerStatus, (fmi2Component handle, const fmi2StatusKind, fmi2Integer*))
BF_FMI_NONE(fmi2GetStringStatus, (fmi2Component handle, const fmi2StatusKind, fmi2String*))

} // extern "C"
