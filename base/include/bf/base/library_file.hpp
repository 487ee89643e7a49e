// Whether a shared library may be opened.
#pragma once

#include <string>

namespace bf {

/// Empty, or why the file is not opened as a shared library: it is no regular file, or shorter than its own
/// headers say, where the loader would map what is not there and end the program with SIGBUS. Whether the
/// rest is a library is left to the loader, which says it.
std::string why_not_loadable(const std::string& file);

} // namespace bf
