// Calls of one service, which wait for their answers.
#pragma once

#include "node.hpp"

#include <atomic>
#include <mutex>
#include <ros/service_server_link.h>
#include <string>

namespace bf::ros1 {

/// For one thread that may wait, but for break_off().
class Caller {
  public:
    /// `name` is the whole one.
    Caller(std::string name, ServiceType type) : name_(std::move(name)), type_(std::move(type)) {}
    ~Caller() { break_off(); }
    Caller(const Caller&) = delete;
    const ServiceType& type() const { return type_; }

    /// Does somebody offer the service? The master is asked 20 times a second at most.
    bool has_server() noexcept;
    /// Calls it, where it is there; null: it fails, or breaks off. The answer stays until the next call.
    const Message* call(const Message& request) noexcept;
    /// Ends a call that waits, and all that follow; from any thread.
    void break_off() noexcept;

  private:
    const std::string name_;
    const ServiceType type_;
    const std::shared_ptr<Message> answer_ = std::static_pointer_cast<Message>(type_.response->make());
    Raw answered_;                   ///< its bytes
    double asked_ = 0;               ///< when the master was asked last, s
    std::mutex mutex_;               ///< of a change of the link by its thread, and of what breaks it off
    ros::ServiceServerLinkPtr link_; ///< a connection that stays
    std::atomic<bool> is_over_{false};
};

} // namespace bf::ros1
