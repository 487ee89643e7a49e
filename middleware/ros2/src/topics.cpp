// Topics of any type of message that this machine has, whose fields are ports.
#include "bf/base/names.hpp"
#include "bf/core/interrupt.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/exchange.hpp"
#include "blocks.hpp"
#include "types.hpp"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cstdio>
#include <map>
#include <set>
#include <stdexcept>
#include <thread>

namespace bf::ros2 {

namespace {

using middleware::ExchangeBuffer;

/// What a block has opened in a run. It is not part of snapshots.
template <class End> struct Opened { std::shared_ptr<End> end; };

/// The text of a Status, as long as the block.
struct Text {
    explicit Text(const std::string& text) { std::snprintf(letters, sizeof letters, "%s", text.c_str()); }
    char letters[400];
};

/// A field, and where its numbers are among all of a message.
struct Place {
    const Field* field;
    int first, size;
};

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
        for (const auto& path : *fields) {
            const Field* field = type_->field(path);
            if (field == nullptr || !is_number(*field))
                problem("argument 'fields': " + type_->name() + " has no numbers '" + path + "'; it has " +
                        name_list(paths(true)));
            else
                wanted_.push_back(field);
        }
        if (fields->empty())
            for (const auto& field : type_->fields())
                if (is_number(field) && (is_stamp_port || field.path != stamp_path))
                    wanted_.push_back(&field);
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

    static bool is_number(const Field& field) {
        return field.kind != Field::Kind::text && field.kind != Field::Kind::texts;
    }
    std::vector<std::string> paths(bool are_numbers) const {
        std::vector<std::string> all;
        for (const auto& field : type_->fields())
            if (is_number(field) == are_numbers) all.push_back(field.path);
        return all;
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
        for (const Field* field : wanted_) {
            About about{.unit = any_unit};
            const std::string doc = type_->name() + ": " + field->path;
            Port port{field, {}, {}, -1};
            if (field->is_scalar) {
                const Input<double> key(this, field->port(), about);
                set(port, key, doc);
                port.data = [key](Now at) { return &at[key]; };
            } else {
                const bool is_any = field->kind == Field::Kind::sequence;
                about.shape = is_any ? Shape(Dim(this, ("n_" + field->port()).c_str())) : Shape(field->size);
                const Input<Vector> key(this, field->port(), about);
                set(port, key, doc);
                port.data = [key](Now at) { return at[key].data(); };
                port.size = [key](Now at) { return static_cast<int>(at[key].size()); };
            }
            ports_.push_back(std::move(port));
        }
        stamp_ = *stamp == "none" ? nullptr : type_->field(stamp_path);
        if (!frame_id->empty()) add_text(frame_path, {*frame_id});
        for (const auto& text : *texts) {
            const auto equals = text.find('=');
            if (equals == std::string::npos) {
                problem("argument 'texts': '" + text + "' is not given as field=text");
                continue;
            }
            std::vector<std::string> parts{""};
            for (const char letter : text.substr(equals + 1))
                if (letter == ',')
                    parts.emplace_back();
                else
                    parts.back() += letter;
            add_text(text.substr(0, equals), parts);
        }
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
        std::vector<Place> places;
        int size = 0;
        for (const auto& port : ports_) {
            if (!port.is_wired(at)) continue; // it stays what messages begin with
            const int its = port.size ? port.size(at) : 1;
            if (port.field->kind == Field::Kind::sequence && port.field->size > 0 && its > port.field->size)
                throw std::runtime_error("input '" + port.field->port() + "' has " + std::to_string(its) +
                                         " elements, but " + type_->name() + " has room for " +
                                         std::to_string(port.field->size) + " in '" + port.field->path + "'");
            places.push_back({port.field, size + 1, its});
            size += its;
        }
        Node& its = at[node];
        its.open();
        auto end = std::make_shared<Outgoing>(its.context(), type_, places, size, stamp_, *stamp == "model");
        for (const auto& [field, its_texts] : texts_) field->write(end->message.get(), its_texts);
        end->publisher = its.advertise(type_->memory(), topic, quality());
        its.add(end);
        at[values].assign(static_cast<std::size_t>(size) + 1, 0.0);
        at[outgoing].end = std::move(end);
    }
    void stop(Now at) const noexcept override {
        auto& end = at[outgoing].end;
        // The last message is sent, too.
        for (int tries = 0; end && end->has_news() && tries < 100; ++tries)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        end.reset();
    }

    Status output(Now at, Out) const noexcept override {
        auto& all = at[values];
        all[0] = at.time();
        auto to = all.begin() + 1;
        for (const auto& port : ports_) {
            if (!port.is_wired(at)) continue;
            const double* from = port.data(at);
            to = std::copy(from, from + (port.size ? port.size(at) : 1), to);
        }
        at[outgoing].end->newest.write(all.data(), middleware::now());
        at[node].bell().ring();
        return ok;
    }

  private:
    struct Port {
        const Field* field;
        std::function<const double*(Now)> data;
        std::function<int(Now)> size;
        int slot;
        std::function<bool(Now)> is_wired = nullptr;
    };
    template <class Key> void set(Port& port, const Key& key, const std::string& doc) {
        auto& slot = detail::declared_by(*this).slots[static_cast<std::size_t>(key.index())];
        slot.doc = doc;
        slot.optional = port.field->kind != Field::Kind::sequence;
        port.is_wired = [key](Now at) { return at.is_connected(key); };
    }
    void add_text(const std::string& path, const std::vector<std::string>& values) {
        const Field* field = type_->field(path);
        if (field == nullptr || is_number(*field))
            problem(type_->name() + " has no text '" + path + "'; it has " + name_list(paths(false)));
        else
            texts_.emplace_back(field, values);
    }

    std::vector<Port> ports_;
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
        std::fill(values_.begin(), values_.end(), 0.0);
        for (std::size_t i = 0; i < places_.size(); ++i) {
            const auto& [field, first, size] = places_[i];
            const auto length = field->length(message);
            if (length > static_cast<std::size_t>(size)) {
                too_long_size = static_cast<int>(std::min<std::size_t>(length, INT32_MAX));
                too_long = static_cast<int>(i);
                return;
            }
            field->read(message, &values_[static_cast<std::size_t>(first)], static_cast<std::size_t>(size));
            if (field->kind == Field::Kind::sequence)
                values_[static_cast<std::size_t>(first + size)] = static_cast<double>(length);
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
        const auto bounds = read_sizes();
        for (const Field* field : wanted_) {
            Place place{field, size_, field->size};
            if (field->kind == Field::Kind::sequence) {
                const auto bound = bounds.find(field->path);
                if (bound != bounds.end()) place.size = bound->second;
                if (place.size == 0) {
                    if (!fields->empty())
                        problem("argument 'sizes' is to say how many elements '" + field->path +
                                "' has at most, such as " + field->path + "=7");
                    continue; // it cannot be a port
                }
            }
            const auto add = [&](const std::string& name, bool is_scalar, int size, const std::string& doc) {
                About about{.unit = any_unit};
                Port port{size, {}};
                int slot = -1;
                if (is_scalar) {
                    const Output<double> key(this, name, about);
                    port.data = [key](Out out) { return &out[key]; };
                    slot = key.index();
                } else {
                    about.shape = {size};
                    const Output<Vector> key(this, name, about);
                    port.data = [key](Out out) { return out[key].data(); };
                    slot = key.index();
                }
                detail::declared_by(*this).slots[static_cast<std::size_t>(slot)].doc = doc;
                ports_.push_back(std::move(port));
                size_ += size;
            };
            const std::string of = type_->name() + ": " + field->path;
            add(field->port(), field->is_scalar, place.size, of);
            if (field->kind == Field::Kind::sequence)
                add(field->port() + "_length", true, 1, "how many elements of " + field->path + " came");
            places_.push_back(place);
            too_long_.emplace_back("a message has {} elements in '" + field->path +
                                   "', but at most {} are expected; raise argument 'sizes'");
        }
        if (places_.empty() && fields->empty())
            problem(type_->name() + " has no numbers of a known size; say by argument 'sizes' how many " +
                    name_list(paths(true)) + " has at most, such as position=7");
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
        this, [this] { return std::vector<double>(static_cast<std::size_t>(size_)); }};

    void start(Now at) const override {
        Node& its = at[node];
        its.open();
        auto end = std::make_shared<Incoming>(type_, places_, size_, frame_id);
        std::fill(at[values].begin(), at[values].end(), 0.0);
        // The thread keeps what it writes to, but not the subscription, which ends with the run.
        const std::weak_ptr<Incoming> to = end;
        end->subscription = its.subscribe(type_->memory(), topic, quality(), [to](const void* message) {
            if (const auto still = to.lock()) still->take(message);
        });
        at[incoming].end = end;
        for (const double until = middleware::now() + start_timeout;
             *start_timeout > 0 && end->newest.newest() == 0 && bool(failure(*end));) {
            if (is_interrupted()) throw std::runtime_error(interrupted);
            if (middleware::now() > until)
                throw std::runtime_error("no message of '" + *topic + "' came within " +
                                         Value(*start_timeout).describe() +
                                         " s; start who sends it, or correct topic, type or reliability");
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    }
    void stop(Now at) const noexcept override { at[incoming].end.reset(); }

    Status output(Now at, Out out) const noexcept override {
        Incoming& end = *at[incoming].end;
        if (const Status bad = failure(end); !bad) return bad;
        auto& all = at[values];
        end.newest.read(all.data(), end.taken);
        const double* from = all.data();
        for (const auto& port : ports_) {
            std::copy(from, from + port.size, port.data(out));
            from += port.size;
        }
        const double its_age = middleware::now() - (end.taken.number == 0 ? end.begin : end.taken.time);
        out[age] = its_age;
        out[received] = static_cast<double>(end.taken.number);
        if (*timeout > 0 && its_age > *timeout)
            return Status::failure(
                "no message came within argument 'timeout'; look whether its sender runs, or raise it");
        return ok;
    }

  private:
    struct Port {
        int size;
        std::function<double*(Out)> data;
    };
    Status failure(const Incoming& end) const noexcept {
        if (end.is_of_other_frame)
            return Status::failure("a message is of another frame than argument 'frame_id' says");
        const int place = end.too_long;
        if (place < 0) return ok;
        return Status::failure(too_long_[static_cast<std::size_t>(place)].letters, end.too_long_size.load(),
                               places_[static_cast<std::size_t>(place)].size);
    }
    std::map<std::string, int> read_sizes() {
        std::map<std::string, int> bounds;
        for (const auto& text : *sizes) {
            const auto equals = text.find('=');
            const std::string path = text.substr(0, equals);
            const Field* field = type_->field(path);
            int size = 0;
            if (equals != std::string::npos)
                std::from_chars(text.data() + equals + 1, text.data() + text.size(), size);
            if (size < 1 || size > 1'000'000)
                problem("argument 'sizes': '" + text +
                        "' is not given as field=size, with a size from 1 to 1000000");
            else if (field == nullptr || field->kind != Field::Kind::sequence)
                problem("argument 'sizes': " + type_->name() + " has no '" + path +
                        "' of any number of elements; it has " + name_list(paths(true)));
            else
                bounds[path] = size;
        }
        return bounds;
    }

    std::vector<Place> places_;
    std::vector<Port> ports_;
    std::vector<Text> too_long_; ///< what is said of each place
    int size_ = 0;
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
