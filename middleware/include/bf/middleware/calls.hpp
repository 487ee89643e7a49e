// Calls of services of any type, whose fields are ports: what the blocks Call of the middlewares that have
// services share.
#pragma once

#include "bf/middleware/topics.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace bf::middleware {

/// A type of service.
struct ServiceParts {
    std::shared_ptr<const MessageType> request, response;
};

/// The types of services that a middleware has.
struct ServiceTypes {
    ServiceParts (*find)(const std::string& name); ///< throws std::runtime_error
    const char* usual;                             ///< where none is said
    const NameRules& names;
};

/// The step leaves the numbers of a request, and the thread of an Outbox sends it.
class Calling final : public Sender {
  public:
    Calling(const ServiceParts& type, std::vector<Place> places, int size, std::vector<Place> answer_places,
            int answer_size);
    /// A call that nobody can take yet waits.
    bool has_news() const noexcept override { return asked.newest() != sent && has_server(); }
    void send() override;
    /// An answer, in any one thread.
    void take(const void* response);

    ExchangeBuffer asked, answers; ///< numbers of requests, and of answers
    const std::shared_ptr<void> request;
    std::function<bool()> has_server; ///< these are set by who opens it
    std::function<void(const void* request)> call;
    Bell* bell = nullptr; ///< of who sends

    std::atomic<std::uint64_t> sent{0}, calls{0};
    std::atomic<std::uint64_t> failed{0}; ///< calls that get no answer
    std::atomic<int> too_long{-1}, too_long_size{0};
    Stamp taken;
    bool was_pending = false; ///< in the last step
    double since = 0;         ///< when the wait began, s

  private:
    const std::vector<Place> places_, answer_places_;
    std::vector<double> values_, answer_;
};

/// Calls a service when its input `call` becomes positive.
class CallBlock : public Block {
  public:
    CallBlock(const Arguments& arguments, const ServiceTypes& types);

  private:
    const ServiceTypes types_;

  public:
    Argument<std::string> service{
        this, "service", {.initial = "service", .doc = "its name, absolute or in the node's namespace"}};
    Argument<std::string> type{
        this,
        "type",
        {.initial = types_.usual, .doc = "type of the service, of any package that is installed"}};
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
    Argument<double> timeout{this, "timeout",
                             waiting_time("without an answer until the run ends, s; 0: never")};
    Input<double> call{
        this, "call", {.doc = "calls when it becomes positive, with the request of that step"}};
    Output<double> pending{this, "pending", {.doc = "1: a call is not answered yet"}};
    Output<double> answered{this, "answered", {.doc = "answers so far"}};
    DiscreteState<double> last{this, "last", {.doc = "the input call of the step before"}};
    OutsideState<Opened<Calling>> opened{this, [] { return std::make_shared<Opened<Calling>>(); }};
    Scratch<std::vector<double>> asked{this, [] { return std::vector<double>(); }},
        answer{this, [] { return std::vector<double>(); }};

    void start(Now at) const override;
    void stop(Now at) const noexcept override { at[opened].end.reset(); }
    Status output(Now at, Out out) const noexcept override;
    Status update(Now at, Next next) const noexcept override;

  protected:
    /// Gives it what it calls with, and who sends. Throws std::runtime_error.
    virtual void open(Now at, const std::shared_ptr<Calling>& end) const = 0;

  private:
    ServiceParts parts_;
    FieldInputs inputs_;
    FieldOutputs outputs_;
    std::vector<std::pair<const Field*, std::vector<std::string>>> texts_;
};

} // namespace bf::middleware
