#include "node.hpp"

#include "bf/core/interrupt.hpp"
#include "bf/middleware/clock.hpp"
#include "messages.hpp"
#include "rmw_choice.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <dlfcn.h>
#include <rcl/domain_id.h>
#include <rcl/error_handling.h>
#include <rcl/graph.h>
#include <rcutils/logging.h>
#include <set>
#include <stdexcept>
#include <string_view>
#include <unistd.h>

namespace bf::ros2 {

namespace {

std::string reason() {
    std::string text = rcl_error_is_set() ? rcl_get_error_string().str : "";
    rcl_reset_error();
    // "..., at /file:line" is for those who work on rcl.
    if (const auto at = text.rfind(", at "); at != std::string::npos) text.resize(at);
    return text;
}

rmw_qos_profile_t profile_of(const Quality& quality) {
    rmw_qos_profile_t profile = rmw_qos_profile_default;
    profile.depth = static_cast<std::size_t>(quality.depth);
    profile.reliability =
        quality.is_reliable ? RMW_QOS_POLICY_RELIABILITY_RELIABLE : RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT;
    profile.durability =
        quality.stays ? RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL : RMW_QOS_POLICY_DURABILITY_VOLATILE;
    return profile;
}

bool is_set(const char* variable) {
    const char* value = std::getenv(variable);
    return value != nullptr && *value != '\0';
}

bool has_security() {
    const char* value = std::getenv("ROS_SECURITY_ENABLE");
    return value != nullptr && value == std::string_view("true");
}

/// Gives a middleware our profile, which keeps it to this computer, unless the user has given another one.
/// True: it has ours, and no range may be asked of it, as for LOCALHOST rmw_fastrtps adds shared memory to
/// any profile.
bool give_loopback_profile(std::string_view middleware) {
    constexpr const char* variable = "FASTDDS_DEFAULT_PROFILES_FILE";
    const auto ours = loopback_profile();
    if (!ours.empty()) setenv(variable, ours.c_str(), 0);
    const char* profile = std::getenv(variable);
    return middleware.starts_with("rmw_fastrtps") && !ours.empty() && profile == ours &&
           !is_set("ROS_STATIC_PEERS"); // which belong to a range
}

/// Where nothing can be done about it.
void ignore(rcl_ret_t code) noexcept {
    if (code != RCL_RET_OK) rcl_reset_error();
}

/// A number of the program that has that publisher: the numbers of all that it has in DDS begin alike
/// (GuidPrefix_t, RTPS 2.5, 8.2.4).
std::uint64_t program_of(const std::uint8_t* publisher) {
    constexpr std::size_t prefix = 12;
    return std::hash<std::string_view>()({reinterpret_cast<const char*>(publisher), prefix});
}

/// Calls `told(node, program)` for each publisher of the topic. Returns how many there are.
template <class F> int each_publisher(const rcl_node_t& node, const char* topic, F&& told) {
    auto all = rcl_get_zero_initialized_topic_endpoint_info_array();
    auto allocator = rcutils_get_default_allocator();
    ignore(rcl_get_publishers_info_by_topic(&node, &allocator, topic, false, &all));
    for (std::size_t i = 0; i < all.size; ++i) {
        const auto& its = all.info_array[i];
        const std::string space = its.node_namespace;
        told((space == "/" ? "" : space) + "/" + its.node_name, program_of(its.endpoint_gid));
    }
    const auto count = static_cast<int>(all.size);
    ignore(rmw_topic_endpoint_info_array_fini(&all, &allocator));
    return count;
}

} // namespace

void check(rcl_ret_t code, const std::string& what) {
    if (code == RCL_RET_OK) return;
    const std::string why = reason();
    throw std::runtime_error(what +
                             (why.empty() ? " (rcl's code " + std::to_string(code) + ")" : ": " + why));
}

std::string loopback_profile() {
    std::vector<std::string> files{BF_ROS2_PROFILE};
    Dl_info its{}; // an installation, or a package of bf deploy, has it beside the folder of this plugin
    if (dladdr(reinterpret_cast<const void*>(&check), &its) != 0 && its.dli_fname != nullptr) {
        const std::string file = its.dli_fname;
        files.push_back(file.substr(0, file.rfind('/')) + "/../../share/blockfactory/loopback.xml");
    }
    const auto found =
        std::ranges::find_if(files, [](const auto& f) { return access(f.c_str(), R_OK) == 0; });
    return found == files.end() ? "" : *found;
}

Context::Context(const NodeOptions& options) {
    // What goes wrong is told by those who call.
    rcutils_logging_set_output_handler([](auto...) {});
    rcl_init_options_t init = rcl_get_zero_initialized_init_options();
    const auto prepared = rcl_init_options_init(&init, rcl_get_default_allocator());
    const char* const ours =
        prepared == RCL_RET_OK ? rcl_init_options_get_rmw_init_options(&init)->implementation_identifier : "";
    if (is_set(rmw_choice) && std::getenv(rmw_choice) != std::string_view(ours)) {
        ignore(rcl_init_options_fini(&init));
        throw std::runtime_error(std::string(rmw_choice) + " asks for '" + std::getenv(rmw_choice) +
                                 "', which ROS 2 does not have here; unset it");
    }
    check(prepared, "ROS 2 does not begin");
    // Fast DDS ends the program there: ports of a domain begin at 7400 + 250 times its number.
    constexpr std::size_t last_domain = 232;
    std::size_t domain = 0;
    if (rcl_get_default_domain_id(&domain) == RCL_RET_OK && domain != RCL_DEFAULT_DOMAIN_ID &&
        domain > last_domain) {
        ignore(rcl_init_options_fini(&init));
        throw std::runtime_error("ROS_DOMAIN_ID is " + std::to_string(domain) +
                                 "; domains have numbers from 0 to " + std::to_string(last_domain));
    }
    // Others than programs of this computer are found only where the user says so.
    if (!is_set("ROS_AUTOMATIC_DISCOVERY_RANGE") && !is_set("ROS_LOCALHOST_ONLY")) {
        auto& middleware = *rcl_init_options_get_rmw_init_options(&init);
        middleware.discovery_options.automatic_discovery_range =
            give_loopback_profile(middleware.implementation_identifier)
                ? RMW_AUTOMATIC_DISCOVERY_RANGE_SYSTEM_DEFAULT
                : RMW_AUTOMATIC_DISCOVERY_RANGE_LOCALHOST;
    }
    std::vector<const char*> arguments{"blockfactory", "--ros-args"};
    for (const auto& argument : options.arguments) arguments.push_back(argument.c_str());
    const auto begun = rcl_init(static_cast<int>(arguments.size()), arguments.data(), &init, &context);
    const std::string why = begun == RCL_RET_OK ? "" : reason();
    ignore(rcl_init_options_fini(&init));
    if (begun != RCL_RET_OK) {
        ignore(rcl_context_fini(&context));
        throw std::runtime_error("ROS 2 does not begin" + (why.empty() ? "" : ": " + why) +
                                 (has_security()
                                      ? "; ROS_SECURITY_ENABLE asks for keys of this program, which are in "
                                        "ROS_SECURITY_KEYSTORE"
                                      : ""));
    }
    rcl_node_options_t node_options = rcl_node_get_default_options();
    const auto made =
        rcl_node_init(&node, options.name.c_str(), options.name_space.c_str(), &context, &node_options);
    const std::string why_not = made == RCL_RET_OK ? "" : reason();
    ignore(rcl_node_options_fini(&node_options));
    if (made != RCL_RET_OK) {
        ignore(rcl_shutdown(&context));
        ignore(rcl_context_fini(&context));
        throw std::runtime_error("there can be no node '" + options.name + "' in the namespace '" +
                                 options.name_space + "': " + why_not);
    }
}

Context::~Context() {
    ignore(rcl_node_fini(&node));
    ignore(rcl_shutdown(&context));
    ignore(rcl_context_fini(&context));
    rcl_reset_error();
}

double Context::now() const noexcept {
    if (const double told = told_time; told != by_system) return std::max(told, 0.0);
    return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

// ---- what is awaited and sent

Subscription::Subscription(std::shared_ptr<Context> context, const MessageMemory& type,
                           const std::string& topic, const Quality& quality,
                           std::function<void(const void*, std::uint64_t)> taken)
    : context_(std::move(context)), message_(type.make()), taken_(std::move(taken)) {
    auto options = rcl_subscription_get_default_options();
    options.qos = profile_of(quality);
    const std::lock_guard lock(context_->ends);
    check(rcl_subscription_init(&handle_, &context_->node, type.support, topic.c_str(), &options),
          "the topic '" + topic + "' cannot be subscribed to");
}
Subscription::~Subscription() {
    const std::lock_guard lock(context_->ends);
    ignore(rcl_subscription_fini(&handle_, &context_->node));
}
int Subscription::writers() const noexcept {
    std::size_t count = 0;
    ignore(rcl_subscription_get_publisher_count(&handle_, &count));
    return static_cast<int>(count);
}
std::string Subscription::publisher(std::uint64_t program) const {
    std::set<std::string> nodes;
    each_publisher(context_->node, rcl_subscription_get_topic_name(&handle_),
                   [&](const std::string& its, std::uint64_t number) {
                       // A program is known a little before its nodes; rmw_dds_common says so by this name.
                       if (number == program && its.find("_NODE_NAME_UNKNOWN_") == its.npos)
                           nodes.insert(its);
                   });
    std::string text;
    for (const auto& node : nodes) text += (text.empty() ? "" : "' or '") + node;
    return text;
}
void Subscription::add_to(rcl_wait_set_t& set) {
    ignore(rcl_wait_set_add_subscription(&set, &handle_, nullptr));
}
void Subscription::take() {
    rmw_message_info_t info = rmw_get_zero_initialized_message_info();
    while (rcl_take(&handle_, message_.get(), &info, nullptr) == RCL_RET_OK)
        taken_(message_.get(), program_of(info.publisher_gid.data));
    rcl_reset_error();
}

Publisher::Publisher(std::shared_ptr<Context> context, const MessageMemory& type, const std::string& topic,
                     const Quality& quality)
    : context_(std::move(context)) {
    auto options = rcl_publisher_get_default_options();
    options.qos = profile_of(quality);
    const std::lock_guard lock(context_->ends);
    check(rcl_publisher_init(&handle_, &context_->node, type.support, topic.c_str(), &options),
          "the topic '" + topic + "' cannot be published");
}
Publisher::~Publisher() {
    wait_until_heard(0.2);
    while (middleware::now() < last_ + 0.1 && readers() > 0) // by those who acknowledge nothing
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const std::lock_guard lock(context_->ends);
    ignore(rcl_publisher_fini(&handle_, &context_->node));
}
void Publisher::publish(const void* message) noexcept {
    if (rcl_publish(&handle_, message, nullptr) != RCL_RET_OK) rcl_reset_error();
    last_ = middleware::now();
}
void Publisher::wait_until_heard(double longest) const noexcept {
    const auto most = static_cast<rcl_duration_value_t>(std::max(longest, 0.0) * 1e9);
    if (rcl_publisher_wait_for_all_acked(&handle_, most) != RCL_RET_OK) rcl_reset_error();
}
int Publisher::readers() const noexcept {
    std::size_t count = 0;
    ignore(rcl_publisher_get_subscription_count(&handle_, &count));
    return static_cast<int>(count);
}
int Publisher::others() const noexcept {
    std::size_t count = 1;
    ignore(rcl_count_publishers(&context_->node, rcl_publisher_get_topic_name(&handle_), &count));
    return static_cast<int>(count) - 1;
}
std::string Publisher::another() const {
    const std::string own = rcl_node_get_fully_qualified_name(&context_->node);
    std::string other; // which may have our name
    const int count = each_publisher(context_->node, rcl_publisher_get_topic_name(&handle_),
                                     [&](const std::string& its, std::uint64_t) {
                                         if (other.empty() || its != own) other = its;
                                     });
    return count > 1 ? other : "";
}

Service::Service(std::shared_ptr<Context> context, const rosidl_service_type_support_t* support,
                 const std::string& name, std::shared_ptr<void> request, std::shared_ptr<void> response,
                 std::function<void(const void*, void*)> answer)
    : context_(std::move(context)), request_(std::move(request)), response_(std::move(response)),
      answer_(std::move(answer)) {
    const auto options = rcl_service_get_default_options();
    const std::lock_guard lock(context_->ends);
    check(rcl_service_init(&handle_, &context_->node, support, name.c_str(), &options),
          "the service '" + name + "' cannot be offered");
}
Service::~Service() {
    const std::lock_guard lock(context_->ends);
    ignore(rcl_service_fini(&handle_, &context_->node));
}
void Service::add_to(rcl_wait_set_t& set) { ignore(rcl_wait_set_add_service(&set, &handle_, nullptr)); }
void Service::take() {
    rmw_request_id_t caller{};
    while (rcl_take_request(&handle_, &caller, request_.get()) == RCL_RET_OK) {
        answer_(request_.get(), response_.get());
        ignore(rcl_send_response(&handle_, &caller, response_.get()));
    }
    rcl_reset_error();
}

Client::Client(std::shared_ptr<Context> context, const rosidl_service_type_support_t* support,
               const std::string& name, std::shared_ptr<void> response, Answered answered)
    : context_(std::move(context)), response_(std::move(response)), answered_(std::move(answered)) {
    const auto options = rcl_client_get_default_options();
    const std::lock_guard lock(context_->ends);
    check(rcl_client_init(&handle_, &context_->node, support, name.c_str(), &options),
          "the service '" + name + "' cannot be called");
}
Client::~Client() {
    const std::lock_guard lock(context_->ends);
    ignore(rcl_client_fini(&handle_, &context_->node));
}
bool Client::has_server() const noexcept {
    bool has = false;
    ignore(rcl_service_server_is_available(&context_->node, &handle_, &has));
    return has;
}
std::int64_t Client::call(const void* request) noexcept {
    std::int64_t number = 0;
    const auto code = rcl_send_request(&handle_, request, &number);
    ignore(code);
    return code == RCL_RET_OK ? number : 0;
}
void Client::add_to(rcl_wait_set_t& set) { ignore(rcl_wait_set_add_client(&set, &handle_, nullptr)); }
void Client::take() {
    rmw_request_id_t its{};
    while (rcl_take_response(&handle_, &its, response_.get()) == RCL_RET_OK)
        answered_(response_.get(), its.sequence_number);
    rcl_reset_error();
}

// ---- the node

void Node::open() {
    if (context_) return;
    context_ = std::make_shared<Context>(options_);
    auto guard = rcl_guard_condition_get_default_options();
    check(rcl_guard_condition_init(&changed_, &context_->context, guard), "ROS 2 does not begin");
    const auto& args = options_.arguments;
    if (std::find(args.begin(), args.end(), "use_sim_time:=true") != args.end()) {
        context_->told_time = Context::awaited;
        clock_ = subscribe(messages::clock(), "/clock", {1, false},
                           [context = context_](const void* message, std::uint64_t) {
                               context->told_time =
                                   messages::seconds(static_cast<const messages::Clock*>(message)->clock);
                           });
    }
    goes_on_ = true;
    waiting_ = std::thread([this] { wait(); });
    outbox_.open();
}

void Node::close() noexcept {
    if (!context_) return;
    outbox_.close(); // while answers to what it sends are waited for
    goes_on_ = false;
    ignore(rcl_trigger_guard_condition(&changed_));
    if (waiting_.joinable()) waiting_.join();
    clock_.reset();
    awaited_.clear();
    ignore(rcl_guard_condition_fini(&changed_));
    changed_ = rcl_get_zero_initialized_guard_condition();
    context_.reset();
}

std::string Node::resolve(const std::string& topic) const {
    char* name = nullptr;
    const auto allocator = rcutils_get_default_allocator();
    check(rcl_node_resolve_name(&context_->node, topic.c_str(), allocator, false, false, &name),
          "'" + topic + "' is no topic");
    std::string whole = name;
    allocator.deallocate(name, allocator.state);
    return whole;
}

template <class T> std::shared_ptr<T> Node::awaited(std::shared_ptr<T> entity) {
    {
        const std::lock_guard lock(mutex_);
        awaited_.push_back(entity);
        ++changes_;
    }
    ignore(rcl_trigger_guard_condition(&changed_));
    return entity;
}

std::shared_ptr<Subscription> Node::subscribe(const MessageMemory& type, const std::string& topic,
                                              const Quality& quality,
                                              std::function<void(const void*, std::uint64_t)> taken) {
    return awaited(std::make_shared<Subscription>(context_, type, topic, quality, std::move(taken)));
}

std::shared_ptr<Publisher> Node::advertise(const MessageMemory& type, const std::string& topic,
                                           const Quality& quality) const {
    return std::make_shared<Publisher>(context_, type, topic, quality);
}

std::shared_ptr<Service> Node::serve(const rosidl_service_type_support_t* support, const std::string& name,
                                     std::shared_ptr<void> request, std::shared_ptr<void> response,
                                     std::function<void(const void*, void*)> answer) {
    return awaited(std::make_shared<Service>(context_, support, name, std::move(request), std::move(response),
                                             std::move(answer)));
}

std::shared_ptr<Client> Node::client(const rosidl_service_type_support_t* support, const std::string& name,
                                     std::shared_ptr<void> response, Client::Answered answered) {
    return awaited(
        std::make_shared<Client>(context_, support, name, std::move(response), std::move(answered)));
}

void Node::wait() {
    std::vector<std::shared_ptr<Awaited>> all;
    rcl_wait_set_t set = rcl_get_zero_initialized_wait_set();
    for (std::uint64_t seen = 0; goes_on_;) {
        const bool has_left =
            std::any_of(all.begin(), all.end(), [](const auto& each) { return each.use_count() == 1; });
        if (seen != changes_ || has_left) {
            all.clear(); // those that nobody else has end here
            {
                const std::lock_guard lock(mutex_);
                seen = changes_;
                all = middleware::alive(awaited_);
            }
            // A call that comes behind a message is answered behind it.
            std::ranges::stable_sort(all, {}, [](const auto& each) { return each->kind(); });
            const auto of = [&](Awaited::Kind kind) {
                return static_cast<std::size_t>(
                    std::ranges::count(all, kind, [](const auto& each) { return each->kind(); }));
            };
            ignore(rcl_wait_set_fini(&set));
            if (rcl_wait_set_init(&set, of(Awaited::Kind::message), 1, 0, of(Awaited::Kind::answer),
                                  of(Awaited::Kind::call), 0, &context_->context,
                                  rcl_get_default_allocator()) != RCL_RET_OK)
                return;
        }
        ignore(rcl_wait_set_clear(&set));
        ignore(rcl_wait_set_add_guard_condition(&set, &changed_, nullptr));
        for (const auto& each : all) each->add_to(set);
        if (rcl_wait(&set, 100'000'000) == RCL_RET_OK)
            for (const auto& each : all) each->take();
        rcl_reset_error();
    }
    ignore(rcl_wait_set_fini(&set));
}

} // namespace bf::ros2
