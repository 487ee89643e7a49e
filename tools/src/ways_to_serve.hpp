// How other programs may reach a robot that `bf serve` serves: one line of a table for each middleware.
#pragma once

#include "bf/core/registry.hpp"
#include "bf/middleware/served_robot.hpp"

#include <memory>
#include <string>
#include <vector>

namespace bf::tools {

struct WayOption {
    const char *name, *value, *help;         ///< "--udp", "WHERE", what `bf serve --help` says
    bool is_needed = false, is_list = false; ///< the way needs it; it may be given several times
};

struct WayToServe {
    WayOption option;            ///< by which it is chosen
    std::vector<WayOption> more; ///< that it takes beside that
    /// What is wrong with the value of `option`; empty: nothing.
    std::string (*wrong)(const std::string& value);
    /// Where not all robots of a model can be served at once: why, and what to do.
    const char* alone;
    const char* plugin; ///< that serves it; null: `make` does
    std::unique_ptr<middleware::ServedRobot> (*make)(const middleware::ServeRequest& request);
    bool has_reset = false; ///< others may ask for the model as it began
    /// The plugin shows the model's parameters, too, where `option` says: whom recordings name when one is
    /// changed. Null: it does not.
    const char* parameters_by = nullptr;
};

const std::vector<WayToServe>& ways_to_serve();
/// That one is there.
const WayToServe& way_to_serve(const std::string& option);

/// A function of that name in a plugin, which `option` needs. Throws std::runtime_error: there is none.
void* function_of(const char* plugin, const char* function, const std::string& option, Registry& registry);

/// Throws std::runtime_error: the plugin is not there, or what it throws.
std::unique_ptr<middleware::ServedRobot> make_served_robot(const WayToServe& way,
                                                           const middleware::ServeRequest& request,
                                                           Registry& registry);

} // namespace bf::tools
