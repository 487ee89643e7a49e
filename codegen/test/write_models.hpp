// Generated code of many models as a few sources, and programs that run it.
#pragma once

#include "cases.hpp"

#include <cstddef>
#include <filesystem>
#include <vector>

namespace bf::codegen::test {

/// Writes the generated code of all cases as part_0.cpp, ... (`count` of them), and the program driver.cpp
/// that runs them in its working folder; of those that can be plain C, c_part_0.c, c_part_1.c and c_driver.c;
/// and of those with blocks of the factory hosted_0.cpp and hosted_driver.cpp.
void write_models(const std::vector<std::vector<Case> (*)()>& families, const std::filesystem::path& folder,
                  std::size_t count);

} // namespace bf::codegen::test
