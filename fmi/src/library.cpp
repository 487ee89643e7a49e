// Libraries of FMUs.
#include "arithmetic.hpp"
#include "functions.hpp"

#include <dlfcn.h>
#include <sys/utsname.h>

namespace bf::fmi {

namespace fs = std::filesystem;

namespace {

/// All functions of the standards, by their names.
constexpr const char* names_3[] = {"fmi3GetVersion",
                                   "fmi3SetDebugLogging",
                                   "fmi3InstantiateModelExchange",
                                   "fmi3InstantiateCoSimulation",
                                   "fmi3InstantiateScheduledExecution",
                                   "fmi3FreeInstance",
                                   "fmi3EnterInitializationMode",
                                   "fmi3ExitInitializationMode",
                                   "fmi3EnterEventMode",
                                   "fmi3Terminate",
                                   "fmi3Reset",
                                   "fmi3GetFloat32",
                                   "fmi3GetFloat64",
                                   "fmi3GetInt8",
                                   "fmi3GetUInt8",
                                   "fmi3GetInt16",
                                   "fmi3GetUInt16",
                                   "fmi3GetInt32",
                                   "fmi3GetUInt32",
                                   "fmi3GetInt64",
                                   "fmi3GetUInt64",
                                   "fmi3GetBoolean",
                                   "fmi3GetString",
                                   "fmi3GetBinary",
                                   "fmi3GetClock",
                                   "fmi3SetFloat32",
                                   "fmi3SetFloat64",
                                   "fmi3SetInt8",
                                   "fmi3SetUInt8",
                                   "fmi3SetInt16",
                                   "fmi3SetUInt16",
                                   "fmi3SetInt32",
                                   "fmi3SetUInt32",
                                   "fmi3SetInt64",
                                   "fmi3SetUInt64",
                                   "fmi3SetBoolean",
                                   "fmi3SetString",
                                   "fmi3SetBinary",
                                   "fmi3SetClock",
                                   "fmi3GetNumberOfVariableDependencies",
                                   "fmi3GetVariableDependencies",
                                   "fmi3GetFMUState",
                                   "fmi3SetFMUState",
                                   "fmi3FreeFMUState",
                                   "fmi3SerializedFMUStateSize",
                                   "fmi3SerializeFMUState",
                                   "fmi3DeserializeFMUState",
                                   "fmi3GetDirectionalDerivative",
                                   "fmi3GetAdjointDerivative",
                                   "fmi3EnterConfigurationMode",
                                   "fmi3ExitConfigurationMode",
                                   "fmi3GetIntervalDecimal",
                                   "fmi3GetIntervalFraction",
                                   "fmi3GetShiftDecimal",
                                   "fmi3GetShiftFraction",
                                   "fmi3SetIntervalDecimal",
                                   "fmi3SetIntervalFraction",
                                   "fmi3SetShiftDecimal",
                                   "fmi3SetShiftFraction",
                                   "fmi3EvaluateDiscreteStates",
                                   "fmi3UpdateDiscreteStates",
                                   "fmi3EnterContinuousTimeMode",
                                   "fmi3CompletedIntegratorStep",
                                   "fmi3SetTime",
                                   "fmi3SetContinuousStates",
                                   "fmi3GetContinuousStateDerivatives",
                                   "fmi3GetEventIndicators",
                                   "fmi3GetContinuousStates",
                                   "fmi3GetNominalsOfContinuousStates",
                                   "fmi3GetNumberOfEventIndicators",
                                   "fmi3GetNumberOfContinuousStates",
                                   "fmi3EnterStepMode",
                                   "fmi3GetOutputDerivatives",
                                   "fmi3DoStep",
                                   "fmi3ActivateModelPartition"};
constexpr const char* common_2[] = {"fmi2GetTypesPlatform",
                                    "fmi2GetVersion",
                                    "fmi2SetDebugLogging",
                                    "fmi2Instantiate",
                                    "fmi2FreeInstance",
                                    "fmi2SetupExperiment",
                                    "fmi2EnterInitializationMode",
                                    "fmi2ExitInitializationMode",
                                    "fmi2Terminate",
                                    "fmi2Reset",
                                    "fmi2GetReal",
                                    "fmi2GetInteger",
                                    "fmi2GetBoolean",
                                    "fmi2GetString",
                                    "fmi2SetReal",
                                    "fmi2SetInteger",
                                    "fmi2SetBoolean",
                                    "fmi2SetString",
                                    "fmi2GetFMUstate",
                                    "fmi2SetFMUstate",
                                    "fmi2FreeFMUstate",
                                    "fmi2SerializedFMUstateSize",
                                    "fmi2SerializeFMUstate",
                                    "fmi2DeSerializeFMUstate",
                                    "fmi2GetDirectionalDerivative"};
constexpr const char* co_simulation_2[] = {"fmi2SetRealInputDerivatives",
                                           "fmi2GetRealOutputDerivatives",
                                           "fmi2DoStep",
                                           "fmi2CancelStep",
                                           "fmi2GetStatus",
                                           "fmi2GetRealStatus",
                                           "fmi2GetIntegerStatus",
                                           "fmi2GetBooleanStatus",
                                           "fmi2GetStringStatus"};
constexpr const char* model_exchange_2[] = {"fmi2EnterEventMode",
                                            "fmi2NewDiscreteStates",
                                            "fmi2EnterContinuousTimeMode",
                                            "fmi2CompletedIntegratorStep",
                                            "fmi2SetTime",
                                            "fmi2SetContinuousStates",
                                            "fmi2GetDerivatives",
                                            "fmi2GetEventIndicators",
                                            "fmi2GetContinuousStates",
                                            "fmi2GetNominalsOfContinuousStates"};

/// The folder of a machine's libraries in the archive.
std::string platform(int version) {
    utsname system{};
    uname(&system);
    const std::string machine = system.machine;
    return version == 2 && machine == "x86_64" ? "linux64" : machine + "-linux";
}

std::string list_of(const fs::path& folder) {
    std::string list;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error))
        list += (list.empty() ? "" : ", ") + entry.path().filename().string();
    return list.empty() ? "none" : list;
}

} // namespace

Library::Library(const fs::path& archive, Kind kind, const Structure& structure)
    : Library(archive, fmi::description_of(archive, structure), kind, structure) {}

Library::Library(const fs::path& archive, Description description, Kind kind, Structure structure)
    : archive_(archive), kind_(kind), structure_(std::move(structure)), description_(std::move(description)),
      folder_(archive.stem().string()), functions_(std::make_unique<Functions>()) {
    if (!interface())
        throw FmuError(archive.string() + (kind == Kind::co_simulation ? ": it is for model exchange alone"
                                                                       : ": it is for co-simulation alone"));
    extract(archive, folder_.path());
    const std::string name = platform(description_.version), identifier = interface()->identifier;
    const fs::path file = folder_.path() / "binaries" / name / (identifier + ".so");
    if (!fs::exists(file))
        throw FmuError(
            archive.string() + ": it has no binaries/" + name + "/" + identifier + ".so, but binaries for: " +
            list_of(folder_.path() / "binaries") + "; have it exported for this machine" +
            (description_.version == 2 ? " (FMI 2.0.4, section 2.3)" : " (FMI 3.0, section 2.5.1)"));
    {
        const KeptArithmetic kept;
        UnderWay under_way(archive.filename().string());
        under_way.set("its opening");
        handle_ = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
        changes_arithmetic_ = kept.is_changed();
        under_way.set(nullptr);
    }
    if (!handle_) {
        std::string why = ::dlerror();
        if (const auto at = why.find(file.string() + ": "); at != std::string::npos)
            why.erase(at, file.string().size() + 2);
        throw FmuError(archive.string() + ": its library cannot be opened: " + why + without_tool());
    }
    std::string lacks;
    const auto load = [&](auto& function, const char* its_name) {
        function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(::dlsym(handle_, its_name));
        if (!function) lacks += (lacks.empty() ? "" : ", ") + std::string(its_name);
    };
    const bool steps = kind == Kind::co_simulation;
#define BF_FMI_LOAD(function) load(functions_->function, #function);
    if (description_.version == 2) {
        BF_FMI2_FUNCTIONS(BF_FMI_LOAD)
        if (interface()->has_derivatives) BF_FMI2_DERIVATIVES(BF_FMI_LOAD)
        if (steps) {
            BF_FMI2_CO_SIMULATION(BF_FMI_LOAD)
        } else {
            BF_FMI2_MODEL_EXCHANGE(BF_FMI_LOAD)
        }
    } else {
        BF_FMI3_FUNCTIONS(BF_FMI_LOAD)
        if (interface()->has_derivatives) BF_FMI3_DERIVATIVES(BF_FMI_LOAD)
        if (!structure_.empty()) {
            BF_FMI3_CONFIGURATION(BF_FMI_LOAD)
        }
        if (description_.has_clocks()) {
            BF_FMI3_CLOCKS(BF_FMI_LOAD)
            if (steps) {
                BF_FMI3_EVENTS(BF_FMI_LOAD)
                BF_FMI3_STEPS(BF_FMI_LOAD)
            }
        }
        if (steps) {
            BF_FMI3_CO_SIMULATION(BF_FMI_LOAD)
        } else {
            BF_FMI3_MODEL_EXCHANGE(BF_FMI_LOAD)
        }
    }
#undef BF_FMI_LOAD
    if (lacks.empty()) return;
    ::dlclose(handle_);
    throw FmuError(archive.string() + ": its library lacks the functions " + lacks +
                   (description_.version == 2 ? " (FMI 2.0.4, section 2.1)" : " (FMI 3.0, section 2.2)"));
}

Library::~Library() {
    if (!handle_) return;
    const KeptArithmetic kept;
    UnderWay under_way(archive_.filename().string());
    under_way.set("its closing");
    ::dlclose(handle_);
    under_way.set(nullptr);
}

std::string Library::without_tool() const {
    return interface()->needs_tool
               ? "; it says that it needs the tool that made it, " +
                     (description_.tool.empty() ? "which it does not name" : description_.tool)
               : "";
}

std::vector<std::string> Library::missing() const {
    std::vector<std::string> all;
    const auto look = [&](const auto& names) {
        for (const char* name : names)
            if (!::dlsym(handle_, name)) all.emplace_back(name);
    };
    if (description_.version == 3) {
        look(names_3);
    } else {
        look(common_2);
        if (kind_ == Kind::co_simulation)
            look(co_simulation_2);
        else
            look(model_exchange_2);
    }
    return all;
}

} // namespace bf::fmi
