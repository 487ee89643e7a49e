// The engine side of one block in code that Simulink Coder generated.
#ifndef BLOCKFACTORY_CODER_CODERBLOCKINFORMATION_H
#define BLOCKFACTORY_CODER_CODERBLOCKINFORMATION_H

#include <BlockFactory/Core/BlockInformation.h>
#include <BlockFactory/Core/Parameters.h>
#include <BlockFactory/Core/Signal.h>

#include <map>
#include <memory>
#include <string>

namespace blockfactory {
namespace coder {
class CoderBlockInformation;
/// Parameters of a model's blocks, by the blocks' unique names.
using ModelParameters = std::map<std::string, blockfactory::core::Parameters>;
} // namespace coder
} // namespace blockfactory

/// Generated code tells it name, parameters and ports before the block is initialised. Vectors are {1, n}.
class blockfactory::coder::CoderBlockInformation final : public blockfactory::core::BlockInformation {
  public:
    CoderBlockInformation();
    ~CoderBlockInformation() override;

    bool setUniqueBlockName(const std::string& blockUniqueName);
    /// What code generated before BlockFactory 0.8 calls it.
    bool setBlockName(const std::string& blockName) { return setUniqueBlockName(blockName); }
    /// Error when there are none.
    bool storeRTWParameters(const blockfactory::core::Parameters& parameters);
    /// Errors: an index given before, a null address, not one or two lengths above 0, an unknown type.
    bool setInputPort(const blockfactory::core::Port::Info& portInfo, void* signalAddress);
    bool setOutputPort(const blockfactory::core::Port::Info& portInfo, void* signalAddress);

    /// From here on, what this thread's objects store is copied to `to` as well; null: to nowhere. Returns
    /// what was set before.
    static ModelParameters* collect(ModelParameters* to);

    bool getUniqueName(std::string& blockUniqueName) const override;
    /// Every option is accepted and left as it is.
    bool optionFromKey(const std::string& key, double& option) const override;
    /// Every parameter declared since the last call must be stored with equal metadata; gives all stored
    /// ones.
    bool parseParameters(blockfactory::core::Parameters& parameters) override;
    bool addParameterMetadata(const blockfactory::core::ParameterMetadata& paramMD) override;
    /// Ports are known from the generated code: compares number, elements and type with them.
    bool setPortsInfo(const blockfactory::core::InputPortsInfo& inputPortsInfo,
                      const blockfactory::core::OutputPortsInfo& outputPortsInfo) override;
    blockfactory::core::Port::Info getInputPortInfo(blockfactory::core::Port::Index index) const override;
    blockfactory::core::Port::Info getOutputPortInfo(blockfactory::core::Port::Index index) const override;
    blockfactory::core::Port::Size::Vector getInputPortWidth(
        const blockfactory::core::Port::Index index) const override;
    blockfactory::core::Port::Size::Vector getOutputPortWidth(
        const blockfactory::core::Port::Index index) const override;
    blockfactory::core::Port::Size::Matrix getInputPortMatrixSize(
        const blockfactory::core::Port::Index index) const override;
    blockfactory::core::Port::Size::Matrix getOutputPortMatrixSize(
        const blockfactory::core::Port::Index index) const override;
    blockfactory::core::InputSignalPtr getInputPortSignal(
        const blockfactory::core::Port::Index index) const override;
    blockfactory::core::OutputSignalPtr getOutputPortSignal(
        const blockfactory::core::Port::Index index) const override;

  private:
    class impl;
    std::unique_ptr<impl> pImpl;
};

#endif
