#include "parameters.hpp"

#include "messages.hpp"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <rcl_interfaces/msg/floating_point_range.h>
#include <rcl_interfaces/msg/integer_range.h>
#include <rcl_interfaces/msg/parameter.h>
#include <rcl_interfaces/msg/parameter_descriptor.h>
#include <rcl_interfaces/msg/parameter_event.h>
#include <rcl_interfaces/msg/parameter_type.h>
#include <rcl_interfaces/msg/parameter_value.h>
#include <rcl_interfaces/msg/set_parameters_result.h>
#include <rcl_interfaces/srv/describe_parameters.h>
#include <rcl_interfaces/srv/get_parameter_types.h>
#include <rcl_interfaces/srv/get_parameters.h>
#include <rcl_interfaces/srv/list_parameters.h>
#include <rcl_interfaces/srv/set_parameters.h>
#include <rcl_interfaces/srv/set_parameters_atomically.h>
#include <rosidl_runtime_c/primitives_sequence_functions.h>
#include <set>
#include <stdexcept>

namespace bf::ros2 {

namespace {

using messages::assign;
using messages::text;
using middleware::ParameterSource;
using middleware::ServedParameter;
using Kind = ServedParameter::Kind;
using Result = rcl_interfaces__msg__SetParametersResult;
using Given = rcl_interfaces__msg__Parameter;
using Value = rcl_interfaces__msg__ParameterValue;

/// As rcl_interfaces/msg/ParameterType numbers them.
const char* const type_names[] = {"none",         "bool",        "integer",    "double",
                                  "string",       "byte_array",  "bool_array", "integer_array",
                                  "double_array", "string_array"};

std::string name_of(std::uint8_t type) { return type < std::size(type_names) ? type_names[type] : "unknown"; }

enum Type : std::uint8_t {
    truth = rcl_interfaces__msg__ParameterType__PARAMETER_BOOL,
    whole = rcl_interfaces__msg__ParameterType__PARAMETER_INTEGER,
    real = rcl_interfaces__msg__ParameterType__PARAMETER_DOUBLE,
    truths = rcl_interfaces__msg__ParameterType__PARAMETER_BOOL_ARRAY,
    wholes = rcl_interfaces__msg__ParameterType__PARAMETER_INTEGER_ARRAY,
    reals = rcl_interfaces__msg__ParameterType__PARAMETER_DOUBLE_ARRAY
};

Type type_of(const ServedParameter& parameter) {
    switch (parameter.kind) {
    case Kind::truth: return parameter.is_scalar ? truth : truths;
    case Kind::whole: return parameter.is_scalar ? whole : wholes;
    case Kind::real: break;
    }
    return parameter.is_scalar ? real : reals;
}

/// Of this size, with elements as they are made.
#define BF_RENEW(type)                                                                                       \
    void renew(type##__Sequence& sequence, std::size_t size) {                                               \
        type##__Sequence__fini(&sequence);                                                                   \
        if (!type##__Sequence__init(&sequence, size)) throw std::bad_alloc();                                \
    }
BF_RENEW(rcl_interfaces__msg__FloatingPointRange)
BF_RENEW(rcl_interfaces__msg__IntegerRange)
BF_RENEW(rcl_interfaces__msg__Parameter)
BF_RENEW(rcl_interfaces__msg__ParameterDescriptor)
BF_RENEW(rcl_interfaces__msg__ParameterValue)
BF_RENEW(rcl_interfaces__msg__SetParametersResult)
BF_RENEW(rosidl_runtime_c__boolean)
BF_RENEW(rosidl_runtime_c__double)
BF_RENEW(rosidl_runtime_c__int64)
BF_RENEW(rosidl_runtime_c__uint8)
#undef BF_RENEW

template <class Sequence> void copy(const std::vector<double>& from, Sequence& to) {
    renew(to, from.size());
    std::transform(from.begin(), from.end(), to.data,
                   [](double x) { return static_cast<std::remove_reference_t<decltype(*to.data)>>(x); });
}

void write(const ServedParameter& parameter, Value& to) {
    to.type = type_of(parameter);
    const auto& values = parameter.values;
    switch (to.type) {
    case truth: to.bool_value = values[0] != 0; break;
    case whole: to.integer_value = static_cast<std::int64_t>(values[0]); break;
    case real: to.double_value = values[0]; break;
    case truths: copy(values, to.bool_array_value); break;
    case wholes: copy(values, to.integer_array_value); break;
    default: copy(values, to.double_array_value);
    }
}

/// Whole numbers are real ones, too; nothing else stands for another type.
std::vector<double> read(const ServedParameter& parameter, const Value& from) {
    const Type type = type_of(parameter);
    const bool is_real = parameter.kind == Kind::real;
    if (from.type != type && !(is_real && from.type == (parameter.is_scalar ? whole : wholes)))
        throw std::runtime_error("'" + parameter.name + "' is of type " + name_of(type) + ", and is given " +
                                 name_of(from.type));
    const auto all = [](const auto& sequence) {
        return std::vector<double>(sequence.data, sequence.data + sequence.size);
    };
    switch (from.type) {
    case truth: return {from.bool_value ? 1.0 : 0.0};
    case whole: return {static_cast<double>(from.integer_value)};
    case real: return {from.double_value};
    case truths: return all(from.bool_array_value);
    case wholes: return all(from.integer_array_value);
    default: return all(from.double_array_value);
    }
}

void describe(const ServedParameter& parameter, rcl_interfaces__msg__ParameterDescriptor& to) {
    to.type = type_of(parameter);
    to.read_only = !parameter.fixed.empty();
    assign(to.description, parameter.doc);
    assign(to.additional_constraints, to.read_only ? parameter.fixed : parameter.limits);
    if (std::isinf(parameter.minimum) && std::isinf(parameter.maximum)) return;
    if (parameter.kind == Kind::real) {
        renew(to.floating_point_range, 1);
        to.floating_point_range.data[0].from_value = std::max(parameter.minimum, -DBL_MAX);
        to.floating_point_range.data[0].to_value = std::min(parameter.maximum, DBL_MAX);
    } else if (parameter.kind == Kind::whole) {
        constexpr double most = 9007199254740992; // a parameter is a double
        renew(to.integer_range, 1);
        to.integer_range.data[0].from_value = static_cast<std::int64_t>(std::max(parameter.minimum, -most));
        to.integer_range.data[0].to_value = static_cast<std::int64_t>(std::min(parameter.maximum, most));
    }
}

class Parameters final : public middleware::ServedParameters {
  public:
    Parameters(ParameterSource& source, const NodeOptions& options)
        : source_(source),
          full_name_((options.name_space == "/" ? "" : options.name_space) + "/" + options.name),
          node_(options) {
        node_.open();
        static const MessageMemory event_type{
            ROSIDL_GET_MSG_TYPE_SUPPORT(rcl_interfaces, msg, ParameterEvent), [] {
                return messages::memory(rcl_interfaces__msg__ParameterEvent__create,
                                        rcl_interfaces__msg__ParameterEvent__destroy);
            }};
        event_ = messages::make<rcl_interfaces__msg__ParameterEvent>(event_type);
        assign(event_->node, full_name_);
        events_ = node_.advertise(event_type, "/parameter_events", {1000});
#define BF_OFFER(type, name, function)                                                                       \
    services_.push_back(                                                                                     \
        node_.serve(ROSIDL_GET_SRV_TYPE_SUPPORT(rcl_interfaces, srv, type), "~/" name,                       \
                    messages::memory(rcl_interfaces__srv__##type##_Request__create,                          \
                                     rcl_interfaces__srv__##type##_Request__destroy),                        \
                    messages::memory(rcl_interfaces__srv__##type##_Response__create,                         \
                                     rcl_interfaces__srv__##type##_Response__destroy),                       \
                    [this](const void* request, void* response) {                                            \
                        function(*static_cast<const rcl_interfaces__srv__##type##_Request*>(request),        \
                                 *static_cast<rcl_interfaces__srv__##type##_Response*>(response));           \
                    }))
        BF_OFFER(ListParameters, "list_parameters", list);
        BF_OFFER(GetParameters, "get_parameters", get);
        BF_OFFER(GetParameterTypes, "get_parameter_types", types);
        BF_OFFER(DescribeParameters, "describe_parameters", describe_all);
        BF_OFFER(SetParameters, "set_parameters", set);
        BF_OFFER(SetParametersAtomically, "set_parameters_atomically", set_atomically);
#undef BF_OFFER
    }
    ~Parameters() override { node_.close(); }

  private:
    using All = std::vector<ServedParameter>;

    /// Null: there is none of that name.
    static const ServedParameter* find(const All& all, const std::string& name) {
        const auto found = std::ranges::find(all, name, &ServedParameter::name);
        return found == all.end() ? nullptr : &*found;
    }
    /// Calls `take(parameter, i)` for each of the names that there is.
    template <class F> void each(const rosidl_runtime_c__String__Sequence& names, F&& take) {
        const All all = source_.parameters();
        for (std::size_t i = 0; i < names.size; ++i)
            if (const auto* parameter = find(all, text(names.data[i]))) take(*parameter, i);
    }

    void list(const rcl_interfaces__srv__ListParameters_Request& request,
              rcl_interfaces__srv__ListParameters_Response& response) {
        std::vector<std::string> names;
        std::set<std::string> prefixes;
        const auto depth_of = [](std::string_view name) {
            return static_cast<std::uint64_t>(std::ranges::count(name, '.'));
        };
        // Of depth 0 is what has no separator behind the prefix; 0 asked for means any depth.
        const auto is_asked = [&](const std::string& name) {
            const auto& asked = request.prefixes;
            const std::uint64_t depth = request.depth;
            if (asked.size == 0) return depth == 0 || depth_of(name) < depth;
            return std::any_of(asked.data, asked.data + asked.size, [&](const auto& its) {
                const std::string prefix = text(its);
                if (name == prefix) return true;
                return name.starts_with(prefix + ".") &&
                       (depth == 0 || depth_of(std::string_view(name).substr(prefix.size() + 1)) < depth);
            });
        };
        for (const auto& parameter : source_.parameters()) {
            if (!is_asked(parameter.name)) continue;
            names.push_back(parameter.name);
            if (const auto dot = parameter.name.rfind('.'); dot != std::string::npos)
                prefixes.insert(parameter.name.substr(0, dot));
        }
        assign(response.result.names, names);
        assign(response.result.prefixes, {prefixes.begin(), prefixes.end()});
    }
    void get(const rcl_interfaces__srv__GetParameters_Request& request,
             rcl_interfaces__srv__GetParameters_Response& response) {
        renew(response.values, request.names.size); // of type none where there is no such parameter
        each(request.names, [&](const auto& its, std::size_t i) { write(its, response.values.data[i]); });
    }
    void types(const rcl_interfaces__srv__GetParameterTypes_Request& request,
               rcl_interfaces__srv__GetParameterTypes_Response& response) {
        renew(response.types, request.names.size);
        each(request.names, [&](const auto& its, std::size_t i) { response.types.data[i] = type_of(its); });
    }
    void describe_all(const rcl_interfaces__srv__DescribeParameters_Request& request,
                      rcl_interfaces__srv__DescribeParameters_Response& response) {
        renew(response.descriptors, request.names.size);
        for (std::size_t i = 0; i < request.names.size; ++i)
            assign(response.descriptors.data[i].name, text(request.names.data[i]));
        each(request.names,
             [&](const auto& its, std::size_t i) { describe(its, response.descriptors.data[i]); });
    }
    void set(const rcl_interfaces__srv__SetParameters_Request& request,
             rcl_interfaces__srv__SetParameters_Response& response) {
        renew(response.results, request.parameters.size);
        for (std::size_t i = 0; i < request.parameters.size; ++i)
            change(&request.parameters.data[i], 1, response.results.data[i]);
    }
    void set_atomically(const rcl_interfaces__srv__SetParametersAtomically_Request& request,
                        rcl_interfaces__srv__SetParametersAtomically_Response& response) {
        change(request.parameters.data, request.parameters.size, response.result);
    }

    /// All or none.
    void change(const Given* given, std::size_t count, Result& result) {
        try {
            const All before = source_.parameters();
            ParameterSource::Values values;
            for (std::size_t i = 0; i < count; ++i) {
                const std::string name = text(given[i].name);
                const auto* parameter = find(before, name);
                if (!parameter)
                    throw std::runtime_error("there is no parameter '" + name + "'; list_parameters has all");
                if (!parameter->fixed.empty())
                    throw std::runtime_error("'" + name +
                                             "' is fixed while the model runs: " + parameter->fixed);
                values.emplace_back(name, read(*parameter, given[i].value));
            }
            if (count > 0) source_.set(values);
            result.successful = true;
            assign(result.reason, std::string());
            tell(before, source_.parameters());
        } catch (const std::runtime_error& error) {
            result.successful = false;
            assign(result.reason, std::string(error.what()));
        }
    }
    /// Also of those that follow from those that were set.
    void tell(const All& before, const All& after) {
        std::vector<const ServedParameter*> changed;
        for (std::size_t i = 0; i < after.size(); ++i)
            if (i >= before.size() || before[i].values != after[i].values) changed.push_back(&after[i]);
        if (changed.empty()) return;
        event_->stamp = messages::time_of(node_.context()->now());
        renew(event_->changed_parameters, changed.size());
        for (std::size_t i = 0; i < changed.size(); ++i) {
            assign(event_->changed_parameters.data[i].name, changed[i]->name);
            write(*changed[i], event_->changed_parameters.data[i].value);
        }
        events_->publish(event_.get());
    }

    ParameterSource& source_;
    const std::string full_name_;
    std::shared_ptr<rcl_interfaces__msg__ParameterEvent> event_;
    std::shared_ptr<Publisher> events_;
    std::vector<std::shared_ptr<Service>> services_;
    Node node_;
};

} // namespace

std::unique_ptr<middleware::ServedParameters> serve_parameters(ParameterSource& source,
                                                               const NodeOptions& node) {
    return std::make_unique<Parameters>(source, node);
}

} // namespace bf::ros2
