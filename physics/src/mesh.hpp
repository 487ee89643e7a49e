#pragma once

#include <filesystem>
#include <mujoco/mujoco.h>

namespace bf::physics {

/// Does MuJoCo read meshes like this one: OBJ, MSH and binary STL?
bool mujoco_reads(const std::filesystem::path& file);

/// Reads any other mesh, such as COLLADA. Throws std::runtime_error naming the file.
void import_mesh(mjsMesh* mesh, const std::filesystem::path& file);

} // namespace bf::physics
