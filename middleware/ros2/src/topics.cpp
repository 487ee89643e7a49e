// Topics of any type of message that this machine has, whose fields are ports.
#include "bf/base/names.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/exchange.hpp"
#include "blocks.hpp"
#include "fields.hpp"

#include <algorithm>
#include <atomic>
#include <stdexcept>

namespace bf::ros2 {

namespace {

using middleware::ExchangeBuffer;

/// What Publish and Subscribe have in common.
class Topic : public Block {
  public:
    explicit Topic(const Arguments& arguments, bool is_stamp_port) : Block(arguments) {
        if (topic->empty()) problem("argument 'topic' is empty; name the topic, such as joint_states");
        try {
            type_ = MessageType::find(type);
        } catch (const std::runtime_error& error) {
            problem(std::string("argument 'type': ") + error.what());
            return;
        }
        std::vector<std::string> problems;
        wanted_ = fields_of(*type_, fields, "fields", problems);
        if (fields->empty() && !is_stamp_port)
            std::erase_if(wanted_, [](const Field* field) { return field->path == stamp_path; });
        tell(problems);
    }

    Argument<std::string> topic{
        this, "topic", {.initial = "topic", .doc = "its name, absolute or in the node's namespace"}};
    Argument<std::string> type{
        this,
        "type",
        {.initial = "std_msgs/msg/Float64",
         .doc = "type of its messages, of any package that is installed, such as sensor_msgs/msg/Imu"}};
    Argument<std::vector<std::string>> fields{
        this,
        "fields",
        {.doc = "paths of those fields that are ports, such as linear_acceleration or twist.linear; none: "
                "all that are numbers"}};
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
    Argument<std::string> frame_id{this, "frame_id", {.doc = frame_doc}};
    Requires<RosNode> node{this, "the node that talks"};

  protected:
    static constexpr const char* stamp_path = "header.stamp";
    static constexpr const char* frame_path = "header.frame_id";
    static constexpr const char* frame_doc =
        "of the message's header; Subscribe: a message of another frame is an error, unless this is empty";

    void tell(std::vector<std::string>& problems) {
        for (auto& text : problems) problem(std::move(text));
    }
    Quality quality() const { return {depth, *reliability == "reliable", *durability == "transient_local"}; }

    std::shared_ptr<const MessageType> type_; ///< null: there is none
    std::vector<const Field*> wanted_;
};

// ---- publish

/// The step leaves numbers, and the node's thread makes a message of them.
class Outgoing final : public Sender {
  public:
    Outgoing(std::shared_ptr<Context> context, std::shared_ptr<const MessageType> type,
             std::vector<Place> places, int size, const Field* stamp, bool is_model_time)
        : newest(size + 1), context_(std::move(context)), type_(std::move(type)),
          message(type_->memory().make()), places_(std::move(places)), stamp_(stamp),
          is_model_time_(is_model_time), values_(static_cast<std::size_t>(size) + 1) {}

    bool has_news() const noexcept override { return newest.newest() != sent_; }
    void send() override {
        middleware::Stamp stamp;
        if (!newest.read(values_.data(), stamp)) return;
        for (const auto& place : places_)
            place.field->write(message.get(), &values_[static_cast<std::size_t>(place.first)],
                               static_cast<std::size_t>(place.size));
        const double time = is_model_time_ ? values_[0] : context_->now();
        if (stamp_ != nullptr) stamp_->write(message.get(), &time, 1);
        publisher->publish(message.get());
        sent_ = stamp.number;
    }

    ExchangeBuffer newest; ///< time of the model, values
    std::shared_ptr<Publisher> publisher;

  private:
    std::shared_ptr<Context> context_;
    std::shared_ptr<const MessageType> type_;

  public:
    const std::shared_ptr<void> message;

  private:
    const std::vector<Place> places_;
    const Field* stamp_;
    const bool is_model_time_;
    std::vector<double> values_;
    std::atomic<std::uint64_t> sent_{0};
};

class Publish final : public Topic {
  public:
    explicit Publish(const Arguments& arguments) : Topic(arguments, false) {
        if (!type_) return;
        inputs_.add(*this, *type_, wanted_);
        stamp_ = *stamp == "none" ? nullptr : type_->field(stamp_path);
        std::vector<std::string> problems;
        texts_ = texts_of(*type_, texts, problems);
        const Field* frame = type_->field(frame_path);
        if (!frame_id->empty() && frame == nullptr)
            problems.push_back(type_->name() + " has no text '" + frame_path + "'; it has " +
                               name_list(paths(*type_, false)));
        else if (!frame_id->empty())
            texts_.emplace_back(frame, std::vector<std::string>{*frame_id});
        tell(problems);
    }

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

    void start(Now at) const override {
        const int size = inputs_.size(at);
        Node& its = at[node];
        its.open();
        auto end = std::make_shared<Outgoing>(its.context(), type_, inputs_.places(at, 1), size, stamp_,
                                              *stamp == "model");
        for (const auto& [field, its_texts] : texts_) field->write(end->message.get(), its_texts);
        end->publisher = its.advertise(type_->memory(), topic, quality());
        its.add(end);
        at[values].assign(static_cast<std::size_t>(size) + 1, 0.0);
        at[outgoing].end = std::move(end);
    }
    void stop(Now at) const noexcept override {
        send_last(at[outgoing].end);
        at[outgoing].end.reset();
    }

    Status output(Now at, Out) const noexcept override {
        auto& all = at[values];
        all[0] = at.time();
        inputs_.copy(at, all.data() + 1);
        at[outgoing].end->newest.write(all.data(), middleware::now());
        at[node].bell().ring();
        return ok;
    }

  private:
    FieldInputs inputs_;
    const Field* stamp_ = nullptr;
    std::vector<std::pair<const Field*, std::vector<std::string>>> texts_;
};

// ---- subscribe

/// The node's thread writes the numbers of each message, and the step takes the newest.
class Incoming {
  public:
    Incoming(std::shared_ptr<const MessageType> type, std::vector<Place> places, int size, std::string frame)
        : newest(size), type_(std::move(type)), places_(std::move(places)),
          frame_(type_->field("header.frame_id")), wanted_frame_(std::move(frame)),
          values_(static_cast<std::size_t>(size)) {}

    /// In the node's thread.
    void take(const void* message) {
        if (frame_ != nullptr && !wanted_frame_.empty() && frame_->text(message) != wanted_frame_) {
            is_of_other_frame = true;
            return;
        }
        int count = 0;
        if (const int wrong = read(message, places_, values_, count); wrong >= 0) {
            too_long_size = count;
            too_long = wrong;
            return;
        }
        newest.write(values_.data(), middleware::now());
    }

    ExchangeBuffer newest; ///< of each place its values and, of a sequence, how many came
    std::atomic<bool> is_of_other_frame{false};
    std::atomic<int> too_long{-1}, too_long_size{0}; ///< number of the place, and what came for it
    std::shared_ptr<Subscription> subscription;
    middleware::Stamp taken;
    double begin = middleware::now();

  private:
    std::shared_ptr<const MessageType> type_;
    const std::vector<Place> places_;
    const Field* frame_;
    const std::string wanted_frame_;
    std::vector<double> values_;
};

class Subscribe final : public Topic {
  public:
    explicit Subscribe(const Arguments& arguments) : Topic(arguments, true) {
        if (!type_) return;
        if (!frame_id->empty() && type_->field(frame_path) == nullptr)
            problem("argument 'frame_id': " + type_->name() + " has no header with a frame");
        std::vector<std::string> problems;
        outputs_.add(*this, *type_, wanted_, !fields->empty(), sizes, problems);
        tell(problems);
        if (outputs_.places().empty() && fields->empty())
            problem(type_->name() + " has no numbers of a known size; say by argument 'sizes' how many " +
                    name_list(paths(*type_, true)) + " has at most, such as position=7");
    }

    Argument<std::vector<std::string>> sizes{
        this,
        "sizes",
        {.doc = "largest number of elements of fields that have any number of them, each as field=size; "
                "those that are not named are no ports"}};
    Argument<double> timeout{this,
                             "timeout",
                             {.initial = 0,
                              .minimum = 0,
                              .maximum = 1e6,
                              .doc = "without a message until the run ends, s; 0: never"}};
    Argument<double> start_timeout{
        this,
        "start_timeout",
        {.initial = 0,
         .minimum = 0,
         .maximum = 1e6,
         .doc = "how long the start waits for the first message, s; 0: not at all"}};
    Output<double> age{
        this,
        "age",
        {.unit = unit<"s">, .doc = "how long ago the newest message came; before the first, the start"}};
    Output<double> received{this, "received", {.doc = "messages so far"}};
    OutsideState<Opened<Incoming>> incoming{this, [] { return std::make_shared<Opened<Incoming>>(); }};
    Scratch<std::vector<double>> values{
        this, [this] { return std::vector<double>(static_cast<std::size_t>(outputs_.size())); }};

    void start(Now at) const override {
        Node& its = at[node];
        its.open();
        auto end = std::make_shared<Incoming>(type_, outputs_.places(), outputs_.size(), frame_id);
        std::fill(at[values].begin(), at[values].end(), 0.0);
        // The thread keeps what it writes to, but not the subscription, which ends with the run.
        const std::weak_ptr<Incoming> to = end;
        end->subscription = its.subscribe(type_->memory(), topic, quality(), [to](const void* message) {
            if (const auto still = to.lock()) still->take(message);
        });
        at[incoming].end = end;
        const auto has_come = [&] { return end->newest.newest() > 0 || !failure(*end); };
        if (*start_timeout > 0 && !wait_until(middleware::now() + start_timeout, has_come))
            throw std::runtime_error("no message of '" + *topic + "' came within " +
                                     Value(*start_timeout).describe() +
                                     " s; start who sends it, or correct topic, type or reliability");
    }
    void stop(Now at) const noexcept override { at[incoming].end.reset(); }

    Status output(Now at, Out out) const noexcept override {
        Incoming& end = *at[incoming].end;
        if (const Status bad = failure(end); !bad) return bad;
        auto& all = at[values];
        end.newest.read(all.data(), end.taken);
        outputs_.copy(all.data(), out);
        const double its_age = middleware::now() - (end.taken.number == 0 ? end.begin : end.taken.time);
        out[age] = its_age;
        out[received] = static_cast<double>(end.taken.number);
        if (*timeout > 0 && its_age > *timeout)
            return Status::failure(
                "no message came within argument 'timeout'; look whether its sender runs, or raise it");
        return ok;
    }

  private:
    Status failure(const Incoming& end) const noexcept {
        if (end.is_of_other_frame)
            return Status::failure("a message is of another frame than argument 'frame_id' says");
        const int place = end.too_long;
        if (place < 0) return ok;
        return outputs_.too_long(place, end.too_long_size);
    }
    FieldOutputs outputs_;
};

} // namespace

void add_topics(Library& library) {
    library.group("topics")
        .add<Publish>(
            "Publish",
            "Publishes a message of any type that is installed in each step; the node's thread sends "
            "it, the newest where several are left. Its fields are ports: numbers, vectors of "
            "geometry, arrays, of any length where the type allows it, times as s; what is "
            "wired to none keeps the type's default. Numbers that a field cannot hold become the "
            "nearest that it can. Lists of messages are left out. "
            "Errors: no such type, field or name of a topic; more elements than a field has.")
        .add<Subscribe>(
            "Subscribe",
            "The newest message of a topic, of any type that is installed; zeros before the first "
            "one. Its fields are ports as those of Publish; a field of any number of elements has "
            "the size that `sizes` says, zeros behind those that came, and how many these were. "
            "Integers are exact up to 2^53. "
            "Errors: no such type, field or name of a topic; no message within start_timeout; in a "
            "step: none for timeout, more elements than expected, another frame.");
}

} // namespace bf::ros2
