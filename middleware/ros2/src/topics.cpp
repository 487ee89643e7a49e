// Topics of any type of message that this machine has, whose fields are ports.
#include "bf/middleware/topics.hpp"
#include "blocks.hpp"
#include "names.hpp"
#include "types.hpp"

namespace bf::ros2 {

namespace {

constexpr middleware::MessageTypes types{
    [](const std::string& name) -> std::shared_ptr<const middleware::MessageType> {
        return MessageType::find(name);
    },
    "std_msgs/msg/Float64",
    "type of its messages, of any package that is installed, such as sensor_msgs/msg/Imu", name_rules};

/// What the blocks have beside those of other middlewares.
template <class Base> class RosTopic : public Base {
  public:
    explicit RosTopic(const Arguments& arguments) : Base(arguments, types) {}

    Argument<std::string> reliability{
        this,
        "reliability",
        {.initial = "reliable",
         .doc = "best_effort: what is lost is not sent again; a reader that wants reliable messages hears no "
                "such writer",
         .choices = {"reliable", "best_effort"}}};
    Argument<std::string> durability{
        this,
        "durability",
        {.initial = "volatile",
         .doc = "transient_local: the last messages are for those, too, who come later",
         .choices = {"volatile", "transient_local"}}};
    Argument<int> depth{
        this,
        "depth",
        {.initial = 10, .minimum = 1, .maximum = 10'000, .doc = "messages that are kept on their way"}};
    Requires<RosNode> node{this, "the node that talks"};

  protected:
    Quality quality() const { return {depth, *reliability == "reliable", *durability == "transient_local"}; }
    const MessageMemory& memory() const { return static_cast<const MessageType&>(*this->type_).memory(); }
};

class Publish final : public RosTopic<middleware::PublishBlock> {
  public:
    using RosTopic::RosTopic;

  private:
    void open(Now at, const std::shared_ptr<middleware::Outgoing>& end) const override {
        Node& its = at[node];
        its.open();
        end->clock = [context = its.context()] { return context->now(); };
        end->publish = [publisher = its.advertise(memory(), topic, quality())](const void* message) {
            publisher->publish(message);
        };
        end->bell = &its.bell();
        its.add(end);
    }
};

class Subscribe final : public RosTopic<middleware::SubscribeBlock> {
  public:
    using RosTopic::RosTopic;

  private:
    std::shared_ptr<middleware::Incoming> open(Now at, middleware::Wanted wanted) const override {
        Node& its = at[node];
        its.open();
        auto end = std::make_shared<middleware::LiveIncoming>(std::move(wanted));
        // The thread keeps what it writes to, but not the subscription, which ends with the run.
        const std::weak_ptr<middleware::LiveIncoming> to = end;
        end->subscription =
            its.subscribe(memory(), topic, quality(), [to](const void* message, std::uint64_t) {
                if (const auto still = to.lock()) still->receive(message);
            });
        return end;
    }
};

} // namespace

void add_topics(Library& library) {
    library.group("topics")
        .add<Publish>(
            "Publish",
            "Publishes a message of any type that is installed in each step; the node's thread sends it, the "
            "newest where several are left. Its fields are ports: numbers, vectors of geometry, arrays, of "
            "any length where the type allows it, times as s; what is wired to none keeps the type's "
            "default, but arrays of any length, which are wired or left out by `fields`. Numbers that a "
            "field cannot hold become the nearest that it can, integers with halves away from 0 and NaN as "
            "0; what is beyond a float32 is infinite. Wide strings, arrays of strings and lists of messages "
            "are left out. Errors: no such type, field or name of a topic; more elements than a field has.")
        .add<Subscribe>(
            "Subscribe",
            "The newest message of a topic, of any type that is installed; zeros before the first one. Its "
            "fields are ports as those of Publish; a field of any number of elements has the size that "
            "`sizes` says, zeros behind those that came, and how many these were. Integers are exact up to "
            "2^53, and numbers that are not finite, which some types give a meaning, come as they are. "
            "Errors: no such type, field or name of a topic; no message within start_timeout; in a step: "
            "none for timeout, more elements than expected, another frame.");
}

} // namespace bf::ros2
