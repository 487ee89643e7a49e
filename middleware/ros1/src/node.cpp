#include "node.hpp"

#include "bf/core/interrupt.hpp"
#include "bf/middleware/ending.hpp"
#include "bf/middleware/node_block.hpp"
#include "master.hpp"
#include "names.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <atomic>
#include <cerrno>
#include <chrono>
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
#include <thread>

namespace bf::ros1 {

using middleware::LiveIncoming;

// ---- session

namespace {

std::mutex session_mutex; ///< of roscpp, which has one node for all of a program
int sessions = 0;

/// Ends something of roscpp, which tells the master. One that has stopped answering holds that up once, while
/// roscpp keeps its own locks; what is left to end then stays as it is, as long as the program.
std::atomic<bool> master_is_silent{false};
void end_by_master(std::function<void()> end) {
    if (master_is_silent)
        static_cast<void>(new std::function<void()>(std::move(end)));
    else
        master_is_silent = !middleware::end_within(5, std::move(end));
}
template <class T> std::shared_ptr<T> ended_by_master(T made) {
    return {new T(std::move(made)), [](T* its) { end_by_master([its] { delete its; }); }};
}

Address master() { return {ros::master::getHost(), ros::master::getPort()}; }

/// Does a program run that is the node of that name? It answers another one that asks it.
bool runs(const std::string& name) {
    XmlRpc::XmlRpcValue arguments;
    arguments[0] = ros::this_node::getName();
    arguments[1] = name;
    auto uri = ask(master(), "lookupNode", arguments, 5);
    Address its{};
    if (!uri || uri->getType() != XmlRpc::XmlRpcValue::TypeString ||
        !ros::network::splitURI(static_cast<std::string>(*uri), its.host, its.port))
        return false;
    XmlRpc::XmlRpcValue caller;
    caller[0] = ros::this_node::getName();
    // One that was killed is still known, and refuses at once; where packets are lost others answer seconds
    // later.
    return ask(its, "getPid", caller, 5).has_value();
}

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

/// Who asks the node to end, as `rosnode kill` and the master where another one has its name, asks for the
/// end of the run, which gives robots back and tells the master. roscpp itself would send nothing from then
/// on.
void end_by_the_run() {
    auto& calls = *ros::XMLRPCManager::instance();
    calls.unbind("shutdown");
    calls.bind("shutdown", [](XmlRpc::XmlRpcValue&, XmlRpc::XmlRpcValue& answer) {
        if (!interrupt()) ros::requestShutdown();
        answer = ros::xmlrpc::responseInt(1, "", 0);
    });
}

void begin_session(const NodeOptions& options) {
    // What fails is told by exceptions.
    ros::console::set_logger_level(ROSCONSOLE_ROOT_LOGGER_NAME, ros::console::levels::Fatal);
    ros::console::notifyLoggerLevelsChanged();
    ros::M_string arguments;
    for (const auto& rule : options.remap) {
        const auto at = rule.find(":=");
        arguments[rule.substr(0, at)] = rule.substr(at + 2);
    }
    // It sees programs of this computer alone, unless it is told otherwise.
    if (std::getenv("ROS_HOSTNAME") == nullptr && std::getenv("ROS_IP") == nullptr)
        arguments["__hostname"] = "localhost";
    master_of_environment(); // roscpp ends the program where that is none
    try {
        ros::init(arguments, options.name, ros::init_options::NoSigintHandler);
    } catch (const ros::Exception& error) {
        throw std::runtime_error(std::string("ROS 1 refuses the node: ") + error.what());
    }
    require_master(master(), ros::this_node::getName());
    master_is_silent = false;
    if (runs(ros::this_node::getName())) // the master would end it when we come
        throw std::runtime_error("another program is the node '" + ros::this_node::getName() +
                                 "' of ROS 1; end it, or give this one another name or namespace");
    ros::master::setRetryTimeout(ros::WallDuration(5)); // otherwise calls wait for a master that is gone
    ros::start();
    end_by_the_run();
    const std::string host = ros::network::getHost();
    try {
        if (host == "localhost" || host.starts_with("127.")) keep_to_this_computer();
    } catch (const std::exception&) {
        ros::shutdown();
        throw;
    }
}

} // namespace

Session::Session(const NodeOptions& options) {
    static std::unique_ptr<const NodeOptions> first;
    const std::lock_guard lock(session_mutex);
    if (first && !options.joins && (first->name != options.name || first->remap != options.remap))
        throw std::runtime_error("a program is one node of ROS 1, and this one is '" + first->name +
                                 "'; give all nodes and robots of the model the same name and remap");
    if (sessions == 0) {
        if (!first) first = std::make_unique<const NodeOptions>(options);
        begin_session(*first);
    }
    ++sessions;
}

Session::~Session() {
    const std::lock_guard lock(session_mutex);
    if (--sessions == 0) end_by_master([] { ros::shutdown(); });
}

// ---- node

void Node::open() {
    if (handle_) return;
    if (const auto wrong = name_rules.name_space(options_.name_space); !wrong.empty())
        throw std::runtime_error("namespace " + wrong);
    session_ = std::make_unique<Session>(options_);
    try {
        handle_ = std::make_unique<ros::NodeHandle>(options_.name_space);
    } catch (const ros::Exception& error) {
        throw std::runtime_error("namespace '" + options_.name_space + "': " + error.what());
    }
    handle_->setCallbackQueue(&queue_);
    queue_.enable();
    spinner_ = std::make_unique<ros::AsyncSpinner>(1, &queue_);
    spinner_->start();
    if (options_.use_sim_time) {
        *told_time_ = 0;
        const auto type = MessageType::find("rosgraph_msgs/Clock");
        clock_ = hear(
            {"/clock", type, 1},
            [type, to = told_time_](const Message& message, const std::string&) {
                double time = 0;
                type->field("clock")->read(&message, &time, 1);
                *to = time;
            },
            [](const std::string&, const std::string&) {});
    }
    outbox_.open();
}

void Node::close() noexcept {
    if (!handle_) return;
    outbox_.close();
    clock_.reset();
    spinner_->stop();
    queue_.disable();
    queue_.clear();
    spinner_.reset();
    handle_.reset();
    session_.reset();
}

std::function<double()> Node::clock() const {
    return [told = told_time_] {
        const double time = *told;
        return time == by_system ? ros::Time::now().toSec() : time;
    };
}

Publisher::~Publisher() {
    auto its = std::make_shared<ros::Publisher>(end_);
    end_ = {}; // so that the other one is the last
    end_by_master([end = std::move(its), last = last_] {
        constexpr double longest = 0.1; // s, of roscpp's thread
        while (end->getNumSubscribers() > 0 && middleware::now() < last + longest)
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
    });
}

std::string Node::resolve(const std::string& name) const {
    try {
        return handle_->resolveName(name);
    } catch (const ros::Exception& error) {
        throw std::runtime_error("'" + name + "': " + error.what());
    }
}

std::shared_ptr<Publisher> Node::advertise(const TopicOptions& topic) {
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
    return std::make_shared<Publisher>(std::move(publisher));
}

std::string Node::other(Side side, const std::vector<std::string>& topics) {
    XmlRpc::XmlRpcValue arguments;
    arguments[0] = ros::this_node::getName();
    // [publishers, subscribers, services], each a list of [name, [node, ...]]
    auto state = ask(master(), "getSystemState", arguments, 5);
    try {
        const int list = static_cast<int>(side);
        for (int i = 0; state && i < (*state)[list].size(); ++i) {
            auto& topic = (*state)[list][i];
            if (std::ranges::find(topics, static_cast<std::string>(topic[0])) == topics.end()) continue;
            for (int k = 0; k < topic[1].size(); ++k)
                if (const auto name = static_cast<std::string>(topic[1][k]);
                    name != ros::this_node::getName() && runs(name))
                    return name;
        }
    } catch (const XmlRpc::XmlRpcException&) { // what the master says is something else
    }
    return "";
}

void Node::publish(const TopicOptions& topic, const std::shared_ptr<middleware::Outgoing>& end) {
    end->publish = [publisher = advertise(topic), type = topic.type,
                    raw = Raw()](const void* message) mutable {
        raw.bytes.clear();
        type->encode(*static_cast<const Message*>(message), raw.bytes);
        publisher->publish(raw);
    };
    end->clock = clock();
    end->bell = &outbox_.bell();
    outbox_.add(end);
}

std::shared_ptr<ros::Subscriber> Node::hear(
    const TopicOptions& topic, std::function<void(const Message&, const std::string&)> taken,
    std::function<void(const std::string&, const std::string&)> refused) {
    const auto receive = [message = std::static_pointer_cast<Message>(topic.type->make()), type = topic.type,
                          taken = std::move(taken),
                          refused = std::move(refused)](const ros::MessageEvent<const Raw>& event) {
        const auto& header = event.getConnectionHeader();
        const auto said = [&](const char* key) {
            const auto found = header.find(key);
            return found == header.end() ? std::string() : found->second;
        };
        if (said("md5sum") != type->md5())
            return refused(said("type") + " (" + said("md5sum") + "), not " + type->name() + " (" +
                               type->md5() + ")",
                           event.getPublisherName());
        try {
            type->decode(event.getConstMessage()->bytes, *message);
        } catch (const std::runtime_error& error) {
            return refused("what is no " + type->name() + ": " + error.what(), event.getPublisherName());
        }
        taken(*message, event.getPublisherName());
    };
    ros::SubscribeOptions options;
    options.initByFullCallbackType<const ros::MessageEvent<const Raw>&>(
        topic.name, static_cast<std::uint32_t>(topic.depth), receive);
    options.datatype = topic.type->name();
    options.transport_hints.tcpNoDelay();
    try {
        return ended_by_master(handle_->subscribe(options));
    } catch (const ros::Exception& error) {
        throw std::runtime_error("topic '" + topic.name + "': " + error.what());
    }
}

std::shared_ptr<ros::ServiceServer> Node::offer(const std::string& name, const ServiceType& type,
                                                std::function<void(const Message&, Message&)> answer) {
    using Spec = ros::ServiceSpec<Raw, Raw>;
    const auto call = [request = std::static_pointer_cast<Message>(type.request->make()),
                       response = std::static_pointer_cast<Message>(type.response->make()), type,
                       answer = std::move(answer)](const Raw& asked, Raw& answered) {
        type.request->decode(asked.bytes, *request); // whoever sends something else is told so
        answer(*request, *response);
        type.response->encode(*response, answered.bytes);
        return true;
    };
    ros::AdvertiseServiceOptions options;
    options.service = name;
    options.md5sum = type.md5;
    options.datatype = type.name;
    options.req_datatype = type.request->name();
    options.res_datatype = type.response->name();
    options.helper = boost::make_shared<ros::ServiceCallbackHelperT<Spec>>(call);
    ros::ServiceServer server;
    try {
        server = handle_->advertiseService(options);
    } catch (const ros::Exception& error) {
        throw std::runtime_error("service '" + name + "': " + error.what());
    }
    if (!server)
        throw std::runtime_error("the service '" + name +
                                 "' cannot be offered; look whether this program has it already");
    return ended_by_master(std::move(server));
}

std::shared_ptr<middleware::Incoming> Node::subscribe(const TopicOptions& topic, middleware::Wanted wanted) {
    auto end = std::make_shared<LiveIncoming>(std::move(wanted));
    // The thread keeps what it writes to, but not the subscription, which ends with the run.
    const std::weak_ptr<LiveIncoming> to = end;
    end->subscription = hear(
        topic,
        [to](const Message& message, const std::string&) {
            if (const auto still = to.lock()) still->receive(&message);
        },
        [to](const std::string& what, const std::string& from) {
            if (const auto still = to.lock())
                still->refuse("'" + from + "' sends " + what + "; correct argument 'type', or that node");
        });
    return end;
}

// ---- block

namespace {

class NodeBlock final : public middleware::NodeBlock {
  public:
    explicit NodeBlock(const Arguments& arguments) : middleware::NodeBlock(arguments, name_rules) {}

    Provides<RosConnection> node{
        this, [this]() -> std::shared_ptr<const RosConnection> {
            return std::make_shared<RosConnection>(RosConnection{
                [options = NodeOptions{
                     .name = name, .remap = remap, .name_space = name_space, .use_sim_time = use_sim_time}] {
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
        "by what name others reach it. Whether time is that of /clock its argument alone says, not the "
        "parameter /use_sim_time. A program is one node, whatever namespaces its blocks have. It has no "
        "ports. Errors: no master answers; names that ROS 1 does not allow; two nodes with different names.");
}

} // namespace bf::ros1
