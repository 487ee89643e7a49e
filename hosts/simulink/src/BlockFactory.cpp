// The level-2 S-function `BlockFactory`: any block of any plugin, and the standard blocks, in Simulink.
#define S_FUNCTION_NAME BlockFactory
#define S_FUNCTION_LEVEL 2

#include <BlockFactory/Core/Log.h>

#include "block.hpp"

#include <simstruc.h>

#include <algorithm>
#include <string>

namespace {

using namespace bf;
using namespace bf::simulink;
namespace core = blockfactory::core;

/// Where the block of a run is kept; null outside a run.
Running* running(SimStruct* S) {
    void** work = ssGetPWork(S);
    return work ? static_cast<Running*>(work[0]) : nullptr;
}

/// Nothing leaves a callback: what goes wrong becomes the block's error status, with path and callback. What
/// hosted blocks logged becomes a warning.
template <class F> void guarded(SimStruct* S, const char* callback, F&& f) noexcept {
    static std::string message; // Simulink reads it after the callback returned
    const auto fail = [&](const std::string& reason) {
        std::string path = ssGetPath(S);
        std::replace(path.begin(), path.end(), '\n', ' ');
        message = path + ", " + callback + ": " + reason;
        ssSetErrorStatus(S, message.c_str());
    };
    try {
        f();
        auto& log = core::Log::getSingleton();
        if (std::string warnings = log.getWarnings(); !warnings.empty()) {
            log.clearWarnings();
            warnings.pop_back(); // the last line break
            ssWarning(S, warnings.c_str());
        }
    } catch (const std::exception& error) {
        fail(error.what());
    } catch (...) {
        fail("an exception of unknown type");
    }
}

/// What Simulink has decided about a port tells more about others, where `set` says that it could be set.
template <class Set> void take(SimStruct* S, const char* callback, Set&& set) {
    guarded(S, callback, [&] {
        if (!set()) return;
        Prototype prototype(S);
        prototype.learn(S);
        prototype.tell(S);
    });
}

} // namespace

extern "C" {

static void mdlInitializeSizes(SimStruct* S) {
    guarded(S, "mdlInitializeSizes", [&] {
        ssSetNumSFcnParams(S, ssGetSFcnParamsCount(S));
        Prototype prototype(S);
        for (int i = 0; i < prototype.parameter_count(); ++i)
            ssSetSFcnParamTunable(S, i,
                                  prototype.is_tunable(i) ? SS_PRM_SIM_ONLY_TUNABLE : SS_PRM_NOT_TUNABLE);
        const int inputs = static_cast<int>(prototype.inputs.size());
        const int outputs = static_cast<int>(prototype.outputs.size());
        if (!ssSetNumInputPorts(S, inputs) || !ssSetNumOutputPorts(S, outputs)) return;
        for (int i = 0; i < inputs; ++i) {
            ssSetInputPortDimensionInfo(S, i, DYNAMIC_DIMENSION);
            ssSetInputPortDataType(S, i, DYNAMICALLY_TYPED);
            ssSetInputPortRequiredContiguous(S, i, 1);
            ssSetInputPortOptimOpts(S, i, SS_NOT_REUSABLE_AND_GLOBAL);
            ssSetInputPortDirectFeedThrough(
                S, i, prototype.feeds_through(prototype.inputs[static_cast<std::size_t>(i)]));
        }
        for (int i = 0; i < outputs; ++i) {
            ssSetOutputPortDimensionInfo(S, i, DYNAMIC_DIMENSION);
            ssSetOutputPortDataType(S, i, DYNAMICALLY_TYPED);
            ssSetOutputPortOptimOpts(S, i, SS_NOT_REUSABLE_AND_GLOBAL);
        }
        prototype.learn(S);
        prototype.tell(S);
        if (!prototype.declaration().provisions.empty())
            Scope::instance().enter(ssGetPath(S), prototype.type(), prototype.arguments);

        // What mdlSetWorkWidths sets must be open before: numbers follow from the sizes of the ports.
        ssSetNumContStates(S, prototype.has(Role::continuous_state) ? DYNAMICALLY_SIZED : 0);
        ssSetNumDiscStates(S, 0); // discrete states are work vectors with names and types
        ssSetNumNonsampledZCs(S, DYNAMICALLY_SIZED);
        ssSetNumSampleTimes(S, 1);
        ssSetNumPWork(S, DYNAMICALLY_SIZED);
        if (!ssSetNumDWork(S, DYNAMICALLY_SIZED)) return;
        ssSetSimStateCompliance(S, USE_CUSTOM_SIM_STATE);
        ssSetOptions(S, SS_OPTION_WORKS_WITH_CODE_REUSE | SS_OPTION_EXCEPTION_FREE_CODE |
                            SS_OPTION_ALLOW_INPUT_SCALAR_EXPANSION | SS_OPTION_USE_TLC_WITH_ACCELERATOR |
                            SS_OPTION_CALL_TERMINATE_ON_EXIT);
    });
}

static void mdlInitializeSampleTimes(SimStruct* S) {
    guarded(S, "mdlInitializeSampleTimes", [&] {
        const Prototype prototype(S);
        double period = prototype.period, offset = prototype.offset;
        if (prototype.has(Role::continuous_state)) {
            if (period > 0) throw std::runtime_error("it has continuous states: sample_time must be 0 or -1");
            period = CONTINUOUS_SAMPLE_TIME;
        } else if (period <= 0 && prototype.has_state()) {
            offset = FIXED_IN_MINOR_STEP_OFFSET; // discrete states do not change inside a step
        }
        ssSetSampleTime(S, 0, period);
        ssSetOffsetTime(S, 0, offset);
        ssSetModelReferenceSampleTimeDefaultInheritance(S);
    });
}

#define MDL_SET_INPUT_PORT_DIMENSION_INFO
static void mdlSetInputPortDimensionInfo(SimStruct* S, int_T port, const DimsInfo_T* info) {
    take(S, "mdlSetInputPortDimensionInfo", [&] { return ssSetInputPortDimensionInfo(S, port, info) != 0; });
}

#define MDL_SET_OUTPUT_PORT_DIMENSION_INFO
static void mdlSetOutputPortDimensionInfo(SimStruct* S, int_T port, const DimsInfo_T* info) {
    take(S, "mdlSetOutputPortDimensionInfo",
         [&] { return ssSetOutputPortDimensionInfo(S, port, info) != 0; });
}

#define MDL_SET_DEFAULT_PORT_DIMENSION_INFO
static void mdlSetDefaultPortDimensionInfo(SimStruct* S) {
    guarded(S, "mdlSetDefaultPortDimensionInfo", [&] {
        Prototype prototype(S);
        prototype.require_providers();
        prototype.learn(S);
        settle_sizes(prototype.instance().block());
        prototype.tell(S);
    });
}

#define MDL_SET_INPUT_PORT_DATA_TYPE
static void mdlSetInputPortDataType(SimStruct* S, int_T port, DTypeId type) {
    take(S, "mdlSetInputPortDataType", [&] { return ssSetInputPortDataType(S, port, type), true; });
}

#define MDL_SET_OUTPUT_PORT_DATA_TYPE
static void mdlSetOutputPortDataType(SimStruct* S, int_T port, DTypeId type) {
    take(S, "mdlSetOutputPortDataType", [&] { return ssSetOutputPortDataType(S, port, type), true; });
}

#define MDL_SET_DEFAULT_PORT_DATA_TYPES
static void mdlSetDefaultPortDataTypes(SimStruct* S) {
    guarded(S, "mdlSetDefaultPortDataTypes", [&] {
        Prototype prototype(S);
        prototype.learn(S);
        settle_types(prototype.instance().block());
        prototype.tell(S);
    });
}

#define MDL_SET_WORK_WIDTHS
static void mdlSetWorkWidths(SimStruct* S) {
    guarded(S, "mdlSetWorkWidths", [&] {
        Prototype prototype(S);
        prototype.require_providers();
        prototype.learn(S);
        settle_sizes(prototype.instance().block());
        settle_types(prototype.instance().block());
        prototype.instance().require_resolved();
        Running::declare_work(S, prototype);
    });
}

#define MDL_START
static void mdlStart(SimStruct* S) {
    guarded(S, "mdlStart", [&] { ssGetPWork(S)[0] = new Running(S); });
}

#define MDL_INITIALIZE_CONDITIONS
static void mdlInitializeConditions(SimStruct* S) {
    guarded(S, "mdlInitializeConditions", [&] {
        if (auto* block = running(S)) block->reset(S);
    });
}

static void mdlOutputs(SimStruct* S, int_T) {
    guarded(S, "mdlOutputs", [&] { running(S)->output(S); });
}

#define MDL_UPDATE
static void mdlUpdate(SimStruct* S, int_T) {
    guarded(S, "mdlUpdate", [&] { running(S)->update(S); });
}

#define MDL_DERIVATIVES
static void mdlDerivatives(SimStruct* S) {
    guarded(S, "mdlDerivatives", [&] { running(S)->derivative(S); });
}

#define MDL_ZERO_CROSSINGS
static void mdlZeroCrossings(SimStruct* S) {
    guarded(S, "mdlZeroCrossings", [&] { running(S)->zero_crossings(S); });
}

#define MDL_CHECK_PARAMETERS
static void mdlCheckParameters(SimStruct* S) {
    guarded(S, "mdlCheckParameters", [&] {
        const Prototype changed(S);
        if (auto* block = running(S)) block->check_parameters(changed);
    });
}

#define MDL_PROCESS_PARAMETERS
static void mdlProcessParameters(SimStruct* S) {
    guarded(S, "mdlProcessParameters", [&] {
        if (auto* block = running(S)) block->take_parameters(Prototype(S));
    });
}

#define MDL_SIM_STATE
static mxArray* mdlGetSimState(SimStruct* S) {
    mxArray* state = nullptr;
    guarded(S, "mdlGetSimState", [&] { state = running(S)->save(S); });
    return state;
}
static void mdlSetSimState(SimStruct* S, const mxArray* state) {
    guarded(S, "mdlSetSimState", [&] { running(S)->restore(S, state); });
}

static void mdlTerminate(SimStruct* S) {
    guarded(S, "mdlTerminate", [&] {
        delete running(S);
        if (void** work = ssGetPWork(S)) work[0] = nullptr;
        Scope::instance().leave(ssGetPath(S));
    });
}

#define MDL_RTW
static void mdlRTW(SimStruct* S) {
    guarded(S, "mdlRTW", [&] {
        const Prototype prototype(S);
        write_record(S, prototype, prototype.period_of_steps(S));
    });
}

#ifdef MATLAB_MEX_FILE
#include "simulink.c"
#else
#include "cg_sfun.h"
#endif

} // extern "C"
