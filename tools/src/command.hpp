// The command as a function of its words.
#pragma once

namespace bf::tools {

/// What `bf` does with these words; returns its exit code.
int command(int argc, char** argv);

} // namespace bf::tools
