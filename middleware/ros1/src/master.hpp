// Calls of the master and of other nodes, which answer or do not.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <xmlrpcpp/XmlRpc.h>

namespace bf::ros1 {

/// Where calls go.
struct Address {
    std::string host;
    std::uint32_t port;
};

/// By ROS_MASTER_URI, or port 11311 of this computer.
Address master_of_environment();

/// May a call that ends with an interrupt be left?
enum class Asked { until_an_interrupt, also_behind_an_interrupt };

/// What it answers to a call of the API of masters and nodes: nothing where it fails, or where there is no
/// answer within that many seconds. roscpp itself waits for one that does not answer for ever.
std::optional<XmlRpc::XmlRpcValue> ask(const Address& whom, const char* method,
                                       const XmlRpc::XmlRpcValue& arguments, double longest,
                                       Asked how = Asked::until_an_interrupt);

/// Does its computer say that no program listens there? One that hangs is there.
bool is_refused(const Address& whom);

/// Throws std::runtime_error: no master answers there. `caller` is the name of who asks.
void require_master(const Address& master, const std::string& caller);

} // namespace bf::ros1
