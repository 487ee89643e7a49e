#include "master.hpp"

#include "bf/core/interrupt.hpp"
#include "bf/middleware/clock.hpp"

#include <cerrno>
#include <cstdlib>
#include <poll.h>
#include <ros/network.h>
#include <stdexcept>
#include <sys/socket.h>
#include <xmlrpcpp/XmlRpcSocket.h>

namespace bf::ros1 {

Address master_of_environment() {
    const char* uri = std::getenv("ROS_MASTER_URI");
    Address its{"localhost", 11311};
    constexpr std::uint32_t last_port = 65535;
    if (uri != nullptr &&
        (!ros::network::splitURI(uri, its.host, its.port) || its.port == 0 || its.port > last_port))
        throw std::runtime_error("ROS_MASTER_URI is '" + std::string(uri) +
                                 "'; write it as http://localhost:11311");
    return its;
}

void require_master(const Address& master, const std::string& caller) {
    XmlRpc::XmlRpcValue arguments;
    arguments[0] = caller;
    const bool answers = ask(master, "getPid", arguments, 5).has_value();
    if (!answers && is_interrupted()) throw std::runtime_error(interrupted);
    if (!answers)
        throw std::runtime_error("no master of ROS 1 answers at http://" + master.host + ":" +
                                 std::to_string(master.port) +
                                 "; start roscore, or say by ROS_MASTER_URI where it is");
}

bool is_refused(const Address& whom) {
    using Socket = XmlRpc::XmlRpcSocket;
    const int socket = Socket::socket();
    Socket::setNonBlocking(socket);
    bool is = !Socket::connect(socket, whom.host, static_cast<int>(whom.port)) &&
              Socket::getError() == ECONNREFUSED;
    constexpr int longest = 200; // ms
    pollfd answer{socket, POLLOUT, 0};
    int error = 0;
    socklen_t size = sizeof error;
    if (!is && poll(&answer, 1, longest) == 1 && getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size) == 0)
        is = error == ECONNREFUSED;
    Socket::close(socket);
    return is;
}

std::optional<XmlRpc::XmlRpcValue> ask(const Address& whom, const char* method,
                                       const XmlRpc::XmlRpcValue& arguments, double longest, Asked how) {
    XmlRpc::XmlRpcClient client(whom.host.c_str(), static_cast<int>(whom.port), "/");
    if (!client.executeNonBlock(method, arguments)) return {};
    XmlRpc::XmlRpcDispatch dispatch;
    dispatch.addSource(&client, XmlRpc::XmlRpcDispatch::WritableEvent | XmlRpc::XmlRpcDispatch::Exception);
    bool is_done = false;
    XmlRpc::XmlRpcValue answer; // [1 for success, what happened, value]
    for (const double end = middleware::now() + longest;
         !is_done && middleware::now() < end &&
         (how == Asked::also_behind_an_interrupt || !is_interrupted());) {
        dispatch.work(0.02);
        is_done = client.executeCheckDone(answer);
    }
    dispatch.removeSource(&client);
    using Value = XmlRpc::XmlRpcValue;
    if (!is_done || client.isFault() || answer.getType() != Value::TypeArray || answer.size() != 3 ||
        answer[0].getType() != Value::TypeInt || static_cast<int>(answer[0]) != 1)
        return {};
    return answer[2];
}

} // namespace bf::ros1
