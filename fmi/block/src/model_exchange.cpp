// FMUs whose states our solver integrates.
#include "fmu_block.hpp"

#include "bf/core/changes.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <tuple>

namespace bf::fmi {

namespace {

/// x' = f(x, u, t) of the FMU, as its own steps would see it: FMI 2.0.4, section 3.2; FMI 3.0, section 3.2.
///
/// In an event everything changes at once that changes in jumps: states, discrete outputs, what discrete
/// inputs and tunable parameters decide. It comes where an event indicator crosses 0, at the time that the
/// FMU named, where a discrete input or a parameter became another one, and where the FMU asked for it after
/// a step. Those that are no crossings change the sign of one more guard, which the block keeps away from 0
/// otherwise. An event at the begin of a step gives its outputs first, from the inputs there, and ends when
/// all inputs are known.
class ModelExchange final : public FmuBlock, public Differentiable {
  public:
    explicit ModelExchange(const Arguments& arguments) : FmuBlock(arguments, Kind::model_exchange) {}

    Status reset(Now at, After after) const noexcept override {
        Running& its = at[running_];
        try {
            if (!its.instance) {
                its.open();
                its.transfers = {
                    {description_, parameters_, [](const Port& p) { return !p.is_tunable; }},
                    {description_, parameters_, [](const Port& p) { return p.is_tunable; }},
                    {description_, inputs_, [](const Port& p) { return p.is_continuous; }},
                    {description_, inputs_, is_discrete},
                    {description_, inputs_, [](const Port& p) { return p.is_continuous && p.is_early; }},
                    {description_, inputs_, [](const Port& p) { return is_discrete(p) && p.is_early; }},
                    {description_, outputs_, [](const Port& p) { return p.clocks.empty(); }}};
                its.clocked = clocked();
            } else if (!its.instance->reset()) {
                return its.failure();
            }
        } catch (const std::exception& error) {
            return its.failure(error.what());
        }
        its.memory = {};
        its.row.resize(static_cast<std::size_t>(its.instance->state_count()));
        return write(its, at, fixed) && write(its, at, tunable) &&
                       its.instance->enter_initialization(at.time()) &&
                       its.clockwork.begin(*its.instance, at.time()) && its.instance->exit_initialization() &&
                       get_states(its, after)
                   ? ok
                   : its.failure();
    }

    Status output(Now at, Out) const noexcept override {
        Running& its = at[running_];
        if (!its.instance) return Status::failure("the FMU was not started");
        if (!its.is_restored || !begin_step(its, at)) return its.failure();
        const bool is_event = its.instance->state() == event_mode;
        return (is_event ? its.tick(at) && write(its, at, early_discrete) &&
                               its.write_clocked(at, &Running::Clocked::early)
                         : its.instance->set_time(at.time()) && set_states(its, at)) &&
                       write(its, at, early_continuous) &&
                       its.transfers[outputs].read_from(*its.instance, at) && its.read_clocked(at)
                   ? ok
                   : its.failure();
    }

    Status derivative(Now at, Rate rate) const noexcept override {
        Running& its = at[running_];
        return show(its, at) && (!states.is_present() || its.instance->get_derivatives(rate[states].data()))
                   ? ok
                   : its.failure();
    }

    Status guards(Now at, Guards guards) const noexcept override {
        Running& its = at[running_];
        if (!show(its, at)) return its.failure();
        if (indicators.is_present() && !its.instance->get_indicators(guards[indicators].data()))
            return its.failure();
        const bool is_changed = its.instance->state() == event_mode || its.transfers[discrete].differs(at) ||
                                its.transfers[tunable].differs(at);
        guards[change] =
            its.memory.sign *
            (is_changed ? -1.0 : std::min(1.0, its.memory.next_event - at.time() + 2 * Running::slack(at)));
        return ok;
    }

    Status event(Now at, After after) const noexcept override {
        Running& its = at[running_];
        if (its.instance->state() != event_mode && its.is_tick(at))
            return fail_off_the_grid(its), its.failure();
        if (its.instance->state() != event_mode && !enter_event(its, at)) return its.failure();
        if (at[change] != 0) its.memory.sign = -its.memory.sign;
        bool has_jumped = false;
        return settle(its, at, has_jumped) && (!has_jumped || get_states(its, after)) &&
                       its.instance->enter_continuous_time()
                   ? ok
                   : its.failure();
    }

    /// The first event ends here, as no guard can have crossed before.
    Status update(Now at, Next) const noexcept override {
        Running& its = at[running_];
        if (its.instance->state() != event_mode) return ok;
        its.memory.sign = -its.memory.sign;
        bool has_jumped = false;
        if (!settle(its, at, has_jumped)) return its.failure();
        if (has_jumped && !has_same_states(its, at)) {
            its.instance->fail(
                its.instance->of_version("fmi2NewDiscreteStates", "fmi3UpdateDiscreteStates"),
                " makes continuous states jump in the first event, by inputs that were not known when the "
                "run began; give these inputs start values from which they do not jump");
            return its.failure();
        }
        return its.instance->enter_continuous_time() ? ok : its.failure();
    }

    bool directional_derivative(Now at, Changes& changes) const override {
        Values unknowns(description_.version, Type::float64);
        std::vector<std::pair<const Port*, std::size_t>> places;
        for (const auto& output : outputs_)
            if (output.is_continuous && changes.at(output.slot).size() > 0) {
                if (!is_differentiable(output)) return false;
                places.emplace_back(&output, unknowns.add(variable(output)));
            }
        return differentiate(
            at, changes, [](const Port& input) { return input.is_early; }, unknowns,
            [&](int direction) {
                for (const auto& [output, first] : places)
                    for (int i = 0; i < variable(*output).count(); ++i)
                        changes.at(output->slot)(place(*output, i), direction) =
                            unknowns[first + static_cast<std::size_t>(i)];
            });
    }
    bool directional_derivative_of_rates(Now at, Changes& changes) const override {
        Values unknowns(description_.version, Type::float64);
        for (const auto& rate : description_.derivatives)
            unknowns.add(description_.variables[static_cast<std::size_t>(rate.variable)]);
        return differentiate(
            at, changes, [](const Port&) { return true; }, unknowns,
            [&](int direction) {
                for (std::size_t i = 0; i < unknowns.size(); ++i)
                    changes.rate(states)(static_cast<Eigen::Index>(i), direction) = unknowns[i];
            });
    }

  private:
    static bool is_discrete(const Port& p) { return !p.is_continuous && p.clocks.empty(); }
    enum { fixed, tunable, continuous, discrete, early_continuous, early_discrete, outputs }; ///< transfers

    std::optional<std::vector<std::string>> state_names() const {
        std::vector<std::string> names;
        for (const auto& rate : description_.derivatives) {
            const auto& v = description_.variables[static_cast<std::size_t>(rate.variable)];
            const std::string name =
                v.derivative_of < 0 ? v.name
                                    : description_.variables[static_cast<std::size_t>(v.derivative_of)].name;
            for (int i = 0; i < v.count(); ++i)
                names.push_back(v.count() == 1 ? name : name + "[" + std::to_string(i + 1) + "]");
        }
        return names;
    }

    const Variable& variable(const Port& port) const {
        return description_.variables[static_cast<std::size_t>(port.variable)];
    }
    int place(const Port& port, int i) const {
        return column_by_column(i, variable(port).rows(), variable(port).cols());
    }
    /// Directions are numbers of 64 bits.
    bool is_differentiable(const Port& port) const {
        return description_.version == 2 || variable(port).type == Type::float64;
    }
    /// Asks the FMU along one direction after the other; `take` finds in `unknowns` what it gave.
    template <class Wanted, class Take>
    bool differentiate(Now at, const Changes& changes, Wanted&& is_wanted, Values& unknowns,
                       Take&& take) const {
        Running& its = at[running_];
        if (!description_.model_exchange->has_derivatives || !its.instance) return false;
        Values knowns(description_.version, Type::float64);
        std::vector<std::tuple<const Eigen::MatrixXd*, int, std::size_t>> from; // row, and place in `knowns`
        const auto add = [&](const Variable& v, const Eigen::MatrixXd& change, auto&& row) {
            const std::size_t first = knowns.add(v);
            for (int i = 0; i < v.count(); ++i)
                from.emplace_back(&change, row(i), first + static_cast<std::size_t>(i));
        };
        for (const auto& input : inputs_) {
            const auto& change = changes.at(input.slot);
            if (!input.is_continuous || !is_wanted(input) || change.size() == 0) continue;
            if (!is_differentiable(input)) return false;
            add(variable(input), change, [&](int i) { return place(input, i); });
        }
        int row = 0;
        for (const auto& rate : description_.derivatives) {
            const auto& v = description_.variables[static_cast<std::size_t>(rate.variable)];
            if (v.derivative_of < 0) return false; // of which state is not said
            if (changes.moves(states))
                add(description_.variables[static_cast<std::size_t>(v.derivative_of)], changes[states],
                    [&](int i) { return row + i; });
            row += v.count();
        }
        // Derivatives are those between two events: one that is under way ends here, and then begins again.
        struct Kept {
            Running& its;
            std::vector<double> state;
            ~Kept() {
                if (!state.empty()) its.restore(state.data());
            }
        } kept{its, {}};
        if (its.instance->state() == event_mode) {
            if (!its.can_save())
                throw std::runtime_error(
                    "its derivatives are known once its first event has ended, which an FMU without saved "
                    "states cannot do beforehand: go on to a later time");
            kept.state.resize(its.state_size());
            its.save(kept.state.data());
            bool has_jumped = false;
            if (!settle(its, at, has_jumped) || !its.instance->enter_continuous_time())
                throw std::runtime_error(its.instance->failure());
        }
        if (!show(its, at)) throw std::runtime_error(its.instance->failure());
        for (int direction = 0; direction < changes.directions(); ++direction) {
            for (const auto& [change, i, to] : from) knowns.set(to, (*change)(i, direction));
            if (unknowns.size() > 0 && !its.instance->differentiate(knowns, unknowns))
                throw std::runtime_error(its.instance->failure());
            take(direction);
        }
        return true;
    }

    bool write(Running& its, Now at, int transfer) const noexcept {
        return its.transfers[static_cast<std::size_t>(transfer)].write_to(*its.instance, at);
    }
    static bool is_due(const Running& its, Now at) noexcept {
        return at.time() >= its.memory.next_event - Running::slack(at);
    }
    static bool fail_off_the_grid(Running& its) noexcept {
        return its.instance->fail("", "one of its clocks ticks between two steps of the model; give the "
                                      "model a step that divides the clock's interval and shift");
    }
    /// An event is not before the time that the FMU named.
    bool enter_event(Running& its, Now at) const noexcept {
        if (its.has_missed_tick(at)) return fail_off_the_grid(its);
        const double time = is_due(its, at) ? std::max(at.time(), its.memory.next_event) : at.time();
        return its.instance->set_time(time) && set_states(its, at) && its.instance->enter_event_mode();
    }
    bool set_states(Running& its, Now at) const noexcept {
        return !states.is_present() || its.instance->set_states(at[states].data());
    }
    bool get_states(Running& its, After after) const noexcept {
        return !states.is_present() || its.instance->get_states(after[states].data());
    }
    bool has_same_states(Running& its, Now at) const noexcept {
        return !states.is_present() || (its.instance->get_states(its.row.data()) &&
                                        std::equal(its.row.begin(), its.row.end(), at[states].data()));
    }

    /// The first time in a step: the solver's step ended.
    bool begin_step(Running& its, Now at) const noexcept {
        const bool is_new = static_cast<double>(at.step()) != its.memory.step;
        its.memory.step = static_cast<double>(at.step());
        if (!is_new || its.instance->state() != continuous_time) return true;
        bool wants_event = false;
        if (description_.model_exchange->needs_completed_step &&
            !(its.instance->set_time(at.time()) && set_states(its, at) &&
              its.instance->complete_step(wants_event)))
            return false;
        return !(wants_event || is_due(its, at)) || enter_event(its, at);
    }
    /// The instance knows what there is at this instant.
    bool show(Running& its, Now at) const noexcept {
        if (its.instance->state() == event_mode)
            return write(its, at, continuous) && write(its, at, discrete) && write_clocked(its, at);
        return its.instance->set_time(at.time()) && set_states(its, at) && write(its, at, continuous);
    }
    /// An event ends.
    bool settle(Running& its, Now at, bool& has_jumped) const noexcept {
        Event event;
        if (!write(its, at, continuous) || !write(its, at, discrete) || !write_clocked(its, at) ||
            (its.transfers[tunable].differs(at) && !write(its, at, tunable)) || !its.end_event(at, event))
            return false;
        has_jumped = event.has_jumped;
        its.memory.next_event = std::min(event.next, its.clockwork.next(its.memory.ticked));
        return true;
    }
    static bool write_clocked(Running& its, Now at) noexcept {
        return its.write_clocked(at, &Running::Clocked::early) &&
               its.write_clocked(at, &Running::Clocked::late);
    }

    bf::Dim n{this, "n", std::function<bf::Dim::Names()>([this] { return state_names(); })};
    bool has_states_ = !description_.derivatives.empty(), has_indicators_ = description_.event_indicators > 0;

    bf::ContinuousState<bf::Vector> states{this,
                                           "states",
                                           {.shape = {n},
                                            .unit = any_unit,
                                            .doc = "continuous states of the FMU, in its order",
                                            .present = has_states_}};
    bf::GuardOf<bf::Vector> indicators{this,
                                       "indicators",
                                       {.shape = {description_.event_indicators},
                                        .doc = "its event indicators",
                                        .present = has_indicators_}};
    bf::Guard change{this, "event", {.doc = "falls or rises through 0 at events that are no crossings"}};
};

} // namespace

void add_model_exchange(bf::Library& library) {
    library.add<ModelExchange>(
        "ModelExchange", "An FMU of FMI 2.0 or 3.0 for model exchange, whose continuous states the model's "
                         "solver integrates. Ports, parameters, types and sizes are those of its "
                         "description; an output waits for those inputs that the description names.");
}

} // namespace bf::fmi
