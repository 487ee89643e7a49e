#include "bf/boundary/as_legacy_block.hpp"

#include "BlockFactory/Core/BlockInformation.h"
#include "BlockFactory/Core/Log.h"
#include "BlockFactory/Core/Signal.h"
#include "bf/core/context.hpp"
#include "bf/core/resolve.hpp"
#include "data_type.hpp"
#include "host_information.hpp"
#include "log_capture.hpp"

#include <algorithm>
#include <cstring>
#include <dlfcn.h>
#include <stdexcept>

namespace bf::boundary {

namespace core = blockfactory::core;

struct AsLegacyBlock::Instance {
    struct Port {
        int slot;
        void* memory; // of the context
        std::size_t bytes;
        DataType type;
    };
    // The block comes first, providers follow: node i of the context is block i.
    std::vector<const BlockClass*> classes;
    std::vector<std::unique_ptr<bf::Block>> blocks;
    std::vector<Node::End> providers;
    double period = 0;
    std::vector<Port> inputs, outputs;
    std::unique_ptr<Context> context;
    std::vector<Task> output_tasks, update_tasks;

    ~Instance() {
        if (context) stop();
    }
    void stop() {
        for (std::size_t i = blocks.size(); i-- > 0;) context->stop(static_cast<int>(i));
        context.reset();
    }
    Declaration& declaration() const { return blocks[0]->declaration(); }
};

namespace {

using Goal = PositionalValue::Goal;

/// The value as the engine stored it, a scalar or a vector. A matrix comes column by column and has as many
/// columns as its default.
Value read(const core::Parameters& parameters, const PositionalValue& wanted) {
    const core::ParameterMetadata& metadata = wanted.metadata;
    LogCapture quiet; // the first of two tries may fail
    Value value;
    if (is_text(metadata.type)) {
        std::string text;
        if (parameters.getParameter(metadata.name, text))
            return metadata.type == core::ParameterType::STRING ? Value(text)
                                                                : Value(std::vector<std::string>{text});
        value = Value(std::vector<std::string>{});
        if (parameters.getParameter(metadata.name, value.texts)) return value;
    } else {
        double x = 0;
        if (parameters.getParameter(metadata.name, x))
            value = Value(x);
        else if (!parameters.getParameter(metadata.name, value.data))
            throw std::runtime_error("the engine gave no value for parameter '" + metadata.name + "'");
        const int count = static_cast<int>(value.data.size());
        const int cols = wanted.initial.rows > 1 ? wanted.initial.cols : count;
        value.rows = count == 0 ? 0 : count / cols;
        value.cols = cols;
        if (value.rows * cols != count)
            throw std::runtime_error("parameter '" + metadata.name + "' has " + std::to_string(count) +
                                     " elements, which do not make " + std::to_string(cols) + " columns");
        if (metadata.type == core::ParameterType::BOOL) value.type = Type::boolean;
        return value;
    }
    throw std::runtime_error("the engine gave no value for parameter '" + metadata.name + "'");
}

core::Port::Dimensions dimensions(const Declaration& d, const Slot& slot) {
    const auto length = [&](const Extent& extent) {
        if (extent.dim < 0) return extent.plus;
        const int value = d.dims[static_cast<std::size_t>(extent.dim)].value;
        return value < 0 ? core::Port::DynamicSize : value + extent.plus;
    };
    if (slot.size_known) {
        if (slot.size.is_matrix) return {slot.size.rows, slot.size.cols};
        return {slot.size.rows};
    }
    if (slot.shape.symbol >= 0) return {core::Port::DynamicSize};
    if (slot.shape.is_matrix) return {length(slot.shape.rows), length(slot.shape.cols)};
    return {length(slot.shape.rows)};
}

/// The size of a port as a native signal. Engines give vectors as {n} or as {1, n}.
Size size_of(const core::Port::Info& port, const Slot& slot) {
    const bool is_row = port.dimension.size() == 2 && port.dimension[0] == 1;
    const bool is_matrix =
        slot.shape.symbol >= 0 ? port.dimension.size() == 2 && !is_row : slot.shape.is_matrix;
    const int count = width(port);
    if (count <= 0)
        throw std::runtime_error("the size of a port is still open when the block is initialised");
    if (!is_matrix) return {count, 1, false};
    if (port.dimension.size() == 2) return {port.dimension[0], port.dimension[1], true};
    return {count, 1, true};
}

} // namespace

AsLegacyBlock::AsLegacyBlock(std::shared_ptr<const Library> library, std::string name)
    : library_(std::move(library)), name_(std::move(name)) {}
AsLegacyBlock::~AsLegacyBlock() = default;

template <class F> bool AsLegacyBlock::guarded(const char* call, F&& f) noexcept {
    try {
        f();
        return true;
    } catch (const std::exception& error) {
        bfError << "plugin '" << library_->name() << "', block '" << name_ << "', " << call << ": "
                << error.what();
    } catch (...) {
        bfError << "plugin '" << library_->name() << "', block '" << name_ << "', " << call
                << ": unknown exception";
    }
    return false;
}

const BlockClass& AsLegacyBlock::find(const std::string& name) const {
    for (const auto& block_class : library_->classes())
        if (block_class.name == name) return block_class;
    throw std::runtime_error("the plugin lists no block of that name");
}

/// The classes of a block and of the blocks that provide what it requires. A provider has no ports: it
/// describes something and needs not run.
static std::vector<const BlockClass*> classes_for(const Library& library, const BlockClass& block_class,
                                                  const Declaration& declaration) {
    std::vector<const BlockClass*> classes{&block_class};
    for (const auto& requirement : declaration.requirements) {
        const BlockClass* provider = nullptr;
        for (const auto& candidate : library.classes()) {
            const auto block = candidate.make({});
            const auto& d = block->declaration();
            if (d.provisions.size() == 1 && d.provisions[0].type == requirement.type && d.slots.empty())
                provider = &candidate;
        }
        if (!provider)
            throw std::runtime_error("it requires a " + requirement.type +
                                     ", which only a block of a native diagram around it can provide");
        classes.push_back(provider);
    }
    return classes;
}

std::vector<const BlockClass*> AsLegacyBlock::classes() const {
    const BlockClass& own = find(name_);
    return classes_for(*library_, own, own.make({})->declaration());
}

std::vector<PositionalValue> AsLegacyBlock::parameters() const {
    const auto all = classes();
    return positional_values(*all[0], {all.begin() + 1, all.end()});
}

unsigned AsLegacyBlock::numberOfParameters() {
    std::size_t count = 0;
    guarded("numberOfParameters", [&] { count = parameters().size(); });
    return Block::NumberOfParameters + static_cast<unsigned>(count);
}

bool AsLegacyBlock::parseParameters(core::BlockInformation* blockInfo) {
    return guarded("parseParameters", [&] {
        for (const auto& parameter : parameters())
            if (!blockInfo->addParameterMetadata(parameter.metadata))
                throw std::runtime_error("the engine refused parameter '" + parameter.metadata.name + "'");
        if (!blockInfo->parseParameters(m_parameters))
            throw std::runtime_error("the engine could not read the parameters");
    });
}

std::unique_ptr<AsLegacyBlock::Instance> AsLegacyBlock::make() const {
    auto instance = std::make_unique<Instance>();
    const auto list = parameters();
    instance->classes = classes();
    for (std::size_t i = 0; i < instance->classes.size(); ++i) {
        Arguments arguments;
        for (const auto& entry : list)
            if (entry.goal == Goal::argument && entry.owner == instance->classes[i])
                arguments.emplace_back(entry.name, read(m_parameters, entry));
        instance->blocks.push_back(instance->classes[i]->make(arguments));
        std::string problems;
        for (const auto& problem : instance->blocks.back()->declaration().problems)
            problems += (problems.empty() ? "" : "; ") + problem;
        if (!problems.empty()) throw std::runtime_error(problems);
    }
    auto& d = instance->declaration();
    for (const auto& slot : d.slots)
        if (slot.role == Role::continuous_state)
            throw std::runtime_error("it has continuous states, which this interface cannot integrate");
    for (std::size_t i = 0; i < d.requirements.size(); ++i) {
        const auto type_matches = [&](std::size_t k) {
            return instance->blocks[k]->declaration().provisions[0].type == d.requirements[i].type;
        };
        for (std::size_t k = 1; k < instance->blocks.size() && !d.requirements[i].is_bound; ++k) {
            if (!type_matches(k)) continue;
            auto& provision = instance->blocks[k]->declaration().provisions[0];
            if (!provision.made) provision.made = provision.make();
            d.requirements[i].bind(provision.made);
            d.requirements[i].is_bound = true;
            instance->providers.push_back({static_cast<int>(k), 0});
        }
        if (!d.requirements[i].is_bound) throw std::runtime_error("it requires a " + d.requirements[i].type);
    }
    for (const auto& entry : list) {
        if (entry.goal == Goal::period) {
            instance->period = read(m_parameters, entry).data.at(0);
            if (!(instance->period >= 0)) throw std::runtime_error("sample_time must not be negative");
        }
        if (entry.goal != Goal::parameter) continue;
        const int index = d.find(entry.name, Role::parameter);
        if (index < 0) continue; // these arguments switch it off
        Slot& slot = d.slots[static_cast<std::size_t>(index)];
        slot.initial = read(m_parameters, entry).data;
        if (const auto wrong = outside_limits(slot, slot.initial); !wrong.empty())
            throw std::runtime_error(wrong);
        const int count = static_cast<int>(slot.initial.size());
        if (slot.shape.symbol >= 0 ? count > 1 : !slot.shape.is_matrix && count > 1)
            offer(d, index, Size{count, 1, false});
    }
    propagate(*instance->blocks[0]);
    return instance;
}

bool AsLegacyBlock::configureSizeAndPorts(core::BlockInformation* blockInfo) {
    return guarded("configureSizeAndPorts", [&] {
        if (!Block::parseParameters(blockInfo) || !parseParameters(blockInfo))
            throw std::runtime_error("the parameters could not be read");
        const auto instance = make();
        core::InputPortsInfo inputs;
        core::OutputPortsInfo outputs;
        for (const Slot& slot : instance->declaration().slots) {
            if (slot.role == Role::input && !slot.optional)
                inputs.push_back(
                    {inputs.size(), dimensions(instance->declaration(), slot), legacy(slot.type)});
            if (slot.role == Role::output)
                outputs.push_back(
                    {outputs.size(), dimensions(instance->declaration(), slot), legacy(slot.type)});
        }
        if (!blockInfo->setPortsInfo(inputs, outputs))
            throw std::runtime_error("the engine refused the ports");
    });
}

bool AsLegacyBlock::initialize(core::BlockInformation* blockInfo) {
    instance_.reset();
    return guarded("initialize", [&] {
        if (!Block::parseParameters(blockInfo) || !parseParameters(blockInfo))
            throw std::runtime_error("the parameters could not be read");
        auto instance = make();
        bf::Block& block = *instance->blocks[0];
        auto& d = instance->declaration();
        std::size_t inputs = 0, outputs = 0;
        const auto offer_port = [&](std::size_t i, const core::Port::Info& port) {
            const int index = static_cast<int>(i);
            if (!d.slots[i].type_known) offer(d, index, native(port.dataType));
            if (!d.slots[i].size_known || d.slots[i].role == Role::input)
                offer(d, index, size_of(port, d.slots[i]));
            propagate(block);
        };
        for (std::size_t i = 0; i < d.slots.size(); ++i)
            if (d.slots[i].role == Role::input && !d.slots[i].optional)
                offer_port(i, blockInfo->getInputPortInfo(inputs++));
        for (std::size_t i = 0; i < d.slots.size(); ++i)
            if (d.slots[i].role == Role::output) offer_port(i, blockInfo->getOutputPortInfo(outputs++));
        for (std::size_t i = 0; i < d.slots.size(); ++i)
            if (!d.slots[i].size_known && (d.slots[i].role == Role::parameter || d.slots[i].optional)) {
                offer(d, static_cast<int>(i),
                      Size{std::max(1, static_cast<int>(d.slots[i].initial.size())), 1, false});
                propagate(block);
            }
        for (const Slot& slot : d.slots) {
            if (!slot.size_known) throw std::runtime_error("the size of '" + slot.name + "' is not known");
            if (slot.role == Role::parameter && slot.initial.size() > 1 &&
                static_cast<int>(slot.initial.size()) != slot.size.count())
                throw std::runtime_error("parameter '" + slot.name + "' must have " +
                                         std::to_string(slot.size.count()) + " elements, not " +
                                         std::to_string(slot.initial.size()));
        }

        std::vector<Node> nodes;
        for (std::size_t i = 0; i < instance->blocks.size(); ++i)
            nodes.push_back({instance->blocks[i].get(), instance->classes[i]->methods, {}, {}, 0});
        nodes[0].providers = instance->providers;
        instance->context = std::make_unique<Context>(nodes);
        for (std::size_t i = 0; i < d.slots.size(); ++i) {
            const Slot& slot = d.slots[i];
            const Instance::Port port{static_cast<int>(i), instance->context->data(0, static_cast<int>(i)),
                                      static_cast<std::size_t>(slot.size.count()) *
                                          static_cast<std::size_t>(bytes(slot.type)),
                                      legacy(slot.type)};
            if (slot.role == Role::input && !slot.optional) instance->inputs.push_back(port);
            if (slot.role == Role::output) instance->outputs.push_back(port);
        }
        for (int i = 0; i < instance->context->activities(0, Phase::output); ++i)
            instance->output_tasks.push_back(instance->context->task(0, Phase::output, i));
        for (int i = 0; i < instance->context->activities(0, Phase::update); ++i)
            instance->update_tasks.push_back(instance->context->task(0, Phase::update, i));
        instance_ = std::move(instance);
        for (std::size_t i = instance_->blocks.size(); i-- > 0;)
            instance_->context->start(static_cast<int>(i));
        if (!initializeInitialConditions(blockInfo))
            throw std::runtime_error("the initial conditions failed");
    });
}

bool AsLegacyBlock::initializeInitialConditions(const core::BlockInformation*) {
    return guarded("initializeInitialConditions", [&] {
        if (!instance_ || !instance_->context) throw std::runtime_error("the block was not initialised");
        for (std::size_t i = instance_->blocks.size(); i-- > 0;)
            if (const Status status = instance_->context->reset(static_cast<int>(i)); !status)
                throw std::runtime_error(status.text());
        instance_->context->clock(0) = {0, instance_->period, 0};
    });
}

namespace {

template <class S> void* memory_of(const std::shared_ptr<S>& signal, DataType type, std::size_t bytes) {
    if (!signal || signal->getPortDataType() != type || signal->getWidth() * boundary::bytes(type) != bytes)
        return nullptr;
    return with_type(native(type), [&](auto t) -> void* {
        return const_cast<typename decltype(t)::type*>(
            std::as_const(*signal).template getBuffer<typename decltype(t)::type>());
    });
}

} // namespace

bool AsLegacyBlock::output(const core::BlockInformation* blockInfo) {
    const auto refuse = [&](const std::string& why) {
        bfError << "plugin '" << library_->name() << "', block '" << name_ << "', output: " << why;
        return false;
    };
    if (!instance_ || !instance_->context) return refuse("the block was not initialised");
    Instance& instance = *instance_;
    for (std::size_t i = 0; i < instance.inputs.size(); ++i) {
        const auto& port = instance.inputs[i];
        const void* memory = memory_of(blockInfo->getInputPortSignal(i), port.type, port.bytes);
        if (!memory)
            return refuse("the signal of input port " + std::to_string(i) + " is missing or has changed");
        std::memcpy(port.memory, memory, port.bytes);
    }
    for (const Task& task : instance.output_tasks)
        if (const Status status = task(); !status) return refuse(status.text());
    for (std::size_t i = 0; i < instance.outputs.size(); ++i) {
        const auto& port = instance.outputs[i];
        void* memory = memory_of(blockInfo->getOutputPortSignal(i), port.type, port.bytes);
        if (!memory)
            return refuse("the signal of output port " + std::to_string(i) + " is missing or has changed");
        std::memcpy(memory, port.memory, port.bytes);
    }
    for (const Task& task : instance.update_tasks)
        if (const Status status = task(); !status) return refuse(status.text());
    instance.context->commit(0);
    Clock& clock = instance.context->clock(0);
    ++clock.step;
    clock.time = static_cast<double>(clock.step) * clock.period;
    return true;
}

bool AsLegacyBlock::terminate(const core::BlockInformation*) {
    return guarded("terminate", [&] {
        if (!instance_ || !instance_->context) throw std::runtime_error("the block was not initialised");
        instance_.reset();
    });
}

core::Block* make_legacy_block(const void* inside, const char* name) {
    Dl_info plugin;
    if (!dladdr(inside, &plugin) || !plugin.dli_fname) return nullptr;
    const std::filesystem::path file(plugin.dli_fname);
    auto library = std::make_shared<Library>(file.stem().string(), file);
    try {
        void* handle = dlopen(plugin.dli_fname, RTLD_NOW | RTLD_NOLOAD);
        if (!handle) throw std::runtime_error("it is not loaded");
        const std::unique_ptr<void, int (*)(void*)> reference(handle,
                                                              dlclose); // whoever called holds the plugin
        fill_from_plugin(*library, handle);
        return new AsLegacyBlock(std::move(library), name);
    } catch (const std::exception& error) {
        bfError << "plugin " << file.string() << ": " << error.what();
        return nullptr;
    }
}

} // namespace bf::boundary
