#include "BlockFactory/SimulinkCoder/CoderBlockInformation.h"

#include <BlockFactory/Core/Log.h>
#include <BlockFactory/Core/Parameters.h>
#include <BlockFactory/Core/Signal.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

namespace blockfactory::coder {

using namespace blockfactory::core;

namespace {

struct Connected {
    Port::Info info{};
    std::shared_ptr<Signal> signal;
};
thread_local ModelParameters* collector = nullptr;

using Ports = std::map<Port::Index, Connected>;

/// The elements; Port::DynamicSize when a length is open.
int elements(const Port::Dimensions& dimension) {
    int count = 1;
    for (const int length : dimension) {
        if (length == Port::DynamicSize) return Port::DynamicSize;
        count *= length;
    }
    return count;
}

std::string text(const Port::Dimensions& dimension) {
    std::string list;
    for (const int length : dimension) list += (list.empty() ? "" : ", ") + std::to_string(length);
    return "{" + list + "}";
}

} // namespace

class CoderBlockInformation::impl {
  public:
    std::string name;
    Parameters parameters;
    std::vector<ParameterMetadata> pending;
    Ports inputs, outputs;

    /// Errors begin with the block's name, which the Log does not know.
    template <class... Text> bool fail(const Text&... parts) const {
        auto& stream = bfError;
        if (!name.empty()) stream << "block '" << name << "': ";
        (stream << ... << parts);
        return false;
    }

    bool connect(Ports& ports, const char* side, const Port::Info& info, void* address) const {
        const auto refuse = [&](const std::string& why) {
            return fail(side, " port ", info.index, " ", why);
        };
        if (ports.count(info.index)) return refuse("is set twice");
        if (!address) return refuse("has a null address");
        if (info.dimension.empty() || info.dimension.size() > 2)
            return refuse("has " + std::to_string(info.dimension.size()) +
                          " dimensions; only one or two can be");
        for (const int length : info.dimension)
            if (length <= 0) return refuse("has size " + text(info.dimension) + "; lengths must be positive");
        if (info.dataType < Port::DataType::DOUBLE || info.dataType > Port::DataType::BOOLEAN)
            return refuse("has an unknown data type");
        auto signal = std::make_shared<Signal>(Signal::DataFormat::CONTIGUOUS_ZEROCOPY, info.dataType);
        if (!signal->initializeBufferFromContiguousZeroCopy(
                address, static_cast<std::size_t>(elements(info.dimension))))
            return false;
        ports[info.index] = {info, std::move(signal)};
        return true;
    }

    bool compare(const Ports& ports, const char* side, const std::vector<Port::Info>& declared) const {
        if (ports.size() != declared.size())
            return fail("it declares ", declared.size(), " ", side, " ports, the generated code has ",
                        ports.size());
        for (const auto& port : declared) {
            const Connected* known = find(ports, side, port.index);
            if (!known) return false;
            const int wanted = elements(port.dimension);
            if (wanted != Port::DynamicSize && wanted != elements(known->info.dimension))
                return fail(side, " port ", port.index, " is declared ", text(port.dimension),
                            ", the generated code has ", text(known->info.dimension));
            if (port.dataType != known->info.dataType)
                return fail(side, " port ", port.index, " has another data type than in the generated code");
        }
        return true;
    }

    const Connected* find(const Ports& ports, const char* side, Port::Index index) const {
        const auto found = ports.find(index);
        if (found != ports.end()) return &found->second;
        fail("there is no ", side, " port ", index);
        return nullptr;
    }
    static Port::Size::Matrix matrix(const Connected* port) {
        if (!port) return {0, 0};
        const auto& d = port->info.dimension;
        return d.size() == 1 ? Port::Size::Matrix{1, d[0]} : Port::Size::Matrix{d[0], d[1]};
    }
};

CoderBlockInformation::CoderBlockInformation() : pImpl(std::make_unique<impl>()) {}
CoderBlockInformation::~CoderBlockInformation() = default;

bool CoderBlockInformation::setUniqueBlockName(const std::string& blockUniqueName) {
    pImpl->name = blockUniqueName;
    return true;
}
bool CoderBlockInformation::storeRTWParameters(const Parameters& parameters) {
    if (parameters.getNumberOfParameters() == 0)
        return pImpl->fail("the generated code stores no parameters");
    pImpl->parameters = parameters;
    if (collector && !pImpl->name.empty()) (*collector)[pImpl->name] = parameters;
    return true;
}
ModelParameters* CoderBlockInformation::collect(ModelParameters* to) { return std::exchange(collector, to); }
bool CoderBlockInformation::setInputPort(const Port::Info& portInfo, void* signalAddress) {
    return pImpl->connect(pImpl->inputs, "input", portInfo, signalAddress);
}
bool CoderBlockInformation::setOutputPort(const Port::Info& portInfo, void* signalAddress) {
    return pImpl->connect(pImpl->outputs, "output", portInfo, signalAddress);
}

bool CoderBlockInformation::getUniqueName(std::string& blockUniqueName) const {
    blockUniqueName = pImpl->name;
    return true;
}
bool CoderBlockInformation::optionFromKey(const std::string&, double&) const { return true; }

bool CoderBlockInformation::addParameterMetadata(const ParameterMetadata& paramMD) {
    for (const auto& metadata : pImpl->pending)
        if (metadata.name == paramMD.name)
            return pImpl->fail("parameter '", paramMD.name, "' is declared twice");
    pImpl->pending.push_back(paramMD);
    return true;
}

bool CoderBlockInformation::parseParameters(Parameters& parameters) {
    const auto pending = std::move(pImpl->pending);
    pImpl->pending.clear();
    if (pImpl->parameters.getNumberOfParameters() == 0)
        return pImpl->fail("parameters are asked before the generated code stored them");
    for (auto wanted : pending) {
        if (!pImpl->parameters.existName(wanted.name))
            return pImpl->fail("the generated code has no parameter '", wanted.name, "'");
        const auto stored = pImpl->parameters.getParameterMetadata(wanted.name);
        if (wanted.cols == ParameterMetadata::DynamicSize) wanted.cols = stored.cols;
        if (!(wanted == stored))
            return pImpl->fail("parameter '", wanted.name, "' is declared with index ", wanted.index,
                               ", size ", wanted.rows, "x", wanted.cols, " and type ",
                               static_cast<int>(wanted.type), ", the generated code has index ", stored.index,
                               ", size ", stored.rows, "x", stored.cols, " and type ",
                               static_cast<int>(stored.type));
    }
    parameters = pImpl->parameters;
    return true;
}

bool CoderBlockInformation::setPortsInfo(const InputPortsInfo& inputPortsInfo,
                                         const OutputPortsInfo& outputPortsInfo) {
    // Generated code configures a temporary block on a temporary object that knows no ports.
    if (pImpl->inputs.empty() && pImpl->outputs.empty()) return true;
    return pImpl->compare(pImpl->inputs, "input", inputPortsInfo) &&
           pImpl->compare(pImpl->outputs, "output", outputPortsInfo);
}

Port::Info CoderBlockInformation::getInputPortInfo(Port::Index index) const {
    const auto* port = pImpl->find(pImpl->inputs, "input", index);
    return port ? port->info : Port::Info{};
}
Port::Info CoderBlockInformation::getOutputPortInfo(Port::Index index) const {
    const auto* port = pImpl->find(pImpl->outputs, "output", index);
    return port ? port->info : Port::Info{};
}
Port::Size::Vector CoderBlockInformation::getInputPortWidth(const Port::Index index) const {
    const auto* port = pImpl->find(pImpl->inputs, "input", index);
    return port ? elements(port->info.dimension) : 0;
}
Port::Size::Vector CoderBlockInformation::getOutputPortWidth(const Port::Index index) const {
    const auto* port = pImpl->find(pImpl->outputs, "output", index);
    return port ? elements(port->info.dimension) : 0;
}
Port::Size::Matrix CoderBlockInformation::getInputPortMatrixSize(const Port::Index index) const {
    return impl::matrix(pImpl->find(pImpl->inputs, "input", index));
}
Port::Size::Matrix CoderBlockInformation::getOutputPortMatrixSize(const Port::Index index) const {
    return impl::matrix(pImpl->find(pImpl->outputs, "output", index));
}
InputSignalPtr CoderBlockInformation::getInputPortSignal(const Port::Index index) const {
    const auto* port = pImpl->find(pImpl->inputs, "input", index);
    return port ? port->signal : nullptr;
}
OutputSignalPtr CoderBlockInformation::getOutputPortSignal(const Port::Index index) const {
    const auto* port = pImpl->find(pImpl->outputs, "output", index);
    return port ? port->signal : nullptr;
}

} // namespace blockfactory::coder
