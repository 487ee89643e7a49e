// Figures as files.
#pragma once

#include "bf/recording/plot.hpp"

#include <filesystem>
#include <string>

namespace bf::tools {

/// Is it one by its name: PNG or SVG?
bool is_figure(const std::filesystem::path& file);
/// Throws CommandError where the file that an option names is none; an empty name is no file.
void require_figure(const char* option, const std::string& file);
/// Writes it, height 0: as it fits, and prints the name. Throws CommandError.
void write_figure(const recording::Figure& figure, const std::filesystem::path& file, int width,
                  int height = 0);

} // namespace bf::tools
