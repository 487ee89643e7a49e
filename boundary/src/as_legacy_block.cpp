#include "bf/boundary/as_legacy_block.hpp"

#include "BlockFactory/Core/BlockInformation.h"
#include "BlockFactory/Core/Log.h"
#include "BlockFactory/Core/Signal.h"
#include "bf/core/instance.hpp"
#include "data_type.hpp"
#include "host_information.hpp"
#include "log_capture.hpp"

#include <algorithm>
#include <cstring>
#include <dlfcn.h>
#include <stdexcept>

namespace bf::boundary {

namespace core = blockfactory::core;

struct AsLegacyBlock::Running {
    struct Port {
        void* memory; // of the instance
        std::size_t bytes;
        DataType type;
    };
    std::vector<std::unique_ptr<Instance>> providers;
    std::unique_ptr<Instance> block; // which goes before what it uses
    double period = 0;
    std::vector<Port> inputs, outputs;
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

core::Port::Dimensions dimensions(const Resolution& r, const Slot& slot) {
    const auto length = [&](const Extent& extent) {
        if (extent.dim < 0) return extent.plus;
        const int value = r.dims[static_cast<std::size_t>(extent.dim)];
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
            if (!d.provisions.empty() && d.provisions[0].type == requirement.type && d.slots.empty())
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

std::unique_ptr<AsLegacyBlock::Running> AsLegacyBlock::make() const {
    auto running = std::make_unique<Running>();
    const auto list = parameters();
    const auto instance_of = [&](const BlockClass& type) {
        Arguments arguments;
        for (const auto& entry : list)
            if (entry.goal == Goal::argument && entry.owner == &type)
                arguments.emplace_back(entry.name, read(m_parameters, entry));
        return std::make_unique<Instance>(type, arguments);
    };
    const auto all = classes();
    running->block = instance_of(*all[0]);
    Instance& block = *running->block;
    for (const auto& slot : block.declaration().slots)
        if (slot.role == Role::continuous_state)
            throw std::runtime_error("it has continuous states, which this interface cannot integrate");
    for (std::size_t i = 0; i < block.declaration().requirements.size(); ++i) {
        auto& provider = running->providers.emplace_back(instance_of(*all[i + 1]));
        provide(provider->block());
        block.require(static_cast<int>(i), provider->resolution().provided[0],
                      [from = provider.get()] { return from->object(0); });
    }
    for (const auto& entry : list) {
        if (entry.goal == Goal::period) {
            running->period = read(m_parameters, entry).data.at(0);
            if (!(running->period >= 0)) throw std::runtime_error("sample_time must not be negative");
        }
        if (entry.goal != Goal::parameter) continue;
        const int index = block.declaration().find(entry.name, Role::parameter);
        if (index < 0) continue; // these arguments switch it off
        block.give(index, read(m_parameters, entry));
    }
    propagate(block.block());
    return running;
}

bool AsLegacyBlock::configureSizeAndPorts(core::BlockInformation* blockInfo) {
    return guarded("configureSizeAndPorts", [&] {
        if (!Block::parseParameters(blockInfo) || !parseParameters(blockInfo))
            throw std::runtime_error("the parameters could not be read");
        const auto running = make();
        const Resolution& r = running->block->resolution();
        core::InputPortsInfo inputs;
        core::OutputPortsInfo outputs;
        for (const Slot& slot : r.slots) {
            if (slot.role == Role::input && !slot.optional)
                inputs.push_back({inputs.size(), dimensions(r, slot), legacy(slot.type)});
            if (slot.role == Role::output)
                outputs.push_back({outputs.size(), dimensions(r, slot), legacy(slot.type)});
        }
        if (!blockInfo->setPortsInfo(inputs, outputs))
            throw std::runtime_error("the engine refused the ports");
    });
}

bool AsLegacyBlock::initialize(core::BlockInformation* blockInfo) {
    running_.reset();
    return guarded("initialize", [&] {
        if (!Block::parseParameters(blockInfo) || !parseParameters(blockInfo))
            throw std::runtime_error("the parameters could not be read");
        auto running = make();
        Instance& block = *running->block;
        std::vector<int> inputs, outputs;
        for (int i = 0; i < static_cast<int>(block.resolution().slots.size()); ++i) {
            if (block.slot(i).role == Role::input && !block.slot(i).optional) inputs.push_back(i);
            if (block.slot(i).role == Role::output) outputs.push_back(i);
        }
        const auto wire = [&](int i, const core::Port::Info& port) {
            if (!block.resolution().type_of(i)) block.wire(i, native(port.dataType));
            if (!block.slot(i).size_known || block.slot(i).role == Role::input)
                block.wire(i, size_of(port, block.slot(i)));
        };
        for (std::size_t k = 0; k < inputs.size(); ++k) wire(inputs[k], blockInfo->getInputPortInfo(k));
        for (std::size_t k = 0; k < outputs.size(); ++k) wire(outputs[k], blockInfo->getOutputPortInfo(k));
        block.settle();
        for (auto& provider : running->providers) provider->open();
        block.open();
        const auto port = [&](int i) {
            return Running::Port{block.data(i), block.bytes_of(i), legacy(block.slot(i).type)};
        };
        for (const int i : inputs) running->inputs.push_back(port(i));
        for (const int i : outputs) running->outputs.push_back(port(i));
        for (auto& provider : running->providers) provider->start();
        block.start();
        running_ = std::move(running);
        if (!initializeInitialConditions(blockInfo))
            throw std::runtime_error("the initial conditions failed");
    });
}

bool AsLegacyBlock::initializeInitialConditions(const core::BlockInformation*) {
    return guarded("initializeInitialConditions", [&] {
        if (!running_) throw std::runtime_error("the block was not initialised");
        const auto reset = [](Instance& instance) {
            if (const Status status = instance.reset(); !status) throw std::runtime_error(status.text());
        };
        for (auto& provider : running_->providers) reset(*provider);
        reset(*running_->block);
        running_->block->clock() = {0, running_->period, 0};
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
    if (!running_) return refuse("the block was not initialised");
    Instance& block = *running_->block;
    for (std::size_t i = 0; i < running_->inputs.size(); ++i) {
        const auto& port = running_->inputs[i];
        const void* memory = memory_of(blockInfo->getInputPortSignal(i), port.type, port.bytes);
        if (!memory)
            return refuse("the signal of input port " + std::to_string(i) + " is missing or has changed");
        std::memcpy(port.memory, memory, port.bytes);
    }
    if (const Status status = block.run(Phase::output); !status) return refuse(status.text());
    for (std::size_t i = 0; i < running_->outputs.size(); ++i) {
        const auto& port = running_->outputs[i];
        void* memory = memory_of(blockInfo->getOutputPortSignal(i), port.type, port.bytes);
        if (!memory)
            return refuse("the signal of output port " + std::to_string(i) + " is missing or has changed");
        std::memcpy(memory, port.memory, port.bytes);
    }
    if (const Status status = block.run(Phase::update); !status) return refuse(status.text());
    block.commit();
    Clock& clock = block.clock();
    ++clock.step;
    clock.time = static_cast<double>(clock.step) * clock.period;
    return true;
}

bool AsLegacyBlock::terminate(const core::BlockInformation*) {
    return guarded("terminate", [&] {
        if (!running_) throw std::runtime_error("the block was not initialised");
        running_.reset();
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
