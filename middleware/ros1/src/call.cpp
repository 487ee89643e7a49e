// Calls of services of any type that this machine has.
#include "bf/middleware/calls.hpp"
#include "caller.hpp"
#include "connection.hpp"
#include "names.hpp"

namespace bf::ros1 {

namespace {

constexpr middleware::ServiceTypes service_types{[](const std::string& name) -> middleware::ServiceParts {
                                                     const auto type = ServiceType::find(name);
                                                     return {type.request, type.response};
                                                 },
                                                 "std_srvs/Trigger", name_rules};

class Call final : public middleware::CallBlock {
  public:
    explicit Call(const Arguments& arguments) : CallBlock(arguments, service_types) {}

    Requires<RosConnection> node{this, "the node that calls"};
    Output<double> failed{
        this, "failed", {.doc = "calls so far that the service refused, or that broke off"}};

    OutsideState<middleware::Opened<void>> thread{
        this, [] { return std::make_shared<middleware::Opened<void>>(); }};

    void stop(Now at) const noexcept override {
        at[thread].end.reset();
        CallBlock::stop(at);
    }
    Status output(Now at, Out out) const noexcept override {
        out[failed] = static_cast<double>(at[opened].end->failed);
        return CallBlock::output(at, out);
    }

  private:
    void open(Now at, const std::shared_ptr<middleware::Calling>& end) const override {
        at[node].open();
        at[thread].end = at[node].call(service, ServiceType::find(type), end);
    }
};

} // namespace

std::shared_ptr<void> Node::call(const std::string& service, const ServiceType& type,
                                 const std::shared_ptr<middleware::Calling>& end) {
    // Calls of roscpp wait for their answers.
    struct Thread {
        explicit Thread(const std::string& name, const ServiceType& type) : caller(name, type) {
            outbox.open();
        }
        ~Thread() {
            caller.break_off();
            outbox.close();
        }
        Caller caller;
        middleware::Outbox outbox;
    };
    const auto thread = std::make_shared<Thread>(resolve(service), type);
    end->has_server = [&caller = thread->caller] { return caller.has_server(); };
    end->call = [&caller = thread->caller, &to = *end](const void* request) {
        if (const auto* answer = caller.call(*static_cast<const Message*>(request)))
            to.take(answer);
        else
            ++to.failed;
    };
    end->bell = &thread->outbox.bell();
    thread->outbox.add(end);
    return thread;
}

void add_calls(Library& library) {
    library.group("topics").add<Call>(
        "Call",
        "Calls a service of any type that is installed when its input `call` becomes positive. The numbers "
        "of the request are inputs, those of the answer outputs, as those of Publish and Subscribe; outputs "
        "keep the newest answer, and are zeros before the first one. A step neither waits nor sends: a "
        "thread of the block does, and a call waits until somebody offers the service. Of calls that come "
        "faster than they are answered the newest counts. A call that fails is not made again. Errors: no "
        "such type, field or name of a service; below a Bag, which answers no calls; in a step: no answer "
        "for timeout, more elements than expected.");
}

} // namespace bf::ros1
