// A node of ROS 1 over roscpp, of which a program has one.
#pragma once

#include "connection.hpp"
#include "raw.hpp"

#include <atomic>
#include <memory>
#include <mutex>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <string>
#include <vector>

namespace bf::ros1 {

class Frames;

/// Of a node, by its name.
inline std::uint64_t number_of(const std::string& node) { return std::hash<std::string>()(node); }

/// How a program appears among others.
struct NodeOptions {
    std::string name = "blockfactory";
    std::vector<std::string> remap = {}; ///< each as from:=to
    std::string name_space = "/";        ///< in which names are that do not begin with /
    bool use_sim_time = false;           ///< time is what comes on /clock
    bool joins = false;                  ///< it is whatever node its program is, where that is one already
};

/// A share of roscpp, which is open from the first of them to the last. Its name and what is remapped stay
/// for as long as the program.
class Session {
  public:
    /// Throws std::runtime_error: no master answers, or this program is another node already.
    explicit Session(const NodeOptions& options);
    ~Session();
    Session(const Session&) = delete;
};

/// Sends to a topic, from any one thread that is no step.
class Publisher {
  public:
    explicit Publisher(ros::Publisher end) : end_(std::move(end)) {}
    /// roscpp sends in a thread of its own, which drops what is left when the end goes: that waits for it.
    ~Publisher();
    void publish(const Raw& message) {
        end_.publish(message);
        last_ = middleware::now();
    }
    int readers() const { return static_cast<int>(end_.getNumSubscribers()); }
    std::string topic() const { return end_.getTopic(); } ///< its whole name

  private:
    ros::Publisher end_;
    double last_ = 0; ///< when something was sent, s
};

struct ToldTransforms;
/// Those of blocks that tell transforms which stay, all sent by one thread.
struct KeptTransforms {
    std::mutex mutex; ///< of the list
    std::vector<std::weak_ptr<ToldTransforms>> all;
};

/// A node in a running diagram. Messages come in a thread of its own and are sent by another.
class Node final : public Connection {
  public:
    explicit Node(NodeOptions options) : options_(std::move(options)) {}
    ~Node() override { close(); }
    void open() override;
    void close() noexcept override;
    void publish(const TopicOptions& topic, const std::shared_ptr<middleware::Outgoing>& end) override;
    void publish(const TopicOptions& topic, const std::string& frame,
                 const std::vector<std::string>& children,
                 const std::shared_ptr<middleware::OutgoingTransforms>& end) override;
    std::shared_ptr<middleware::Incoming> subscribe(const TopicOptions& topic,
                                                    middleware::Wanted wanted) override;
    std::shared_ptr<void> call(const std::string& service, const ServiceType& type,
                               const std::shared_ptr<middleware::Calling>& end) override;
    std::shared_ptr<middleware::TransformView> watch(const std::string& target,
                                                     const std::string& source) override;
    bool can_save() const override { return false; }

    /// Calls `taken` in the node's thread for each message with the node that has sent it, as long as
    /// somebody has what is returned; or `refused` with what that sends in place of such messages.
    std::shared_ptr<ros::Subscriber> hear(
        const TopicOptions& topic, std::function<void(const Message&, const std::string& node)> taken,
        std::function<void(const std::string& what, const std::string& node)> refused);
    /// The whole name of what is called so in the node's namespace. Throws std::runtime_error.
    std::string resolve(const std::string& name) const;
    std::shared_ptr<Publisher> advertise(const TopicOptions& topic);
    /// As the master lists them.
    enum class Side : std::uint8_t { publisher, subscriber };
    /// Another node that runs and is at that side of one of these topics, which have their whole names;
    /// empty: none is, or the master does not say.
    static std::string other(Side side, const std::vector<std::string>& topics);
    /// Calls `answer(request, response)` in the node's thread for each call, as long as somebody has what is
    /// returned.
    std::shared_ptr<ros::ServiceServer> offer(const std::string& name, const ServiceType& type,
                                              std::function<void(const Message&, Message&)> answer);
    /// Gives the time of ROS, s.
    std::function<double()> clock() const;
    /// The thread that sends looks at it as long as somebody else has it, too.
    void add(const std::shared_ptr<middleware::Sender>& sender) { outbox_.add(sender); }
    /// Wakes that thread; in steps, too.
    middleware::Bell& bell() noexcept { return outbox_.bell(); }
    /// Ends that thread before the node.
    void stop_sending() noexcept { outbox_.close(); }

  private:
    const NodeOptions options_;
    std::unique_ptr<Session> session_;
    ros::CallbackQueue queue_;
    std::unique_ptr<ros::NodeHandle> handle_;
    std::unique_ptr<ros::AsyncSpinner> spinner_;
    static constexpr double by_system = -1;
    const std::shared_ptr<std::atomic<double>> told_time_ =
        std::make_shared<std::atomic<double>>(by_system); ///< on /clock, s
    std::shared_ptr<ros::Subscriber> clock_;
    const std::shared_ptr<KeptTransforms> kept_transforms_ = std::make_shared<KeptTransforms>();
    std::weak_ptr<Frames> frames_; ///< that blocks of the node listen to
    middleware::Outbox outbox_;
};

} // namespace bf::ros1
