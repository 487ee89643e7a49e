#include "simstruct/model.hpp"

#include "simstruct.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace simstruct {

Model::Model(const SimStructMethods& methods, double step, Solver solver)
    : methods_(methods), step_size_(step), solver_(solver) {}

Model::~Model() {
    try {
        terminate();
    } catch (const Error&) { // nobody can hear it here
    }
}

void Model::call(SimStruct& block, const char* name, auto&& f) {
    block.phase = name;
    block.calls.emplace_back(name);
    f();
    block.phase.clear();
    if (!block.forbidden.empty()) throw Error(block.path + ": not allowed: " + block.forbidden.front());
    if (block.has_error) throw Error(block.error);
}

int Model::add(const std::string& path, std::vector<mxArray*> parameters) {
    blocks_.push_back(std::make_unique<SimStruct>());
    blocks_.back()->path = path;
    blocks_.back()->parameters = std::move(parameters);
    blocks_.back()->step_size = step_size_;
    return static_cast<int>(blocks_.size()) - 1;
}

int Model::add_input(int rows, int cols, DTypeId type) {
    const int index = add("input", {});
    SimStruct& source = *blocks_.back();
    source.is_source = true;
    source.outputs.resize(1);
    source.outputs[0].dims = cols ? std::vector<int_T>{rows, cols} : std::vector<int_T>{rows};
    source.outputs[0].type = type;
    source.outputs[0].own.resize(static_cast<std::size_t>(source.outputs[0].width() * bytes_of(type)));
    return index;
}

void Model::connect(int from, int from_port, int to, int to_port) {
    wires_.push_back({from, from_port, to, to_port});
}

/// Sizes and types travel along the wires until nothing moves.
void Model::spread() {
    const auto text = [](const std::vector<int_T>& dims) {
        std::string list;
        for (const int n : dims) list += (list.empty() ? "" : "x") + std::to_string(n);
        return "[" + list + "]";
    };
    for (bool moved = true; moved;) {
        moved = false;
        for (const Wire& wire : wires_) {
            SimStruct &a = *blocks_[static_cast<std::size_t>(wire.from)],
                      &b = *blocks_[static_cast<std::size_t>(wire.to)];
            auto& from = a.outputs.at(static_cast<std::size_t>(wire.from_port));
            auto& to = b.inputs.at(static_cast<std::size_t>(wire.to_port));
            if (from.dims.empty() != to.dims.empty()) {
                std::vector<int_T> dims = from.dims.empty() ? to.dims : from.dims;
                int width = 1;
                for (const int n : dims) width *= n;
                const DimsInfo_T info = {width, static_cast<int_T>(dims.size()), dims.data()};
                if (to.dims.empty())
                    call(b, "mdlSetInputPortDimensionInfo",
                         [&] { methods_.set_input_port_dimension_info(&b, wire.to_port, &info); });
                else
                    call(a, "mdlSetOutputPortDimensionInfo",
                         [&] { methods_.set_output_port_dimension_info(&a, wire.from_port, &info); });
                if (from.dims.empty() || to.dims.empty())
                    throw Error((to.dims.empty() ? b : a).path + ": it did not take the size of its port");
                moved = true;
            }
            if (!from.dims.empty() && from.dims != to.dims)
                throw Error(b.path + ": input port " + std::to_string(wire.to_port + 1) + " has size " +
                            text(to.dims) + " but is driven by " + text(from.dims));
            if ((from.type == DYNAMICALLY_TYPED) != (to.type == DYNAMICALLY_TYPED)) {
                if (to.type == DYNAMICALLY_TYPED)
                    call(b, "mdlSetInputPortDataType",
                         [&] { methods_.set_input_port_data_type(&b, wire.to_port, from.type); });
                else
                    call(a, "mdlSetOutputPortDataType",
                         [&] { methods_.set_output_port_data_type(&a, wire.from_port, to.type); });
                moved = true;
            }
            if (from.type != to.type)
                throw Error(b.path + ": input port " + std::to_string(wire.to_port + 1) + " has type " +
                            std::to_string(to.type) + " but is driven by " + std::to_string(from.type));
        }
    }
}

/// Blocks after those whose outputs they read in the same step.
void Model::sort() {
    std::vector<int> state(blocks_.size());
    order_.clear();
    const std::function<void(int)> visit = [&](int block) {
        int& mark = state[static_cast<std::size_t>(block)];
        if (mark == 2) return;
        if (mark == 1)
            throw Error(blocks_[static_cast<std::size_t>(block)]->path + ": it is in an algebraic loop");
        mark = 1;
        for (const Wire& wire : wires_)
            if (wire.to == block && blocks_[static_cast<std::size_t>(block)]
                                        ->inputs[static_cast<std::size_t>(wire.to_port)]
                                        .feedthrough)
                visit(wire.from);
        mark = 2;
        order_.push_back(block);
    };
    for (std::size_t i = 0; i < blocks_.size(); ++i) visit(static_cast<int>(i));
}

void Model::compile() {
    const auto each = [&](auto&& f) {
        for (auto& block : blocks_)
            if (!block->is_source) f(*block);
    };
    each([&](SimStruct& b) { call(b, "mdlInitializeSizes", [&] { methods_.initialize_sizes(&b); }); });
    each([&](SimStruct& b) {
        if (b.wanted_parameters != static_cast<int>(b.parameters.size()))
            throw Error(b.path + ": it wants " + std::to_string(b.wanted_parameters) +
                        " parameters and has " + std::to_string(b.parameters.size()));
    });
    for (const Wire& wire : wires_) {
        auto& inputs = blocks_[static_cast<std::size_t>(wire.to)]->inputs;
        if (wire.to_port >= static_cast<int>(inputs.size()) ||
            wire.from_port >= static_cast<int>(blocks_[static_cast<std::size_t>(wire.from)]->outputs.size()))
            throw Error(blocks_[static_cast<std::size_t>(wire.to)]->path +
                        ": a wire ends at a port that is not there");
        inputs[static_cast<std::size_t>(wire.to_port)].connected = true;
    }
    spread();
    const auto is_open = [](const SimStruct& b) {
        const auto open = [](const auto& port) { return port.dims.empty(); };
        return std::any_of(b.inputs.begin(), b.inputs.end(), open) ||
               std::any_of(b.outputs.begin(), b.outputs.end(), open);
    };
    each([&](SimStruct& b) {
        if (!is_open(b)) return;
        call(b, "mdlSetDefaultPortDimensionInfo", [&] { methods_.set_default_port_dimension_info(&b); });
        spread();
        if (is_open(b)) throw Error(b.path + ": the size of a port is still open");
    });
    each([&](SimStruct& b) {
        call(b, "mdlInitializeSampleTimes", [&] { methods_.initialize_sample_times(&b); });
    });
    // Inherited: continuous behind what is continuous, unless it asks for major steps only; else the base
    // step.
    for (bool moved = true; moved;) {
        moved = false;
        for (const Wire& wire : wires_) {
            SimStruct& b = *blocks_[static_cast<std::size_t>(wire.to)];
            if (b.sample_time != INHERITED_SAMPLE_TIME || b.offset == FIXED_IN_MINOR_STEP_OFFSET ||
                blocks_[static_cast<std::size_t>(wire.from)]->sample_time != CONTINUOUS_SAMPLE_TIME)
                continue;
            b.sample_time = CONTINUOUS_SAMPLE_TIME;
            moved = true;
        }
    }
    each([&](SimStruct& b) {
        if (b.sample_time == INHERITED_SAMPLE_TIME) b.sample_time = step_size_;
        if (b.offset == FIXED_IN_MINOR_STEP_OFFSET) b.offset = 0;
    });
    each([&](SimStruct& b) {
        const auto open = [](const auto& port) { return port.type == DYNAMICALLY_TYPED; };
        if (std::none_of(b.inputs.begin(), b.inputs.end(), open) &&
            std::none_of(b.outputs.begin(), b.outputs.end(), open))
            return;
        call(b, "mdlSetDefaultPortDataTypes", [&] { methods_.set_default_port_data_types(&b); });
        spread();
        if (std::any_of(b.inputs.begin(), b.inputs.end(), open) ||
            std::any_of(b.outputs.begin(), b.outputs.end(), open))
            throw Error(b.path + ": the type of a port is still open");
    });
    each([&](SimStruct& b) { call(b, "mdlSetWorkWidths", [&] { methods_.set_work_widths(&b); }); });
    sort();

    // Memory of signals, states and work; what nothing drives is grounded.
    for (auto& block : blocks_) {
        for (const int count :
             {block->wanted_states, block->wanted_pointers, block->wanted_crossings, block->wanted_work})
            if (count == DYNAMICALLY_SIZED)
                throw Error(block->path + ": a number of its states or work vectors is still open");
        block->states.assign(static_cast<std::size_t>(block->wanted_states), 0);
        block->rates = block->states;
        block->pointers.assign(static_cast<std::size_t>(block->wanted_pointers), nullptr);
        for (auto* ports : {&block->inputs, &block->outputs})
            for (auto& port : *ports) {
                port.own.assign(static_cast<std::size_t>(port.width() * bytes_of(port.type)), std::byte{});
                port.signal = port.own.data();
            }
        for (auto& work : block->work)
            work.memory.assign(static_cast<std::size_t>(work.width * bytes_of(work.type)), std::byte{});
    }
    for (const Wire& wire : wires_)
        blocks_[static_cast<std::size_t>(wire.to)]->inputs[static_cast<std::size_t>(wire.to_port)].signal =
            blocks_[static_cast<std::size_t>(wire.from)]
                ->outputs[static_cast<std::size_t>(wire.from_port)]
                .own.data();
}

void Model::start() {
    steps_ = 0;
    for (const int i : order_) {
        SimStruct& b = *blocks_[static_cast<std::size_t>(i)];
        if (b.is_source) continue;
        b.was_started = true;
        b.time = 0;
        if (methods_.start) call(b, "mdlStart", [&] { methods_.start(&b); });
    }
    for (const int i : order_)
        if (!blocks_[static_cast<std::size_t>(i)]->is_source) reset(i);
}

void Model::reset(int block) {
    SimStruct& b = *blocks_[static_cast<std::size_t>(block)];
    call(b, "mdlInitializeConditions", [&] { methods_.initialize_conditions(&b); });
}

void Model::outputs_of(SimStruct& b) {
    call(b, "mdlOutputs", [&] { methods_.outputs(&b, 0); });
}

void Model::step() {
    const double time = static_cast<double>(steps_) * step_size_;
    const auto is_hit = [&](const SimStruct& b) {
        if (b.sample_time == CONTINUOUS_SAMPLE_TIME) return true;
        const long period = std::lround(b.sample_time / step_size_),
                   offset = std::lround(b.offset / step_size_);
        return (steps_ - offset) % period == 0;
    };
    const auto each_hit = [&](auto&& f) {
        for (const int i : order_)
            if (SimStruct& b = *blocks_[static_cast<std::size_t>(i)]; !b.is_source && is_hit(b)) f(b);
    };
    for (auto& block : blocks_) block->time = time;
    each_hit([&](SimStruct& b) { outputs_of(b); });
    each_hit([&](SimStruct& b) {
        if (methods_.update) call(b, "mdlUpdate", [&] { methods_.update(&b, 0); });
    });
    integrate();
    each_hit([&](SimStruct& b) {
        if (!b.zero_crossings.empty()) call(b, "mdlZeroCrossings", [&] { methods_.zero_crossings(&b); });
    });
    ++steps_;
}

void Model::derive(std::vector<std::vector<double>>& rates) {
    rates.clear();
    for (auto& block : blocks_) {
        if (!block->states.empty())
            call(*block, "mdlDerivatives", [&] { methods_.derivatives(block.get()); });
        rates.push_back(block->rates);
    }
}

void Model::integrate() {
    if (std::all_of(blocks_.begin(), blocks_.end(), [](const auto& b) { return b->states.empty(); })) return;
    std::vector<std::vector<double>> begin, k1, k;
    for (auto& block : blocks_) begin.push_back(block->states);
    const double t = static_cast<double>(steps_) * step_size_, h = step_size_;
    const auto minor = [&](double dt, const std::vector<std::vector<double>>& rates) {
        for (std::size_t i = 0; i < blocks_.size(); ++i) {
            blocks_[i]->time = t + dt;
            blocks_[i]->is_major = false;
            for (std::size_t e = 0; e < begin[i].size(); ++e)
                blocks_[i]->states[e] = begin[i][e] + dt * rates[i][e];
        }
        for (const int i : order_)
            if (SimStruct& b = *blocks_[static_cast<std::size_t>(i)];
                !b.is_source && b.sample_time == CONTINUOUS_SAMPLE_TIME)
                outputs_of(b);
    };
    derive(k1);
    std::vector<std::vector<double>> sum = k1;
    if (solver_ == Solver::runge_kutta_4) {
        const auto add = [&](double weight) {
            for (std::size_t i = 0; i < sum.size(); ++i)
                for (std::size_t e = 0; e < sum[i].size(); ++e) sum[i][e] += weight * k[i][e];
        };
        minor(h / 2, k1);
        derive(k);
        add(2);
        minor(h / 2, k);
        derive(k);
        add(2);
        minor(h, k);
        derive(k);
        add(1);
        for (auto& rates : sum)
            for (double& rate : rates) rate /= 6;
    }
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
        blocks_[i]->is_major = true;
        for (std::size_t e = 0; e < begin[i].size(); ++e) blocks_[i]->states[e] = begin[i][e] + h * sum[i][e];
    }
}

void Model::change(int block, int parameter, mxArray* value) {
    SimStruct& b = *blocks_[static_cast<std::size_t>(block)];
    auto& array = b.parameters.at(static_cast<std::size_t>(parameter));
    if (b.tunable.at(static_cast<std::size_t>(parameter)) == SS_PRM_NOT_TUNABLE) {
        mxDestroyArray(value);
        throw Error(b.path + ": parameter " + std::to_string(parameter + 1) + " cannot change in a run");
    }
    std::swap(array, value);
    try {
        call(b, "mdlCheckParameters", [&] { methods_.check_parameters(&b); });
    } catch (const Error&) { // the dialog keeps the old value
        std::swap(array, value);
        mxDestroyArray(value);
        ssSetErrorStatus(&b, nullptr);
        throw;
    }
    mxDestroyArray(value);
    call(b, "mdlProcessParameters", [&] { methods_.process_parameters(&b); });
}

mxArray* Model::save(int block) {
    SimStruct& b = *blocks_[static_cast<std::size_t>(block)];
    mxArray* state = nullptr;
    call(b, "mdlGetSimState", [&] { state = methods_.get_sim_state(&b); });
    return state;
}

void Model::restore(int block, const mxArray* state) {
    SimStruct& b = *blocks_[static_cast<std::size_t>(block)];
    call(b, "mdlSetSimState", [&] { methods_.set_sim_state(&b, state); });
}

std::vector<std::vector<Setting>> Model::rtw(int block) {
    SimStruct& b = *blocks_[static_cast<std::size_t>(block)];
    b.settings.clear();
    call(b, "mdlRTW", [&] { methods_.rtw(&b); });
    return b.settings;
}

void Model::terminate() {
    std::string error;
    for (auto& block : blocks_) {
        if (block->is_source) continue;
        block->has_error = false;
        try {
            call(*block, "mdlTerminate", [&] { methods_.terminate(block.get()); });
        } catch (const Error& problem) {
            error = problem.what();
        }
        block->was_started = false;
    }
    if (!error.empty()) throw Error(error);
}

double Model::time() const { return static_cast<double>(steps_) * step_size_; }
void* Model::input(int source) { return blocks_[static_cast<std::size_t>(source)]->outputs[0].own.data(); }
const void* Model::output(int block, int port) const {
    return blocks_[static_cast<std::size_t>(block)]->outputs.at(static_cast<std::size_t>(port)).own.data();
}
int Model::inputs(int block) const {
    return static_cast<int>(blocks_[static_cast<std::size_t>(block)]->inputs.size());
}
int Model::outputs(int block) const {
    return static_cast<int>(blocks_[static_cast<std::size_t>(block)]->outputs.size());
}
std::vector<int> Model::output_dimensions(int block, int port) const {
    return blocks_[static_cast<std::size_t>(block)]->outputs.at(static_cast<std::size_t>(port)).dims;
}
DTypeId Model::output_type(int block, int port) const {
    return blocks_[static_cast<std::size_t>(block)]->outputs.at(static_cast<std::size_t>(port)).type;
}
bool Model::feeds_through(int block, int port) const {
    return blocks_[static_cast<std::size_t>(block)]->inputs.at(static_cast<std::size_t>(port)).feedthrough;
}
bool Model::is_tunable(int block, int parameter) const {
    return blocks_[static_cast<std::size_t>(block)]->tunable.at(static_cast<std::size_t>(parameter)) !=
           SS_PRM_NOT_TUNABLE;
}
std::vector<std::string> Model::state_names(int block) const {
    std::vector<std::string> names;
    for (const auto& work : blocks_[static_cast<std::size_t>(block)]->work)
        if (work.is_state) names.push_back(work.name);
    return names;
}
const void* Model::state(int block, const std::string& name) const {
    for (const auto& work : blocks_[static_cast<std::size_t>(block)]->work)
        if (work.name == name) return work.memory.data();
    throw Error("there is no state '" + name + "'");
}
std::vector<double>& Model::continuous_states(int block) {
    return blocks_[static_cast<std::size_t>(block)]->states;
}
const std::vector<std::string>& Model::warnings(int block) const {
    return blocks_[static_cast<std::size_t>(block)]->warnings;
}
const std::vector<std::pair<std::string, int>>& Model::pointer_names(int block) const {
    return blocks_[static_cast<std::size_t>(block)]->pointer_names;
}
const std::vector<std::string>& Model::calls(int block) const {
    return blocks_[static_cast<std::size_t>(block)]->calls;
}

} // namespace simstruct
