// Parameters of a running model for programs of a middleware.
#pragma once

#include <functional>
#include <memory>
#include <string>

namespace bf {
struct LoadedModel;
class Recorder;
class Simulation;
} // namespace bf

namespace bf::tools {

/// Shown for as long as it lives.
class ModelParameters {
  public:
    virtual ~ModelParameters() = default;
    /// Before a step, in the thread of the steps. Allocates nothing.
    virtual void apply() noexcept = 0;
    /// Does what saves the simulation or takes it elsewhere, between two steps in their thread, while nobody
    /// asks for its parameters: variables are followed in another thread.
    virtual void alone(const std::function<void()>& what) = 0;
};

/// Variables and parameters of blocks in the way that this option of `bf serve` chooses, as "--ros2", with
/// its value: where. What is changed is recorded, too; without a recorder, null, it is not. Throws
/// CommandError.
std::unique_ptr<ModelParameters> serve_parameters(const std::string& option, const std::string& where,
                                                  const LoadedModel& loaded, Simulation& simulation,
                                                  Recorder* recorder);

/// What is wrong with a namespace of ROS, which says itself what its parts may be; empty: nothing.
inline std::string wrong_namespace(const std::string& name) {
    return name.empty() || name.front() != '/' ? "write a namespace that begins with /, such as / or /icub"
                                               : "";
}

} // namespace bf::tools
