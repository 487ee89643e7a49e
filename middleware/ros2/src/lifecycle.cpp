// The node as a managed one, whose state decides what of the diagram runs.
#include "bf/middleware/topics.hpp"
#include "blocks.hpp"
#include "messages.hpp"
#include "types.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <lifecycle_msgs/msg/state.h>
#include <lifecycle_msgs/msg/transition.h>
#include <lifecycle_msgs/msg/transition_description.h>
#include <lifecycle_msgs/msg/transition_event.h>
#include <lifecycle_msgs/srv/change_state.h>
#include <lifecycle_msgs/srv/get_available_states.h>
#include <lifecycle_msgs/srv/get_available_transitions.h>
#include <lifecycle_msgs/srv/get_state.h>
#include <mutex>
#include <new>
#include <string_view>

namespace bf::ros2 {

namespace {

using middleware::Opened;

using State = lifecycle_msgs__msg__State;
using Transition = lifecycle_msgs__msg__Transition;

/// As lifecycle_msgs/msg/State numbers them.
struct Named {
    std::uint8_t id;
    const char* label;
};
constexpr Named states[] = {{0, "unknown"},       {1, "unconfigured"},    {2, "inactive"},
                            {3, "active"},        {4, "finalized"},       {10, "configuring"},
                            {11, "cleaningup"},   {12, "shuttingdown"},   {13, "activating"},
                            {14, "deactivating"}, {15, "errorprocessing"}};
constexpr int unconfigured = 1, inactive = 2, active_state = 3, finalized = 4, first_under_way = 10,
              error_processing = 15;

/// As lifecycle_msgs/msg/Transition numbers them. Who asks for one of the first ones leads the node to a
/// state under way; from there the others lead on, as that has succeeded, has failed, or is an error.
struct Change {
    Named transition;
    int from, to;
};
constexpr const char *succeeded = "transition_success", *failed = "transition_failure",
                     *erred = "transition_error";
constexpr Change changes[] = {
    {{1, "configure"}, 1, 10}, {{2, "cleanup"}, 2, 11},  {{3, "activate"}, 2, 13}, {{4, "deactivate"}, 3, 14},
    {{5, "shutdown"}, 1, 12},  {{6, "shutdown"}, 2, 12}, {{7, "shutdown"}, 3, 12}, {{10, succeeded}, 10, 2},
    {{11, failed}, 10, 1},     {{12, erred}, 10, 15},    {{20, succeeded}, 11, 1}, {{21, failed}, 11, 2},
    {{22, erred}, 11, 15},     {{30, succeeded}, 13, 3}, {{31, failed}, 13, 2},    {{32, erred}, 13, 15},
    {{40, succeeded}, 14, 2},  {{41, failed}, 14, 3},    {{42, erred}, 14, 15},    {{50, succeeded}, 12, 4},
    {{51, failed}, 12, 4},     {{52, erred}, 12, 15},    {{60, succeeded}, 15, 1}, {{61, failed}, 15, 4},
    {{62, erred}, 15, 4}};
/// An error of what is inactive or active has no number of its own.
constexpr Named error_at_work{99, erred};
enum class Outcome : std::uint64_t { success, failure, error };

template <class Message> void write(const Named& from, Message& to) {
    to.id = from.id;
    messages::assign(to.label, from.label);
}
void write_state(int id, State& to) {
    write(*std::ranges::find(states, id, [](const Named& each) { return int{each.id}; }), to);
}

/// The node's threads change the state and tell it; steps look at it, and answer what becomes of it.
class Life final : public Sender {
  public:
    /// Where steps are not asked, every transition succeeds.
    Life(int begin, bool asks_steps) : seen_(static_cast<std::uint64_t>(begin)), asks_steps_(asks_steps) {}

    /// What a step sees: the state, and how often it has changed.
    std::uint64_t seen() const noexcept { return seen_; }
    static int state_of(std::uint64_t seen) noexcept { return static_cast<int>(seen % changed); }
    /// What becomes of that which a step has seen; the first answer counts.
    void answer(std::uint64_t seen, Outcome outcome) noexcept {
        if (answer_ / outcomes != seen) answer_ = seen * outcomes + static_cast<std::uint64_t>(outcome);
    }
    bool has_news() const noexcept override { return answer_ != heard_; }
    void send() override {
        const std::lock_guard lock(mutex_);
        heard_ = answer_.load();
        if (heard_ / outcomes == seen_) go_on(static_cast<Outcome>(heard_ % outcomes));
    }
    /// A step has failed, and with it the run.
    void fail() {
        const std::lock_guard lock(mutex_);
        if (state() == unconfigured || state() == finalized) return;
        if (state() != error_processing) go_on(Outcome::error);
        go_on(Outcome::failure);
    }
    /// Offers what managed nodes do. The node's thread may answer once more when this one has gone.
    void open(Node& node, const std::weak_ptr<Life>& self) {
        const MessageMemory event_type{ROSIDL_GET_MSG_TYPE_SUPPORT(lifecycle_msgs, msg, TransitionEvent), [] {
                                           return messages::memory(
                                               lifecycle_msgs__msg__TransitionEvent__create,
                                               lifecycle_msgs__msg__TransitionEvent__destroy);
                                       }};
        event_ = messages::make<lifecycle_msgs__msg__TransitionEvent>(event_type);
        events_ = node.advertise(event_type, "~/transition_event", {});
#define BF_OFFER(type, name, answer)                                                                         \
    services_.push_back(                                                                                     \
        node.serve(ROSIDL_GET_SRV_TYPE_SUPPORT(lifecycle_msgs, srv, type), "~/" name,                        \
                   messages::memory(lifecycle_msgs__srv__##type##_Request__create,                           \
                                    lifecycle_msgs__srv__##type##_Request__destroy),                         \
                   messages::memory(lifecycle_msgs__srv__##type##_Response__create,                          \
                                    lifecycle_msgs__srv__##type##_Response__destroy),                        \
                   [self]([[maybe_unused]] const void* asked, void* answered) {                              \
                       const auto its = self.lock();                                                         \
                       if (!its) return;                                                                     \
                       [[maybe_unused]] const auto& request =                                                \
                           *static_cast<const lifecycle_msgs__srv__##type##_Request*>(asked);                \
                       auto& response = *static_cast<lifecycle_msgs__srv__##type##_Response*>(answered);     \
                       answer;                                                                               \
                   }))
        BF_OFFER(ChangeState, "change_state", response.success = its->change(request.transition));
        BF_OFFER(GetState, "get_state", write_state(its->state(), response.current_state));
        BF_OFFER(GetAvailableStates, "get_available_states", list_states(response.available_states));
        BF_OFFER(GetAvailableTransitions, "get_available_transitions",
                 list(response.available_transitions,
                      [&](const Change& each) { return each.from == its->state(); }));
        BF_OFFER(GetAvailableTransitions, "get_transition_graph",
                 list(response.available_transitions, [](const Change&) { return true; }));
#undef BF_OFFER
    }

  private:
    static constexpr std::uint64_t changed = 100, outcomes = 4;
    static constexpr std::chrono::milliseconds patience{500};

    int state() const noexcept { return state_of(seen_); }
    /// By its name where it has one, else by its number, as managed nodes do.
    bool change(const Transition& asked) {
        const std::string label = messages::text(asked.label);
        std::unique_lock lock(mutex_);
        const auto is_it = [&](const Change& each) {
            return each.from == state() && each.from < first_under_way &&
                   (label.empty() ? each.transition.id == asked.id : label == each.transition.label);
        };
        const auto* found = std::ranges::find_if(changes, is_it);
        if (found == std::end(changes)) return false;
        move(found->transition, found->to);
        const auto has_gone_on = [&, then = seen_.load()] { return seen_ != then; };
        if (!asks_steps_)
            go_on(Outcome::success);
        else if (!gone_on_.wait_for(lock, patience, has_gone_on))
            go_on(Outcome::failure);
        return last_ == Outcome::success;
    }
    /// From a state under way, or from one of work to the processing of errors.
    void go_on(Outcome outcome) {
        const char* const labels[] = {succeeded, failed, erred};
        const std::string_view label = labels[static_cast<int>(outcome)];
        const auto* found = std::ranges::find_if(changes, [&](const Change& each) {
            return each.from == state() && each.transition.label == label;
        });
        if (state() != error_processing) last_ = outcome;
        if (found != std::end(changes))
            move(found->transition, found->to);
        else if (outcome == Outcome::error)
            move(error_at_work, error_processing);
        gone_on_.notify_all();
    }
    void move(const Named& transition, int to) {
        const int from = state();
        seen_ = (seen_ / changed + 1) * changed + static_cast<std::uint64_t>(to);
        tell(transition, from, to);
    }
    void tell(const Named& transition, int from, int to) {
        event_->timestamp =
            static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                           std::chrono::system_clock::now().time_since_epoch())
                                           .count());
        write(transition, event_->transition);
        write_state(from, event_->start_state);
        write_state(to, event_->goal_state);
        events_->publish(event_.get());
    }
    static void list_states(lifecycle_msgs__msg__State__Sequence& to) {
        lifecycle_msgs__msg__State__Sequence__fini(&to);
        if (!lifecycle_msgs__msg__State__Sequence__init(&to, std::size(states))) throw std::bad_alloc();
        for (std::size_t i = 0; i < to.size; ++i) write(states[i], to.data[i]);
    }
    template <class F>
    static void list(lifecycle_msgs__msg__TransitionDescription__Sequence& to, F&& is_asked) {
        lifecycle_msgs__msg__TransitionDescription__Sequence__fini(&to);
        const auto count = static_cast<std::size_t>(std::ranges::count_if(changes, is_asked));
        if (!lifecycle_msgs__msg__TransitionDescription__Sequence__init(&to, count)) throw std::bad_alloc();
        std::size_t i = 0;
        for (const auto& each : changes) {
            if (!is_asked(each)) continue;
            auto& its = to.data[i++];
            write(each.transition, its.transition);
            write_state(each.from, its.start_state);
            write_state(each.to, its.goal_state);
        }
    }

    std::atomic<std::uint64_t> seen_, answer_{0}, heard_{0};
    const bool asks_steps_;
    std::mutex mutex_; ///< of who changes the state, and of all that follow
    std::condition_variable gone_on_;
    Outcome last_ = Outcome::success; ///< of a transition that was asked for
    std::shared_ptr<lifecycle_msgs__msg__TransitionEvent> event_;
    std::shared_ptr<Publisher> events_;
    std::vector<std::shared_ptr<Service>> services_;
};

class Lifecycle final : public Block {
  public:
    using Block::Block;
    Argument<std::string> begin{this,
                                "begin",
                                {.initial = "unconfigured",
                                 .doc = "the state of the node at the start",
                                 .choices = {"unconfigured", "inactive", "active"}}};
    Argument<std::string> on_error{
        this,
        "on_error",
        {.initial = "finalized",
         .doc = "the state to which the processing of an error leads, unless `failure` is positive then",
         .choices = {"finalized", "unconfigured"}}};
    Requires<RosNode> node{this, "the node that is managed"};
    Input<double> failure{this,
                          "failure",
                          {.doc = "positive while a transition is under way: it fails, and the node is again "
                                  "what it was; in errorprocessing: it becomes finalized",
                           .feedthrough = false,
                           .optional = true}};
    Input<double> error{
        this,
        "error",
        {.doc = "positive: an error of a node that is inactive or active, or of a transition under way",
         .feedthrough = false,
         .optional = true}};
    Output<bool> active{
        this, "active", {.doc = "whether it is active, such as for the enable of a subsystem"}};
    Output<double> state{
        this,
        "state",
        {.doc = "as lifecycle_msgs/msg/State numbers it: 1 unconfigured, 2 inactive, 3 active, 4 finalized; "
                "where `failure` or `error` is wired, for a step at least: 10 configuring, 11 cleaningup, 12 "
                "shuttingdown, 13 activating, 14 deactivating, 15 errorprocessing"}};
    OutsideState<Opened<Life>> opened{this, [] { return std::make_shared<Opened<Life>>(); }};
    Scratch<std::uint64_t> seen{this, [] { return std::uint64_t{0}; }};
    Scratch<std::int64_t> ended{this, [] { return std::int64_t{-1}; }}; ///< number of the last whole step

    void start(Now at) const override {
        at[node].open();
        const auto* found = std::ranges::find(states, *begin, &Named::label);
        auto life = std::make_shared<Life>(found->id, asks(at));
        life->open(at[node], life);
        at[node].add(life);
        at[ended] = at.step();
        at[opened].end = std::move(life);
    }
    void stop(Now at) const noexcept override {
        auto& life = at[opened].end;
        if (life && at.step() != at[ended]) life->fail(); // the step that was begun last has not ended
        life.reset();
    }
    Status output(Now at, Out out) const noexcept override {
        at[seen] = at[opened].end->seen();
        const int its = Life::state_of(at[seen]);
        out[active] = its == active_state;
        out[state] = its;
        return ok;
    }
    Status update(Now at, Next) const noexcept override {
        at[ended] = at.step();
        if (!asks(at)) return ok;
        const int its = Life::state_of(at[seen]);
        const bool is_under_way = its >= first_under_way;
        const bool has_erred = at[error] > 0 && its != error_processing &&
                               (is_under_way || its == inactive || its == active_state);
        if (!has_erred && !is_under_way) return ok;
        const bool has_failed =
            at[failure] > 0 || (its == error_processing && *on_error == std::string_view("finalized"));
        at[opened].end->answer(at[seen], has_erred    ? Outcome::error
                                         : has_failed ? Outcome::failure
                                                      : Outcome::success);
        at[node].bell().ring();
        return ok;
    }

  private:
    bool asks(Now at) const { return at.is_connected(failure) || at.is_connected(error); }
};

} // namespace

void add_lifecycle(Library& library) {
    library.group("topics").add<Lifecycle>(
        "Lifecycle",
        "Makes the node a managed one: its services change_state, get_state, get_available_states, "
        "get_available_transitions and get_transition_graph, and the topic transition_event, are those of "
        "lifecycle nodes (lifecycle_msgs), and the outputs tell its state from the next step on. What of the "
        "diagram is in a subsystem that `active` enables runs as long as the node is active; the others go "
        "on. What is asked for is done, or refused where the state has no such transition. Where `failure` "
        "or `error` is wired, a step sees each state that is under way and decides: a transition that fails, "
        "or that no step sees for 0.5 s, leads back, an error leads through errorprocessing to `on_error`. A "
        "step of any block that fails ends the run, which leads a node that is inactive or active through "
        "errorprocessing to finalized. transition_event tells it all. Source: ROS 2 design, Managed nodes.");
}

} // namespace bf::ros2
