// What the module says of quantities, and blocks that are written in Python.
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

/// A library of blocks that are written in Python: classes derived from blockfactory.Block.
Library library_of(const std::vector<nb::object>& blocks);

} // namespace bf::python
