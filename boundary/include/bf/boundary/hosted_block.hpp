// A block of a plugin written against the paper's API, as a block of our engines.
#pragma once

#include "BlockFactory/Core/Parameter.h"
#include "BlockFactory/Core/Parameters.h"
#include "bf/core/registry.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace bf::boundary {

/// The factory of one class of a plugin.
class LegacyClass;
/// One running object of it.
class LegacyObject;

/// Parameters of the old block are arguments here, by their names (see argument_name); ports are u1, u2, ...
/// and y1, y2, ... Lengths that the block leaves open are decided by the wiring; an open output is as large
/// as the open inputs when these agree. Every input feeds through. The state is hidden in the foreign object,
/// therefore a diagram with such a block refuses snapshots.
///
/// What the old block does wrong (false, an exception, ports declared twice, ...) is reported with plugin,
/// block and call: as a problem of the arguments, as an exception of start, or as the status of the step.
class HostedBlock final : public Block {
  public:
    HostedBlock(std::shared_ptr<const LegacyClass> legacy, const Arguments& arguments);

    /// What the old block declares from index 2 on.
    const std::vector<blockfactory::core::ParameterMetadata>& parameters() const { return parameters_; }

    void infer(Inference& inference) const override;
    void start(Now at) const override;
    Status reset(Now at, After after) const noexcept override;
    Status output(Now at, Out out) const noexcept override;
    Status update(Now at, Next next) const noexcept override;
    void stop(Now at) const noexcept override;

  private:
    struct HostedPort {
        int slot;
        bool is_output, is_open;
        std::function<void*(Now)> memory;
    };
    /// Runs the object's configureSizeAndPorts; declares arguments, ports and problems.
    void declare(const Arguments& arguments);
    void declare_port(bool is_output, std::size_t index, const std::vector<int>& dimension, Type type);

    std::shared_ptr<const LegacyClass> legacy_;
    Arguments given_;
    std::vector<HostedPort> ports_;
    std::vector<blockfactory::core::ParameterMetadata> parameters_;
    OutsideState<LegacyObject> object_;
};

/// Lists the classes that the plugin exports by SHLIBPP_DEFINE_SHARED_SUBCLASS, except those of a name that
/// is listed already: a plugin that is moving to the block API calls it behind its native blocks. Throws
/// PluginError when one is of another interface version.
void add_legacy_classes(Library& library);

/// What an engine of the old kind stores for a class that is given these values: its parameters with their
/// metadata, class and library included. Throws std::runtime_error with the block's reasons.
blockfactory::core::Parameters stored_parameters(const std::string& library, const std::string& name,
                                                 const Arguments& values);

/// The names of those classes, from the dynamic symbols of the file.
std::vector<std::string> legacy_labels(const std::filesystem::path& file);

} // namespace bf::boundary
