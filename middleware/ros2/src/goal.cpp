// Goals of actions of any type that this machine has.
#include "bf/middleware/clock.hpp"
#include "bf/middleware/exchange.hpp"
#include "bf/middleware/topics.hpp"
#include "blocks.hpp"
#include "names.hpp"
#include "types.hpp"

#include <action_msgs/msg/goal_status_array.h>
#include <action_msgs/srv/cancel_goal.h>
#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <random>
#include <stdexcept>
#include <thread>

namespace bf::ros2 {

namespace {

using middleware::Opened;

using middleware::ExchangeBuffer;
using Id = std::array<std::uint8_t, 16>;

/// As action_msgs/msg/GoalStatus numbers them.
enum Progress : int {
    rejected = -1,
    unknown = action_msgs__msg__GoalStatus__STATUS_UNKNOWN,
    accepted = action_msgs__msg__GoalStatus__STATUS_ACCEPTED,
    canceling = action_msgs__msg__GoalStatus__STATUS_CANCELING,
};

/// Numbers of those fields of messages that are outputs: the node's thread writes them, and steps read the
/// newest.
struct Told {
    Told(const FieldOutputs& outputs)
        : newest(std::max(outputs.size(), 1)), places_(outputs.places()),
          arriving_(static_cast<std::size_t>(newest.size())) {}
    void take(const void* message) {
        int count = 0;
        if (const int wrong = read(message, places_, arriving_, count); wrong >= 0) {
            too_long_size = count;
            too_long = wrong;
            return;
        }
        newest.write(arriving_.data(), middleware::now());
    }
    ExchangeBuffer newest;
    std::atomic<int> too_long{-1}, too_long_size{0}; ///< number of the place, and what came for it

  private:
    const std::vector<Place> places_;
    std::vector<double> arriving_;
};

/// The step leaves the numbers of a goal, or that it is over; the node's threads talk to the server.
class Pursuit final : public Sender {
  public:
    Pursuit(const ActionType& type, std::vector<Place> places, int size, const FieldOutputs& feedback_outputs,
            const FieldOutputs& result_outputs)
        : asked(std::max(size, 1)), feedback(feedback_outputs), result(result_outputs),
          goal(type.goal.request->memory().make()), type_(type), places_(std::move(places)),
          values_(static_cast<std::size_t>(asked.size())),
          result_request_(type.result.request->memory().make()),
          cancel_request_(type.cancel.request->memory().make()) {}

    /// Joins the server's services and topics, which know this one as long as it lives.
    void open(Node& node, const std::string& name, const std::shared_ptr<Pursuit>& self) {
        const std::weak_ptr<Pursuit> to = self;
        const auto told = [to](auto&& take) {
            return [to, take](const void* message, std::int64_t call) {
                const auto still = to.lock();
                if (!still) return;
                const std::lock_guard lock(still->mutex_);
                take(*still, message, call);
            };
        };
        const auto client = [&](const ServiceType& service, const char* its, auto&& take) {
            return node.client(service.support, name + "/_action/" + its, service.response->memory().make(),
                               told(take));
        };
        goals_ = client(type_.goal, "send_goal", [](Pursuit& its, const void* message, std::int64_t call) {
            if (call == its.goal_call_) its.take_answer(message);
        });
        results_ =
            client(type_.result, "get_result", [](Pursuit& its, const void* message, std::int64_t call) {
                if (call == its.result_call_) its.take_result(message);
            });
        cancels_ = client(type_.cancel, "cancel_goal", [](auto&&...) {});
        topics_ = {node.subscribe(type_.feedback->memory(), name + "/_action/feedback", {},
                                  told([](Pursuit& its, const void* message, std::int64_t) {
                                      its.take_feedback(message);
                                  })),
                   node.subscribe(type_.status->memory(), name + "/_action/status", {1, true, true},
                                  told([](Pursuit& its, const void* message, std::int64_t) {
                                      its.take_status(
                                          *static_cast<const action_msgs__msg__GoalStatusArray*>(message));
                                  }))};
        node.add(self);
    }

    /// A goal that nobody can take yet waits, and one is canceled when it is accepted.
    bool has_news() const noexcept override {
        return (asked.newest() != sent && goals_->has_server()) || is_to_be_canceled();
    }
    void send() override {
        const std::lock_guard lock(mutex_);
        if (is_to_be_canceled()) {
            auto& request = *static_cast<action_msgs__srv__CancelGoal_Request*>(cancel_request_.get());
            std::copy(id_.begin(), id_.end(), request.goal_info.goal_id.uuid);
            cancels_->call(&request);
            canceled_ = sent.load();
        }
        middleware::Stamp stamp;
        if (asked.newest() == sent || !goals_->has_server() || !asked.read(values_.data(), stamp)) return;
        for (const auto& place : places_)
            place.field->write(goal.get(), &values_[static_cast<std::size_t>(place.first)],
                               static_cast<std::size_t>(place.size));
        std::random_device random;
        for (auto& byte : id_) byte = static_cast<std::uint8_t>(random());
        write_id(*type_.goal.request, goal.get());
        is_accepted_ = false;
        result_call_ = 0;
        status = unknown;
        sent = stamp.number;
        ++signs;
        goal_call_ = goals_->call(goal.get());
        if (goal_call_ == 0) end(rejected); // it was not sent, so nobody answers
    }
    /// Whether the newest goal has neither a result nor is rejected.
    bool is_active() const noexcept { return over != asked.newest(); }
    /// From a step, or behind the last one.
    void cancel() noexcept { to_cancel_ = asked.newest(); }
    bool has_to_cancel() const noexcept {
        return is_active() && to_cancel_ != canceled_ && goals_->has_server();
    }

    ExchangeBuffer asked; ///< numbers of goals
    Told feedback, result;
    const std::shared_ptr<void> goal;                 ///< the request, with its texts
    std::atomic<std::uint64_t> sent{0}, over{0};      ///< the newest goal that was sent, and that has ended
    std::atomic<std::uint64_t> finished{0}, signs{0}; ///< goals that have ended, and what came of the server
    std::atomic<int> status{unknown};

    middleware::Stamp taken; ///< of the step: results
    bool was_active = false;
    std::uint64_t signs_seen = 0;
    double since = 0; ///< the last sign of the server, s

  private:
    bool is_to_be_canceled() const noexcept {
        return is_accepted_ && to_cancel_ == sent && canceled_ != sent && over != sent;
    }
    void write_id(const MessageType& type, void* message) const {
        std::array<double, 16> numbers{};
        std::copy(id_.begin(), id_.end(), numbers.begin());
        type.field(id_path)->write(message, numbers.data(), numbers.size());
    }
    // ---- in the waiting thread, with the lock
    void take_answer(const void* message) {
        ++signs;
        double is_good = 0;
        type_.goal.response->field("accepted")->read(message, &is_good, 1);
        if (is_good == 0) return end(rejected);
        is_accepted_ = true;
        status = std::max<int>(status, accepted); // what it does may have come before
        write_id(*type_.result.request, result_request_.get());
        result_call_ = results_->call(result_request_.get());
    }
    void take_result(const void* message) {
        double its = 0;
        type_.result.response->field("status")->read(message, &its, 1);
        result.take(message);
        end(static_cast<int>(its));
    }
    void take_feedback(const void* message) {
        std::array<double, 16> numbers{};
        type_.feedback->field(id_path)->read(message, numbers.data(), numbers.size());
        if (!std::equal(id_.begin(), id_.end(), numbers.begin())) return; // of somebody else's
        ++signs;
        feedback.take(message);
    }
    void take_status(const action_msgs__msg__GoalStatusArray& all) {
        for (std::size_t i = 0; i < all.status_list.size; ++i) {
            const auto& its = all.status_list.data[i];
            if (!std::equal(id_.begin(), id_.end(), its.goal_info.goal_id.uuid)) continue;
            ++signs;
            // How it ended is told with its result.
            if (over != sent && its.status >= accepted && its.status <= canceling) status = its.status;
        }
    }
    void end(int how) {
        ++signs;
        ++finished;
        status = how;
        over = sent.load(); // last: a step that sees it has the result
    }

    static constexpr const char* id_path = "goal_id.uuid";
    const ActionType type_;
    const std::vector<Place> places_;
    std::vector<double> values_;
    const std::shared_ptr<void> result_request_, cancel_request_;
    std::shared_ptr<Client> goals_, results_, cancels_;
    std::array<std::shared_ptr<Subscription>, 2> topics_;
    std::mutex mutex_; ///< between the node's threads
    Id id_{};          ///< of the goal that was sent last
    std::int64_t goal_call_ = 0, result_call_ = 0;
    std::atomic<bool> is_accepted_{false};
    std::atomic<std::uint64_t> to_cancel_{0}, canceled_{0};
};

std::vector<std::string> starting_with(const std::string& prefix, const std::vector<std::string>& all) {
    std::vector<std::string> some;
    std::ranges::copy_if(all, std::back_inserter(some),
                         [&](const auto& text) { return text.starts_with(prefix); });
    return some;
}

class SendGoal final : public Block {
  public:
    explicit SendGoal(const Arguments& arguments) : Block(arguments) {
        std::vector<std::string> problems;
        middleware::check_name(name_rules.topic, "action", action, problems);
        try {
            type_ = ActionType::find(type);
        } catch (const std::runtime_error& error) {
            problems.push_back(std::string("argument 'type': ") + error.what());
        }
        if (type_.feedback) add_ports(problems);
        for (auto& text : problems) problem(std::move(text));
    }

    Argument<std::string> action{
        this, "action", {.initial = "action", .doc = "its name, absolute or in the node's namespace"}};
    Argument<std::string> type{this,
                               "type",
                               {.doc = "type of the action, of any package that is installed, such as "
                                       "control_msgs/action/FollowJointTrajectory"}};
    Argument<std::vector<std::string>> fields{
        this,
        "fields",
        {.doc = "paths of those fields of the goal that are inputs, such as goal.target; none: all that are "
                "numbers"}};
    Argument<std::vector<std::string>> texts{
        this,
        "texts",
        {.doc = "fields of the goal that are texts, each as field=text, such as goal.frame=base"}};
    Argument<std::vector<std::string>> answer_fields{
        this,
        "answer_fields",
        {.doc =
             "paths of those fields that are outputs, such as feedback.position and result.error_code; none: "
             "all that are numbers"}};
    Argument<std::vector<std::string>> sizes{
        this,
        "sizes",
        {.doc =
             "largest number of elements of outputs that have any number of them, each as field=size, such "
             "as result.sequence=10; those that are not named are no ports"}};
    Argument<double> timeout{
        this, "timeout",
        middleware::waiting_time(
            "without a word of the server on an active goal until the run ends, s; 0: never")};
    Requires<RosNode> node{this, "the node that talks"};
    Input<double> start_goal{
        this, "start", {.doc = "sends a goal when it becomes positive, with the numbers of that step"}};
    Input<double> cancel{
        this, "cancel", {.doc = "cancels the newest goal when it becomes positive", .optional = true}};
    Output<double> status{
        this,
        "status",
        {.doc = "of the newest goal, as action_msgs/msg/GoalStatus numbers it: 0 not answered, 1 accepted, 2 "
                "executing, 3 canceling, 4 succeeded, 5 canceled, 6 aborted; -1: rejected"}};
    Output<double> active{this, "active", {.doc = "1: the newest goal has no result, and is not rejected"}};
    Output<double> finished{this, "finished", {.doc = "goals that have a result or were rejected, so far"}};
    DiscreteState<double> last_start{this, "last_start", {.doc = "the input start of the step before"}},
        last_cancel{this, "last_cancel", {.doc = "the input cancel of the step before"}};
    OutsideState<Opened<Pursuit>> opened{this, [] { return std::make_shared<Opened<Pursuit>>(); }};
    Scratch<std::vector<double>> goal{this, [] { return std::vector<double>(); }},
        feedback{this, [] { return std::vector<double>(); }},
        result{this, [] { return std::vector<double>(); }};

    void start(Now at) const override {
        Node& its = at[node];
        its.open();
        auto end =
            std::make_shared<Pursuit>(type_, inputs_.places(at, 0), inputs_.size(at), feedback_, result_);
        for (const auto& [field, its_texts] : texts_) field->write(end->goal.get(), its_texts);
        end->open(its, action, end);
        at[goal].assign(static_cast<std::size_t>(end->asked.size()), 0.0);
        at[feedback].assign(static_cast<std::size_t>(end->feedback.newest.size()), 0.0);
        at[result].assign(static_cast<std::size_t>(end->result.newest.size()), 0.0);
        at[opened].end = std::move(end);
    }
    void stop(Now at) const noexcept override {
        auto& end = at[opened].end;
        if (end && end->is_active()) {
            end->cancel(); // nobody will hear how it ends
            for (int tries = 0; end->has_to_cancel() && tries < 100; ++tries) {
                at[node].bell().ring();
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
        }
        end.reset();
    }

    Status output(Now at, Out out) const noexcept override {
        Pursuit& end = *at[opened].end;
        if (at[start_goal] > 0 && !(at[last_start] > 0)) {
            inputs_.copy(at, at[goal].data());
            end.asked.write(at[goal].data(), middleware::now());
            at[node].bell().ring();
        }
        if (at[cancel] > 0 && !(at[last_cancel] > 0)) {
            end.cancel();
            at[node].bell().ring();
        }
        for (const auto& [outputs, told] : {std::pair(&feedback_, &end.feedback), {&result_, &end.result}})
            if (const int place = told->too_long; place >= 0)
                return outputs->too_long(place, told->too_long_size);
        const bool is_active = end.is_active();
        out[active] = is_active ? 1 : 0;
        out[status] = end.sent == end.asked.newest() ? end.status.load() : unknown;
        out[finished] = static_cast<double>(end.finished);
        middleware::Stamp stamp;
        end.feedback.newest.read(at[feedback].data(), stamp);
        feedback_.copy(at[feedback].data(), out);
        end.result.newest.read(at[result].data(), stamp);
        result_.copy(at[result].data(), out);
        const double now = middleware::now();
        const std::uint64_t signs = end.signs;
        if (!is_active || !std::exchange(end.was_active, is_active) ||
            std::exchange(end.signs_seen, signs) != signs)
            end.since = now;
        end.was_active = is_active;
        if (*timeout > 0 && now - end.since > *timeout)
            return Status::failure("no word on the goal came within argument 'timeout'; look whether the "
                                   "action's server is there, or raise it");
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[last_start] = at[start_goal];
        next[last_cancel] = at[cancel];
        return ok;
    }

  private:
    void add_ports(std::vector<std::string>& problems) {
        inputs_.add(*this, *type_.goal.request,
                    fields_of(*type_.goal.request, fields, "fields", problems, "goal."));
        texts_ = texts_of(*type_.goal.request, texts, problems);
        const auto add = [&](FieldOutputs& outputs, const MessageType& its, const std::string& prefix) {
            const auto named = starting_with(prefix, answer_fields);
            if (named.empty() && !answer_fields->empty()) return;
            outputs.add(*this, its, fields_of(its, named, "answer_fields", problems, prefix), !named.empty(),
                        starting_with(prefix, sizes), problems);
        };
        add(feedback_, *type_.feedback, "feedback.");
        add(result_, *type_.result.response, "result.");
        for (const auto* list : {&*answer_fields, &*sizes})
            for (const auto& text : *list)
                if (!text.starts_with("feedback.") && !text.starts_with("result."))
                    problems.push_back("'" + text +
                                       "' is neither of the feedback nor of the result; write it as "
                                       "feedback.field or result.field");
    }

    ActionType type_;
    FieldInputs inputs_;
    FieldOutputs feedback_, result_;
    std::vector<std::pair<const Field*, std::vector<std::string>>> texts_;
};

} // namespace

void add_goals(Library& library) {
    library.group("topics").add<SendGoal>(
        "SendGoal",
        "Sends a goal to the server of an action, of any type that is installed, when its input `start` "
        "becomes positive. The numbers of the goal are inputs, those of feedback and result outputs, as "
        "those of Publish and Subscribe; outputs keep the newest feedback and result, and are zeros before "
        "the first ones. A step neither waits nor sends: the node's threads do, and a goal waits until "
        "there is a server. A new goal takes the place of one that is active, which the server may end or "
        "not. When the run ends, a goal that is active is canceled if the server has accepted it, or does "
        "within 0.1 s. Errors: no such type, field or name of an action; in a step: no word of the server "
        "for timeout, more elements than expected.");
}

} // namespace bf::ros2
