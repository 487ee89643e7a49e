// What a block may ask the engine, and tell it.
#ifndef BLOCKFACTORY_CORE_BLOCKINFORMATION_H
#define BLOCKFACTORY_CORE_BLOCKINFORMATION_H

#include "BlockFactory/Core/Port.h"

#include <memory>
#include <string>
#include <tuple>   // for plugins that rely on it
#include <utility> // as well
#include <vector>

namespace blockfactory {
namespace core {
class BlockInformation;
class Parameters;
class ParameterMetadata;
class Signal;

using InputPortsInfo = std::vector<Port::Info>;
using OutputPortsInfo = std::vector<Port::Info>;
using InputSignalPtr = std::shared_ptr<const Signal>;
using OutputSignalPtr = std::shared_ptr<Signal>;

/// Option: run as early in the step as possible.
const std::string BlockOptionPrioritizeOrder = "wbt.BlockOptionPrioritizeOrder";
} // namespace core
} // namespace blockfactory

/// Methods that return bool log an error when they return false.
class blockfactory::core::BlockInformation {
  public:
    BlockInformation() = default;
    virtual ~BlockInformation() = default;

    /// The path of the block, unique in its model.
    virtual bool getUniqueName(std::string& blockUniqueName) const = 0;
    /// The engine's value of an option.
    virtual bool optionFromKey(const std::string& key, double& option) const = 0;
    /// Reads the parameters declared since the last call into `parameters`.
    virtual bool parseParameters(Parameters& parameters) = 0;
    /// Declares one expected parameter, or one field of a struct parameter.
    virtual bool addParameterMetadata(const ParameterMetadata& paramMD) = 0;
    /// Declares all ports: once, in configureSizeAndPorts.
    virtual bool setPortsInfo(const InputPortsInfo& inputPortsInfo,
                              const OutputPortsInfo& outputPortsInfo) = 0;

    virtual Port::Info getInputPortInfo(Port::Index index) const = 0;
    virtual Port::Info getOutputPortInfo(Port::Index index) const = 0;
    /// Number of elements.
    virtual Port::Size::Vector getInputPortWidth(const Port::Index index) const = 0;
    virtual Port::Size::Vector getOutputPortWidth(const Port::Index index) const = 0;
    virtual Port::Size::Matrix getInputPortMatrixSize(const Port::Index index) const = 0;
    virtual Port::Size::Matrix getOutputPortMatrixSize(const Port::Index index) const = 0;
    /// Null on failure.
    virtual InputSignalPtr getInputPortSignal(const Port::Index index) const = 0;
    virtual OutputSignalPtr getOutputPortSignal(const Port::Index index) const = 0;
};

#endif
