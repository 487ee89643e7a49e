// Calls of the functions of an FMU.
#include "bf/fmi/instance.hpp"

#include "bf/base/escape.hpp"
#include "bf/fmi/fmi2.h"
#include "bf/fmi/fmi3.h"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
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

bool is_float64(int version, Type type) {
    return type == Type::float64 || (version == 2 && type == Type::float32);
}

template <class F> auto with_bytes(Type type, F&& f) {
    switch (type) {
    case Type::float32: return f(float{});
    case Type::int8: return f(std::int8_t{});
    case Type::uint8: return f(std::uint8_t{});
    case Type::int16: return f(std::int16_t{});
    case Type::uint16: return f(std::uint16_t{});
    case Type::int32: return f(std::int32_t{});
    case Type::uint32: return f(std::uint32_t{});
    case Type::uint64: return f(std::uint64_t{});
    case Type::boolean: return f(bool{});
    default: return f(std::int64_t{}); // enumerations, too
    }
}

} // namespace

bool has_values(Type type) { return type != Type::string && type != Type::binary && type != Type::clock; }

// ---- libraries

struct Library::Functions {
#define BF_FMI_FUNCTION(name) decltype(&::name) name = nullptr;
#define BF_FMI2_FUNCTIONS(f)                                                                                 \
    f(fmi2Instantiate) f(fmi2FreeInstance) f(fmi2SetupExperiment) f(fmi2EnterInitializationMode)             \
        f(fmi2ExitInitializationMode) f(fmi2Terminate) f(fmi2Reset) f(fmi2GetReal) f(fmi2GetInteger)         \
            f(fmi2GetBoolean) f(fmi2SetReal) f(fmi2SetInteger) f(fmi2SetBoolean) f(fmi2DoStep)               \
                f(fmi2GetFMUstate) f(fmi2SetFMUstate) f(fmi2FreeFMUstate) f(fmi2SerializedFMUstateSize)      \
                    f(fmi2SerializeFMUstate) f(fmi2DeSerializeFMUstate)
#define BF_FMI3_FUNCTIONS(f)                                                                                 \
    f(fmi3InstantiateCoSimulation) f(fmi3FreeInstance) f(fmi3EnterInitializationMode)                        \
        f(fmi3ExitInitializationMode) f(fmi3Terminate) f(fmi3Reset) f(fmi3DoStep) f(fmi3GetFMUState)         \
            f(fmi3SetFMUState) f(fmi3FreeFMUState) f(fmi3SerializedFMUStateSize) f(fmi3SerializeFMUState)    \
                f(fmi3DeserializeFMUState) f(fmi3GetFloat64) f(fmi3SetFloat64) f(fmi3GetFloat32)             \
                    f(fmi3SetFloat32) f(fmi3GetInt8) f(fmi3SetInt8) f(fmi3GetUInt8) f(fmi3SetUInt8)          \
                        f(fmi3GetInt16) f(fmi3SetInt16) f(fmi3GetUInt16) f(fmi3SetUInt16) f(fmi3GetInt32)    \
                            f(fmi3SetInt32) f(fmi3GetUInt32) f(fmi3SetUInt32) f(fmi3GetInt64)                \
                                f(fmi3SetInt64) f(fmi3GetUInt64) f(fmi3SetUInt64) f(fmi3GetBoolean)          \
                                    f(fmi3SetBoolean)
    BF_FMI2_FUNCTIONS(BF_FMI_FUNCTION)
    BF_FMI3_FUNCTIONS(BF_FMI_FUNCTION)
#undef BF_FMI_FUNCTION
};

Library::Library(const fs::path& archive)
    : archive_(archive), description_(fmi::description_of(archive)), folder_(archive.stem().string()),
      functions_(std::make_unique<Functions>()) {
    extract(archive, folder_.path());
    const auto& its = description_.co_simulation ? *description_.co_simulation : *description_.model_exchange;
    const std::string name = platform(description_.version);
    const fs::path file = folder_.path() / "binaries" / name / (its.identifier + ".so");
    if (!fs::exists(file))
        throw FmuError(
            archive.string() + ": it has no binaries/" + name + "/" + its.identifier +
            ".so, but binaries for: " + list_of(folder_.path() / "binaries") +
            "; have it exported for this machine" +
            (description_.version == 2 ? " (FMI 2.0.4, section 2.3)" : " (FMI 3.0, section 2.5.1)"));
    handle_ = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!handle_) {
        std::string why = ::dlerror();
        if (const auto at = why.find(file.string() + ": "); at != std::string::npos)
            why.erase(at, file.string().size() + 2);
        throw FmuError(archive.string() + ": its library cannot be opened: " + why);
    }
    std::string lacks;
    const auto load = [&](auto& function, const char* its_name) {
        function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(::dlsym(handle_, its_name));
        if (!function) lacks += (lacks.empty() ? "" : ", ") + std::string(its_name);
    };
#define BF_FMI_LOAD(function) load(functions_->function, #function);
    if (description_.version == 2) {
        BF_FMI2_FUNCTIONS(BF_FMI_LOAD)
    } else {
        BF_FMI3_FUNCTIONS(BF_FMI_LOAD)
    }
#undef BF_FMI_LOAD
#undef BF_FMI2_FUNCTIONS
#undef BF_FMI3_FUNCTIONS
    if (lacks.empty() || !description_.co_simulation) return;
    ::dlclose(handle_);
    throw FmuError(archive.string() + ": its library lacks the functions " + lacks +
                   (description_.version == 2 ? " (FMI 2.0.4, section 2.1)" : " (FMI 3.0, section 2.2)"));
}

Library::~Library() {
    if (handle_) ::dlclose(handle_);
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
        if (description_.co_simulation) look(co_simulation_2);
        if (description_.model_exchange) look(model_exchange_2);
    }
    return all;
}

// ---- values

std::size_t Values::add(const Variable& variable) {
    const std::size_t first = count_;
    references_.push_back(variable.reference);
    count_ += static_cast<std::size_t>(variable.count());
    if (is_float64(version_, type_))
        doubles_.resize(count_);
    else if (version_ == 2)
        integers_.resize(count_);
    else
        with_bytes(type_, [&](auto t) { bytes_.resize(count_ * sizeof t); });
    return first;
}

double Values::operator[](std::size_t i) const {
    if (!doubles_.empty()) return doubles_[i];
    if (version_ == 2) return integers_[i];
    return with_bytes(type_, [&](auto t) {
        std::memcpy(&t, bytes_.data() + i * sizeof t, sizeof t);
        return static_cast<double>(t);
    });
}

void Values::set(std::size_t i, double x) {
    if (!doubles_.empty()) {
        doubles_[i] = x;
    } else if (version_ == 2) {
        integers_[i] = type_ == Type::boolean ? x != 0 : static_cast<std::int32_t>(x);
    } else {
        with_bytes(type_, [&](auto t) {
            if constexpr (std::is_same_v<decltype(t), bool>)
                t = x != 0;
            else
                t = static_cast<decltype(t)>(x);
            std::memcpy(bytes_.data() + i * sizeof t, &t, sizeof t);
        });
    }
}

// ---- instances

struct Instance::Callbacks {
    fmi2CallbackFunctions of_2{};
};

Instance::Instance(const Library& library, const std::string& name, Log log)
    : library_(library), f_(*library.functions_), order_(library.description_.version, true, false),
      name_(name), token_(library.description_.token), log_(std::move(log)),
      callbacks_(std::make_unique<Callbacks>()) {
    const auto& d = library.description_;
    if (!d.co_simulation)
        throw FmuError(library.archive_.string() +
                       ": it is for model exchange alone; have it exported for co-simulation");
    const std::string resources = library.resources().string();
    if (d.version == 2) {
        callbacks_->of_2 = {reinterpret_cast<decltype(fmi2CallbackFunctions::logger)>(&Instance::log_2),
                            std::calloc, std::free, nullptr, this};
        instance_ = f_.fmi2Instantiate(name_.c_str(), fmi2CoSimulation, token_.c_str(),
                                       ("file://" + resources).c_str(), &callbacks_->of_2, false,
                                       static_cast<bool>(log_));
    } else {
        instance_ = f_.fmi3InstantiateCoSimulation(
            name_.c_str(), token_.c_str(), (resources + "/").c_str(), false, static_cast<bool>(log_), false,
            false, nullptr, 0, this,
            [](void* self, fmi3Status status, const char* category, const char* text) {
                log_3(self, status, category, text);
            },
            nullptr);
    }
    if (!instance_)
        throw FmuError(library.archive_.string() + ": it makes no instance" +
                       (logged_[0] ? std::string(": ") + logged_ : std::string()));
}

Instance::~Instance() {
    if (!instance_) return;
    if (order_.state() == step_mode) terminate();
    if (order_.version() == 2)
        f_.fmi2FreeInstance(instance_);
    else
        f_.fmi3FreeInstance(instance_);
}

void Instance::log(int status, const char* category, const char* text) noexcept {
    if (!text) return;
    if (status >= fmi3Discard) std::snprintf(logged_, sizeof logged_, "%s", text);
    try {
        if (log_) log_(status, category ? category : "", escape::shortened(text, 2000));
    } catch (const std::exception&) { // a message that cannot be kept is lost
    }
}

void Instance::log_3(void* self, int status, const char* category, const char* text) {
    if (self) static_cast<Instance*>(self)->log(status, category, text);
}

void Instance::log_2(void* self, const char*, int status, const char* category, const char* format, ...) {
    if (!self || !format) return;
    char text[2000];
    va_list list;
    va_start(list, format);
    std::vsnprintf(text, sizeof text, format, list);
    va_end(list);
    static_cast<Instance*>(self)->log(status, category, text);
}

void Instance::fail(const char* function, const char* why) noexcept {
    std::snprintf(failure_, sizeof failure_, "%.200s: %s%s", library_.archive_.filename().c_str(), function,
                  why);
    // Braces stand for numbers in the text of a Status.
    for (char* c = failure_; *c; ++c) *c = *c == '{' ? '(' : *c == '}' ? ')' : *c;
}

bool Instance::may(Call call, const char* function) noexcept {
    struct {
        char text[400];
    } problem{};
    logged_[0] = '\0';
    if (order_.check(call, function, problem)) return true;
    fail("", problem.text);
    return false;
}

bool Instance::done(Call call, const char* function, int status) noexcept {
    if (status <= fmi3Warning) {
        order_.done(call);
        return true;
    }
    constexpr const char* names[] = {"OK", "Warning", "Discard", "Error", "Fatal", "Pending"};
    char why[500];
    std::snprintf(why, sizeof why, " gave %s%s%s", status >= 0 && status <= 5 ? names[status] : "no status",
                  logged_[0] ? ": " : " and logged no reason", logged_);
    fail(function, why);
    if (status >= fmi3Error) order_.fail();
    return false;
}

bool Instance::enter_initialization(double start) noexcept {
    if (order_.version() == 2) {
        if (!may(Call::setup_experiment, "fmi2SetupExperiment") ||
            !done(Call::setup_experiment, "fmi2SetupExperiment",
                  f_.fmi2SetupExperiment(instance_, false, 0, start, false, 0)))
            return false;
        return may(Call::enter_initialization, "fmi2EnterInitializationMode") &&
               done(Call::enter_initialization, "fmi2EnterInitializationMode",
                    f_.fmi2EnterInitializationMode(instance_));
    }
    return may(Call::enter_initialization, "fmi3EnterInitializationMode") &&
           done(Call::enter_initialization, "fmi3EnterInitializationMode",
                f_.fmi3EnterInitializationMode(instance_, false, 0, start, false, 0));
}

bool Instance::exit_initialization() noexcept {
    const bool is_2 = order_.version() == 2;
    const char* const name = is_2 ? "fmi2ExitInitializationMode" : "fmi3ExitInitializationMode";
    return may(Call::exit_initialization, name) &&
           done(Call::exit_initialization, name,
                is_2 ? static_cast<int>(f_.fmi2ExitInitializationMode(instance_))
                     : static_cast<int>(f_.fmi3ExitInitializationMode(instance_)));
}

bool Instance::terminate() noexcept {
    const bool is_2 = order_.version() == 2;
    const char* const name = is_2 ? "fmi2Terminate" : "fmi3Terminate";
    return may(Call::terminate, name) && done(Call::terminate, name,
                                              is_2 ? static_cast<int>(f_.fmi2Terminate(instance_))
                                                   : static_cast<int>(f_.fmi3Terminate(instance_)));
}

bool Instance::reset() noexcept {
    const bool is_2 = order_.version() == 2;
    const char* const name = is_2 ? "fmi2Reset" : "fmi3Reset";
    return may(Call::reset, name) &&
           done(Call::reset, name,
                is_2 ? static_cast<int>(f_.fmi2Reset(instance_)) : static_cast<int>(f_.fmi3Reset(instance_)));
}

bool Instance::do_step(double time, double step) noexcept {
    if (order_.version() == 2)
        return may(Call::do_step, "fmi2DoStep") &&
               done(Call::do_step, "fmi2DoStep", f_.fmi2DoStep(instance_, time, step, true));
    bool needs_event = false, terminates = false, returned_early = false;
    double reached = time;
    if (!may(Call::do_step, "fmi3DoStep") || !done(Call::do_step, "fmi3DoStep",
                                                   f_.fmi3DoStep(instance_, time, step, true, &needs_event,
                                                                 &terminates, &returned_early, &reached)))
        return false;
    if (terminates)
        fail("fmi3DoStep", " asks for the end of the simulation");
    else if (returned_early)
        fail("fmi3DoStep", " ended its step early, though it was not allowed to (FMI 3.0, section 4.2.1)");
    return !terminates && !returned_early;
}

bool Instance::get(Values& values) noexcept {
    const auto* const references = values.references_.data();
    const auto count = values.references_.size();
    int status = fmi3OK;
    if (order_.version() == 2) {
        if (!may(Call::get_values, "fmi2Get")) return false;
        if (is_float64(2, values.type_))
            status = f_.fmi2GetReal(instance_, references, count, values.doubles_.data());
        else if (values.type_ == Type::boolean)
            status = f_.fmi2GetBoolean(instance_, references, count, values.integers_.data());
        else
            status = f_.fmi2GetInteger(instance_, references, count, values.integers_.data());
        return done(Call::get_values, "fmi2Get", status);
    }
    if (!may(Call::get_values, "fmi3Get")) return false;
    const auto size = values.count_;
    auto* const bytes = static_cast<void*>(values.bytes_.data());
#define BF_FMI_GET(T) f_.fmi3Get##T(instance_, references, count, static_cast<fmi3##T*>(bytes), size)
    switch (values.type_) {
    case Type::float64:
        status = f_.fmi3GetFloat64(instance_, references, count, values.doubles_.data(), size);
        break;
    case Type::float32: status = BF_FMI_GET(Float32); break;
    case Type::int8: status = BF_FMI_GET(Int8); break;
    case Type::uint8: status = BF_FMI_GET(UInt8); break;
    case Type::int16: status = BF_FMI_GET(Int16); break;
    case Type::uint16: status = BF_FMI_GET(UInt16); break;
    case Type::int32: status = BF_FMI_GET(Int32); break;
    case Type::uint32: status = BF_FMI_GET(UInt32); break;
    case Type::uint64: status = BF_FMI_GET(UInt64); break;
    case Type::boolean: status = BF_FMI_GET(Boolean); break;
    default: status = BF_FMI_GET(Int64); break;
    }
#undef BF_FMI_GET
    return done(Call::get_values, "fmi3Get", status);
}

bool Instance::set(const Values& values) noexcept {
    const auto* const references = values.references_.data();
    const auto count = values.references_.size();
    int status = fmi3OK;
    if (order_.version() == 2) {
        if (!may(Call::set_values, "fmi2Set")) return false;
        if (is_float64(2, values.type_))
            status = f_.fmi2SetReal(instance_, references, count, values.doubles_.data());
        else if (values.type_ == Type::boolean)
            status = f_.fmi2SetBoolean(instance_, references, count, values.integers_.data());
        else
            status = f_.fmi2SetInteger(instance_, references, count, values.integers_.data());
        return done(Call::set_values, "fmi2Set", status);
    }
    if (!may(Call::set_values, "fmi3Set")) return false;
    const auto size = values.count_;
    const auto* const bytes = static_cast<const void*>(values.bytes_.data());
#define BF_FMI_SET(T) f_.fmi3Set##T(instance_, references, count, static_cast<const fmi3##T*>(bytes), size)
    switch (values.type_) {
    case Type::float64:
        status = f_.fmi3SetFloat64(instance_, references, count, values.doubles_.data(), size);
        break;
    case Type::float32: status = BF_FMI_SET(Float32); break;
    case Type::int8: status = BF_FMI_SET(Int8); break;
    case Type::uint8: status = BF_FMI_SET(UInt8); break;
    case Type::int16: status = BF_FMI_SET(Int16); break;
    case Type::uint16: status = BF_FMI_SET(UInt16); break;
    case Type::int32: status = BF_FMI_SET(Int32); break;
    case Type::uint32: status = BF_FMI_SET(UInt32); break;
    case Type::uint64: status = BF_FMI_SET(UInt64); break;
    case Type::boolean: status = BF_FMI_SET(Boolean); break;
    default: status = BF_FMI_SET(Int64); break;
    }
#undef BF_FMI_SET
    return done(Call::set_values, "fmi3Set", status);
}

bool Instance::save(std::vector<std::uint8_t>& bytes) noexcept {
    void* state = nullptr;
    std::size_t size = 0;
    const bool is_2 = order_.version() == 2;
    if (!may(Call::save_state, is_2 ? "fmi2GetFMUstate" : "fmi3GetFMUState")) return false;
    bool good = false;
    if (is_2) {
        good = done(Call::save_state, "fmi2GetFMUstate", f_.fmi2GetFMUstate(instance_, &state)) &&
               done(Call::save_state, "fmi2SerializedFMUstateSize",
                    f_.fmi2SerializedFMUstateSize(instance_, state, &size));
        if (good) {
            bytes.resize(size);
            good =
                done(Call::save_state, "fmi2SerializeFMUstate",
                     f_.fmi2SerializeFMUstate(instance_, state, reinterpret_cast<char*>(bytes.data()), size));
        }
        if (state) f_.fmi2FreeFMUstate(instance_, &state);
        return good;
    }
    good = done(Call::save_state, "fmi3GetFMUState", f_.fmi3GetFMUState(instance_, &state)) &&
           done(Call::save_state, "fmi3SerializedFMUStateSize",
                f_.fmi3SerializedFMUStateSize(instance_, state, &size));
    if (good) {
        bytes.resize(size);
        good = done(Call::save_state, "fmi3SerializeFMUState",
                    f_.fmi3SerializeFMUState(instance_, state, bytes.data(), size));
    }
    if (state) f_.fmi3FreeFMUState(instance_, &state);
    return good;
}

bool Instance::restore(const std::vector<std::uint8_t>& bytes) noexcept {
    void* state = nullptr;
    const bool is_2 = order_.version() == 2;
    if (!may(Call::save_state, is_2 ? "fmi2DeSerializeFMUstate" : "fmi3DeserializeFMUState")) return false;
    bool good = false;
    if (is_2) {
        good = done(Call::save_state, "fmi2DeSerializeFMUstate",
                    f_.fmi2DeSerializeFMUstate(instance_, reinterpret_cast<const char*>(bytes.data()),
                                               bytes.size(), &state)) &&
               done(Call::save_state, "fmi2SetFMUstate", f_.fmi2SetFMUstate(instance_, state));
        if (state) f_.fmi2FreeFMUstate(instance_, &state);
    } else {
        good = done(Call::save_state, "fmi3DeserializeFMUState",
                    f_.fmi3DeserializeFMUState(instance_, bytes.data(), bytes.size(), &state)) &&
               done(Call::save_state, "fmi3SetFMUState", f_.fmi3SetFMUState(instance_, state));
        if (state) f_.fmi3FreeFMUState(instance_, &state);
    }
    if (good) order_.set_state(step_mode); // the state was saved between two steps
    return good;
}

} // namespace bf::fmi
