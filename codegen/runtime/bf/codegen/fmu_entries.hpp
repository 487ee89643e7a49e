// Calls of the functions of an FMU, and those functions whose shape both versions of the standard share:
// included where BF_FMI(name) and the like are the version's names.
#pragma once

#include "bf/codegen/fmu_derivatives.hpp"

#include <exception>
#include <utility>

namespace bf::generated {

extern const FmuModels fmu_models;

using fmi::Call;
using FmuStatus = BF_FMI(Status);
/// Both standards number them alike.
constexpr auto fmu_ok = FmuStatus(0), fmu_error = FmuStatus(3);

inline FmuInstance* instance_of(void* handle) noexcept { return static_cast<FmuInstance*>(handle); }

/// Does what f does where the order of calls allows it; f says whether it succeeded, and whatever it could
/// not do has a message.
template <class F> FmuStatus call(void* handle, Call kind, const char* function, F&& f) noexcept {
    FmuInstance* const instance = instance_of(handle);
    if (!instance) return fmu_error;
    try {
        if (!instance->may(kind, function) || !f(*instance)) return fmu_error;
    } catch (const std::exception& error) {
        instance->message(FmuInstance::Level::error, "logStatusError", "%s: %s", function, error.what());
        return fmu_error;
    }
    instance->order.done(kind);
    return fmu_ok;
}

/// The same of what the model itself does: after a failure nothing goes on.
template <class F> FmuStatus run(void* handle, Call kind, const char* function, F&& f) noexcept {
    return call(handle, kind, function, [&](FmuInstance& instance) {
        const bool good = f(instance);
        if (!good) instance.order.fail();
        return good;
    });
}

inline FmuStatus unsupported(void* handle, const char* function) noexcept {
    if (handle)
        instance_of(handle)->message(FmuInstance::Level::error, "logStatusError",
                                     "%s: this FMU has nothing of that kind", function);
    return fmu_error;
}

/// The instance for that token, or null, with a message.
inline void* opened(std::unique_ptr<FmuInstance> instance, const char* token) {
    if (!token || std::strcmp(token, fmu_models.token) != 0)
        instance->fail("the GUID or instantiation token is not that of this FMU");
    else if (instance->open())
        return instance.release();
    return nullptr;
}

inline bool has_states(FmuInstance& instance) {
    return instance.has_state() ||
           instance.fail("some blocks of the model cannot be saved, so there are no states");
}
inline bool is_state(FmuInstance& instance, const void* state) {
    return has_states(instance) && (state || instance.fail("there is no state at this address"));
}

/// The variable's memory holds its value of now.
inline bool refreshed(FmuInstance& instance, const FmuVariables::Variable& v) {
    if (instance.refresh(v)) return true;
    instance.order.fail();
    return false;
}
inline bool can_be_set(const FmuInstance& instance, const char* function, const FmuVariables::Variable& v) {
    const auto mode = instance.order.state();
    const bool is_before = mode == fmi::instantiated || mode == fmi::initialization;
    if (mode == fmi::configuration) {
        instance.message(FmuInstance::Level::error, "logStatusError",
                         "%s: '%s' is no structural parameter, as which alone the Configuration Mode sets",
                         function, v.name);
        return false;
    }
    if (v.setting == FmuSetting::always || (v.setting == FmuSetting::before && is_before)) return true;
    instance.message(FmuInstance::Level::error, "logStatusError",
                     v.setting == FmuSetting::none
                         ? "%s: '%s' is computed, it cannot be set"
                         : "%s: '%s' is fixed: initial states follow from it, so it is set before the run",
                     function, v.name);
    return false;
}
inline bool cannot_be(const FmuInstance& instance, const char* function, const FmuVariables::Variable& v,
                      double value) {
    instance.message(FmuInstance::Level::error, "logStatusError", "%s: '%s' cannot be %.17g", function,
                     v.name, value);
    return false;
}
inline bool has_none(const FmuInstance& instance, const char* function, std::uint32_t reference) {
    instance.message(FmuInstance::Level::error, "logStatusError", "%s: there is no variable %u of this type",
                     function, unsigned(reference));
    return false;
}

} // namespace bf::generated

#define BF_FMI_TEXT(name) #name
#define BF_FMI_NAME(name) BF_FMI_TEXT(name)
/// A function of the standard: its name in both versions, its parameters after the instance, in parentheses,
/// how and what it does.
#define BF_FMI_FUNCTION(name, parameters, how, kind, ...)                                                    \
    bf::generated::FmuStatus name parameters {                                                               \
        return bf::generated::how(                                                                           \
            handle, bf::fmi::Call::kind, BF_FMI_NAME(name),                                                  \
            [&]([[maybe_unused]] bf::generated::FmuInstance & instance) -> bool __VA_ARGS__);                \
    }

/// One of what this FMU has not.
#define BF_FMI_NONE(name, parameters)                                                                        \
    bf::generated::FmuStatus name parameters { return bf::generated::unsupported(handle, BF_FMI_NAME(name)); }

extern "C" {

BF_FMI_FUNCTION(BF_FMI(ExitInitializationMode), (void* handle), run, exit_initialization,
                { return instance.exit_initialization(); })
BF_FMI_FUNCTION(BF_FMI(Terminate), (void* handle), call, terminate, { return true; })
BF_FMI_FUNCTION(BF_FMI(Reset), (void* handle), run, reset, { return instance.reset(); })
void BF_FMI(FreeInstance)(void* handle) { delete bf::generated::instance_of(handle); }

// States: one that is given again is written over.
BF_FMI_FUNCTION(BF_FMI_STATE(Get), (void* handle, void** state), call, save_state, {
    if (!bf::generated::has_states(instance)) return false;
    if (!state) return instance.fail("there is no place for the state");
    if (!*state) *state = new bf::generated::FmuState{nullptr, instance.order, {}, {}};
    instance.save(*static_cast<bf::generated::FmuState*>(*state));
    return true;
})
BF_FMI_FUNCTION(BF_FMI_STATE(Set), (void* handle, void* state), call, save_state, {
    if (!bf::generated::is_state(instance, state)) return false;
    return instance.restore(*static_cast<const bf::generated::FmuState*>(state));
})
BF_FMI_FUNCTION(BF_FMI_STATE(Free), (void* handle, void** state), call, save_state, {
    if (state) delete static_cast<bf::generated::FmuState*>(std::exchange(*state, nullptr));
    return true;
})
BF_FMI_FUNCTION(BF_FMI_STATE_SIZE, (void* handle, void* state, size_t* size), call, save_state, {
    if (!bf::generated::is_state(instance, state)) return false;
    *size = static_cast<const bf::generated::FmuState*>(state)->size();
    return true;
})
BF_FMI_FUNCTION(BF_FMI_STATE(Serialize), (void* handle, void* state, BF_FMI(Byte) * bytes, size_t size), call,
                save_state, {
                    if (!bf::generated::is_state(instance, state)) return false;
                    const auto& its = *static_cast<const bf::generated::FmuState*>(state);
                    if (size < its.size()) return instance.fail("the state needs more bytes");
                    its.serialize(reinterpret_cast<unsigned char*>(bytes), bf::generated::fmu_models.token);
                    return true;
                })
BF_FMI_FUNCTION(BF_FMI_DESERIALIZE, (void* handle, const BF_FMI(Byte) * bytes, size_t size, void** state),
                call, save_state, {
                    if (!bf::generated::has_states(instance)) return false;
                    *state = bf::generated::FmuState::deserialize(
                                 instance.tables(), instance.model_size(), instance.order,
                                 bf::generated::fmu_models.token,
                                 reinterpret_cast<const unsigned char*>(bytes), size)
                                 .release();
                    return *state ||
                           instance.fail("these bytes are no state of an instance of this kind of this FMU");
                })

// Model exchange.
BF_FMI_FUNCTION(BF_FMI(EnterEventMode), (void* handle), run, enter_event_mode,
                { return instance.enter_event(); })
BF_FMI_FUNCTION(BF_FMI(EnterContinuousTimeMode), (void* handle), run, enter_continuous_time,
                { return instance.leave_event(); })
BF_FMI_FUNCTION(BF_FMI(CompletedIntegratorStep),
                (void* handle, BF_FMI(Boolean), BF_FMI(Boolean) * enter_event_mode,
                 BF_FMI(Boolean) * terminate),
                call, completed_integrator_step, {
                    *enter_event_mode = *terminate = false;
                    return true;
                })
BF_FMI_FUNCTION(BF_FMI(SetTime), (void* handle, double time), call, set_time, {
    instance.set_time(time);
    return true;
})
BF_FMI_FUNCTION(BF_FMI(SetContinuousStates), (void* handle, const double* values, size_t count), call,
                set_continuous_states, {
                    if (!instance.has_count(count, instance.exchange().continuous_count)) return false;
                    instance.set_states(values);
                    return true;
                })
BF_FMI_FUNCTION(BF_FMI(GetContinuousStates), (void* handle, double* values, size_t count), run,
                get_continuous, {
                    return instance.has_count(count, instance.exchange().continuous_count) &&
                           instance.get_states(values);
                })
BF_FMI_FUNCTION(BF_FMI_DERIVATIVES, (void* handle, double* values, size_t count), run, get_continuous, {
    return instance.has_count(count, instance.exchange().continuous_count) && instance.get_rates(values);
})
BF_FMI_FUNCTION(BF_FMI(GetEventIndicators), (void* handle, double* values, size_t count), run, get_continuous,
                {
                    return instance.has_count(count, instance.exchange().guard_count) &&
                           instance.compute_crossings(values);
                })
BF_FMI_FUNCTION(BF_FMI(GetNominalsOfContinuousStates), (void* handle, double* values, size_t count), call,
                get_nominals, {
                    std::fill(values, values + count, 1.0);
                    return instance.has_count(count, instance.exchange().continuous_count);
                })

} // extern "C"
