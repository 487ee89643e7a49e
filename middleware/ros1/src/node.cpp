#include "node.hpp"

#include <arpa/inet.h>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <netinet/in.h>
#include <ros/console.h>
#include <ros/network.h>
#include <ros/xmlrpc_manager.h>
#include <stdexcept>
#include <sys/socket.h>

namespace bf::ros1 {

/// A message as roscpp carries it, whose type it leaves to us.
struct Raw {
    std::vector<std::uint8_t> bytes;
};

} // namespace bf::ros1

namespace ros {
namespace message_traits {
template <> struct MD5Sum<bf::ros1::Raw> {
    static const char* value() { return "*"; }
    static const char* value(const bf::ros1::Raw&) { return "*"; }
};
template <> struct DataType<bf::ros1::Raw> {
    static const char* value() { return "*"; }
    static const char* value(const bf::ros1::Raw&) { return "*"; }
};
template <> struct Definition<bf::ros1::Raw> {
    static const char* value() { return ""; }
    static const char* value(const bf::ros1::Raw&) { return ""; }
};
} // namespace message_traits
namespace serialization {
template <> struct Serializer<bf::ros1::Raw> {
    template <class Stream> static void read(Stream& stream, bf::ros1::Raw& raw) {
        raw.bytes.assign(stream.getData(), stream.getData() + stream.getLength());
    }
    template <class Stream> static void write(Stream& stream, const bf::ros1::Raw& raw) {
        std::copy(raw.bytes.begin(), raw.bytes.end(), stream.advance(raw.bytes.size()));
    }
    static std::uint32_t serializedLength(const bf::ros1::Raw& raw) {
        return static_cast<std::uint32_t>(raw.bytes.size());
    }
};
} // namespace serialization
} // namespace ros

namespace bf::ros1 {

using middleware::LiveIncoming;

// ---- session

std::shared_ptr<Session> Session::join(const NodeOptions& options) {
    // roscpp has one node for all of a program; so there is one of this, too.
    static std::mutex mutex;
    static std::weak_ptr<Session> open;
    static std::unique_ptr<const NodeOptions> first;
    const std::lock_guard lock(mutex);
    if (first && !(*first == options))
        throw std::runtime_error("a program is one node of ROS 1, and this one is '" + first->name +
                                 "' in '" + first->name_space +
                                 "'; give all nodes of the model the same arguments");
    if (auto its = open.lock()) return its;
    first = std::make_unique<const NodeOptions>(options);
    std::shared_ptr<Session> made(new Session(options));
    open = made;
    return made;
}

namespace {

/// roscpp takes messages from this computer alone when it is told a name such as localhost, but its port for
/// calls listens to all networks: that socket is tied to the loopback device.
void keep_to_this_computer() {
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
        const int file = std::atoi(entry.path().filename().c_str());
        sockaddr_in address{};
        socklen_t size = sizeof address;
        if (getsockname(file, reinterpret_cast<sockaddr*>(&address), &size) != 0 ||
            address.sin_family != AF_INET || address.sin_addr.s_addr != INADDR_ANY ||
            ntohs(address.sin_port) != ros::XMLRPCManager::instance()->getServerPort())
            continue;
        if (setsockopt(file, SOL_SOCKET, SO_BINDTODEVICE, "lo", 3) != 0)
            throw std::runtime_error(
                std::string("roscpp's port for calls cannot be kept to this computer: ") +
                std::strerror(errno) + "; say by ROS_IP by what address others reach it");
    }
}

} // namespace

Session::Session(const NodeOptions& options) {
    // What fails is told by exceptions.
    ros::console::set_logger_level(ROSCONSOLE_ROOT_LOGGER_NAME, ros::console::levels::Fatal);
    ros::console::notifyLoggerLevelsChanged();
    ros::M_string arguments{{"__ns", options.name_space}};
    for (const auto& rule : options.remap) {
        const auto at = rule.find(":=");
        arguments[rule.substr(0, at)] = rule.substr(at + 2);
    }
    // It sees programs of this computer alone, unless it is told otherwise.
    if (std::getenv("ROS_HOSTNAME") == nullptr && std::getenv("ROS_IP") == nullptr)
        arguments["__hostname"] = "localhost";
    try {
        ros::init(arguments, options.name, ros::init_options::NoSigintHandler);
    } catch (const ros::Exception& error) {
        throw std::runtime_error(std::string("ROS 1 refuses the node: ") + error.what());
    }
    if (!ros::master::check())
        throw std::runtime_error("no master of ROS 1 answers at " + ros::master::getURI() +
                                 "; start roscore, or say by ROS_MASTER_URI where it is");
    ros::master::setRetryTimeout(ros::WallDuration(5)); // otherwise calls wait for a master that is gone
    ros::start();
    const std::string host = ros::network::getHost();
    if (host == "localhost" || host.starts_with("127.")) keep_to_this_computer();
}

Session::~Session() { ros::shutdown(); }

// ---- node

void Node::open() {
    if (handle_) return;
    session_ = Session::join(options_);
    handle_ = std::make_unique<ros::NodeHandle>();
    handle_->setCallbackQueue(&queue_);
    queue_.enable();
    spinner_ = std::make_unique<ros::AsyncSpinner>(1, &queue_);
    spinner_->start();
    outbox_.open();
}

void Node::close() noexcept {
    if (!handle_) return;
    outbox_.close();
    spinner_->stop();
    queue_.disable();
    queue_.clear();
    spinner_.reset();
    handle_.reset();
    session_.reset();
}

void Node::publish(const TopicOptions& topic, const std::shared_ptr<middleware::Outgoing>& end) {
    ros::AdvertiseOptions options(topic.name, static_cast<std::uint32_t>(topic.depth), topic.type->md5(),
                                  topic.type->name(), topic.type->definition());
    options.latch = topic.is_kept;
    ros::Publisher publisher;
    try {
        publisher = handle_->advertise(options);
    } catch (const ros::Exception& error) {
        throw std::runtime_error("topic '" + topic.name + "': " + error.what());
    }
    if (!publisher)
        throw std::runtime_error("the master refuses the topic '" + topic.name +
                                 "'; look whether this program has it with another type");
    end->publish = [publisher, type = topic.type, raw = Raw()](const void* message) mutable {
        raw.bytes.clear();
        type->encode(*static_cast<const Message*>(message), raw.bytes);
        publisher.publish(raw);
    };
    end->clock = [] { return ros::Time::now().toSec(); };
    end->bell = &outbox_.bell();
    outbox_.add(end);
}

namespace {

/// In the node's thread.
void receive(const ros::MessageEvent<const Raw>& event, const MessageType& type, Message& message,
             LiveIncoming& end) {
    const auto& header = event.getConnectionHeader();
    const auto said = [&](const char* key) {
        const auto found = header.find(key);
        return found == header.end() ? std::string() : found->second;
    };
    if (said("md5sum") != type.md5()) {
        end.refuse("'" + event.getPublisherName() + "' sends " + said("type") + " (" + said("md5sum") +
                   "), not " + type.name() + " (" + type.md5() + "); correct argument 'type'");
        return;
    }
    try {
        type.decode(event.getConstMessage()->bytes, message);
        end.receive(&message);
    } catch (const std::runtime_error& error) {
        end.refuse("a message of '" + event.getPublisherName() + "' is no " + type.name() + ": " +
                   error.what());
    }
}

} // namespace

std::shared_ptr<middleware::Incoming> Node::subscribe(const TopicOptions& topic, middleware::Wanted wanted) {
    auto end = std::make_shared<LiveIncoming>(std::move(wanted));
    // The thread keeps what it writes to, but not the subscription, which ends with the run.
    const std::weak_ptr<LiveIncoming> to = end;
    const auto message = std::static_pointer_cast<Message>(topic.type->make());
    ros::SubscribeOptions options;
    options.initByFullCallbackType<const ros::MessageEvent<const Raw>&>(
        topic.name, static_cast<std::uint32_t>(topic.depth),
        [to, message, type = topic.type](const ros::MessageEvent<const Raw>& event) {
            if (const auto still = to.lock()) receive(event, *type, *message, *still);
        });
    options.datatype = topic.type->name();
    options.transport_hints.tcpNoDelay();
    try {
        end->subscription = std::make_shared<ros::Subscriber>(handle_->subscribe(options));
    } catch (const ros::Exception& error) {
        throw std::runtime_error("topic '" + topic.name + "': " + error.what());
    }
    return end;
}

// ---- block

namespace {

class NodeBlock final : public Block {
  public:
    explicit NodeBlock(const Arguments& arguments) : Block(arguments) {
        for (const auto& rule : *remap)
            if (rule.find(":=") == std::string::npos)
                problem("argument 'remap': '" + rule + "' is not given as from:=to");
    }
    Argument<std::string> name{this, "name", {.initial = "blockfactory", .doc = "of the node"}};
    Argument<std::string> name_space{
        this, "namespace", {.initial = "/", .doc = "in which names are that do not begin with /"}};
    Argument<std::vector<std::string>> remap{
        this, "remap", {.doc = "names that stand for others, each as from:=to"}};
    Provides<RosConnection> node{this, [this]() -> std::shared_ptr<const RosConnection> {
                                     return std::make_shared<RosConnection>(
                                         RosConnection{[options = NodeOptions{name, name_space, remap}] {
                                             return std::make_shared<Node>(options);
                                         }});
                                 }};

    void start(Now at) const override { at[node].open(); }
    void stop(Now at) const noexcept override { at[node].close(); }
};

} // namespace

void add_node(Library& library) {
    library.group("topics").add<NodeBlock>(
        "Node",
        "A node of ROS 1 (roscpp), for Publish and Subscribe in its subsystem and below. Messages come in a "
        "thread of its own and are sent by another, and the newest counts. The master is that of "
        "ROS_MASTER_URI. The node sees programs of this computer alone, unless ROS_HOSTNAME or ROS_IP says "
        "by what name others reach it. A program is one node. It has no ports. Errors: no master answers; "
        "names that ROS 1 does not allow; two nodes with different arguments.");
}

} // namespace bf::ros1
