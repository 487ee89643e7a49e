// What the module says of quantities.
#pragma once

#include "native.hpp"

namespace bf::python {

/// A signal, parameter or state of a model.
struct PythonQuantity {
    std::string path;
    recording::ChannelInfo info;
    bool size_known = true, type_known = true;
    std::optional<Limits> limits = {}; ///< of a parameter
    std::string at_least = {};
};

} // namespace bf::python
