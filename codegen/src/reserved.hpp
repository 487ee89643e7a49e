// Names that mean something else already where generated code is read.
#pragma once

#include <string_view>

namespace bf::codegen {

/// In C or C++: a keyword, or a macro of the headers of their libraries.
bool is_reserved(std::string_view name);

/// As the beginning of C functions, or as a module of Python.
bool is_reserved_for_files(std::string_view name);

} // namespace bf::codegen
