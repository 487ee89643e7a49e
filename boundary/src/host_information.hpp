// The engine side of one hosted block.
#pragma once

#include "BlockFactory/Core/BlockInformation.h"
#include "BlockFactory/Core/Parameters.h"
#include "BlockFactory/Core/Signal.h"
#include "bf/core/value.hpp"

#include <optional>
#include <set>
#include <string>
#include <vector>

namespace bf::boundary {

/// Answers a block from given values. While sizing it records ports; once `run_on` was called the ports are
/// those of the diagram and have signals, made once.
class HostInformation final : public blockfactory::core::BlockInformation {
  public:
    using Metadata = blockfactory::core::ParameterMetadata;
    using Ports = std::vector<blockfactory::core::Port::Info>;
    using Signals = std::vector<std::shared_ptr<blockfactory::core::Signal>>;

    HostInformation(std::string library, std::string class_name, Arguments arguments);

    /// Ports with their final sizes; signals refer to memory given later by `point`.
    void run_on(Ports inputs, Ports outputs);
    void point(bool is_output, std::size_t index, void* memory);
    /// parseParameters is refused once these parameters are declared: the block is only asked for them, and
    /// what it does when it has them must not happen.
    void end_when_declared(std::set<unsigned> indices) { awaited_ = std::move(indices); }

    const Ports& inputs() const { return inputs_; }
    const Ports& outputs() const { return outputs_; }
    /// All that was declared, and the names that no value was given for.
    const std::vector<Metadata>& declared() const { return declared_; }
    const std::vector<std::string>& missing() const { return missing_; }

    bool getUniqueName(std::string& blockUniqueName) const override;
    bool optionFromKey(const std::string& key, double& option) const override;
    bool parseParameters(blockfactory::core::Parameters& parameters) override;
    bool addParameterMetadata(const Metadata& metadata) override;
    bool setPortsInfo(const blockfactory::core::InputPortsInfo& inputs,
                      const blockfactory::core::OutputPortsInfo& outputs) override;
    blockfactory::core::Port::Info getInputPortInfo(std::size_t index) const override;
    blockfactory::core::Port::Info getOutputPortInfo(std::size_t index) const override;
    int getInputPortWidth(const std::size_t index) const override;
    int getOutputPortWidth(const std::size_t index) const override;
    blockfactory::core::Port::Size::Matrix getInputPortMatrixSize(const std::size_t index) const override;
    blockfactory::core::Port::Size::Matrix getOutputPortMatrixSize(const std::size_t index) const override;
    blockfactory::core::InputSignalPtr getInputPortSignal(const std::size_t index) const override;
    blockfactory::core::OutputSignalPtr getOutputPortSignal(const std::size_t index) const override;

  private:
    bool parse(Metadata metadata, blockfactory::core::Parameters& to);

    std::string library_, class_name_, unique_name_;
    Arguments arguments_;
    std::vector<Metadata> pending_, declared_;
    std::vector<std::string> missing_;
    std::optional<std::set<unsigned>> awaited_;
    Ports inputs_, outputs_;
    Signals input_signals_, output_signals_;
    bool has_ports_ = false, is_running_ = false;
};

/// The elements of a port; DynamicSize when a length is open.
int width(const blockfactory::core::Port::Info& port);
/// {rows, cols}; a vector is one row.
blockfactory::core::Port::Size::Matrix matrix_size(const blockfactory::core::Port::Info& port);
/// Ports in order of their index. Throws std::runtime_error: which port of which side is wrong.
std::vector<blockfactory::core::Port::Info> in_order(std::vector<blockfactory::core::Port::Info> ports,
                                                     const char* side);

/// What the value of a parameter is called by the last word of its type.
inline bool is_text(blockfactory::core::ParameterType type) { return static_cast<int>(type) % 4 == 3; }

} // namespace bf::boundary
