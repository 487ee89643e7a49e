// What a model's blocks from plugins need beside their program: libraries, headers to compile against, files.
#pragma once

#include "session.hpp"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace bf::tools {

/// The shared libraries that these plugins need, with libbf_core.so and the plugins themselves, by the names
/// under which they look for one another; those of the C library are everywhere. Throws CommandError naming a
/// plugin that works with more than its libraries, or whose libraries are larger than `bundle_limit`.
std::map<std::string, std::filesystem::path> libraries_of(const std::vector<std::string>& plugins,
                                                          const Registry& registry);
inline constexpr double bundle_limit = 150; ///< MB

/// Options of a compiler for code that makes blocks, and the static libraries of the standard ones. Throws
/// CommandError where this installation has no headers.
struct CoreOptions {
    std::string compile, blocks;
};
CoreOptions core_options();

/// Files of a diagram's blocks and their robots, with meshes where it has a world, by where they go:
/// model/FILE or share/FILE of installed robots. Throws CommandError for those from elsewhere.
std::map<std::string, std::filesystem::path> resources_of(const LoadedModel& loaded);

/// The files that worlds of several robots name in theirs: descriptions of robots, shapes of objects. In a
/// build without robots none.
std::vector<std::filesystem::path> world_files_of(const Diagram& diagram);

/// Where blocks look for files there, as codegen::generate_fmu takes it.
std::map<std::string, std::string> folders_of(const Diagram& diagram);

} // namespace bf::tools
