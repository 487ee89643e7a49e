// Topics of any type of message, whose fields are ports: what the blocks Publish and Subscribe of the
// middlewares that have such topics share.
#pragma once

#include "bf/middleware/clock.hpp"
#include "bf/middleware/exchange.hpp"
#include "bf/middleware/fields.hpp"
#include "bf/middleware/names.hpp"
#include "bf/middleware/outbox.hpp"

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace bf::middleware {

/// An argument that says how long something is waited for, s, where 0 is no limit or no wait.
inline AboutArgument<double> waiting_time(const char* doc) {
    return {.initial = 0, .minimum = 0, .maximum = 1e6, .doc = doc};
}

/// The types of messages that a middleware has.
struct MessageTypes {
    std::shared_ptr<const MessageType> (*find)(const std::string& name); ///< throws std::runtime_error
    const char* usual;                                                   ///< where none is said
    const char* doc;                                                     ///< of the argument that says one
    const NameRules& names;
};

/// What Publish and Subscribe have in common.
class Topic : public Block {
  public:
    Topic(const Arguments& arguments, const MessageTypes& types, bool is_stamp_port);

  private:
    const MessageTypes types_;

  public:
    Argument<std::string> topic{
        this, "topic", {.initial = "topic", .doc = "its name, absolute or in the node's namespace"}};
    Argument<std::string> type{this, "type", {.initial = types_.usual, .doc = types_.doc}};
    Argument<std::vector<std::string>> fields{
        this,
        "fields",
        {.doc = "paths of those fields that are ports, such as linear_acceleration or twist.linear; none: "
                "all that are numbers"}};
    Argument<std::string> frame_id{
        this,
        "frame_id",
        {.doc = "of the message's header; Subscribe: a message of another frame is an error, unless this is "
                "empty"}};

  protected:
    static constexpr const char* stamp_path = "header.stamp";
    static constexpr const char* frame_path = "header.frame_id";
    void tell(std::vector<std::string>& problems);

    std::shared_ptr<const MessageType> type_; ///< null: there is none
    std::vector<const Field*> wanted_;
};

/// What a block has opened in a run. It has nothing that a snapshot keeps: where messages are of a moment,
/// the node that brings them refuses snapshots.
template <class End> struct Opened {
    std::shared_ptr<End> end;
    int state_size() const { return 0; }
    void save(double*) const {}
    void restore(const double*) {}
};

/// The step leaves numbers, and the thread of an Outbox makes a message of them.
class Outgoing final : public Sender {
  public:
    Outgoing(const MessageType& type, std::vector<Place> places, int size, const Field* stamp,
             bool is_model_time);
    bool has_news() const noexcept override { return newest.newest() != sent_; }
    void send() override;

    ExchangeBuffer newest; ///< time of the model, values
    const std::shared_ptr<void> message;
    std::function<void(const void*)> publish; ///< all that follow are set by who opens it
    std::function<double()> clock;            ///< time of the network, s
    Bell* bell = nullptr;                     ///< of who sends; null: nobody does

  private:
    const std::vector<Place> places_;
    const Field* stamp_;
    const bool is_model_time_;
    std::vector<double> values_;
    std::atomic<std::uint64_t> sent_{0};
};

/// Publishes a message in each step.
class PublishBlock : public Topic {
  public:
    PublishBlock(const Arguments& arguments, const MessageTypes& types);

    Argument<std::vector<std::string>> texts{
        this,
        "texts",
        {.doc = "fields that are texts, each as field=text, such as name=hip,knee where there are several"}};
    Argument<std::string> stamp{this,
                                "stamp",
                                {.initial = "clock",
                                 .doc =
                                     "header.stamp: time of ROS when the message is sent, time of the model, "
                                     "or none",
                                 .choices = {"clock", "model", "none"}}};
    OutsideState<Opened<Outgoing>> outgoing{this, [] { return std::make_shared<Opened<Outgoing>>(); }};
    Scratch<std::vector<double>> values{this, [] { return std::vector<double>(); }};

    void start(Now at) const override;
    void stop(Now at) const noexcept override;
    Status output(Now at, Out out) const noexcept override;

  protected:
    /// Gives it what it sends with. Throws std::runtime_error.
    virtual void open(Now at, const std::shared_ptr<Outgoing>& end) const = 0;

  private:
    FieldInputs inputs_;
    const Field* stamp_ = nullptr;
    std::vector<std::pair<const Field*, std::vector<std::string>>> texts_;
};

/// What a block wants of each message.
struct Wanted {
    std::shared_ptr<const MessageType> type;
    std::vector<Place> places;
    int size; ///< of the numbers of all places
    std::string frame;
};

/// The end of a topic that receives.
class Incoming {
  public:
    explicit Incoming(Wanted wanted);
    virtual ~Incoming() = default;

    struct News {
        double count; ///< messages so far
        double age;   ///< of the newest, s; before the first, how long there was none
    };
    /// The numbers of the newest message; they stay as they are before the first one.
    virtual News take(double time, double* values) noexcept = 0;
    virtual bool has_begun() const noexcept { return true; }

    /// What came is not what is wanted, which a step tells. The first text counts.
    void refuse(const std::string& text);
    /// Empty: nothing is wrong.
    const char* refusal() const noexcept { return is_refused_ ? refusal_ : ""; }

    std::atomic<bool> is_of_other_frame{false};
    std::atomic<int> too_long{-1}, too_long_size{0}; ///< number of the place, and what came for it

  protected:
    /// Numbers of the message, or null where it is not what is wanted.
    const std::vector<double>* read(const void* message);
    const Wanted& wanted() const { return wanted_; }

  private:
    const Wanted wanted_;
    const Field* frame_;
    std::vector<double> values_;
    std::atomic<bool> is_refused_{false};
    char refusal_[400] = "";
};

/// One whose messages come in another thread, and the step takes the newest.
class LiveIncoming final : public Incoming {
  public:
    explicit LiveIncoming(Wanted its_wanted) : Incoming(std::move(its_wanted)), newest_(wanted().size) {}

    /// In the thread of who receives.
    void receive(const void* message) {
        if (const auto* values = read(message)) newest_.write(values->data(), now());
    }
    News take(double, double* values) noexcept override {
        newest_.read(values, taken_);
        return {static_cast<double>(taken_.number), now() - (taken_.number == 0 ? begin_ : taken_.time)};
    }
    bool has_begun() const noexcept override { return newest_.newest() != 0; }

    std::shared_ptr<void> subscription; ///< ends with it

  private:
    ExchangeBuffer newest_; ///< of each place its values and, of a sequence, how many came
    Stamp taken_;
    const double begin_ = now();
};

/// The newest message of a topic.
class SubscribeBlock : public Topic {
  public:
    SubscribeBlock(const Arguments& arguments, const MessageTypes& types);

    Argument<std::vector<std::string>> sizes{
        this,
        "sizes",
        {.doc = "largest number of elements of fields that have any number of them, each as field=size; "
                "those that are not named are no ports"}};
    Argument<double> timeout{this, "timeout",
                             waiting_time("without a message until the run ends, s; 0: never")};
    Argument<double> start_timeout{
        this, "start_timeout",
        waiting_time("how long the start waits for the first message, s; 0: not at all")};
    Output<double> age{
        this,
        "age",
        {.unit = unit<"s">, .doc = "how long ago the newest message came; before the first, the start"}};
    Output<double> received{this, "received", {.doc = "messages so far"}};
    OutsideState<Opened<Incoming>> incoming{this, [] { return std::make_shared<Opened<Incoming>>(); }};
    Scratch<std::vector<double>> values{
        this, [this] { return std::vector<double>(static_cast<std::size_t>(outputs_.size())); }};
    Scratch<StatusText> refused{this, [] { return StatusText(""); }};

    void start(Now at) const override;
    void stop(Now at) const noexcept override { at[incoming].end.reset(); }
    Status output(Now at, Out out) const noexcept override;

  protected:
    /// Opens the end. Throws std::runtime_error.
    virtual std::shared_ptr<Incoming> open(Now at, Wanted wanted) const = 0;

  private:
    Status failure(Now at, const Incoming& end) const noexcept;
    template <class... Values> Status fail(Now at, const char* format, Values... values) const noexcept;
    FieldOutputs outputs_;
};

} // namespace bf::middleware
