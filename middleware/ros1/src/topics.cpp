// Topics of any type of message that this machine has, whose fields are ports.
#include "connection.hpp"
#include "names.hpp"

namespace bf::ros1 {

namespace {

constexpr middleware::MessageTypes types{
    [](const std::string& name) -> std::shared_ptr<const middleware::MessageType> {
        return MessageType::find(name);
    },
    "std_msgs/Float64", "type of its messages, of any package that is installed, such as sensor_msgs/Imu",
    name_rules};

/// What the blocks have beside those of other middlewares.
template <class Base> class RosTopic : public Base {
  public:
    explicit RosTopic(const Arguments& arguments) : Base(arguments, types) {}

    Argument<int> depth{
        this,
        "depth",
        {.initial = 10, .minimum = 1, .maximum = 10'000, .doc = "messages that are kept on their way"}};
    Requires<RosConnection> node{this, "the node that talks"};

  protected:
    TopicOptions options(bool is_kept) const {
        return {this->topic, std::static_pointer_cast<const MessageType>(this->type_), depth, is_kept};
    }
};

class Publish final : public RosTopic<middleware::PublishBlock> {
  public:
    using RosTopic::RosTopic;
    Argument<bool> latch{
        this, "latch", {.initial = false, .doc = "the last message is for those, too, who come later"}};

  private:
    void open(Now at, const std::shared_ptr<middleware::Outgoing>& end) const override {
        at[node].open();
        at[node].publish(options(latch), end);
    }
};

class Subscribe final : public RosTopic<middleware::SubscribeBlock> {
  public:
    using RosTopic::RosTopic;

  private:
    std::shared_ptr<middleware::Incoming> open(Now at, middleware::Wanted wanted) const override {
        at[node].open();
        return at[node].subscribe(options(false), std::move(wanted));
    }
};

} // namespace

void add_topics(Library& library) {
    library.group("topics")
        .add<Publish>("Publish",
                      "Publishes a message of any type that is installed in each step; the node's thread "
                      "sends it, the newest where several are left. Its fields are ports: numbers, vectors "
                      "of geometry, arrays, of any length where the type allows it, times and durations as "
                      "s; what is wired to none is zero, but arrays of any length, which are wired or left "
                      "out by `fields`. Numbers that a field cannot hold become the nearest that it can. "
                      "Lists of messages are empty. Errors: no such type, field or name of a topic.")
        .add<Subscribe>(
            "Subscribe",
            "The newest message of a topic, of any type that is installed; zeros before the first one. Its "
            "fields are ports as those of Publish; a field of any number of elements has the size that "
            "`sizes` says, zeros behind those that came, and how many these were. Integers are exact up to "
            "2^53, and numbers that are not finite, which some types give a meaning, come as they are. Below "
            "a Bag, messages are those of the file, and `age` is in time of the model. Errors: no such type, "
            "field or name of a topic; no message within start_timeout; in a step: none for timeout, more "
            "elements than expected, another frame, another type.");
}

} // namespace bf::ros1
