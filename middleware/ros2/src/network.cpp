// The node, and streams of vectors over it.
#include "bf/core/interrupt.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/exchange.hpp"
#include "bf/middleware/node_block.hpp"
#include "bf/toolbox/streams.hpp"
#include "blocks.hpp"
#include "messages.hpp"
#include "names.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <stdexcept>

namespace bf::ros2 {

std::vector<std::string> node_arguments(const std::vector<std::string>& remap, bool use_sim_time) {
    std::vector<std::string> all;
    for (const auto& rule : remap) all.insert(all.end(), {"-r", rule});
    if (use_sim_time) all.insert(all.end(), {"-p", "use_sim_time:=true"});
    return all;
}

namespace {

using middleware::Bell;
using middleware::ExchangeBuffer;
using toolbox::Taken;

/// Do the ends know each other within a second? Nodes find each other some time after their start.
template <class F> bool finds(F&& count) noexcept {
    for (const double end = middleware::now() + 1; count() == 0;
         std::this_thread::sleep_for(std::chrono::milliseconds(5)))
        if (middleware::now() > end || is_interrupted()) return false;
    return true;
}

class Reader final : public toolbox::StreamReader {
  public:
    Reader(Node& node, const std::string& name, int size)
        : name_(name), state_(std::make_shared<State>(size)), values_(static_cast<std::size_t>(size) + 1) {
        auto context = node.context();
        subscription_ = node.subscribe(
            messages::numbers(), name, {}, [state = state_, context](const void* message, std::uint64_t) {
                const auto& data = static_cast<const messages::Numbers*>(message)->data;
                if (data.size + 1 != state->arriving.size()) {
                    state->wrong_size = static_cast<int>(data.size);
                    ++state->wrong_messages;
                } else {
                    state->arriving[0] = context->now();
                    std::copy(data.data, data.data + data.size, state->arriving.begin() + 1);
                    state->newest.write(state->arriving.data(), state->arriving[0]);
                }
                state->bell.ring();
            });
    }

    Taken take(Eigen::Ref<Eigen::VectorXd> values, toolbox::Stamp& stamp) noexcept override {
        if (const auto wrong = state_->wrong_messages.load(); wrong != seen_wrong_) {
            seen_wrong_ = wrong;
            return Taken::wrong_size;
        }
        if (state_->newest.newest() == taken_.number || !state_->newest.read(values_.data(), taken_))
            return Taken::nothing;
        stamp = {static_cast<double>(taken_.number), values_[0]};
        values = Eigen::Map<const Eigen::VectorXd>(values_.data() + 1, values.size());
        return Taken::message;
    }
    bool wait(double timeout) noexcept override {
        state_->bell.wait(
            timeout, [&] { return is_news(); }, 0);
        return is_news();
    }
    bool has_writer() const noexcept override {
        return finds([&] { return subscription_->writers(); });
    }
    int received_size() const noexcept override { return state_->wrong_size; }
    void say_source(Source& text) const noexcept override {
        std::snprintf(text, sizeof text, "ROS 2 topic %s", name_.c_str());
    }

  private:
    struct State {
        explicit State(int size) : newest(size + 1), arriving(static_cast<std::size_t>(size) + 1) {}
        ExchangeBuffer newest; ///< time, values
        std::vector<double> arriving;
        std::atomic<std::uint64_t> wrong_messages{0};
        std::atomic<int> wrong_size{0};
        Bell bell{};
    };
    bool is_news() const noexcept {
        return state_->newest.newest() != taken_.number || state_->wrong_messages.load() != seen_wrong_;
    }

    const std::string name_;
    std::shared_ptr<State> state_; ///< the node's thread has it, too
    std::shared_ptr<Subscription> subscription_;
    std::vector<double> values_;
    middleware::Stamp taken_;
    std::uint64_t seen_wrong_ = 0;
};

class Writer final : public toolbox::StreamWriter {
  public:
    Writer(Node& node, const std::string& name, int size) : end_(std::make_shared<End>(size)), node_(node) {
        end_->publisher = node.advertise(messages::numbers(), name, {});
        node.add(end_);
    }
    ~Writer() override { send_last(end_); }
    bool write(const Eigen::Ref<const Eigen::VectorXd>& values) noexcept override {
        end_->newest.write(values.data(), 0);
        node_.bell().ring();
        return true;
    }
    bool has_reader() const noexcept override {
        return finds([&] { return end_->publisher->readers(); });
    }

  private:
    struct End final : Sender {
        explicit End(int size)
            : newest(size), message(messages::make<messages::Numbers>(messages::numbers())) {
            messages::resize(message->data, static_cast<std::size_t>(size));
        }
        bool has_news() const noexcept override { return newest.newest() != sent; }
        void send() override {
            middleware::Stamp stamp;
            if (!newest.read(message->data.data, stamp)) return;
            publisher->publish(message.get());
            sent = stamp.number;
        }
        ExchangeBuffer newest;
        std::shared_ptr<messages::Numbers> message;
        std::shared_ptr<Publisher> publisher;
        std::atomic<std::uint64_t> sent{0};
    };
    std::shared_ptr<End> end_;
    Node& node_;
};

/// Streams over a node that another block has opened.
class Streams final : public toolbox::StreamConnection {
  public:
    void use(Node& node) {
        node_ = &node;
        context_ = node.context();
    }

    std::shared_ptr<toolbox::StreamReader> open_reader(const std::string& name, int size) override {
        return std::make_shared<Reader>(*node_, name, size);
    }
    std::shared_ptr<toolbox::StreamWriter> open_writer(const std::string& name, int size) override {
        return std::make_shared<Writer>(*node_, name, size);
    }
    std::shared_ptr<toolbox::SimulatorConnection> open_simulator(const std::string&, const std::string&,
                                                                 double) override {
        throw std::runtime_error(no_simulators);
    }
    std::shared_ptr<toolbox::SimulatorServer> serve_simulator(const std::string&, double) override {
        throw std::runtime_error(no_simulators);
    }
    double now() const noexcept override { return context_ ? context_->now() : 0; }
    bool has_time() const noexcept override { return context_ && context_->told_time != Context::awaited; }
    /// A time that others send on /clock may go at any pace, so it is looked at again and again.

  private:
    static constexpr const char* no_simulators =
        "nodes of ROS 2 have no agreed way to step simulators; let the robot's clock drive the steps";
    Node* node_ = nullptr;
    std::shared_ptr<Context> context_;
};

struct Network final : toolbox::StreamNetwork {
    std::shared_ptr<toolbox::StreamConnection> open() const override { return std::make_shared<Streams>(); }
};

class NodeBlock final : public middleware::NodeBlock {
  public:
    explicit NodeBlock(const Arguments& arguments) : middleware::NodeBlock(arguments, name_rules) {}

    Provides<RosNode> node{this, [this]() -> std::shared_ptr<const RosNode> {
                               return std::make_shared<RosNode>(
                                   RosNode{{name, name_space, node_arguments(remap, use_sim_time)}});
                           }};
    Provides<toolbox::StreamNetwork> network{
        this, []() -> std::shared_ptr<const toolbox::StreamNetwork> { return std::make_shared<Network>(); }};

    void start(Now at) const override {
        at[node].open();
        static_cast<Streams&>(at[network]).use(at[node]);
    }
    void stop(Now at) const noexcept override { at[node].close(); }
};

} // namespace

std::shared_ptr<toolbox::StreamConnection> streams_over(Node& node) {
    auto streams = std::make_shared<Streams>();
    streams->use(node);
    return streams;
}

void add_network(Library& library) {
    library.group("topics").add<NodeBlock>(
        "Node",
        "A node of ROS 2 (rcl), for Publish and Subscribe in its subsystem and below. Messages come and go "
        "in two threads of its own, and the newest counts. It is also a network for the blocks StreamRead "
        "and StreamWrite, whose streams are topics of std_msgs/msg/Float64MultiArray, and for NetworkClock "
        "and RealTimeSynchronizer, whose time is that of ROS. It sees programs of this computer alone, "
        "unless ROS_AUTOMATIC_DISCOVERY_RANGE or ROS_LOCALHOST_ONLY says otherwise; ROS_DOMAIN_ID counts as "
        "always. It has no ports. Errors: names that ROS 2 does not allow.");
}

} // namespace bf::ros2
