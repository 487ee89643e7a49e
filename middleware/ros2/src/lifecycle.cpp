// The node as a managed one, whose state decides what of the diagram runs.
#include "bf/middleware/topics.hpp"
#include "blocks.hpp"
#include "messages.hpp"
#include "types.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <lifecycle_msgs/msg/state.h>
#include <lifecycle_msgs/msg/transition.h>
#include <lifecycle_msgs/msg/transition_description.h>
#include <lifecycle_msgs/msg/transition_event.h>
#include <lifecycle_msgs/srv/change_state.h>
#include <lifecycle_msgs/srv/get_available_states.h>
#include <lifecycle_msgs/srv/get_available_transitions.h>
#include <lifecycle_msgs/srv/get_state.h>
#include <new>

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
constexpr int active_state = 3;

/// As lifecycle_msgs/msg/Transition numbers them: who asks for one passes a state on the way, which nothing
/// in a diagram can refuse.
struct Change {
    Named transition;
    int from, by, to;
    std::uint8_t done; ///< the transition that ends it
};
constexpr Change changes[] = {{{1, "configure"}, 1, 10, 2, 10}, {{2, "cleanup"}, 2, 11, 1, 20},
                              {{3, "activate"}, 2, 13, 3, 30},  {{4, "deactivate"}, 3, 14, 2, 40},
                              {{5, "shutdown"}, 1, 12, 4, 50},  {{6, "shutdown"}, 2, 12, 4, 50},
                              {{7, "shutdown"}, 3, 12, 4, 50}};
constexpr const char* done_label = "transition_success";

template <class Message> void write(const Named& from, Message& to) {
    to.id = from.id;
    messages::assign(to.label, from.label);
}
void write_state(int id, State& to) {
    write(*std::ranges::find(states, id, [](const Named& each) { return int{each.id}; }), to);
}

/// The node's thread answers, and steps look at the state.
class Life {
  public:
    explicit Life(int begin) : state(begin) {}
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
        BF_OFFER(GetState, "get_state", write_state(its->state, response.current_state));
        BF_OFFER(GetAvailableStates, "get_available_states", list_states(response.available_states));
        BF_OFFER(GetAvailableTransitions, "get_available_transitions",
                 list(response.available_transitions,
                      [&](const Change& each) { return each.from == its->state; }));
        BF_OFFER(GetAvailableTransitions, "get_transition_graph",
                 list(response.available_transitions, [](const Change&) { return true; }));
#undef BF_OFFER
    }
    std::atomic<int> state;

  private:
    /// By its name where it has one, else by its number, as managed nodes do.
    bool change(const Transition& asked) {
        const std::string label = messages::text(asked.label);
        const auto is_it = [&](const Change& each) {
            return each.from == state &&
                   (label.empty() ? each.transition.id == asked.id : label == each.transition.label);
        };
        const auto* found = std::ranges::find_if(changes, is_it);
        if (found == std::end(changes)) return false;
        tell(found->transition, found->from, found->by);
        state = found->to;
        tell({found->done, done_label}, found->by, found->to);
        return true;
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
    Requires<RosNode> node{this, "the node that is managed"};
    Output<bool> active{
        this, "active", {.doc = "whether it is active, such as for the enable of a subsystem"}};
    Output<double> state{
        this,
        "state",
        {.doc = "as lifecycle_msgs/msg/State numbers it: 1 unconfigured, 2 inactive, 3 active, 4 "
                "finalized"}};
    OutsideState<Opened<Life>> opened{this, [] { return std::make_shared<Opened<Life>>(); }};

    void start(Now at) const override {
        at[node].open();
        const auto* found = std::ranges::find(states, *begin, &Named::label);
        at[opened].end = std::make_shared<Life>(found->id);
        at[opened].end->open(at[node], at[opened].end);
    }
    void stop(Now at) const noexcept override { at[opened].end.reset(); }
    Status output(Now at, Out out) const noexcept override {
        const int its = at[opened].end->state;
        out[active] = its == active_state;
        out[state] = its;
        return ok;
    }
};

} // namespace

void add_lifecycle(Library& library) {
    library.group("topics").add<Lifecycle>(
        "Lifecycle",
        "Makes the node a managed one: its services change_state, get_state, get_available_states, "
        "get_available_transitions and get_transition_graph, and the topic transition_event, are those of "
        "lifecycle nodes (lifecycle_msgs), and the outputs tell its state from the next step on. What of "
        "the diagram is in a subsystem that `active` enables runs as long as the node is active; the others "
        "go on. What is asked for is done, or refused where the state has no such transition. Source: ROS 2 "
        "design, Managed nodes.");
}

} // namespace bf::ros2
