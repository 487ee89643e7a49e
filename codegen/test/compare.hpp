// Generated code beside the engine, bit for bit.
#pragma once

#include "cases.hpp"

#include <map>
#include <string>
#include <vector>

namespace bf::codegen::test {

/// What a run shows: one row of numbers per step and before each event, and the failure that ended it.
struct Recording {
    std::vector<std::vector<double>> rows;
    std::string failure;
};

/// The programs that run generated code of the cases.
struct Drivers {
    std::string plain;  ///< of models without hosted blocks; several
    std::string in_c;   ///< of those that are plain C; several
    std::string hosted; ///< of the others
    std::string plugins;
};

/// Runs every compiled version of the cases and compares it with the engine.
std::map<std::string, Recording> compare_all(const std::vector<Case>& cases, const Drivers& drivers);

} // namespace bf::codegen::test
