// A node of ROS 1 over roscpp, of which a program has one.
#pragma once

#include "connection.hpp"

#include <memory>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <string>
#include <vector>

namespace bf::ros1 {

/// How a program appears among others.
struct NodeOptions {
    std::string name = "blockfactory", name_space = "/";
    std::vector<std::string> remap = {}; ///< each as from:=to
    bool operator==(const NodeOptions&) const = default;
};

/// roscpp, from the first of those who share it to the last. Its name and what is remapped stay for as long
/// as the program.
class Session {
  public:
    /// Throws std::runtime_error: no master answers, or this program is another node already.
    static std::shared_ptr<Session> join(const NodeOptions& options);
    ~Session();

  private:
    explicit Session(const NodeOptions& options);
};

/// A node in a running diagram. Messages come in a thread of its own and are sent by another.
class Node final : public Connection {
  public:
    explicit Node(NodeOptions options) : options_(std::move(options)) {}
    ~Node() override { close(); }
    void open() override;
    void close() noexcept override;
    void publish(const TopicOptions& topic, const std::shared_ptr<middleware::Outgoing>& end) override;
    std::shared_ptr<middleware::Incoming> subscribe(const TopicOptions& topic,
                                                    middleware::Wanted wanted) override;
    bool can_save() const override { return false; }

  private:
    const NodeOptions options_;
    std::shared_ptr<Session> session_;
    ros::CallbackQueue queue_;
    std::unique_ptr<ros::NodeHandle> handle_;
    std::unique_ptr<ros::AsyncSpinner> spinner_;
    middleware::Outbox outbox_;
};

} // namespace bf::ros1
