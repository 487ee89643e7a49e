#include "master.hpp"

#include "bf/core/interrupt.hpp"
#include "bf/middleware/clock.hpp"

namespace bf::ros1 {

std::optional<XmlRpc::XmlRpcValue> ask(const Address& whom, const char* method,
                                       const XmlRpc::XmlRpcValue& arguments, double longest) {
    XmlRpc::XmlRpcClient client(whom.host.c_str(), static_cast<int>(whom.port), "/");
    if (!client.executeNonBlock(method, arguments)) return {};
    XmlRpc::XmlRpcDispatch dispatch;
    dispatch.addSource(&client, XmlRpc::XmlRpcDispatch::WritableEvent | XmlRpc::XmlRpcDispatch::Exception);
    bool is_done = false;
    XmlRpc::XmlRpcValue answer; // [1 for success, what happened, value]
    for (const double end = middleware::now() + longest;
         !is_done && middleware::now() < end && !is_interrupted();) {
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
