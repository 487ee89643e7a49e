// A node of ROS 2 and the two threads that talk for it: one waits for messages and calls, one sends.
#pragma once

#include "bf/middleware/outbox.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <rcl/rcl.h>
#include <string>
#include <thread>
#include <vector>

namespace bf::ros2 {

class Frames;
using middleware::Sender, middleware::send_last, middleware::wait_until;

/// How a program appears among others.
struct NodeOptions {
    std::string name = "blockfactory", name_space = "/";
    std::vector<std::string> arguments = {}; ///< as behind --ros-args
};

/// The file by which Fast DDS listens to this computer alone, and soon forgets a program that was killed;
/// empty: there is none.
std::string loopback_profile();

/// Throws std::runtime_error: what failed, and why as rcl says it.
void check(rcl_ret_t code, const std::string& what);

/// The guarantees of a topic's messages.
struct Quality {
    int depth = 10;
    bool is_reliable = true;
    bool stays = false; ///< a message is kept for those who come later (transient local)
};

/// Context and node. It stays as long as anything that it has made.
struct Context {
    explicit Context(const NodeOptions& options);
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;
    /// s since 1970, by the system or by whoever sends /clock, 0 until somebody does; for use in steps, too.
    double now() const noexcept;

    rcl_context_t context = rcl_get_zero_initialized_context();
    rcl_node_t node = rcl_get_zero_initialized_node();
    std::mutex ends; ///< while one of the node is made or ends: rcl notes their types in a map without a lock
    std::atomic<double> told_time{by_system}; ///< on /clock, s
    static constexpr double by_system = -1, awaited = -2;
};

/// What the waiting thread waits for.
class Awaited {
  public:
    enum class Kind { message, answer, call };
    virtual ~Awaited() = default;
    virtual Kind kind() const noexcept { return Kind::message; }
    virtual void add_to(rcl_wait_set_t& set) = 0;
    /// Takes what has come, if anything has.
    virtual void take() = 0;
};

/// Makes memory for a message of a type, and frees it.
struct MessageMemory {
    const rosidl_message_type_support_t* support = nullptr;
    std::function<std::shared_ptr<void>()> make;
};

class Subscription final : public Awaited {
  public:
    /// `taken` is called in the waiting thread for each message, with a number of the program that has sent
    /// it; it owns all that it uses.
    Subscription(std::shared_ptr<Context> context, const MessageMemory& type, const std::string& topic,
                 const Quality& quality, std::function<void(const void*, std::uint64_t)> taken);
    ~Subscription() override;
    /// How many send to the topic.
    int writers() const noexcept;
    /// The nodes of the program with that number that do, as in "a' or 'b"; empty: none is known.
    std::string publisher(std::uint64_t program) const;
    void add_to(rcl_wait_set_t& set) override;
    void take() override;

  private:
    std::shared_ptr<Context> context_;
    rcl_subscription_t handle_ = rcl_get_zero_initialized_subscription();
    std::shared_ptr<void> message_;
    std::function<void(const void*, std::uint64_t)> taken_;
};

class Publisher {
  public:
    Publisher(std::shared_ptr<Context> context, const MessageMemory& type, const std::string& topic,
              const Quality& quality);
    /// Waits until what was published last is heard, at most 0.2 s: it would not be sent again, and readers
    /// drop what they have not taken from an end that is gone.
    ~Publisher();
    /// From any one thread that is no step.
    void publish(const void* message) noexcept;
    /// Waits until its readers have what was published, at most `longest` s.
    void wait_until_heard(double longest) const noexcept;
    int readers() const noexcept;
    int others() const noexcept; ///< publishers of the topic besides this one
    std::string another() const; ///< the node of one of them; empty: there is none

  private:
    std::shared_ptr<Context> context_;
    rcl_publisher_t handle_ = rcl_get_zero_initialized_publisher();
    double last_ = 0; ///< when something was published, s
};

class Service final : public Awaited {
  public:
    /// `answer(request, response)` is called in the waiting thread.
    Service(std::shared_ptr<Context> context, const rosidl_service_type_support_t* support,
            const std::string& name, std::shared_ptr<void> request, std::shared_ptr<void> response,
            std::function<void(const void*, void*)> answer);
    ~Service() override;
    void add_to(rcl_wait_set_t& set) override;
    void take() override;
    Kind kind() const noexcept override { return Kind::call; }

  private:
    std::shared_ptr<Context> context_;
    rcl_service_t handle_ = rcl_get_zero_initialized_service();
    std::shared_ptr<void> request_, response_;
    std::function<void(const void*, void*)> answer_;
};

/// The other side of a service.
class Client final : public Awaited {
  public:
    using Answered = std::function<void(const void* response, std::int64_t call)>;
    /// `answered` is called in the waiting thread for each answer; it owns all that it uses.
    Client(std::shared_ptr<Context> context, const rosidl_service_type_support_t* support,
           const std::string& name, std::shared_ptr<void> response, Answered answered);
    ~Client() override;
    /// Does somebody offer the service?
    bool has_server() const noexcept;
    /// From any one thread that is no step; the answer comes later. The number of the call; 0: it is not
    /// sent.
    std::int64_t call(const void* request) noexcept;
    void add_to(rcl_wait_set_t& set) override;
    void take() override;
    Kind kind() const noexcept override { return Kind::answer; }

  private:
    std::shared_ptr<Context> context_;
    rcl_client_t handle_ = rcl_get_zero_initialized_client();
    std::shared_ptr<void> response_;
    Answered answered_;
};

/// A node in a running diagram. Its threads run from open() to close().
class Node {
  public:
    explicit Node(NodeOptions options) : options_(std::move(options)) {}
    ~Node() { close(); }

    /// Joins the network; nothing where that is done. Throws std::runtime_error.
    void open();
    void close() noexcept;
    std::shared_ptr<Context> context() const { return context_; }
    /// The whole name of a topic. Throws std::runtime_error.
    std::string resolve(const std::string& topic) const;

    std::shared_ptr<Subscription> subscribe(const MessageMemory& type, const std::string& topic,
                                            const Quality& quality,
                                            std::function<void(const void*, std::uint64_t)> taken);
    std::shared_ptr<Publisher> advertise(const MessageMemory& type, const std::string& topic,
                                         const Quality& quality) const;
    std::shared_ptr<Service> serve(const rosidl_service_type_support_t* support, const std::string& name,
                                   std::shared_ptr<void> request, std::shared_ptr<void> response,
                                   std::function<void(const void*, void*)> answer);
    std::shared_ptr<Client> client(const rosidl_service_type_support_t* support, const std::string& name,
                                   std::shared_ptr<void> response, Client::Answered answered);
    /// The sending thread looks at it as long as somebody else has it, too.
    void add(const std::shared_ptr<middleware::Sender>& sender) { outbox_.add(sender); }
    /// Wakes the sending thread; in steps, too.
    middleware::Bell& bell() noexcept { return outbox_.bell(); }
    std::weak_ptr<Frames> frames; ///< that blocks of the node listen to

  private:
    template <class T> std::shared_ptr<T> awaited(std::shared_ptr<T> entity);
    void wait();

    const NodeOptions options_;
    std::shared_ptr<Context> context_;
    rcl_guard_condition_t changed_ = rcl_get_zero_initialized_guard_condition();
    std::shared_ptr<Subscription> clock_;
    std::mutex mutex_; ///< of the list
    std::vector<std::weak_ptr<Awaited>> awaited_;
    std::atomic<std::uint64_t> changes_{1}; ///< of it
    std::atomic<bool> goes_on_{false};
    middleware::Outbox outbox_;
    std::thread waiting_;
};

} // namespace bf::ros2
