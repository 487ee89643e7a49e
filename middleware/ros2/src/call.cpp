// Calls of services of any type that this machine has.
#include "bf/middleware/calls.hpp"
#include "blocks.hpp"
#include "names.hpp"
#include "types.hpp"

namespace bf::ros2 {

namespace {

constexpr middleware::ServiceTypes service_types{[](const std::string& name) -> middleware::ServiceParts {
                                                     const auto type = ServiceType::find(name);
                                                     return {type.request, type.response};
                                                 },
                                                 "std_srvs/srv/Trigger", name_rules};

class Call final : public middleware::CallBlock {
  public:
    explicit Call(const Arguments& arguments) : CallBlock(arguments, service_types) {}

    Requires<RosNode> node{this, "the node that calls"};

  private:
    void open(Now at, const std::shared_ptr<middleware::Calling>& end) const override {
        Node& its = at[node];
        its.open();
        const auto found = ServiceType::find(type);
        // The thread keeps what it writes to, but not the client, which ends with the run.
        const std::weak_ptr<middleware::Calling> to = end;
        const auto client = its.client(found.support, service, found.response->memory().make(),
                                       [to](const void* response, std::int64_t) {
                                           if (const auto still = to.lock()) still->take(response);
                                       });
        end->has_server = [client] { return client->has_server(); };
        end->call = [client](const void* request) { client->call(request); };
        end->bell = &its.bell();
        its.add(end);
    }
};

} // namespace

void add_calls(Library& library) {
    library.group("topics").add<Call>(
        "Call",
        "Calls a service of any type that is installed when its input `call` becomes positive. The numbers "
        "of the request are inputs, those of the answer outputs, as those of Publish and Subscribe; outputs "
        "keep the newest answer, and are zeros before the first one. A step neither waits nor sends: the "
        "node's threads do, and a call waits until somebody offers the service. Of calls that come faster "
        "than they are sent the newest counts. Errors: no such type, field or name of a service; in a step: "
        "no answer for timeout, more elements than expected.");
}

} // namespace bf::ros2
