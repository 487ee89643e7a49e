#pragma once

#include <string>

namespace bf::recording {

/// Runs gnuplot on a script; returns what it complains about, empty when it succeeds. Throws
/// std::runtime_error when gnuplot cannot be run.
std::string run_gnuplot(const std::string& script);

} // namespace bf::recording
