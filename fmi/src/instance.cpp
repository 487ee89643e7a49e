// Calls of the functions of an FMU.
#include "arithmetic.hpp"
#include "functions.hpp"

#include "bf/base/escape.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

namespace bf::fmi {

namespace {

constexpr double untouched = -2.2250738585072014e-308; ///< what no FMU writes behind the end of its numbers
constexpr int most_iterations = 1000;                  ///< of one event
constexpr std::size_t most_state_bytes = std::size_t{1} << 30; ///< of a saved state

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

void* Values::data() {
    return !doubles_.empty()    ? static_cast<void*>(doubles_.data())
           : !integers_.empty() ? static_cast<void*>(integers_.data())
                                : bytes_.data();
}

std::size_t Values::bytes() const {
    return doubles_.size() * sizeof(double) + integers_.size() * sizeof(std::int32_t) + bytes_.size();
}

// ---- instances

struct LocalInstance::Callbacks {
    fmi2CallbackFunctions of_2{};
};

LocalInstance::LocalInstance(const Library& library, const std::string& name, Log log, char* doing)
    : Instance(library.archive_.filename().string(), library.description_.version), library_(library),
      f_(*library.functions_), order_(library.description_.version, library.kind_ == Kind::co_simulation,
                                      library.description_.has_clocks()),
      name_(name), token_(library.description_.token), log_(std::move(log)), doing_(doing),
      callbacks_(std::make_unique<Callbacks>()), under_way_(file_), arithmetic_(arithmetic_modes()) {
    const auto& d = library.description_;
    const bool steps = library.kind_ == Kind::co_simulation, is_logging = static_cast<bool>(log_);
    const std::string resources = library.resources().string();
    if (library.changes_arithmetic_)
        this->log(
            fmi3Warning, "",
            "its library changes the arithmetic of the process when it is opened (rounding, or subnormal "
            "numbers flushed to zero, as libraries linked with -Ofast do); it was put back");
    const char* const function = d.version == 2 ? "fmi2Instantiate"
                                 : steps        ? "fmi3InstantiateCoSimulation"
                                                : "fmi3InstantiateModelExchange";
    note(function);
    if (d.version == 2) {
        callbacks_->of_2 = {reinterpret_cast<decltype(fmi2CallbackFunctions::logger)>(&LocalInstance::log_2),
                            std::calloc, std::free, nullptr, this};
        instance_ = f_.fmi2Instantiate(name_.c_str(), steps ? fmi2CoSimulation : fmi2ModelExchange,
                                       token_.c_str(), ("file://" + escape::uri(resources)).c_str(),
                                       &callbacks_->of_2, false, is_logging);
    } else {
        const std::string path = resources + "/";
        const auto to_log = [](void* self, fmi3Status status, const char* category, const char* text) {
            log_3(self, status, category, text);
        };
        instance_ = steps ? f_.fmi3InstantiateCoSimulation(name_.c_str(), token_.c_str(), path.c_str(), false,
                                                           is_logging, d.has_clocks(), false, nullptr, 0,
                                                           this, to_log, nullptr)
                          : f_.fmi3InstantiateModelExchange(name_.c_str(), token_.c_str(), path.c_str(),
                                                            false, is_logging, this, to_log);
    }
    returned(function);
    if (!instance_)
        throw FmuError(library.archive_.string() + ": it makes no instance" +
                       (logged_[0] ? std::string(": ") + logged_ : std::string()) + library.without_tool());
    if (!configure()) throw FmuError(failure_);
    if (!steps) count_states();
}

/// Gives structural parameters their values, of an instance that is new or begun anew.
bool LocalInstance::configure() noexcept {
    if (library_.structure_.empty()) return true;
    const auto set = [&](const Variable& v) {
        if (!library_.structure_.contains(v.name)) return true;
        const auto value = static_cast<std::uint64_t>(v.start.front());
        return called(Call::set_values, "fmi3SetUInt64",
                      [&] { return f_.fmi3SetUInt64(instance_, &v.reference, 1, &value, 1); });
    };
    const auto& variables = library_.description_.variables;
    return called(Call::enter_configuration, "fmi3EnterConfigurationMode",
                  [&] { return f_.fmi3EnterConfigurationMode(instance_); }) &&
           std::all_of(variables.begin(), variables.end(), set) &&
           called(Call::exit_configuration, "fmi3ExitConfigurationMode",
                  [&] { return f_.fmi3ExitConfigurationMode(instance_); });
}

/// From the description; an FMU of FMI 3.0 says it, too.
void LocalInstance::count_states() {
    const auto& d = library_.description_;
    for (const auto& rate : d.derivatives)
        state_count_ += d.variables[static_cast<std::size_t>(rate.variable)].count();
    indicator_count_ = d.event_indicators;
    row_.resize(static_cast<std::size_t>(std::max(state_count_, indicator_count_)) + 1);
    if (d.version == 2) return;
    std::size_t states = 0, indicators = 0;
    if (!may(Call::get_numbers, "fmi3GetNumberOfContinuousStates") ||
        !done(Call::get_numbers, "fmi3GetNumberOfContinuousStates",
              f_.fmi3GetNumberOfContinuousStates(instance_, &states)) ||
        !done(Call::get_numbers, "fmi3GetNumberOfEventIndicators",
              f_.fmi3GetNumberOfEventIndicators(instance_, &indicators)))
        throw FmuError(failure_);
    const auto compare = [&](const char* function, std::size_t given, int described, const char* what) {
        if (given != static_cast<std::size_t>(described))
            throw FmuError(library_.archive_.string() + ": " + function + " gave " + std::to_string(given) +
                           ", but its description has " + std::to_string(described) + " " + what +
                           " (FMI 3.0, section 2.4.8)");
    };
    compare("fmi3GetNumberOfContinuousStates", states, state_count_, "continuous states");
    compare("fmi3GetNumberOfEventIndicators", indicators, indicator_count_, "event indicators");
}

LocalInstance::~LocalInstance() {
    if (!instance_) return;
    if (order_.state() & (step_mode | event_mode | continuous_time)) terminate();
    const char* const function = of_version("fmi2FreeInstance", "fmi3FreeInstance");
    note(function);
    if (order_.version() == 2)
        f_.fmi2FreeInstance(instance_);
    else
        f_.fmi3FreeInstance(instance_);
    returned(function);
}

void LocalInstance::log(int status, const char* category, const char* text) noexcept {
    if (!text) return;
    if (status >= fmi3Discard) std::snprintf(logged_, sizeof logged_, "%s", text);
    try {
        if (log_) log_(status, category ? category : "", escape::shortened(text, 2000));
    } catch (const std::exception&) { // a message that cannot be kept is lost
    }
}

void LocalInstance::log_3(void* self, int status, const char* category, const char* text) {
    if (self) static_cast<LocalInstance*>(self)->log(status, category, text);
}

void LocalInstance::log_2(void* self, const char*, int status, const char* category, const char* format,
                          ...) {
    if (!self || !format) return;
    char text[2000];
    va_list list;
    va_start(list, format);
    std::vsnprintf(text, sizeof text, format, list);
    va_end(list);
    static_cast<LocalInstance*>(self)->log(status, category, text);
}

bool Instance::fail(const char* function, const char* why) noexcept {
    std::snprintf(failure_, sizeof failure_, "%.200s: %s%s", file_.c_str(), function, why);
    return false;
}

void LocalInstance::note(const char* function) noexcept {
    if (doing_) std::snprintf(doing_, longest_name, "%s", function);
    under_way_.set(function);
}

void LocalInstance::returned(const char* function) noexcept {
    under_way_.set(nullptr);
    if (arithmetic_modes() == arithmetic_) return;
    set_arithmetic_modes(arithmetic_);
    if (changed_arithmetic_) return;
    changed_arithmetic_ = function;
    char text[300];
    std::snprintf(text, sizeof text,
                  "%s leaves the arithmetic of the process changed (rounding, or subnormal numbers flushed "
                  "to zero); it is put back after each call",
                  function);
    log(fmi3Warning, "", text);
}

bool LocalInstance::may(Call call, const char* function) noexcept {
    struct {
        char text[400];
    } problem{};
    logged_[0] = '\0';
    if (!order_.check(call, function, problem)) return fail("", problem.text);
    note(function);
    return true;
}

bool LocalInstance::done(Call call, const char* function, int status) noexcept {
    returned(function);
    if (status == fmi3OK || status == fmi3Warning) {
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

bool LocalInstance::enter_initialization(double start) noexcept {
    if (order_.version() == 3)
        return called(Call::enter_initialization, "fmi3EnterInitializationMode",
                      [&] { return f_.fmi3EnterInitializationMode(instance_, false, 0, start, false, 0); });
    return called(Call::setup_experiment, "fmi2SetupExperiment",
                  [&] { return f_.fmi2SetupExperiment(instance_, false, 0, start, false, 0); }) &&
           called(Call::enter_initialization, "fmi2EnterInitializationMode",
                  [&] { return f_.fmi2EnterInitializationMode(instance_); });
}

/// A function of the same parameters in both versions.
#define BF_FMI_BOTH(kind, name, ...)                                                                         \
    (order_.version() == 2 ? called(kind, "fmi2" #name, [&] { return f_.fmi2##name(__VA_ARGS__); })          \
                           : called(kind, "fmi3" #name, [&] { return f_.fmi3##name(__VA_ARGS__); }))

bool LocalInstance::exit_initialization() noexcept {
    return BF_FMI_BOTH(Call::exit_initialization, ExitInitializationMode, instance_);
}
bool LocalInstance::terminate() noexcept { return BF_FMI_BOTH(Call::terminate, Terminate, instance_); }
bool LocalInstance::reset() noexcept { return BF_FMI_BOTH(Call::reset, Reset, instance_) && configure(); }

bool LocalInstance::do_step(double time, double step) noexcept {
    if (order_.version() == 2)
        return may(Call::do_step, "fmi2DoStep") &&
               done(Call::do_step, "fmi2DoStep", f_.fmi2DoStep(instance_, time, step, true));
    bool needs_event = false, terminates = false, returned_early = false;
    double reached = time;
    if (!may(Call::do_step, "fmi3DoStep") || !done(Call::do_step, "fmi3DoStep",
                                                   f_.fmi3DoStep(instance_, time, step, true, &needs_event,
                                                                 &terminates, &returned_early, &reached)))
        return false;
    if (terminates) return fail("fmi3DoStep", " asks for the end of the simulation");
    if (returned_early)
        return fail("fmi3DoStep",
                    " ended its step early, though it was not allowed to (FMI 3.0, section 4.2.1)");
    Event event;
    return !needs_event || !library_.description_.has_clocks() ||
           (enter_event_mode() && handle_event(event) && enter_step_mode());
}

// ---- model exchange

bool LocalInstance::set_time(double time) noexcept {
    return BF_FMI_BOTH(Call::set_time, SetTime, instance_, time);
}
bool LocalInstance::set_states(const double* x) noexcept {
    return state_count_ == 0 || BF_FMI_BOTH(Call::set_continuous_states, SetContinuousStates, instance_, x,
                                            static_cast<std::size_t>(state_count_));
}
bool LocalInstance::enter_event_mode() noexcept {
    return BF_FMI_BOTH(Call::enter_event_mode, EnterEventMode, instance_);
}
bool LocalInstance::enter_continuous_time() noexcept {
    return BF_FMI_BOTH(Call::enter_continuous_time, EnterContinuousTimeMode, instance_);
}
#undef BF_FMI_BOTH

/// f writes `count` numbers, and none more.
template <class F>
bool LocalInstance::get_row(Call call, const char* function, double* to, int count, F&& f) noexcept {
    if (count == 0) return true;
    const auto n = static_cast<std::size_t>(count);
    row_[n] = untouched;
    if (!may(call, function) || !done(call, function, f(row_.data(), n))) return false;
    if (std::memcmp(&row_[n], &untouched, sizeof untouched) != 0)
        return fail(function,
                    of_version(" wrote more numbers than the description has (FMI 2.0.4, section 2.2.8)",
                               " wrote more numbers than the description has (FMI 3.0, section 2.4.8)"));
    std::copy(row_.begin(), row_.begin() + count, to);
    return true;
}

bool LocalInstance::get_states(double* x) noexcept {
    return get_row(Call::get_continuous, of_version("fmi2GetContinuousStates", "fmi3GetContinuousStates"), x,
                   state_count_, [&](double* to, std::size_t n) -> int {
                       return order_.version() == 2
                                  ? static_cast<int>(f_.fmi2GetContinuousStates(instance_, to, n))
                                  : static_cast<int>(f_.fmi3GetContinuousStates(instance_, to, n));
                   });
}

bool LocalInstance::get_derivatives(double* rates) noexcept {
    const char* const function = of_version("fmi2GetDerivatives", "fmi3GetContinuousStateDerivatives");
    if (!get_row(Call::get_continuous, function, rates, state_count_, [&](double* to, std::size_t n) -> int {
            return order_.version() == 2
                       ? static_cast<int>(f_.fmi2GetDerivatives(instance_, to, n))
                       : static_cast<int>(f_.fmi3GetContinuousStateDerivatives(instance_, to, n));
        }))
        return false;
    int number = 0;
    for (const auto& rate : library_.description_.derivatives) {
        const auto& v = library_.description_.variables[static_cast<std::size_t>(rate.variable)];
        for (int i = 0; i < v.count(); ++i, ++number)
            if (!std::isfinite(rates[number])) {
                char why[300];
                std::snprintf(why, sizeof why, " gave %g as '%.150s' (%s)", rates[number], v.name.c_str(),
                              of_version("FMI 2.0.4, section 3.2.2", "FMI 3.0, section 3.2.1"));
                return fail(function, why);
            }
    }
    return true;
}

bool LocalInstance::get_indicators(double* z) noexcept {
    return get_row(Call::get_continuous, of_version("fmi2GetEventIndicators", "fmi3GetEventIndicators"), z,
                   indicator_count_, [&](double* to, std::size_t n) -> int {
                       return order_.version() == 2
                                  ? static_cast<int>(f_.fmi2GetEventIndicators(instance_, to, n))
                                  : static_cast<int>(f_.fmi3GetEventIndicators(instance_, to, n));
                   });
}

bool LocalInstance::complete_step(bool& wants_event) noexcept {
    const char* const function = of_version("fmi2CompletedIntegratorStep", "fmi3CompletedIntegratorStep");
    bool wants_end = false;
    if (!may(Call::completed_integrator_step, function)) return false;
    int status = fmi3OK;
    if (order_.version() == 2) {
        fmi2Boolean event = false, end = false;
        status = f_.fmi2CompletedIntegratorStep(instance_, true, &event, &end);
        wants_event = event, wants_end = end;
    } else {
        status = f_.fmi3CompletedIntegratorStep(instance_, true, &wants_event, &wants_end);
    }
    if (!done(Call::completed_integrator_step, function, status)) return false;
    return !wants_end || fail(function, " asks for the end of the simulation");
}

bool LocalInstance::handle_event(Event& event) noexcept {
    const char* const function = of_version("fmi2NewDiscreteStates", "fmi3UpdateDiscreteStates");
    event = {};
    for (int i = 0; i < most_iterations; ++i) {
        if (!may(Call::update_discrete_states, function)) return false;
        bool again = false, ends = false, nominals = false, jumps = false, has_next = false;
        double next = 0;
        int status = fmi3OK;
        if (order_.version() == 2) {
            fmi2EventInfo info{};
            status = f_.fmi2NewDiscreteStates(instance_, &info);
            again = info.newDiscreteStatesNeeded, ends = info.terminateSimulation;
            jumps = info.valuesOfContinuousStatesChanged;
            has_next = info.nextEventTimeDefined, next = info.nextEventTime;
        } else {
            status =
                f_.fmi3UpdateDiscreteStates(instance_, &again, &ends, &nominals, &jumps, &has_next, &next);
        }
        if (!done(Call::update_discrete_states, function, status)) return false;
        if (ends) return fail(function, " asks for the end of the simulation");
        event.has_jumped |= jumps;
        event.next = has_next ? next : std::numeric_limits<double>::infinity();
        if (std::isnan(event.next))
            return fail(function, of_version(" gave a next event at NaN s (FMI 2.0.4, section 3.2.2)",
                                             " gave a next event at NaN s (FMI 3.0, section 2.3.5)"));
        if (!again) return true;
    }
    return fail(
        function,
        of_version(" asks for yet another iteration of one event after 1000 (FMI 2.0.4, section 3.2.2)",
                   " asks for yet another iteration of one event after 1000 (FMI 3.0, section 2.3.5)"));
}

bool LocalInstance::get(Values& values) noexcept {
    const auto* const references = values.references_.data();
    const auto count = values.references_.size(), size = values.count_;
    auto* const doubles = values.doubles_.data();
    auto* const integers = values.integers_.data();
    auto* const bytes = static_cast<void*>(values.bytes_.data());
#define BF_FMI_GET(function, ...)                                                                            \
    return may(Call::get_values, #function) &&                                                               \
           done(Call::get_values, #function, f_.function(instance_, references, count, __VA_ARGS__))
#define BF_FMI3_GET(T) BF_FMI_GET(fmi3Get##T, static_cast<fmi3##T*>(bytes), size)
    if (order_.version() == 2) {
        if (is_float64(2, values.type_)) BF_FMI_GET(fmi2GetReal, doubles);
        if (values.type_ == Type::boolean) BF_FMI_GET(fmi2GetBoolean, integers);
        BF_FMI_GET(fmi2GetInteger, integers);
    }
    switch (values.type_) {
    case Type::float64: BF_FMI_GET(fmi3GetFloat64, doubles, size);
    case Type::float32: BF_FMI3_GET(Float32);
    case Type::int8: BF_FMI3_GET(Int8);
    case Type::uint8: BF_FMI3_GET(UInt8);
    case Type::int16: BF_FMI3_GET(Int16);
    case Type::uint16: BF_FMI3_GET(UInt16);
    case Type::int32: BF_FMI3_GET(Int32);
    case Type::uint32: BF_FMI3_GET(UInt32);
    case Type::uint64: BF_FMI3_GET(UInt64);
    case Type::boolean: BF_FMI3_GET(Boolean);
    default: BF_FMI3_GET(Int64);
    }
#undef BF_FMI3_GET
#undef BF_FMI_GET
}

bool LocalInstance::set(const Values& values) noexcept {
    const auto* const references = values.references_.data();
    const auto count = values.references_.size(), size = values.count_;
    const auto* const doubles = values.doubles_.data();
    const auto* const integers = values.integers_.data();
    const auto* const bytes = static_cast<const void*>(values.bytes_.data());
#define BF_FMI_SET(function, ...)                                                                            \
    return may(Call::set_values, #function) &&                                                               \
           done(Call::set_values, #function, f_.function(instance_, references, count, __VA_ARGS__))
#define BF_FMI3_SET(T) BF_FMI_SET(fmi3Set##T, static_cast<const fmi3##T*>(bytes), size)
    if (order_.version() == 2) {
        if (is_float64(2, values.type_)) BF_FMI_SET(fmi2SetReal, doubles);
        if (values.type_ == Type::boolean) BF_FMI_SET(fmi2SetBoolean, integers);
        BF_FMI_SET(fmi2SetInteger, integers);
    }
    switch (values.type_) {
    case Type::float64: BF_FMI_SET(fmi3SetFloat64, doubles, size);
    case Type::float32: BF_FMI3_SET(Float32);
    case Type::int8: BF_FMI3_SET(Int8);
    case Type::uint8: BF_FMI3_SET(UInt8);
    case Type::int16: BF_FMI3_SET(Int16);
    case Type::uint16: BF_FMI3_SET(UInt16);
    case Type::int32: BF_FMI3_SET(Int32);
    case Type::uint32: BF_FMI3_SET(UInt32);
    case Type::uint64: BF_FMI3_SET(UInt64);
    case Type::boolean: BF_FMI3_SET(Boolean);
    default: BF_FMI3_SET(Int64);
    }
#undef BF_FMI3_SET
#undef BF_FMI_SET
}

bool LocalInstance::enter_step_mode() noexcept {
    return called(Call::enter_step_mode, "fmi3EnterStepMode",
                  [&] { return f_.fmi3EnterStepMode(instance_); });
}

bool LocalInstance::activate(const std::vector<std::uint32_t>& clocks) noexcept {
    constexpr std::size_t most = 64; // in one call
    bool active[most];
    std::fill_n(active, most, true);
    for (std::size_t at = 0; at < clocks.size(); at += most)
        if (!called(Call::activate_clocks, "fmi3SetClock", [&] {
                return f_.fmi3SetClock(instance_, clocks.data() + at, std::min(most, clocks.size() - at),
                                       active);
            }))
            return false;
    return true;
}

bool LocalInstance::get_interval(std::uint32_t clock, double& interval, double& shift) noexcept {
    fmi3IntervalQualifier qualifier{};
    if (!called(Call::get_clocks, "fmi3GetIntervalDecimal",
                [&] { return f_.fmi3GetIntervalDecimal(instance_, &clock, 1, &interval, &qualifier); }))
        return false;
    if (qualifier == fmi3IntervalNotYetKnown)
        return fail("fmi3GetIntervalDecimal",
                    " does not know the interval of a periodic clock when the run begins");
    return called(Call::get_clocks, "fmi3GetShiftDecimal",
                  [&] { return f_.fmi3GetShiftDecimal(instance_, &clock, 1, &shift); });
}

bool LocalInstance::differentiate(const Values& along, Values& change) noexcept {
    const char* const function = of_version("fmi2GetDirectionalDerivative", "fmi3GetDirectionalDerivative");
    const auto &by = along.references_, &of = change.references_;
    if (!may(Call::get_derivatives_of, function)) return false;
    return done(Call::get_derivatives_of, function,
                order_.version() == 2
                    ? static_cast<int>(f_.fmi2GetDirectionalDerivative(
                          instance_, of.data(), of.size(), by.data(), by.size(), along.doubles_.data(),
                          change.doubles_.data()))
                    : static_cast<int>(f_.fmi3GetDirectionalDerivative(
                          instance_, of.data(), of.size(), by.data(), by.size(), along.doubles_.data(),
                          along.count_, change.doubles_.data(), change.count_)));
}

/// Makes room for a state of that size, which the FMU gave.
bool LocalInstance::resize(std::vector<std::uint8_t>& bytes, std::size_t size) noexcept {
    const char* const function = of_version("fmi2SerializedFMUstateSize", "fmi3SerializedFMUStateSize");
    const char* const section = of_version("FMI 2.0.4, section 2.1.8", "FMI 3.0, section 2.2.7");
    char why[200];
    std::snprintf(why, sizeof why, " gave %zu bytes as the size of a saved state, which are %s (%s)", size,
                  size == 0 ? "none" : "more than fit into memory", section);
    if (size == 0 || size > most_state_bytes) return fail(function, why);
    try {
        bytes.resize(size);
    } catch (const std::bad_alloc&) {
        return fail(function, why);
    }
    return true;
}

bool LocalInstance::save(std::vector<std::uint8_t>& bytes) noexcept {
    void* state = nullptr;
    std::size_t size = 0;
    bool good = false;
    if (order_.version() == 2) {
        good = called(Call::save_state, "fmi2GetFMUstate",
                      [&] { return f_.fmi2GetFMUstate(instance_, &state); }) &&
               called(Call::save_state, "fmi2SerializedFMUstateSize",
                      [&] { return f_.fmi2SerializedFMUstateSize(instance_, state, &size); }) &&
               resize(bytes, size) && called(Call::save_state, "fmi2SerializeFMUstate", [&] {
                   return f_.fmi2SerializeFMUstate(instance_, state, reinterpret_cast<char*>(bytes.data()),
                                                   size);
               });
    } else {
        good = called(Call::save_state, "fmi3GetFMUState",
                      [&] { return f_.fmi3GetFMUState(instance_, &state); }) &&
               called(Call::save_state, "fmi3SerializedFMUStateSize",
                      [&] { return f_.fmi3SerializedFMUStateSize(instance_, state, &size); }) &&
               resize(bytes, size) && called(Call::save_state, "fmi3SerializeFMUState", [&] {
                   return f_.fmi3SerializeFMUState(instance_, state, bytes.data(), size);
               });
    }
    free_state(state);
    return good;
}

bool LocalInstance::restore(const std::vector<std::uint8_t>& bytes, State mode) noexcept {
    void* state = nullptr;
    bool good = false;
    if (order_.version() == 2) {
        const auto* const from = reinterpret_cast<const char*>(bytes.data());
        good =
            called(Call::save_state, "fmi2DeSerializeFMUstate",
                   [&] { return f_.fmi2DeSerializeFMUstate(instance_, from, bytes.size(), &state); }) &&
            called(Call::save_state, "fmi2SetFMUstate", [&] { return f_.fmi2SetFMUstate(instance_, state); });
    } else {
        good =
            called(
                Call::save_state, "fmi3DeserializeFMUState",
                [&] { return f_.fmi3DeserializeFMUState(instance_, bytes.data(), bytes.size(), &state); }) &&
            called(Call::save_state, "fmi3SetFMUState", [&] { return f_.fmi3SetFMUState(instance_, state); });
    }
    free_state(state);
    if (good) order_.set_state(mode);
    return good;
}

void LocalInstance::free_state(void* state) noexcept {
    if (!state) return;
    const char* const function = of_version("fmi2FreeFMUstate", "fmi3FreeFMUState");
    note(function);
    if (order_.version() == 2)
        f_.fmi2FreeFMUstate(instance_, &state);
    else
        f_.fmi3FreeFMUState(instance_, &state);
    returned(function);
}

} // namespace bf::fmi
