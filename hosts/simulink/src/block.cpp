#include "block.hpp"

#include "bf/blocks/standard.hpp"
#include "bf/core/resolve.hpp"
#include "mx_value.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <stdexcept>

namespace bf::simulink {

namespace {

using boundary::PositionalValue;
using Goal = PositionalValue::Goal;

constexpr const char* standard = "standard"; // what people call the library without a name
constexpr int steps_work = 0, crossings_work = 1, first_state_work = 2;

/// All classes that models of this process have asked for; a plugin stays loaded with the S-function.
class Classes {
  public:
    static Classes& instance() {
        static Classes only;
        return only;
    }
    const BlockClass& find(const std::string& library, const std::string& name) {
        return registry_.find(library.empty() || library == standard ? name : library + "/" + name);
    }
    const std::vector<PositionalValue>& values(const BlockClass& type) {
        const auto known = values_.find(&type);
        if (known != values_.end()) return known->second;
        return values_[&type] = boundary::positional_values(type);
    }

  private:
    Classes() { registry_.add(standard_library()); }
    Registry registry_;
    std::map<const BlockClass*, std::vector<PositionalValue>> values_;
};

std::string text_parameter(SimStruct* S, int index, const char* what) {
    const Value value = value_of(ssGetSFcnParam(S, index));
    if (value.kind != Value::Kind::text)
        throw std::runtime_error("parameter " + std::to_string(index + 1) + " is the block's " + what +
                                 " and must be a text, not " + value.describe());
    return value.text;
}

/// Parameter `index`, or the field of it that is meant.
Value parameter(SimStruct* S, const PositionalValue& wanted) {
    const auto& name = wanted.metadata.name;
    try {
        const mxArray* array = ssGetSFcnParam(S, static_cast<int>(wanted.metadata.index));
        if (mxIsStruct(array)) {
            if (mxGetNumberOfElements(array) != 1)
                throw std::runtime_error("is an array of structs; give one");
            array = mxGetField(array, 0, name.c_str());
            if (!array) throw std::runtime_error("is not among the fields of its struct");
        }
        Value value = value_of(array);
        // MATLAB writes an empty list like an empty matrix.
        if (wanted.initial.kind == Value::Kind::texts && value.kind == Value::Kind::number &&
            value.data.empty())
            value = Value(std::vector<std::string>{});
        return value;
    } catch (const std::exception& error) {
        throw std::runtime_error("parameter '" + name + "' " + error.what());
    }
}

std::string signature(const BlockClass& type, const std::vector<PositionalValue>& values) {
    std::string text = "'" + type.name + "', '" + (type.library.empty() ? standard : type.library) + "'";
    unsigned last = 1;
    for (const auto& value : values) {
        if (value.metadata.index == last) continue; // a further field of one struct
        last = value.metadata.index;
        text += ", " + value.metadata.name;
    }
    return text;
}

DTypeId simulink_type(Type type) {
    switch (type) {
    case Type::float64: return SS_DOUBLE;
    case Type::float32: return SS_SINGLE;
    case Type::int8: return SS_INT8;
    case Type::uint8: return SS_UINT8;
    case Type::int16: return SS_INT16;
    case Type::uint16: return SS_UINT16;
    case Type::int32: return SS_INT32;
    case Type::uint32: return SS_UINT32;
    case Type::boolean: return SS_BOOLEAN;
    }
    return SS_DOUBLE;
}

Type own_type(DTypeId id) {
    for (int i = 0; i < type_count; ++i)
        if (simulink_type(static_cast<Type>(i)) == id) return static_cast<Type>(i);
    throw std::runtime_error("a port has a type that is not built in; insert a Data Type Conversion");
}

} // namespace

Prototype::Prototype(SimStruct* S) {
    const int given = ssGetSFcnParamsCount(S);
    if (given < 2) throw std::runtime_error("it needs at least two parameters: 'Class', 'Library'");
    const std::string name = text_parameter(S, 0, "class"), library = text_parameter(S, 1, "library");
    type_ = &Classes::instance().find(library, name);
    values_ = &Classes::instance().values(*type_);
    parameter_count_ = values_->empty() ? 2 : static_cast<int>(values_->back().metadata.index) + 1;
    if (given != parameter_count_)
        throw std::runtime_error("it has " + std::to_string(given) + " parameters, but takes " +
                                 std::to_string(parameter_count_) + ": " + signature(*type_, *values_));
    std::vector<std::pair<const PositionalValue*, Value>> numbers;
    for (const auto& wanted : *values_) {
        Value value = parameter(S, wanted);
        if (wanted.goal == Goal::argument) {
            arguments.emplace_back(wanted.name, std::move(value));
        } else if (wanted.goal == Goal::period) {
            period = value.data[0];
            if (value.data.size() > 1) offset = value.data[1];
            if (value.data.size() > 2 || !(period >= 0 || period == INHERITED_SAMPLE_TIME) ||
                std::isinf(period))
                throw std::runtime_error("sample_time must be -1 (inherited), 0 (continuous), a period, or "
                                         "[period offset], not " +
                                         value.describe());
        } else {
            numbers.emplace_back(&wanted, std::move(value));
        }
    }
    instance_ = std::make_unique<Instance>(*type_, arguments);
    const auto& d = declaration();
    for (auto& [wanted, value] : numbers) {
        const int index = d.find(wanted->name, Role::parameter);
        if (index < 0) continue; // these arguments switch it off
        instance_->give(index, value);
        parameters.emplace_back(index, std::move(value));
    }
    give_defaults(instance_->block().resolution());
    for (std::size_t i = 0; i < d.slots.size(); ++i) {
        if (d.slots[i].role == Role::input) inputs.push_back(static_cast<int>(i));
        if (d.slots[i].role == Role::output) outputs.push_back(static_cast<int>(i));
    }
    bindings = Scope::instance().bind(ssGetPath(S), instance_->block());
}

bool Prototype::is_tunable(int parameter) const {
    return std::any_of(values_->begin(), values_->end(), [&](const auto& value) {
        return value.goal == Goal::parameter && static_cast<int>(value.metadata.index) == parameter;
    });
}

bool Prototype::feeds_through(int input) const {
    if (outputs.empty()) return slot(input).feedthrough;
    return std::any_of(outputs.begin(), outputs.end(),
                       [&](int output) { return instance_->block().feedthrough(output, input); });
}

bool Prototype::has(Role role) const {
    const auto& slots = declaration().slots;
    return std::any_of(slots.begin(), slots.end(), [&](const auto& s) { return s.role == role; });
}

bool Prototype::has_state() const {
    return has(Role::discrete_state) || !declaration().objects.empty() || type_->methods.update;
}

double Prototype::period_of_steps(SimStruct* S) const {
    const double sample_time = ssGetSampleTime(S, 0);
    if (sample_time > 0 && std::isfinite(sample_time)) return sample_time;
    return has(Role::continuous_state) || ssIsVariableStepSolver(S) ? 0 : ssGetFixedStepSize(S);
}

void Prototype::learn(SimStruct* S) {
    if (std::any_of(bindings.begin(), bindings.end(), [](const auto& b) { return !b.provider; })) return;
    // What the block itself provides is the object that its users see, and may tell sizes of its ports.
    const auto self = Scope::instance().find(ssGetPath(S));
    for (std::size_t k = 0; self && k < declaration().provisions.size(); ++k)
        instance_->share(static_cast<int>(k), Scope::instance().description(*self, k),
                         [self, k] { return Scope::instance().open(*self, k); });
    propagate(instance_->block());
    const auto hear = [&](int slot, int dimensions, const int_T* lengths, DTypeId type) {
        if (dimensions > 0)
            instance_->wire(slot, Size{lengths[0], dimensions == 2 ? lengths[1] : 1, dimensions == 2});
        if (type != DYNAMICALLY_TYPED) instance_->wire(slot, own_type(type));
    };
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const int port = static_cast<int>(i);
        const bool is_known = ssGetInputPortWidth(S, port) != DYNAMICALLY_SIZED;
        hear(inputs[i], is_known ? ssGetInputPortNumDimensions(S, port) : 0,
             ssGetInputPortDimensions(S, port), ssGetInputPortDataType(S, port));
    }
    for (std::size_t i = 0; i < outputs.size(); ++i) {
        const int port = static_cast<int>(i);
        const bool is_known = ssGetOutputPortWidth(S, port) != DYNAMICALLY_SIZED;
        hear(outputs[i], is_known ? ssGetOutputPortNumDimensions(S, port) : 0,
             ssGetOutputPortDimensions(S, port), ssGetOutputPortDataType(S, port));
    }
}

void Prototype::set_port(SimStruct* S, bool is_input, int port, int index) const {
    const Slot& slot = this->slot(index);
    const int width = is_input ? ssGetInputPortWidth(S, port) : ssGetOutputPortWidth(S, port);
    if (slot.size_known && width == DYNAMICALLY_SIZED) {
        const Size size = slot.size;
        if (size.count() <= 0)
            throw std::runtime_error(std::string(name(slot.role)) + " '" + slot.name +
                                     "' is empty; Simulink has no such signals");
        if (is_input && size.is_matrix)
            ssSetInputPortMatrixDimensions(S, port, size.rows, size.cols);
        else if (is_input)
            ssSetInputPortVectorDimension(S, port, size.rows);
        else if (size.is_matrix)
            ssSetOutputPortMatrixDimensions(S, port, size.rows, size.cols);
        else
            ssSetOutputPortVectorDimension(S, port, size.rows);
    }
    const auto known = instance_->resolution().type_of(index);
    if (!known) return;
    const DTypeId type = simulink_type(*known);
    if (is_input)
        ssSetInputPortDataType(S, port, type);
    else
        ssSetOutputPortDataType(S, port, type);
}

void Prototype::tell(SimStruct* S) const {
    for (std::size_t i = 0; i < inputs.size(); ++i) set_port(S, true, static_cast<int>(i), inputs[i]);
    for (std::size_t i = 0; i < outputs.size(); ++i) set_port(S, false, static_cast<int>(i), outputs[i]);
}

void Prototype::require_providers() const {
    for (std::size_t i = 0; i < bindings.size(); ++i)
        if (!bindings[i].provider)
            throw std::runtime_error("it needs a " + declaration().requirements[i].type +
                                     ": put a block that provides one into its subsystem or one around it");
}

// ---- a run

void Running::declare_work(SimStruct* S, const Prototype& prototype) {
    std::vector<const Slot*> states;
    int continuous = 0, crossings = 0;
    for (const Slot& slot : prototype.instance().resolution().slots) {
        if (slot.role == Role::continuous_state) continuous += slot.size.count();
        if (slot.role == Role::guard) crossings += slot.size.count();
        if (slot.role == Role::discrete_state && slot.size.count() > 0) states.push_back(&slot);
    }
    if (continuous > 0) ssSetNumContStates(S, continuous);
    ssSetNumNonsampledZCs(S, crossings);
    ssSetNumPWork(S, pointers_work);
    if (!ssSetNumDWork(S, first_state_work + static_cast<int>(states.size()))) return;
    const auto declare = [&](int i, int width, DTypeId type, const char* name, bool is_state) {
        ssSetDWorkWidth(S, i, width);
        ssSetDWorkDataType(S, i, type);
        ssSetDWorkName(S, i, const_cast<char_T*>(name)); // documented so, and only kept
        ssSetDWorkUsedAsDState(S, i, is_state);
    };
    static std::set<std::string> names; // Simulink keeps the pointer
    declare(steps_work, 1, SS_DOUBLE, "bf_steps", false);
    declare(crossings_work, std::max(1, crossings), SS_DOUBLE, "bf_crossings", false);
    for (std::size_t i = 0; i < states.size(); ++i)
        declare(first_state_work + static_cast<int>(i), states[i]->size.count(),
                simulink_type(states[i]->type), names.insert(states[i]->name).first->c_str(), true);
}

Running::Running(SimStruct* S) : prototype_(S) {
    prototype_.require_providers();
    prototype_.learn(S);
    Instance& block = instance();
    block.settle();
    for (std::size_t i = 0; i < prototype_.bindings.size(); ++i) {
        const Scope::Binding& from = prototype_.bindings[i];
        block.require(static_cast<int>(i), block.resolution().required[i],
                      [from] { return Scope::instance().open(*from.provider, from.provision); });
    }
    const auto port_is_wired = [&](int slot) {
        const auto port = std::find(prototype_.inputs.begin(), prototype_.inputs.end(), slot);
        return ssGetInputPortConnected(S, static_cast<int>(port - prototype_.inputs.begin()));
    };
    block.open(port_is_wired);

    for (const int slot : prototype_.inputs) {
        const bool keeps_default = prototype_.slot(slot).optional && !port_is_wired(slot);
        input_ports_.push_back({keeps_default ? nullptr : block.data(slot), block.bytes_of(slot),
                                prototype_.feeds_through(slot)});
    }
    for (const int slot : prototype_.outputs)
        output_ports_.push_back({block.data(slot), block.bytes_of(slot), false});
    for (int i = 0; i < static_cast<int>(block.resolution().slots.size()); ++i) {
        const Slot& slot = block.slot(i);
        auto* data = static_cast<double*>(block.data(i));
        for (int e = 0; e < slot.size.count(); ++e) {
            if (slot.role == Role::continuous_state) continuous_.emplace_back(data + e, block.rate(i) + e);
            if (slot.role == Role::guard)
                crossings_.push_back(
                    {reinterpret_cast<std::byte*>(data) +
                         static_cast<std::size_t>(e) * static_cast<std::size_t>(bytes(slot.type)),
                     slot.type});
        }
        if (slot.role == Role::discrete_state && slot.size.count() > 0)
            discrete_.push_back({data, block.bytes_of(i), false});
    }
}

void Running::run(Phase phase) {
    if (const Status status = instance().run(phase); !status) throw std::runtime_error(status.text());
}

void Running::take_clock(SimStruct* S) {
    const double* steps = static_cast<const double*>(ssGetDWork(S, steps_work));
    instance().clock() = {ssGetT(S), prototype_.period_of_steps(S), static_cast<std::int64_t>(*steps)};
}

void Running::take_inputs(SimStruct* S, bool only_feedthrough) {
    for (std::size_t i = 0; i < input_ports_.size(); ++i) {
        const Port& port = input_ports_[i];
        if (port.memory && (port.feeds_through || !only_feedthrough))
            std::memcpy(port.memory, ssGetInputPortSignal(S, static_cast<int>(i)), port.bytes);
    }
}

void Running::take_states(SimStruct* S) {
    for (std::size_t i = 0; i < discrete_.size(); ++i)
        std::memcpy(discrete_[i].memory, ssGetDWork(S, first_state_work + static_cast<int>(i)),
                    discrete_[i].bytes);
    const double* states = continuous_.empty() ? nullptr : ssGetContStates(S);
    for (const auto& [state, rate] : continuous_) *state = *states++;
}

void Running::give_states(SimStruct* S) {
    for (std::size_t i = 0; i < discrete_.size(); ++i)
        std::memcpy(ssGetDWork(S, first_state_work + static_cast<int>(i)), discrete_[i].memory,
                    discrete_[i].bytes);
    double* states = continuous_.empty() ? nullptr : ssGetContStates(S);
    for (const auto& [state, rate] : continuous_) *states++ = *state;
}

void Running::reset(SimStruct* S) {
    auto* steps = static_cast<double*>(ssGetDWork(S, steps_work));
    if (!has_started_) *steps = 0;
    auto* crossings = static_cast<double*>(ssGetDWork(S, crossings_work));
    std::fill_n(crossings, std::max<std::size_t>(1, crossings_.size()), 0.0);
    take_clock(S);
    if (const Status status = instance().reset(); !status) throw std::runtime_error(status.text());
    give_states(S);
    if (has_started_) return;
    instance().start();
    has_started_ = true;
}

void Running::output(SimStruct* S) {
    take_clock(S);
    take_inputs(S, true);
    take_states(S);
    run(Phase::output);
    if (ssIsMajorTimeStep(S) && !crossings_.empty() && cross(S) &&
        instance().block().answers(prototype_.type().methods)) {
        if (const Status status = instance().event(); !status) throw std::runtime_error(status.text());
        give_states(S);
        if (!continuous_.empty()) ssSetSolverNeedsReset(S);
        run(Phase::output);
    }
    for (std::size_t i = 0; i < output_ports_.size(); ++i)
        std::memcpy(ssGetOutputPortSignal(S, static_cast<int>(i)), output_ports_[i].memory,
                    output_ports_[i].bytes);
}

/// Which guards changed sign since the step before? The guards then hold +1, -1 or 0.
bool Running::cross(SimStruct* S) {
    run(Phase::guards);
    auto* last = static_cast<double*>(ssGetDWork(S, crossings_work));
    bool any = false;
    for (std::size_t i = 0; i < crossings_.size(); ++i) {
        const double now = crossings_[i].sign();
        const double direction = last[i] < 0 && now >= 0 ? 1 : last[i] > 0 && now <= 0 ? -1 : 0;
        any = any || direction != 0;
        last[i] = now;
        if (crossings_[i].type == Type::float64) *static_cast<double*>(crossings_[i].data) = direction;
    }
    return any;
}

void Running::update(SimStruct* S) {
    take_clock(S);
    take_inputs(S, false);
    take_states(S);
    run(Phase::update);
    instance().commit();
    give_states(S);
    ++*static_cast<double*>(ssGetDWork(S, steps_work));
}

void Running::derivative(SimStruct* S) {
    take_clock(S);
    take_inputs(S, false);
    take_states(S);
    run(Phase::derivative);
    double* rates = ssGetdX(S);
    for (const auto& [state, rate] : continuous_) *rates++ = *rate;
}

void Running::zero_crossings(SimStruct* S) {
    take_clock(S);
    take_inputs(S, false);
    take_states(S);
    run(Phase::guards);
    double* values = ssGetNonsampledZCs(S);
    for (const auto& crossing : crossings_) *values++ = crossing.sign();
}

void Running::check_parameters(const Prototype& changed) const {
    for (const auto& [slot, value] : changed.parameters) {
        const int count = prototype_.slot(slot).size.count();
        if (value.data.size() != 1 && static_cast<int>(value.data.size()) != count)
            throw std::runtime_error("parameter '" + prototype_.slot(slot).name + "' must keep its " +
                                     std::to_string(count) + " elements while the model runs, not have " +
                                     std::to_string(value.data.size()));
        if (const auto wrong = outside_limits(prototype_.slot(slot), value.data); !wrong.empty())
            throw std::runtime_error(wrong);
    }
}

void Running::take_parameters(const Prototype& changed) {
    for (const auto& [index, value] : changed.parameters) {
        const Slot& slot = prototype_.slot(index);
        write_values(instance().data(index), slot.type, slot.size.count(), value.data);
    }
}

mxArray* Running::save(SimStruct* S) {
    if (instance().context().refuses_snapshot() >= 0)
        throw std::runtime_error("its state lies outside and cannot be saved");
    take_clock(S);
    take_states(S);
    mxArray* state = mxCreateNumericMatrix(instance().context().snapshot_size(), 1, mxUINT8_CLASS, mxREAL);
    instance().context().save(static_cast<std::byte*>(mxGetData(state)));
    return state;
}

void Running::restore(SimStruct* S, const mxArray* state) {
    if (mxGetClassID(state) != mxUINT8_CLASS ||
        mxGetNumberOfElements(state) != instance().context().snapshot_size())
        throw std::runtime_error("the saved state is of another block or of other sizes");
    instance().context().restore(static_cast<const std::byte*>(mxGetData(state)));
    *static_cast<double*>(ssGetDWork(S, steps_work)) = static_cast<double>(instance().clock().step);
    give_states(S);
}

} // namespace bf::simulink
