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

bool knows_type(const Declaration& d, const Slot& slot) {
    return slot.type_symbol < 0 || d.types[static_cast<std::size_t>(slot.type_symbol)].known;
}
Type type_of_slot(const Declaration& d, const Slot& slot) {
    return slot.type_symbol < 0 ? slot.type : d.types[static_cast<std::size_t>(slot.type_symbol)].type;
}

std::size_t bytes_of(const Slot& slot) {
    return static_cast<std::size_t>(slot.size.count()) * static_cast<std::size_t>(bytes(slot.type));
}

/// What drives the inputs of a block that runs alone: outputs that the S-function fills.
struct Wires final : Block {
    explicit Wires(const std::vector<Slot>& inputs) {
        for (Slot slot : inputs) {
            slot.role = Role::output;
            slot.type_symbol = slot.shape.symbol = -1;
            declaration().slots.push_back(std::move(slot));
        }
    }
};

/// Stands for a provider that another S-function is.
struct Borrowed final : Block {
    Borrowed(const Scope::Binding& binding, const std::string& type) {
        auto& d = declaration();
        const auto open = [binding](const void*) {
            Object shared = Scope::instance().open(*binding.provider, binding.provision);
            return Object{shared.pointer, {}, {}, {}, false}; // its provider saves it
        };
        d.provisions.push_back({type, {}, open, {}});
        ObjectDeclaration object;
        object.provision = 0;
        d.objects.push_back(std::move(object));
    }
};

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
        } else if (value.kind != Value::Kind::number || value.data.empty()) {
            throw std::runtime_error("parameter '" + wanted.name + "' must be a number, not " +
                                     value.describe());
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
    block_ = type_->make(arguments);
    auto& d = declaration();
    std::string problems;
    for (const auto& problem : d.problems) problems += (problems.empty() ? "" : "; ") + problem;
    if (!problems.empty()) throw std::runtime_error(problems);
    for (auto& [wanted, value] : numbers) {
        const int index = d.find(wanted->name, Role::parameter);
        if (index < 0) continue; // these arguments switch it off
        if (const auto wrong = outside_limits(d.slots[static_cast<std::size_t>(index)], value.data);
            !wrong.empty())
            throw std::runtime_error(wrong);
        try {
            give(d, index, value);
        } catch (const ResolutionError& error) {
            throw std::runtime_error("parameter '" + wanted->name + "' does not fit: " + error.what());
        }
        parameters.emplace_back(index, std::move(value));
    }
    give_defaults(d);
    for (std::size_t i = 0; i < d.slots.size(); ++i) {
        if (d.slots[i].role == Role::input) inputs.push_back(static_cast<int>(i));
        if (d.slots[i].role == Role::output) outputs.push_back(static_cast<int>(i));
    }
    bindings = Scope::instance().bind(ssGetPath(S), d);
}

bool Prototype::is_tunable(int parameter) const {
    return std::any_of(values_->begin(), values_->end(), [&](const auto& value) {
        return value.goal == Goal::parameter && static_cast<int>(value.metadata.index) == parameter;
    });
}

bool Prototype::feeds_through(int input) const {
    if (outputs.empty()) return slot(input).feedthrough;
    return std::any_of(outputs.begin(), outputs.end(),
                       [&](int output) { return block_->feedthrough(output, input); });
}

bool Prototype::has(Role role) const {
    const auto& slots = declaration().slots;
    return std::any_of(slots.begin(), slots.end(), [&](const Slot& s) { return s.role == role; });
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
    auto& d = declaration();
    propagate(*block_);
    const auto hear = [&](int slot, int dimensions, const int_T* lengths, DTypeId type) {
        if (dimensions > 0)
            offer(d, slot, Size{lengths[0], dimensions == 2 ? lengths[1] : 1, dimensions == 2});
        if (type != DYNAMICALLY_TYPED) offer(d, slot, own_type(type));
        propagate(*block_);
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

void Prototype::set_port(SimStruct* S, bool is_input, int port, const Slot& slot) const {
    const auto& d = declaration();
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
    if (!knows_type(d, slot)) return;
    const DTypeId type = simulink_type(type_of_slot(d, slot));
    if (is_input)
        ssSetInputPortDataType(S, port, type);
    else
        ssSetOutputPortDataType(S, port, type);
}

void Prototype::tell(SimStruct* S) const {
    for (std::size_t i = 0; i < inputs.size(); ++i) set_port(S, true, static_cast<int>(i), slot(inputs[i]));
    for (std::size_t i = 0; i < outputs.size(); ++i)
        set_port(S, false, static_cast<int>(i), slot(outputs[i]));
}

void Prototype::decide_sizes() {
    auto& d = declaration();
    for (const auto& [index, value] : parameters)
        if (!slot(index).size_known) { // one number, for which nothing else expands
            offer(d, index, Size{1, 1, slot(index).shape.is_matrix});
            propagate(*block_);
        }
    for (const Slot& state : d.slots) {
        if (state.size_known || state.initial_from < 0) continue;
        const Slot& initial = slot(state.initial_from);
        for (const int input : inputs)
            if (initial.size_known && !slot(input).size_known &&
                (initial.size.is_scalar() ||
                 (state.shape.symbol >= 0 && slot(input).shape.symbol == state.shape.symbol))) {
                offer(d, input, initial.size);
                propagate(*block_);
            }
    }
    for (const auto* ports : {&inputs, &outputs})
        for (const int port : *ports)
            if (!slot(port).size_known) {
                offer(d, port, Size{});
                propagate(*block_);
            }
}

void Prototype::decide_types() {
    auto& d = declaration();
    for (std::size_t i = 0; i < d.slots.size(); ++i)
        if (!knows_type(d, d.slots[i])) {
            offer(d, static_cast<int>(i), Type::float64);
            propagate(*block_);
        }
}

void Prototype::require_providers() const {
    for (std::size_t i = 0; i < bindings.size(); ++i)
        if (!bindings[i].provider)
            throw std::runtime_error("it needs a " + declaration().requirements[i].type +
                                     ": put a block that provides one into its subsystem or one around it");
}

void Prototype::require_resolved() const {
    const auto open = unresolved(declaration());
    if (open.empty()) return;
    const Slot& s = slot(open[0]);
    throw std::runtime_error(
        std::string("the size of ") + name(s.role) + " '" + s.name +
        "' cannot be found from the wiring; connect the block, or give a parameter of the "
        "wanted size");
}

// ---- a run

void Running::declare_work(SimStruct* S, const Prototype& prototype) {
    std::vector<const Slot*> states;
    int continuous = 0, crossings = 0;
    for (const Slot& slot : prototype.declaration().slots) {
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
    prototype_.decide_sizes();
    prototype_.decide_types();
    prototype_.require_resolved();
    check_parameters(prototype_);
    auto& d = prototype_.declaration();

    // Node 0 is the block, node 1 drives its wired inputs, the others stand for its providers.
    std::vector<Slot> wired;
    std::vector<Node> nodes(2);
    nodes[0].block = prototype_.block().get();
    nodes[0].methods = prototype_.type().methods;
    nodes[0].sources.resize(d.slots.size());
    std::vector<int> drivers(prototype_.inputs.size(), -1);
    for (std::size_t i = 0; i < prototype_.inputs.size(); ++i) {
        const int slot = prototype_.inputs[i];
        if (d.slots[static_cast<std::size_t>(slot)].optional &&
            !ssGetInputPortConnected(S, static_cast<int>(i)))
            continue; // it keeps its declared value
        drivers[i] = static_cast<int>(wired.size());
        nodes[0].sources[static_cast<std::size_t>(slot)] = {1, drivers[i]};
        wired.push_back(d.slots[static_cast<std::size_t>(slot)]);
    }
    wires_ = std::make_unique<Wires>(wired);
    nodes[1].block = wires_.get();
    for (std::size_t i = 0; i < prototype_.bindings.size(); ++i) {
        borrowed_.push_back(std::make_unique<Borrowed>(prototype_.bindings[i], d.requirements[i].type));
        nodes[0].providers.push_back({static_cast<int>(nodes.size()), 0});
        nodes.push_back({borrowed_.back().get(), {}, {}, {}, 0});
    }
    // What the block itself provides is the object that its users see.
    if (!d.provisions.empty()) {
        const auto self = Scope::instance().find(ssGetPath(S));
        for (std::size_t k = 0; self && k < d.provisions.size(); ++k) {
            d.provisions[k].made = Scope::instance().description(*self, k);
            d.provisions[k].open = [self, k](const void*) { return Scope::instance().open(*self, k); };
        }
    }
    context_ = std::make_unique<Context>(nodes);

    for (std::size_t i = 0; i < prototype_.inputs.size(); ++i)
        input_ports_.push_back({drivers[i] < 0 ? nullptr : context_->data(1, drivers[i]),
                                bytes_of(prototype_.slot(prototype_.inputs[i])),
                                prototype_.feeds_through(prototype_.inputs[i])});
    for (const int slot : prototype_.outputs)
        output_ports_.push_back({context_->data(0, slot), bytes_of(prototype_.slot(slot)), false});
    for (std::size_t i = 0; i < d.slots.size(); ++i) {
        const Slot& slot = d.slots[i];
        const int index = static_cast<int>(i);
        auto* data = static_cast<double*>(context_->data(0, index));
        for (int e = 0; e < slot.size.count(); ++e) {
            if (slot.role == Role::continuous_state)
                continuous_.emplace_back(data + e, static_cast<double*>(context_->frame(0).rate[i]) + e);
            if (slot.role == Role::guard)
                crossings_.push_back(
                    {reinterpret_cast<std::byte*>(data) +
                         static_cast<std::size_t>(e) * static_cast<std::size_t>(bytes(slot.type)),
                     slot.type});
        }
        if (slot.role == Role::discrete_state && slot.size.count() > 0)
            discrete_.push_back({data, bytes_of(slot), false});
    }
    const auto bind = [&](Phase phase, std::vector<Task>& tasks) {
        for (int i = 0; i < context_->activities(0, phase); ++i) tasks.push_back(context_->task(0, phase, i));
    };
    bind(Phase::output, outputs_);
    bind(Phase::update, updates_);
    bind(Phase::derivative, derivatives_);
    bind(Phase::guards, guards_);
}

Running::~Running() {
    if (has_started_) context_->stop(0);
}

void Running::run(const std::vector<Task>& tasks) {
    for (const Task& task : tasks)
        if (const Status status = task(); !status) throw std::runtime_error(status.text());
}

void Running::take_clock(SimStruct* S) {
    const double* steps = static_cast<const double*>(ssGetDWork(S, steps_work));
    context_->clock(0) = {ssGetT(S), prototype_.period_of_steps(S), static_cast<std::int64_t>(*steps)};
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
    if (const Status status = context_->reset(0); !status) throw std::runtime_error(status.text());
    give_states(S);
    if (has_started_) return;
    context_->start(0);
    has_started_ = true;
}

void Running::output(SimStruct* S) {
    take_clock(S);
    take_inputs(S, true);
    take_states(S);
    run(outputs_);
    if (ssIsMajorTimeStep(S) && !crossings_.empty() && cross(S) && prototype_.type().methods.event) {
        if (const Status status = context_->event(0); !status) throw std::runtime_error(status.text());
        give_states(S);
        if (!continuous_.empty()) ssSetSolverNeedsReset(S);
        run(outputs_);
    }
    for (std::size_t i = 0; i < output_ports_.size(); ++i)
        std::memcpy(ssGetOutputPortSignal(S, static_cast<int>(i)), output_ports_[i].memory,
                    output_ports_[i].bytes);
}

/// Which guards changed sign since the step before? The guards then hold +1, -1 or 0.
bool Running::cross(SimStruct* S) {
    run(guards_);
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
    run(updates_);
    context_->commit(0);
    give_states(S);
    ++*static_cast<double*>(ssGetDWork(S, steps_work));
}

void Running::derivative(SimStruct* S) {
    take_clock(S);
    take_inputs(S, false);
    take_states(S);
    run(derivatives_);
    double* rates = ssGetdX(S);
    for (const auto& [state, rate] : continuous_) *rates++ = *rate;
}

void Running::zero_crossings(SimStruct* S) {
    take_clock(S);
    take_inputs(S, false);
    take_states(S);
    run(guards_);
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
        write_values(context_->data(0, index), slot.type, slot.size.count(), value.data);
    }
}

mxArray* Running::save(SimStruct* S) {
    if (context_->refuses_snapshot() >= 0)
        throw std::runtime_error("its state lies outside and cannot be saved");
    take_clock(S);
    take_states(S);
    mxArray* state = mxCreateNumericMatrix(context_->snapshot_size(), 1, mxUINT8_CLASS, mxREAL);
    context_->save(static_cast<std::byte*>(mxGetData(state)));
    return state;
}

void Running::restore(SimStruct* S, const mxArray* state) {
    if (mxGetClassID(state) != mxUINT8_CLASS || mxGetNumberOfElements(state) != context_->snapshot_size())
        throw std::runtime_error("the saved state is of another block or of other sizes");
    context_->restore(static_cast<const std::byte*>(mxGetData(state)));
    *static_cast<double*>(ssGetDWork(S, steps_work)) = static_cast<double>(context_->clock(0).step);
    give_states(S);
}

} // namespace bf::simulink
