// FMUs that do their steps by themselves.
#include "fmu_block.hpp"

#include <stdexcept>

namespace bf::fmi {

namespace {

class CoSimulation final : public FmuBlock {
  public:
    explicit CoSimulation(const Arguments& arguments) : FmuBlock(arguments, Kind::co_simulation) {}

    void start(Now at) const override {
        if (at.period() <= 0)
            throw std::runtime_error(
                "an FMU for co-simulation does steps of a fixed length; give the block a period");
        Running& its = at[running_];
        its.open();
        its.transfers = {
            {description_, parameters_, [](const Port& p) { return !p.is_tunable; }},
            {description_, parameters_, [](const Port& p) { return p.is_tunable; }},
            {description_, inputs_, [](const Port& p) { return p.clocks.empty() && p.is_early; }},
            {description_, inputs_, [](const Port& p) { return p.clocks.empty() && !p.is_early; }},
            {description_, outputs_, [](const Port& p) { return p.clocks.empty(); }}};
        its.clocked = clocked();
        if (!begin(at)) throw std::runtime_error(its.instance->failure());
        if (const char* const clock = its.clockwork.off_the_grid(at.period()))
            throw std::runtime_error("the clock '" + std::string(clock) +
                                     "' of the FMU ticks between the steps of the block; give the block a "
                                     "period that divides the clock's interval and shift");
    }
    Status reset(Now at, After) const noexcept override {
        Running& its = at[running_];
        if (!its.instance || its.memory.is_initialized == 0) return ok;
        return its.instance->reset() && begin(at) ? ok : its.failure();
    }
    Status output(Now at, Out) const noexcept override {
        Running& its = at[running_];
        if (!its.instance) return Status::failure("the FMU was not started");
        // What no output waits for is written, too: where it has its value of this step already, the FMU need
        // not compute its signals again when the step ends.
        if (!its.is_restored || !write_new(at, tunable) || !write(at, early) || !write(at, late))
            return its.failure();
        if (its.memory.is_initialized == 0 && !its.instance->exit_initialization()) return its.failure();
        its.memory.is_initialized = 1;
        if (its.is_tick(at) && !((its.instance->state() == event_mode || its.instance->enter_event_mode()) &&
                                 its.tick(at) && its.write_clocked(at, &Running::Clocked::early)))
            return its.failure();
        return its.transfers[outputs].read_from(*its.instance, at) && its.read_clocked(at) ? ok
                                                                                           : its.failure();
    }
    Status update(Now at, Next) const noexcept override {
        Running& its = at[running_];
        Event event;
        if (!write_new(at, late)) return its.failure();
        if (its.instance->state() == event_mode &&
            !(its.write_clocked(at, &Running::Clocked::late) && its.end_event(at, event) &&
              its.instance->enter_step_mode()))
            return its.failure();
        return its.instance->do_step(at.time(), at.period()) ? ok : its.failure();
    }

  private:
    enum { fixed, tunable, early, late, outputs }; ///< transfers

    bool begin(Now at) const noexcept {
        Running& its = at[running_];
        its.memory = {};
        return write(at, fixed) && write(at, tunable) && its.instance->enter_initialization(at.time()) &&
               its.clockwork.begin(*its.instance, at.time());
    }
    bool write(Now at, int which) const noexcept {
        Running& its = at[running_];
        return its.transfers[static_cast<std::size_t>(which)].write_to(*its.instance, at);
    }
    /// Where something changed since they were written.
    bool write_new(Now at, int which) const noexcept {
        return !at[running_].transfers[static_cast<std::size_t>(which)].differs(at) || write(at, which);
    }
};

} // namespace

void add_co_simulation(bf::Library& library) {
    library.add<CoSimulation>("FMU",
                              "An FMU of FMI 2.0 or 3.0 for co-simulation, which steps with the block's "
                              "period. Ports, parameters, types and sizes are those of its description; an "
                              "output waits for those inputs that the description names.");
}

} // namespace bf::fmi
