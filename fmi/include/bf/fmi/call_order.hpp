// In which order the functions of an FMU may be called. C++17: exported FMUs carry a copy of this file.
#pragma once

#include <cstdio>

namespace bf::fmi {

/// What an instance is about to do; each kind has several functions, or one with another name in FMI 2.0.
enum class Call {
    set_debug_logging,
    free_instance,
    setup_experiment, ///< FMI 2.0
    enter_configuration,
    exit_configuration,
    enter_initialization,
    exit_initialization,
    enter_event_mode,
    enter_continuous_time,
    enter_step_mode, ///< FMI 3.0
    terminate,
    reset,
    get_values,
    set_values,
    save_state, ///< get, set, free, serialise and deserialise
    get_derivatives_of,
    update_discrete_states,
    completed_integrator_step,
    set_time,
    set_continuous_states,
    get_continuous,  ///< states, derivatives, event indicators
    get_nominals,    ///< FMI 2.0 allows it before the initialisation, too
    get_numbers,     ///< of states and event indicators
    get_clocks,      ///< intervals and shifts
    set_clocks,      ///< intervals and shifts
    activate_clocks, ///< also asks whether they are active
    get_output_derivatives,
    do_step,
    get_step_status, ///< FMI 2.0: also fmi2CancelStep
    activate_partition
};

/// Modes of an instance, as bits.
enum State : unsigned {
    no_state = 0,
    instantiated = 1,
    configuration = 2, ///< also its reconfiguration mode
    initialization = 4,
    event_mode = 8,
    continuous_time = 16,
    step_mode = 32,
    intermediate_update = 64,
    terminated = 128,
    failed = 256 ///< a function gave Error
};

/// The name of the mode in the standard.
inline const char* name_of(State state) noexcept {
    switch (state) {
    case instantiated: return "Instantiated";
    case configuration: return "Configuration Mode";
    case initialization: return "Initialization Mode";
    case event_mode: return "Event Mode";
    case continuous_time: return "Continuous-Time Mode";
    case step_mode: return "Step Mode";
    case intermediate_update: return "Intermediate Update Mode";
    case terminated: return "Terminated";
    case no_state:
    case failed: break;
    }
    return "error";
}

/// The state machine of calls of one instance: FMI 3.0, sections 2.3, 3.2 and 4.2; FMI 2.0.4, sections 3.2.3
/// and 4.2.4. Both sides of an FMU use it: the exported one refuses, the importer reports.
class CallOrder {
  public:
    CallOrder(int version, bool is_co_simulation, bool uses_event_mode) noexcept
        : version_(version), is_co_simulation_(is_co_simulation),
          uses_event_mode_(uses_event_mode || !is_co_simulation) {}

    State state() const noexcept { return state_; }
    int version() const noexcept { return version_; }
    bool is_co_simulation() const noexcept { return is_co_simulation_; }

    /// The modes in which the call is allowed.
    unsigned allowed(Call call) const noexcept {
        const unsigned all = 2 * failed - 1, running = event_mode | continuous_time | step_mode;
        const unsigned computed = initialization | running | terminated;
        switch (call) {
        case Call::set_debug_logging: return all & ~unsigned(intermediate_update);
        case Call::free_instance:
        case Call::reset: return all & ~unsigned(intermediate_update);
        case Call::setup_experiment: return instantiated;
        case Call::enter_configuration: return instantiated | event_mode | step_mode;
        case Call::exit_configuration: return configuration;
        case Call::enter_initialization: return instantiated;
        case Call::exit_initialization: return initialization;
        case Call::enter_event_mode:
            return unsigned(!is_co_simulation_ ? continuous_time : uses_event_mode_ ? step_mode : no_state);
        case Call::enter_continuous_time: return is_co_simulation_ ? 0u : unsigned(event_mode);
        case Call::enter_step_mode: return is_co_simulation_ && uses_event_mode_ ? unsigned(event_mode) : 0u;
        case Call::terminate: return running;
        case Call::get_values: // of FMI 3.0 also start values (section 2.3.2)
            return computed | intermediate_update | failed |
                   (version_ == 3 ? instantiated | configuration : 0u);
        case Call::set_values:
            return instantiated | configuration | initialization | running | intermediate_update;
        case Call::save_state: return all & ~unsigned(intermediate_update | failed | configuration);
        case Call::get_derivatives_of: return computed | intermediate_update;
        case Call::update_discrete_states: return event_mode;
        case Call::completed_integrator_step: return continuous_time;
        case Call::set_time: return continuous_time | (version_ == 2 ? event_mode | instantiated : 0u);
        case Call::set_continuous_states: return continuous_time;
        case Call::get_continuous: return is_co_simulation_ ? 0u : computed;
        case Call::get_nominals: return is_co_simulation_ ? 0u : computed | instantiated;
        case Call::get_numbers: return is_co_simulation_ ? 0u : computed | instantiated | configuration;
        case Call::get_clocks: return instantiated | initialization | event_mode;
        case Call::set_clocks: return instantiated | initialization | event_mode;
        case Call::activate_clocks: return event_mode;
        case Call::get_output_derivatives: return step_mode | intermediate_update | terminated;
        case Call::do_step: return is_co_simulation_ ? unsigned(step_mode) : 0u;
        case Call::get_step_status: return is_co_simulation_ ? unsigned(step_mode | terminated) : 0u;
        case Call::activate_partition: return 0; // of scheduled execution alone
        }
        return 0;
    }

    /// May `function`, one of the kind `call`, be called now? False: `problem` says why not.
    template <class Text> bool check(Call call, const char* function, Text& problem) const noexcept {
        const unsigned modes = allowed(call);
        if (modes & state_) {
            if (call != Call::enter_initialization || version_ != 2 || is_set_up_) return true;
            std::snprintf(problem.text, sizeof problem.text,
                          "%s is called before fmi2SetupExperiment (FMI 2.0.4, section 2.1.6)", function);
            return false;
        }
        char list[200] = "";
        for (unsigned s = instantiated, at = 0; s <= failed; s *= 2)
            if (modes & s && at < sizeof list)
                at += unsigned(
                    std::snprintf(list + at, sizeof list - at, "%s%s", at ? ", " : "", name_of(State(s))));
        std::snprintf(
            problem.text, sizeof problem.text, "%s is called in the state '%s', but is allowed in: %s (%s)",
            function, name_of(state_), *list ? list : "none of this kind of instance",
            version_ == 2       ? is_co_simulation_ ? "FMI 2.0.4, section 4.2.4" : "FMI 2.0.4, section 3.2.3"
            : is_co_simulation_ ? "FMI 3.0, section 4.2"
                                : "FMI 3.0, section 3.2");
        return false;
    }

    /// The call succeeded.
    void done(Call call) noexcept {
        switch (call) {
        case Call::setup_experiment: is_set_up_ = true; break;
        case Call::enter_configuration: before_ = state_, state_ = configuration; break;
        case Call::exit_configuration: state_ = before_; break;
        case Call::enter_initialization: state_ = initialization; break;
        case Call::exit_initialization: state_ = uses_event_mode_ ? event_mode : step_mode; break;
        case Call::enter_event_mode: state_ = event_mode; break;
        case Call::enter_continuous_time: state_ = continuous_time; break;
        case Call::enter_step_mode: state_ = step_mode; break;
        case Call::terminate: state_ = terminated; break;
        case Call::reset: state_ = instantiated, is_set_up_ = false; break;
        default: break;
        }
    }
    /// A call gave Error or Fatal.
    void fail() noexcept { state_ = failed; }
    /// Goes to the mode of a saved state.
    void set_state(State state) noexcept { state_ = state; }
    static bool is_state(unsigned state) noexcept {
        return state >= instantiated && state <= failed && (state & (state - 1)) == 0;
    }
    /// Inside of a step the importer may look and write.
    void enter_intermediate_update() noexcept { state_ = intermediate_update; }
    void leave_intermediate_update() noexcept { state_ = step_mode; }

  private:
    int version_;
    bool is_co_simulation_, uses_event_mode_, is_set_up_ = false;
    State state_ = instantiated, before_ = instantiated;
};

} // namespace bf::fmi
