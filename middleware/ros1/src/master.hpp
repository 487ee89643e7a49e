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

/// What it answers to a call of the API of masters and nodes: nothing where it fails, or where there is no
/// answer within that many seconds. roscpp itself waits for one that does not answer for ever.
std::optional<XmlRpc::XmlRpcValue> ask(const Address& whom, const char* method,
                                       const XmlRpc::XmlRpcValue& arguments, double longest);

} // namespace bf::ros1
