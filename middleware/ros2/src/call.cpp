// Calls of services of any type that this machine has.
#include "bf/middleware/clock.hpp"
#include "bf/middleware/exchange.hpp"
#include "bf/middleware/topics.hpp"
#include "blocks.hpp"
#include "types.hpp"

#include <algorithm>
#include <atomic>
#include <stdexcept>

namespace bf::ros2 {

namespace {

using middleware::Opened;

using middleware::ExchangeBuffer;

/// The step leaves the numbers of a request, the node's threads send it and take the answer.
class Calling final : public Sender {
  public:
    Calling(std::shared_ptr<const MessageType> type, std::vector<Place> places, int size,
            std::vector<Place> answer_places, int answer_size)
        : asked(size), answers(answer_size), request(type->memory().make()), type_(std::move(type)),
          places_(std::move(places)), values_(static_cast<std::size_t>(size)),
          answer_places_(std::move(answer_places)), answer_(static_cast<std::size_t>(answer_size)) {}

    /// A call that nobody can take yet waits.
    bool has_news() const noexcept override { return asked.newest() != sent && client->has_server(); }
    void send() override {
        middleware::Stamp stamp;
        if (!asked.read(values_.data(), stamp)) return;
        for (const auto& place : places_)
            place.field->write(request.get(), &values_[static_cast<std::size_t>(place.first)],
                               static_cast<std::size_t>(place.size));
        ++calls; // also one that does not get through stays without an answer
        client->call(request.get());
        sent = stamp.number;
    }
    /// In the waiting thread.
    void take(const void* response) {
        int count = 0;
        if (const int wrong = read(response, answer_places_, answer_, count); wrong >= 0) {
            too_long_size = count;
            too_long = wrong;
            return;
        }
        answers.write(answer_.data(), middleware::now());
    }

    ExchangeBuffer asked, answers; ///< numbers of requests, and of answers
    const std::shared_ptr<void> request;
    std::shared_ptr<Client> client;
    std::atomic<std::uint64_t> sent{0}, calls{0};
    std::atomic<int> too_long{-1}, too_long_size{0};
    middleware::Stamp taken;
    bool was_pending = false; ///< in the last step
    double since = 0;         ///< when the wait began, s

  private:
    std::shared_ptr<const MessageType> type_;
    const std::vector<Place> places_;
    std::vector<double> values_;
    const std::vector<Place> answer_places_;
    std::vector<double> answer_;
};

class Call final : public Block {
  public:
    explicit Call(const Arguments& arguments) : Block(arguments) {
        if (service->empty()) problem("argument 'service' is empty; name the service, such as robot/pause");
        try {
            service_ = ServiceType::find(type);
        } catch (const std::runtime_error& error) {
            problem(std::string("argument 'type': ") + error.what());
            return;
        }
        std::vector<std::string> problems;
        inputs_.add(*this, *service_.request, fields_of(*service_.request, fields, "fields", problems));
        texts_ = texts_of(*service_.request, texts, problems);
        const auto wanted = fields_of(*service_.response, answer_fields, "answer_fields", problems);
        outputs_.add(*this, *service_.response, wanted, !answer_fields->empty(), sizes, problems);
        for (auto& text : problems) problem(std::move(text));
    }

    Argument<std::string> service{
        this, "service", {.initial = "service", .doc = "its name, absolute or in the node's namespace"}};
    Argument<std::string> type{
        this,
        "type",
        {.initial = "std_srvs/srv/Trigger", .doc = "type of the service, of any package that is installed"}};
    Argument<std::vector<std::string>> fields{
        this,
        "fields",
        {.doc = "paths of those fields of the request that are inputs; none: all that are numbers"}};
    Argument<std::vector<std::string>> texts{
        this,
        "texts",
        {.doc = "fields of the request that are texts, each as field=text, such as name=hip,knee where there "
                "are several"}};
    Argument<std::vector<std::string>> answer_fields{
        this,
        "answer_fields",
        {.doc = "paths of those fields of the answer that are outputs; none: all that are numbers"}};
    Argument<std::vector<std::string>> sizes{
        this,
        "sizes",
        {.doc = "largest number of elements of fields of the answer that have any number of them, each as "
                "field=size; those that are not named are no ports"}};
    Argument<double> timeout{this,
                             "timeout",
                             {.initial = 0,
                              .minimum = 0,
                              .maximum = 1e6,
                              .doc = "without an answer until the run ends, s; 0: never"}};
    Requires<RosNode> node{this, "the node that calls"};
    Input<double> call{
        this, "call", {.doc = "calls when it becomes positive, with the request of that step"}};
    Output<double> pending{this, "pending", {.doc = "1: a call is not answered yet"}};
    Output<double> answered{this, "answered", {.doc = "answers so far"}};
    DiscreteState<double> last{this, "last", {.doc = "the input call of the step before"}};
    OutsideState<Opened<Calling>> opened{this, [] { return std::make_shared<Opened<Calling>>(); }};
    Scratch<std::vector<double>> asked{this, [] { return std::vector<double>(); }},
        answer{this, [] { return std::vector<double>(); }};

    void start(Now at) const override {
        Node& its = at[node];
        its.open();
        // An exchange has one number at least.
        at[asked].assign(static_cast<std::size_t>(std::max(inputs_.size(at), 1)), 0.0);
        at[answer].assign(static_cast<std::size_t>(std::max(outputs_.size(), 1)), 0.0);
        auto end = std::make_shared<Calling>(service_.request, inputs_.places(at, 0),
                                             static_cast<int>(at[asked].size()), outputs_.places(),
                                             static_cast<int>(at[answer].size()));
        for (const auto& [field, its_texts] : texts_) field->write(end->request.get(), its_texts);
        // The thread keeps what it writes to, but not the client, which ends with the run.
        const std::weak_ptr<Calling> to = end;
        end->client = its.client(service_.support, service, service_.response->memory().make(),
                                 [to](const void* response, std::int64_t) {
                                     if (const auto still = to.lock()) still->take(response);
                                 });
        its.add(end);
        at[opened].end = std::move(end);
    }
    void stop(Now at) const noexcept override { at[opened].end.reset(); }

    Status output(Now at, Out out) const noexcept override {
        Calling& end = *at[opened].end;
        const double now = middleware::now();
        if (at[call] > 0 && !(at[last] > 0)) {
            inputs_.copy(at, at[asked].data());
            end.asked.write(at[asked].data(), now);
            at[node].bell().ring();
        }
        if (const int place = end.too_long; place >= 0) return outputs_.too_long(place, end.too_long_size);
        const std::uint64_t before = end.taken.number, sent = end.sent, calls = end.calls;
        end.answers.read(at[answer].data(), end.taken);
        outputs_.copy(at[answer].data(), out);
        const bool is_pending = sent != end.asked.newest() || end.taken.number < calls;
        out[pending] = is_pending ? 1 : 0;
        out[answered] = static_cast<double>(end.taken.number);
        // The wait begins with a call, and anew with each answer.
        if (!is_pending || !end.was_pending || end.taken.number != before) end.since = now;
        end.was_pending = is_pending;
        if (*timeout > 0 && now - end.since > *timeout)
            return Status::failure("the service has not answered within argument 'timeout'; look whether it "
                                   "is there, or raise it");
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[last] = at[call];
        return ok;
    }

  private:
    ServiceType service_;
    FieldInputs inputs_;
    FieldOutputs outputs_;
    std::vector<std::pair<const Field*, std::vector<std::string>>> texts_;
};

} // namespace

void add_calls(Library& library) {
    library.group("topics").add<Call>(
        "Call",
        "Calls a service of any type that is installed when its input `call` becomes positive. The numbers "
        "of "
        "the request are inputs, those of the answer outputs, as those of Publish and Subscribe; outputs "
        "keep "
        "the newest answer, and are zeros before the first one. A step neither waits nor sends: the node's "
        "threads do, and a call waits until somebody offers the service. Of calls that come faster than they "
        "are sent the newest counts. "
        "Errors: no such type, field or name of a service; in a step: no answer for timeout, more elements "
        "than expected.");
}

} // namespace bf::ros2
