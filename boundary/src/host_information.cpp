#include "host_information.hpp"

#include "BlockFactory/Core/Log.h"
#include "bf/boundary/positional.hpp"
#include "data_type.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>

namespace bf::boundary {

using namespace blockfactory::core;

int width(const Port::Info& port) {
    int count = 1;
    for (const int length : port.dimension) {
        if (length == Port::DynamicSize) return Port::DynamicSize;
        count *= length;
    }
    return count;
}

Port::Size::Matrix matrix_size(const Port::Info& port) {
    if (port.dimension.size() == 1) return {1, port.dimension[0]};
    return {port.dimension[0], port.dimension[1]};
}

std::vector<Port::Info> in_order(std::vector<Port::Info> ports, const char* side) {
    std::stable_sort(ports.begin(), ports.end(),
                     [](const auto& a, const auto& b) { return a.index < b.index; });
    for (std::size_t i = 0; i < ports.size(); ++i) {
        const auto& port = ports[i];
        const std::string label = std::string(side) + " port " + std::to_string(port.index);
        if (port.index != i)
            throw std::runtime_error(label +
                                     (port.index < i
                                          ? " is declared twice"
                                          : " follows port " + std::to_string(static_cast<int>(i) - 1)) +
                                     "; number the ports 0, 1, 2, ...");
        if (port.dimension.empty() || port.dimension.size() > 2)
            throw std::runtime_error(label + " has " + std::to_string(port.dimension.size()) +
                                     " dimensions; ports are vectors (1) or matrices (2)");
        for (const int length : port.dimension)
            if (length <= 0 && length != Port::DynamicSize)
                throw std::runtime_error(label + " has length " + std::to_string(length) +
                                         "; lengths are positive or Port::DynamicSize");
        if (!is_known(port.dataType)) throw std::runtime_error(label + " has an unknown data type");
    }
    return ports;
}

HostInformation::HostInformation(std::string library, std::string class_name, Arguments arguments)
    : library_(std::move(library)), class_name_(std::move(class_name)), arguments_(std::move(arguments)) {
    static std::atomic<unsigned> made{
        0}; // names must differ between instances, and nothing else hangs on them
    unique_name_ = library_ + "/" + class_name_ + "#" + std::to_string(++made);
}

void HostInformation::run_on(Ports inputs, Ports outputs) {
    inputs_ = std::move(inputs);
    outputs_ = std::move(outputs);
    has_ports_ = is_running_ = true;
    const auto make = [](const Ports& ports, Signals& signals) {
        signals.clear();
        for (const auto& port : ports)
            signals.push_back(
                std::make_shared<Signal>(Signal::DataFormat::CONTIGUOUS_ZEROCOPY, port.dataType));
    };
    make(inputs_, input_signals_);
    make(outputs_, output_signals_);
}

void HostInformation::point(bool is_output, std::size_t index, void* memory) {
    const auto& port = (is_output ? outputs_ : inputs_)[index];
    (is_output ? output_signals_ : input_signals_)[index]->initializeBufferFromContiguousZeroCopy(
        memory, static_cast<std::size_t>(width(port)));
}

bool HostInformation::getUniqueName(std::string& blockUniqueName) const {
    blockUniqueName = unique_name_;
    return true;
}

bool HostInformation::optionFromKey(const std::string& key, double& option) const {
    if (key != BlockOptionPrioritizeOrder) return false;
    option = 1; // accepted; the order of a step is that of the diagram
    return true;
}

bool HostInformation::addParameterMetadata(const Metadata& metadata) {
    pending_.push_back(metadata);
    return true;
}

bool HostInformation::parseParameters(Parameters& parameters) {
    const auto pending = std::move(pending_);
    pending_.clear();
    bool good = true;
    for (const auto& metadata : pending) {
        const auto same = [&](const auto& m) { return m.name == metadata.name; };
        if (std::none_of(declared_.begin(), declared_.end(), same)) declared_.push_back(metadata);
        // Base and subclass may both declare a name, and initialize may run again.
        if (!parameters.existName(metadata.name)) good = parse(metadata, parameters) && good;
        if (awaited_) awaited_->erase(metadata.index);
    }
    return good && !(awaited_ && awaited_->empty());
}

bool HostInformation::parse(Metadata metadata, Parameters& to) {
    if (metadata.index == 0) return to.storeParameter(class_name_, metadata);
    if (metadata.index == 1) return to.storeParameter(library_, metadata);
    const auto refuse = [&](const std::string& why) {
        bfError << "parameter '" << metadata.name << "' " << why;
        return false;
    };
    if (metadata.rows == Metadata::DynamicSize)
        return refuse("has rows of open number, which parameters cannot have");
    if (metadata.rows > 1 && metadata.cols > 1)
        return refuse("is declared " + std::to_string(metadata.rows) + "x" + std::to_string(metadata.cols) +
                      ": 2D parameters are not supported");
    const bool text = is_text(metadata.type), scalar = metadata.rows == 1 && metadata.cols == 1;
    const auto given = std::find_if(arguments_.begin(), arguments_.end(),
                                    [&](const auto& a) { return a.first == argument_name(metadata.name); });
    Value value;
    if (given == arguments_.end()) {
        if (std::find(missing_.begin(), missing_.end(), argument_name(metadata.name)) == missing_.end())
            missing_.push_back(argument_name(metadata.name));
        const int count = std::max(1, std::max(metadata.rows, metadata.cols));
        value = text ? Value(std::vector<std::string>(static_cast<std::size_t>(count)))
                     : Value(Matrix(Matrix::Zero(1, count)));
    } else {
        value = given->second;
    }
    if (value.kind == Value::Kind::text) {
        value.texts = {value.text};
        value.kind = Value::Kind::texts;
    }
    if (text != (value.kind == Value::Kind::texts))
        return refuse(std::string("must be ") + (text ? "a text" : "a number") + ", not " +
                      given->second.describe());
    if (!text && value.rows > 1 && value.cols > 1)
        return refuse("is " + value.describe() + ": 2D parameters are not supported");
    const int count = static_cast<int>(text ? value.texts.size() : value.data.size());
    if (metadata.cols == Metadata::DynamicSize) metadata.cols = count;
    const int wanted = metadata.rows * metadata.cols;
    if (count != wanted)
        return refuse("must have " + std::to_string(wanted) + " elements, not " + std::to_string(count));
    if (static_cast<int>(metadata.type) % 4 == 0)
        for (const double x : value.data)
            if (x != std::floor(x)) return refuse("must be a whole number, not " + value.describe());
    if (text)
        return scalar ? to.storeParameter(value.texts[0], metadata)
                      : to.storeParameter(value.texts, metadata);
    return scalar ? to.storeParameter(value.data[0], metadata) : to.storeParameter(value.data, metadata);
}

bool HostInformation::setPortsInfo(const InputPortsInfo& inputs, const OutputPortsInfo& outputs) {
    if (has_ports_) {
        bfError << "the ports are declared twice; call setPortsInfo once, in configureSizeAndPorts";
        return false;
    }
    try {
        inputs_ = in_order(inputs, "input");
        outputs_ = in_order(outputs, "output");
    } catch (const std::exception& error) {
        bfError << error.what();
        return false;
    }
    has_ports_ = true;
    return true;
}

namespace {

const Port::Info* find(const HostInformation::Ports& ports, std::size_t index, const char* side) {
    if (index < ports.size()) return &ports[index];
    bfError << "there is no " << side << " port " << index << "; the block has " << ports.size();
    return nullptr;
}
std::shared_ptr<Signal> signal(const HostInformation::Signals& signals, std::size_t index, const char* side,
                               bool is_running) {
    if (index < signals.size()) return signals[index];
    if (is_running)
        bfError << "there is no " << side << " port " << index << "; the block has " << signals.size();
    else
        bfError << side << " port " << index << " has no signal yet; signals exist from initialize on";
    return nullptr;
}

} // namespace

Port::Info HostInformation::getInputPortInfo(std::size_t index) const {
    const auto* port = find(inputs_, index, "input");
    return port ? *port : Port::Info{};
}
Port::Info HostInformation::getOutputPortInfo(std::size_t index) const {
    const auto* port = find(outputs_, index, "output");
    return port ? *port : Port::Info{};
}
int HostInformation::getInputPortWidth(const std::size_t index) const {
    const auto* port = find(inputs_, index, "input");
    return port ? width(*port) : 0;
}
int HostInformation::getOutputPortWidth(const std::size_t index) const {
    const auto* port = find(outputs_, index, "output");
    return port ? width(*port) : 0;
}
Port::Size::Matrix HostInformation::getInputPortMatrixSize(const std::size_t index) const {
    const auto* port = find(inputs_, index, "input");
    return port ? matrix_size(*port) : Port::Size::Matrix{0, 0};
}
Port::Size::Matrix HostInformation::getOutputPortMatrixSize(const std::size_t index) const {
    const auto* port = find(outputs_, index, "output");
    return port ? matrix_size(*port) : Port::Size::Matrix{0, 0};
}
InputSignalPtr HostInformation::getInputPortSignal(const std::size_t index) const {
    return signal(input_signals_, index, "input", is_running_);
}
OutputSignalPtr HostInformation::getOutputPortSignal(const std::size_t index) const {
    return signal(output_signals_, index, "output", is_running_);
}

} // namespace bf::boundary
