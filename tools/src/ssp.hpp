// Systems of FMUs (SSP) as models, and the FMUs of models.
#pragma once

#include "bf/library/load.hpp"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace bf::tools {

/// Is it a system structure package by its name?
inline bool is_system(const std::filesystem::path& file) { return file.extension() == ".ssp"; }

/// What a millimetre of a system's drawing is, in pixels of ours.
inline constexpr double pixels_per_millimetre = 4;

/// The model of a package's system, in which each component is a block of its FMU. These are unpacked into a
/// folder that lives as long as the command, and found there from now on. Those for co-simulation step as
/// often as the model, with the step that `overrides` give it. Throws CommandError or fmi::FmuError.
model::Model open_system(const std::filesystem::path& package, const std::vector<Override>& overrides);

/// Of the FMU that a block of the plugin FMI runs, as the model calls it.
std::string fmu_name(const DiagramNode& node);

/// The FMUs that blocks run, by the names under which they are found. Throws fmi::FmuError.
std::map<std::string, std::filesystem::path> fmus_of(const Diagram& diagram);

} // namespace bf::tools
