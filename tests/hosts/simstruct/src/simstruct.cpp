#include "simstruct.hpp"

#include <cstdarg>

namespace simstruct {
int bytes_of(DTypeId type) {
    constexpr int bytes[] = {8, 4, 1, 1, 2, 2, 4, 4, 1};
    return bytes[type];
}
} // namespace simstruct

int SimStruct_tag::Port::width() const {
    if (dims.empty()) return DYNAMICALLY_SIZED;
    int count = 1;
    for (const int n : dims) count *= n;
    return count;
}

void SimStruct_tag::set_count(int& count, int number, const char* what) {
    const bool is_open = phase == "mdlSetWorkWidths" && count == DYNAMICALLY_SIZED;
    if (phase != "mdlInitializeSizes" && !is_open) forbid("the number of " + std::string(what) + " is set");
    count = number;
}

SimStruct_tag::~SimStruct_tag() {
    for (auto* array : parameters) mxDestroyArray(array);
}

namespace {

using Port = SimStruct_tag::Port;

int set_dimension(SimStruct* S, std::vector<Port>& ports, int_T port, const DimsInfo_T* info) {
    if (port < 0 || port >= static_cast<int>(ports.size())) {
        S->forbid("a port that does not exist is sized");
        return 0;
    }
    if (info->width == DYNAMICALLY_SIZED) return 1;
    std::vector<int_T> dims(info->dims, info->dims + info->numDims);
    auto& known = ports[static_cast<std::size_t>(port)].dims;
    for (const int n : dims)
        if (n <= 0) S->forbid("a length that is not positive is set");
    if (!known.empty() && known != dims && S->phase != "mdlInitializeSizes")
        S->forbid("the known size of a port is changed");
    known = std::move(dims);
    return 1;
}

int set_ports(SimStruct* S, std::vector<Port>& ports, int_T number) {
    if (S->phase != "mdlInitializeSizes") S->forbid("the number of ports is set");
    ports.assign(static_cast<std::size_t>(number), {});
    return 1;
}

Port& at(std::vector<Port>& ports, int_T port) { return ports.at(static_cast<std::size_t>(port)); }

} // namespace

extern "C" {

static DimsInfo_T dynamic_dimension = {DYNAMICALLY_SIZED, DYNAMICALLY_SIZED, nullptr};
DimsInfo_T* const DYNAMIC_DIMENSION = &dynamic_dimension;

const char* ssGetPath(SimStruct* S) { return S->path.c_str(); }
void ssSetErrorStatus(SimStruct* S, const char* message) {
    S->has_error = message != nullptr;
    S->error = message ? message : "";
}
const char* ssGetErrorStatus(SimStruct* S) { return S->has_error ? S->error.c_str() : nullptr; }
void ssWarning(SimStruct* S, const char* message) { S->warnings.emplace_back(message); }
void ssSetOptions(SimStruct*, uint_T) {}
void ssSetSimStateCompliance(SimStruct*, int) {}

void ssSetNumSFcnParams(SimStruct* S, int_T number) {
    S->wanted_parameters = number;
    S->tunable.assign(static_cast<std::size_t>(number), SS_PRM_TUNABLE);
}
int_T ssGetNumSFcnParams(SimStruct* S) { return S->wanted_parameters; }
int_T ssGetSFcnParamsCount(SimStruct* S) { return static_cast<int_T>(S->parameters.size()); }
const mxArray* ssGetSFcnParam(SimStruct* S, int_T index) {
    return S->parameters.at(static_cast<std::size_t>(index));
}
void ssSetSFcnParamTunable(SimStruct* S, int_T index, int_T tunable) {
    S->tunable.at(static_cast<std::size_t>(index)) = tunable;
}

int ssSetNumInputPorts(SimStruct* S, int_T number) { return set_ports(S, S->inputs, number); }
int ssSetNumOutputPorts(SimStruct* S, int_T number) { return set_ports(S, S->outputs, number); }
int_T ssGetNumInputPorts(SimStruct* S) { return static_cast<int_T>(S->inputs.size()); }
int_T ssGetNumOutputPorts(SimStruct* S) { return static_cast<int_T>(S->outputs.size()); }
int ssSetInputPortDimensionInfo(SimStruct* S, int_T port, const DimsInfo_T* info) {
    return set_dimension(S, S->inputs, port, info);
}
int ssSetOutputPortDimensionInfo(SimStruct* S, int_T port, const DimsInfo_T* info) {
    return set_dimension(S, S->outputs, port, info);
}
int ssSetInputPortVectorDimension(SimStruct* S, int_T port, int_T width) {
    const DimsInfo_T info = {width, 1, &width};
    return set_dimension(S, S->inputs, port, &info);
}
int ssSetOutputPortVectorDimension(SimStruct* S, int_T port, int_T width) {
    const DimsInfo_T info = {width, 1, &width};
    return set_dimension(S, S->outputs, port, &info);
}
int ssSetInputPortMatrixDimensions(SimStruct* S, int_T port, int_T rows, int_T cols) {
    int_T dims[] = {rows, cols};
    const DimsInfo_T info = {rows * cols, 2, dims};
    return set_dimension(S, S->inputs, port, &info);
}
int ssSetOutputPortMatrixDimensions(SimStruct* S, int_T port, int_T rows, int_T cols) {
    int_T dims[] = {rows, cols};
    const DimsInfo_T info = {rows * cols, 2, dims};
    return set_dimension(S, S->outputs, port, &info);
}
int_T ssGetInputPortWidth(SimStruct* S, int_T port) { return at(S->inputs, port).width(); }
int_T ssGetOutputPortWidth(SimStruct* S, int_T port) { return at(S->outputs, port).width(); }
int_T ssGetInputPortNumDimensions(SimStruct* S, int_T port) {
    return static_cast<int_T>(at(S->inputs, port).dims.size());
}
int_T ssGetOutputPortNumDimensions(SimStruct* S, int_T port) {
    return static_cast<int_T>(at(S->outputs, port).dims.size());
}
int_T* ssGetInputPortDimensions(SimStruct* S, int_T port) { return at(S->inputs, port).dims.data(); }
int_T* ssGetOutputPortDimensions(SimStruct* S, int_T port) { return at(S->outputs, port).dims.data(); }
void ssSetInputPortDataType(SimStruct* S, int_T port, DTypeId type) { at(S->inputs, port).type = type; }
void ssSetOutputPortDataType(SimStruct* S, int_T port, DTypeId type) { at(S->outputs, port).type = type; }
DTypeId ssGetInputPortDataType(SimStruct* S, int_T port) { return at(S->inputs, port).type; }
DTypeId ssGetOutputPortDataType(SimStruct* S, int_T port) { return at(S->outputs, port).type; }
void ssSetInputPortDirectFeedThrough(SimStruct* S, int_T port, int_T feedthrough) {
    at(S->inputs, port).feedthrough = feedthrough != 0;
}
void ssSetInputPortRequiredContiguous(SimStruct*, int_T, int_T) {}
void ssSetInputPortOptimOpts(SimStruct*, int_T, uint_T) {}
void ssSetOutputPortOptimOpts(SimStruct*, int_T, uint_T) {}
int_T ssGetInputPortConnected(SimStruct* S, int_T port) { return at(S->inputs, port).connected; }
const void* ssGetInputPortSignal(SimStruct* S, int_T port) {
    if (S->phase == "mdlOutputs" && !at(S->inputs, port).feedthrough)
        S->forbid("an input without direct feedthrough is read");
    if (!S->was_started) S->forbid("a signal is read");
    return at(S->inputs, port).signal;
}
void* ssGetOutputPortSignal(SimStruct* S, int_T port) {
    if (!S->was_started) S->forbid("a signal is written");
    return at(S->outputs, port).own.data();
}

void ssSetNumSampleTimes(SimStruct*, int_T) {}
void ssSetSampleTime(SimStruct* S, int_T, time_T period) { S->sample_time = period; }
void ssSetOffsetTime(SimStruct* S, int_T, time_T offset) { S->offset = offset; }
time_T ssGetSampleTime(SimStruct* S, int_T) { return S->sample_time; }
time_T ssGetOffsetTime(SimStruct* S, int_T) { return S->offset; }
void ssSetModelReferenceSampleTimeDefaultInheritance(SimStruct*) {}
time_T ssGetT(SimStruct* S) { return S->time; }
time_T ssGetFixedStepSize(SimStruct* S) { return S->step_size; }
int_T ssIsMajorTimeStep(SimStruct* S) { return S->is_major; }
int_T ssIsVariableStepSolver(SimStruct*) { return 0; }

void ssSetNumContStates(SimStruct* S, int_T number) { S->set_count(S->wanted_states, number, "states"); }
void ssSetNumDiscStates(SimStruct*, int_T) {}
real_T* ssGetContStates(SimStruct* S) { return S->states.data(); }
real_T* ssGetdX(SimStruct* S) { return S->rates.data(); }
void ssSetSolverNeedsReset(SimStruct*) {}
void ssSetNumNonsampledZCs(SimStruct* S, int_T number) {
    S->set_count(S->wanted_crossings, number, "zero crossings");
    S->zero_crossings.resize(static_cast<std::size_t>(number < 0 ? 0 : number));
}
real_T* ssGetNonsampledZCs(SimStruct* S) { return S->zero_crossings.data(); }
void ssSetNumPWork(SimStruct* S, int_T number) { S->set_count(S->wanted_pointers, number, "pointers"); }
void** ssGetPWork(SimStruct* S) { return S->pointers.empty() ? nullptr : S->pointers.data(); }
int ssSetNumDWork(SimStruct* S, int_T number) {
    S->set_count(S->wanted_work, number, "work vectors");
    S->work.assign(static_cast<std::size_t>(number < 0 ? 0 : number), {});
    return 1;
}
void ssSetDWorkWidth(SimStruct* S, int_T index, int_T width) {
    if (width <= 0) S->forbid("an empty work vector is declared");
    S->work.at(static_cast<std::size_t>(index)).width = width;
}
void ssSetDWorkDataType(SimStruct* S, int_T index, DTypeId type) {
    S->work.at(static_cast<std::size_t>(index)).type = type;
}
void ssSetDWorkName(SimStruct* S, int_T index, char_T* name) {
    S->work.at(static_cast<std::size_t>(index)).name = name;
}
void ssSetDWorkUsedAsDState(SimStruct* S, int_T index, int_T used) {
    S->work.at(static_cast<std::size_t>(index)).is_state = used != 0;
}
void* ssGetDWork(SimStruct* S, int_T index) {
    return S->work.at(static_cast<std::size_t>(index)).memory.data();
}

int ssWriteRTWParamSettings(SimStruct* S, int_T number, ...) {
    std::va_list arguments;
    va_start(arguments, number);
    S->settings.emplace_back();
    for (int i = 0; i < number; ++i) {
        const int kind = va_arg(arguments, int);
        simstruct::Setting setting{va_arg(arguments, const char*), {}};
        if (kind == SSWRITE_VALUE_QSTR) {
            setting.value = std::string(va_arg(arguments, const char*));
        } else if (kind == SSWRITE_VALUE_NUM) {
            setting.value = va_arg(arguments, double);
        } else {
            const auto* data = va_arg(arguments, const double*);
            const int count = va_arg(arguments, int);
            setting.value = std::vector<double>(data, data + count);
        }
        S->settings.back().push_back(std::move(setting));
    }
    va_end(arguments);
    return 1;
}
int ssWriteRTWWorkVect(SimStruct* S, const char* vector, int_T number, const char* name, int_T width) {
    if (std::string(vector) != "PWork" || number != 1 || width != S->wanted_pointers)
        S->forbid("names are given to work that the block does not have");
    S->pointer_names = {{name, width}};
    return 1;
}

} // extern "C"
